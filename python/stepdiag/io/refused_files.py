"""What a refused file is instead: another kind, or a sheet that only `stepdiag import` reads."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.io.file_kind import kind_of_file
from stepdiag.io.sheet_text import form_of

# What the strict reader says of other heads, units and marks of lost readings.
_OTHER_COLUMNS: Final = ("unknown column", 'the column "', "expected a finite decimal number")
_KINDS: Final = {"scenario": "TOML file", "measurement": "measurement"}


@contextmanager
def explained(path: Path, expected: str) -> Iterator[None]:
    """Adds to the refusal of a file that was read as a scenario or a measurement what it is instead."""
    try:
        yield
    except InvalidArgument as error:
        if not os.path.isfile(path):  # a pipe cannot be read again
            raise
        raise InvalidArgument(_swapped(path, expected) or f"{error}{import_hint(path, expected, str(error))}") from None


def import_hint(path: Path, expected: str, refusal: str = "") -> str:
    """The end of a refusal that names the command for such a sheet; empty for other files."""
    if expected != "measurement" or path.suffix.lower() in (".nc", ".toml"):
        return ""
    output = "run.csv" if path.name != "run.csv" else "imported.csv"
    command = f"`stepdiag import {path} -o {output}`"
    form = form_of(path)
    if form is not None:
        return f"; the file looks like {form}: {command} reads such files"
    # u_distance_mm and the like are slips that import refuses, too.
    if any(part in refusal for part in _OTHER_COLUMNS) and 'unknown column "u_' not in refusal:
        return f"; {command} takes other heads, units and marks of lost readings"
    return ""


def _swapped(path: Path, expected: str) -> str | None:
    try:
        kind = kind_of_file(path)
    except InvalidArgument:
        return None
    for other, name in _KINDS.items():
        if other != expected and kind == name:
            what = "a measurement" if other == "measurement" else "a TOML file, such as a scenario"
            return f"{path}: expected a {expected}, got {what}: are the files in the wrong order?"
    return None
