"""The table of a self-test: its rows, the installation that it is about, and its text."""

import hashlib
import platform
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag import _core
from stepdiag.io.data_files import date_of_today

FORMAT: Final = "stepdiag selftest 1"


@dataclass(frozen=True)
class SelfTestRow:
    """One comparison. Passed: the largest deviation is at most what is allowed.

    deviation: None where the case ended with an error. unit: of deviation and allowed."""

    case: str
    compared: str
    source: str
    deviation: float | None
    allowed: float
    unit: str = "1"
    error: str = ""

    @property
    def passed(self) -> bool:
        return self.deviation is not None and self.deviation <= self.allowed


@dataclass(frozen=True)
class Installation:
    """What was tested. sha256: of the names and contents of all files of the package but byte code."""

    stepdiag: str
    sha256: str
    instruction_set: str
    python: str
    numpy: str
    system: str
    date: str


@dataclass(frozen=True)
class SelfTest:
    """Result of `run_selftest`."""

    installation: Installation
    rows: Sequence[SelfTestRow]

    @property
    def passed(self) -> bool:
        return bool(self.rows) and all(row.passed for row in self.rows)

    @property
    def text(self) -> str:
        """The record: the table, and in its last line the SHA-256 of all lines above it."""
        above = "".join(f"{line}\n" for line in self._lines())
        return f"{above}sha256 of the lines above: {hashlib.sha256(above.encode()).hexdigest()}\n"

    def _lines(self) -> Iterator[str]:
        yield f"# format={FORMAT}"
        found = self.installation
        yield f"program          stepdiag {found.stepdiag}"
        yield f"its files        sha256 {found.sha256}"
        yield f"instruction set  {found.instruction_set}"
        yield f"Python, NumPy    {found.python}, {found.numpy}"
        yield f"system           {found.system}"
        yield f"date             {found.date}"
        yield ""
        sources = list(dict.fromkeys(row.source for row in self.rows))
        cells = [("result", "case", "compared", "deviation", "allowed", "unit", "truth")]
        cells += [
            (
                "passed" if row.passed else "FAILED",
                row.case,
                row.compared,
                "none" if row.deviation is None else f"{row.deviation:.2g}",
                f"{row.allowed:.2g}",
                row.unit,
                f"[{sources.index(row.source) + 1}]",
            )
            for row in self.rows
        ]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        for line in cells:
            yield "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        yield ""
        for row in self.rows:
            if row.error:
                yield f"{row.case}: {row.error}"
        yield "The truth comes from:"
        for number, source in enumerate(sources, 1):
            yield f"[{number}] {source}"
        yield ""
        yield f"{sum(row.passed for row in self.rows)} of {len(self.rows)} passed"
        yield "checked by: ____________________  date: ____________"


def this_installation() -> Installation:
    return Installation(
        stepdiag=_core.__version__,
        sha256=sha256_of_files(Path(str(files("stepdiag")))),
        instruction_set=_core.instruction_set(),
        python=platform.python_version(),
        numpy=np.__version__,
        system=platform.platform(),
        date=date_of_today(),
    )


def sha256_of_files(folder: Path) -> str:
    """SHA-256 of the lines that `sha256sum` prints of all files in a folder, byte code left out, by name."""
    names = sorted(
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    )
    lines = (f"{hashlib.sha256((folder / name).read_bytes()).hexdigest()}  {name}\n" for name in names)
    return hashlib.sha256("".join(lines).encode()).hexdigest()
