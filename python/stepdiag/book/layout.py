"""Folders and names in a book, and how a file gets a place there without replacing another.

BOOK.txt                    what this folder is
book.sqlite                 the index, made again from the files if it is gone
machines/NAME/machine.toml  what is known of the machine
machines/NAME/runs/...      files as the commands read and write them, in FOLDERS
machines/NAME/records/      one record a command: what it read and what it wrote
machines/NAME/bin/          what was removed, in the same folders
"""

import os
import re
import shutil
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.io.comp_set import check_set
from stepdiag.io.whole_files import make_folder, reason
from stepdiag.platform import open_new, sync_folder

MARK: Final = "BOOK.txt"
INDEX: Final = "book.sqlite"
MACHINES: Final = "machines"
ABOUT: Final = "machine.toml"
RECORDS: Final = "records"
BIN: Final = "bin"
# Folder -> the kinds of files (file_kind.py) in it.
FOLDERS: Final = {
    "scenarios": ("scenario",),
    "plans": ("measuring program", "table of steps", "table of plans", "uncertainty result", "study result"),
    "runs": ("measurement", "raw readings", "table of target readings"),
    "calibrations": ("calibration", "error map"),
    "reports": ("report page", "comparison", "functional point table", "PNG picture", "SVG picture"),
    "exports": (
        "ISG table",
        "error grid",
        "squareness table",
        "position error table",
        "file of HAL lines",
        "compensation.ini",
        "COMP_FILE",
    ),
    "documents": (),  # everything else: certificates, photos
}
# Of a folder that is one entry, such as an export of several tables: the file that stands for it.
MAIN_FILES: Final = ("compensation.ini", "scenario.toml")
LONGEST_NAME: Final = 80  # characters; with the folders above it, a path stays shorter than Windows allows
README: Final = """\
This folder is a machine book of stepdiag.

machines/NAME/        all files of one machine; machine.toml says which machine it is
  scenarios/          how it is measured: volume, plan, laser head, sensors (TOML)
  plans/              measuring programs, and what plans would determine
  runs/               the readings (CSV or netCDF)
  calibrations/       the errors found, with their uncertainties (CSV or netCDF)
  reports/            pages to hand over, pictures, comparisons
  exports/            tables for controllers
  documents/          other files
  records/            which command made which file from which, with fingerprints (JSON)
  bin/                what was removed

Every file can be opened, copied and mailed without the book. Nothing in it is replaced or deleted by
stepdiag. book.sqlite is an index that is made again from the files if it is missing.
"""

_SAFE: Final = re.compile(r"[^\W_][\w .+()-]*")
_TEMPORARY: Final = re.compile(r".+\.([0-9a-f]{16}|[0-9]+-[0-9]+)")
_OF_WINDOWS: Final = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")


def check_name(name: str, what: str) -> str:
    """The name, if a file or folder may have it on every system. Raises InvalidArgument."""
    if (
        not _SAFE.fullmatch(name)
        or name[-1] in ". "
        or len(name) > LONGEST_NAME
        or len(name.encode()) > 2 * LONGEST_NAME
        or _OF_WINDOWS.fullmatch(name)
    ):
        raise InvalidArgument(
            f"{what} {name!r}: expected a name of at most {LONGEST_NAME} letters, digits, spaces and .+-_(), "
            "that begins with a letter or digit"
        )
    return name


def safe_name(name: str) -> str:
    """A name that `check_name` accepts, as like this one as possible."""
    kept = re.sub(r"[^\w .+()-]+", "_", name).lstrip("_ .+()-")
    stem, ending = os.path.splitext(kept)
    kept = (stem[: LONGEST_NAME - 20] + ending[:20]).rstrip(". ")
    return f"file-{kept}" if not kept or _OF_WINDOWS.fullmatch(kept) else kept


def folder_of(kind: str | None) -> str:
    """The folder for a kind of file."""
    return next((folder for folder, kinds in FOLDERS.items() if kind in kinds), "documents")


def main_file(entry: Path) -> Path:
    """The file itself, or in a folder the one that stands for it."""
    if not entry.is_dir():
        return entry
    for name in MAIN_FILES:
        if (entry / name).is_file():
            return entry / name
    return next((path for path in sorted(entry.iterdir()) if path.suffix == ".toml"), entry / MAIN_FILES[0])


def reserve(folder: Path, name: str, *, exactly: bool = False, as_folder: bool = False) -> Path:
    """Take a free name in a folder: an empty file (or folder) is made there, which no other program can make too.

    Of "a.csv", "a-2.csv", "a-3.csv" ... the first that is free, whatever the case of its letters; `exactly`: only this
    name. Raises InvalidArgument."""
    make_folder(folder)
    for candidate in [name] if exactly else _variants(name):
        if candidate.casefold() in {one.casefold() for one in os.listdir(folder)}:
            continue
        path = folder / candidate
        try:
            if as_folder:
                path.mkdir()
            else:
                os.close(open_new(path, 0o666))
        except FileExistsError:
            continue
        except OSError as error:
            raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
        return path
    raise InvalidArgument(f"{folder / name}: exists already, and nothing in a book is replaced: choose another name")


def move(path: Path, folder: Path) -> Path:
    """Move a file or folder into a folder, under its own name or the next free one. Raises InvalidArgument."""
    target = reserve(folder, path.name, as_folder=path.is_dir())
    try:
        os.replace(path, target)  # of an empty file or folder: nothing is lost
    except OSError as error:
        release(target)
        raise InvalidArgument(f"{path}: cannot be moved: {reason(error)}") from None
    sync_folder(folder)
    sync_folder(path.parent)
    return target


def release(path: Path) -> None:
    """Give back a name that was taken and not used: an empty file, or a folder that is not whole."""
    if path.is_dir():
        if not _is_whole(path):
            shutil.rmtree(path, ignore_errors=True)
    elif path.exists() and path.stat().st_size == 0:
        path.unlink()


def _is_whole(folder: Path) -> bool:
    main = main_file(folder)
    try:
        return main.is_file() and (main.suffix != ".ini" or check_set(main) is not None)
    except InvalidArgument:
        return False


def counts(name: str) -> bool:
    """Whether a file of this name belongs to the book: not hidden ones, nor those that are just written."""
    return not name.startswith(".") and not _TEMPORARY.fullmatch(name)


def _variants(name: str) -> Iterator[str]:
    stem, ending = os.path.splitext(name)
    if ending == ".jsonl":  # run.raw.jsonl
        stem, before = os.path.splitext(stem)
        ending = before + ending
    yield name
    yield from (f"{stem}-{number}{ending}" for number in count(2))
