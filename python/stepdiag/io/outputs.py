"""What a command may overwrite. Every command that writes claims its files here first.

A result that can be computed again replaces an older result of the same kind. A measurement
(perhaps hours of work) and a checkpoint are replaced only if the user asks for it. Nothing else is
replaced, and never an input of the command. The content of a file decides its kind (file_kind.py),
not its name. An empty file may be replaced.
"""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.io.file_kind import kind_of_file
from stepdiag.io.whole_files import check_output, read_beginning
from stepdiag.style import MADE_BY


@dataclass(frozen=True)
class FileKind:
    """A kind of file that a command writes: its name as in file_kind.py, and the endings of paths.

    `kept`: why it is not replaced by another one of its kind, and what the user can do; empty if it
    can be computed again."""

    name: str
    endings: tuple[str, ...] = ()
    kept: str = ""


MEASUREMENT: Final = FileKind(
    "measurement", (".csv", ".nc"), "is a measurement, perhaps the work of hours: `overwrite` replaces it"
)
CALIBRATION: Final = FileKind("calibration", (".csv", ".nc"))
COMPARISON: Final = FileKind("comparison", (".csv", ".nc"))
UNCERTAINTY: Final = FileKind("uncertainty result", (".nc", ".csv"))
STUDY: Final = FileKind("study result", (".nc",))
FUNCTIONAL_POINT: Final = FileKind("functional point table", (".csv",))
OBSERVATION: Final = FileKind("table of steps", (".csv",))
PLANS: Final = FileKind("table of plans", (".csv",))
SCENARIO: Final = FileKind("TOML file", (".toml",), "exists already, perhaps written by hand: name another file")
PNG: Final = FileKind("PNG picture", (".png",))
SVG: Final = FileKind("SVG picture", (".svg",))
PDF: Final = FileKind("PDF document", (".pdf",))
FIGURE: Final = (PNG, SVG, PDF)  # endings: style.FORMATS
PAGE: Final = FileKind("report page", (".html",))
# Not .nc: a usual ending of programs, but in stepdiag it means netCDF.
PROGRAM: Final = FileKind("measuring program", (".ngc", ".iso", ".cnc", ".tap", ".mpf", ".h", ".txt"))
KINEMATICS_TABLE: Final = FileKind("calibration", (".csv",))
SELFTEST: Final = FileKind("self-test", (".txt",))
ISG_TABLE: Final = FileKind("ISG table", (".csv",))
GRID: Final = FileKind("error grid", (".csv",))
SQUARENESS_TABLE: Final = FileKind("squareness table", (".csv",))
POSITION_ERROR: Final = FileKind("position error table", (".csv",))
HAL_LINES: Final = FileKind("file of HAL lines", (".hal",))
COMP_FILE: Final = FileKind("COMP_FILE", (".comp",))
COMP_LINES: Final = FileKind("compensation.ini", (".ini",))
SINUMERIK_TABLE: Final = FileKind("SINUMERIK table", (".ini", ".mpf", ".arc"))
COM_TABLE: Final = FileKind("Heidenhain table")
HEIDENHAIN_NOTES: Final = FileKind("notes beside Heidenhain tables")
ETALON_TABLE: Final = FileKind("Etalon Exchange Format", (".txt", ".etalon"))
FIRMWARE_COMMAND: Final = FileKind("firmware command", (".gcode", ".g", ".cfg"))
RAW: Final = FileKind("raw readings", (".jsonl",))
CHECKPOINT: Final = FileKind(
    "checkpoint",
    (".checkpoint",),
    "is the checkpoint of an earlier run: `resume` continues it; or remove it, or name another file",
)
CELLS: Final = FileKind("study cells", (), "cells of an interrupted study; `resume` continues it, or delete the file")
# Files of the demonstrations.
ERROR_MAP: Final = FileKind("error map")
IMPORTED_MAP: Final = FileKind("error map", (".csv",))
IMPORTED_CALIBRATION: Final = FileKind("calibration", (".nc",))
REPORT: Final = FileKind("report of the demonstration")
POINTS: Final = FileKind("table of points")


@dataclass(frozen=True)
class OutputFile:
    """A file to write, as named by the user: of one of these kinds, chosen by its ending."""

    path: Path
    kinds: tuple[FileKind, ...]

    def claim(self, *inputs: Path, error_map: Path | None = None, overwrite: bool = False) -> Path:
        """Return the path, after checking that nothing would be lost and that it can be written.

        `inputs`: files that the command reads. `error_map`: that of its scenario. Raises
        InvalidArgument before the work begins."""
        path = self.path
        if any(_is_same(path, given) for given in inputs):
            raise InvalidArgument(f"{path}: is also an input; give the output another name")
        if error_map is not None and _is_same(path, error_map):
            raise InvalidArgument(f"{path}: is the scenario's machine.errors; give the output another name")
        check_output(path)
        claim(path, self._kind(), overwrite=overwrite)
        return path

    def _kind(self) -> FileKind:
        for kind in self.kinds:
            if self.path.suffix.lower() in kind.endings:
                return kind
        endings = [ending for kind in self.kinds for ending in kind.endings]
        expected = " or ".join(filter(None, [", ".join(endings[:-1]), endings[-1]]))
        raise InvalidArgument(f"{self.path}: expected a name that ends in {expected}")


def claim(path: Path, kind: FileKind, *, overwrite: bool = False) -> None:
    """Raise InvalidArgument if a file of this kind cannot be written or would replace another file.

    `overwrite`: a file of the same kind that is normally kept may be replaced."""
    check_output(path)
    if not path.exists() or path.stat().st_size == 0:
        return
    found = kind_of_file(path)
    if found != kind.name:
        is_what = f"is {_a(found)}" if found else "is not a file that stepdiag recognises"
        raise InvalidArgument(
            f"{path}: {is_what}, and is not replaced by {_a(kind.name)}: move it away, or name another file"
        )
    if kind.kept and not overwrite:
        raise InvalidArgument(f"{path}: {kind.kept}")


def claim_beside(given: Path, kind: FileKind) -> Path:
    """Claim a picture that the user has not named: beside `given`, with the ending of `kind`.

    It replaces only pictures of stepdiag, because others may have this name. Raises
    InvalidArgument."""
    path = given.with_suffix(kind.endings[0])
    if path == given:
        raise InvalidArgument(f"{given}: is an input; name the figure with `output`")
    claim(path, kind)
    if path.exists() and path.stat().st_size and f"Software\0{MADE_BY}" not in read_beginning(path):
        raise InvalidArgument(f"{path}: is a picture that stepdiag has not made; name another one with `output`")
    return path


def claim_folder(folder: Path, files: Mapping[str, FileKind | str], marks: Iterable[str]) -> Path:
    """Claim files in a folder, which need not exist.

    `files` maps names in the folder to a kind, or to a text: that file must not have been changed
    since. If any of the files exists, one of `marks` must exist too: it shows that stepdiag made
    the folder. Raises InvalidArgument."""
    there = [name for name in files if os.path.lexists(folder / name)]
    if there and not set(marks) & set(there):
        raise InvalidArgument(
            f"{folder / there[0]}: exists already, and {folder} was not written by this command: name another folder"
        )
    for name in there:
        expected = files[name]
        if isinstance(expected, FileKind):
            claim(folder / name, expected, overwrite=True)
        elif not _is_text(folder / name, expected):
            raise InvalidArgument(f"{folder / name}: was changed, and is not replaced: name another folder")
    return folder


def _is_text(path: Path, text: str) -> bool:
    check_output(path)
    content = text.encode()
    return path.stat().st_size == len(content) and path.read_bytes() == content


def _is_same(one: Path, other: Path) -> bool:
    """Compares names too: a result with the name of a missing error map would be read as one."""
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    return one.exists() and other.exists() and one.samefile(other)


def _a(name: str) -> str:
    return f"{'an' if name[0] in 'aeiouI' else 'a'} {name}"
