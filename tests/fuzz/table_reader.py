"""Tables of controllers for python_readers.py: what export writes, small."""

from __future__ import annotations

import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "helpers"))

from exported import random_calibration

from stepdiag.exporting.formats import FORMATS
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.write import write_export
from stepdiag.importing.controller_tables import read_controller_tables


def read(path: Path) -> Any:
    return read_controller_tables([path], chain="[w X' b Y Z t]")


@cache
def seeds() -> list[bytes]:
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for to in FORMATS:
            axes = {"axis": "Y", "depends_on": "X"} if to == "position-error" else {}
            options = ExportOptions(incomplete=True, **axes)  # type: ignore[arg-type]
            done = write_export(random_calibration(3, intervals=2, reversal=True), to, Path(folder) / to, options)
            found += [text.encode() for text in done.files.values()]
    return found
