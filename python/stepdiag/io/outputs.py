"""What a command may write over. Every command that writes claims its files here first.

A result that can be computed again replaces an older result of its own kind. A measurement, which may be the work of
hours, and a checkpoint are replaced only where the user says so. Nothing else is ever replaced, nor what the command
itself reads. What a file is, is seen from its content (file_kind.py), not from its name. An empty file is no loss.
"""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.io.file_kind import kind_of_file
from stepdiag.io.whole_files import check_output


@dataclass(frozen=True)
class FileKind:
    """What a command writes: its name as file_kind.py has it, and the endings of its files. `kept`: why one is not
    replaced by another of its kind, and what to do; empty for what can be computed again."""

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
PNG: Final = FileKind("PNG picture", (".png",))
SVG: Final = FileKind("SVG picture", (".svg",))
# Not .nc, which is a usual ending of programs, too: in stepdiag it says netCDF.
PROGRAM: Final = FileKind("measuring program", (".ngc", ".iso", ".cnc", ".tap", ".mpf", ".txt"))
KINEMATICS_TABLE: Final = FileKind("calibration", (".csv",))
ISG_TABLE: Final = FileKind("ISG table", (".csv",))
GRID: Final = FileKind("error grid", (".csv",))
COMP_FILE: Final = FileKind("COMP_FILE", (".comp",))
COMP_LINES: Final = FileKind("compensation.ini", (".ini",))
RAW: Final = FileKind("raw readings", (".jsonl",))
CHECKPOINT: Final = FileKind(
    "checkpoint",
    (".checkpoint",),
    "is the checkpoint of an earlier run: `resume` goes on with it; or remove it, or name another one",
)
CELLS: Final = FileKind(
    "study cells", (), "cells of an interrupted study; `resume` goes on with them, or delete the file"
)
# Of the demonstrations.
ERROR_MAP: Final = FileKind("error map")
REPORT: Final = FileKind("report of the demonstration")
POINTS: Final = FileKind("table of points")


@dataclass(frozen=True)
class OutputFile:
    """A file that a command is to write, as its user named it: of one of these kinds, by its ending."""

    path: Path
    kinds: tuple[FileKind, ...]

    def claim(self, *inputs: Path, error_map: Path | None = None, overwrite: bool = False) -> Path:
        """The path, to write to. `inputs`: what the command reads; `error_map`: that of its scenario. Raises
        InvalidArgument where something would be lost, or cannot be written, before the work."""
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
    """Raises InvalidArgument where a file of this kind cannot be written there, or would replace what is to be kept.
    `overwrite`: also one of its own kind that is not computed again so easily."""
    check_output(path)
    if not path.exists() or path.stat().st_size == 0:
        return
    found = kind_of_file(path)
    if found != kind.name:
        is_what = f"is {_a(found)}" if found else "is nothing that stepdiag knows"
        raise InvalidArgument(
            f"{path}: {is_what}, and is not replaced by {_a(kind.name)}: move it away, or name another file"
        )
    if kind.kept and not overwrite:
        raise InvalidArgument(f"{path}: {kind.kept}")


def claim_folder(folder: Path, files: Mapping[str, FileKind | str], marks: Iterable[str]) -> Path:
    """The same for files in a folder, there or not; `files` by their names in it. A text stands for a file that must
    not have been changed since. Where any of the files is there, one of the `marks` must be: they tell that the folder
    is ours."""
    there = [name for name in files if os.path.lexists(folder / name)]
    if there and not set(marks) & set(there):
        raise InvalidArgument(
            f"{folder / there[0]}: is there already, and {folder} is no folder that this command has written: "
            "name another one"
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
    """By name too: a result that fills the place of a missing error map would be taken for the machine's errors."""
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    return one.exists() and other.exists() and one.samefile(other)


def _a(name: str) -> str:
    return f"{'an' if name[0] in 'aeiouI' else 'a'} {name}"
