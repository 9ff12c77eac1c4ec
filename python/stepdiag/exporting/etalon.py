"""Etalon Exchange Format, which TwinCAT CNC and ISG-CNC read; written from their manuals, not tried on a controller.

Read: Beckhoff TF5280 and ISG FCT-C26, "Etalon Exchange Format" (296430091) and "Units of measure" (296426379): a block
begins with the name of a parameter in brackets; `VALUE = ` for one value, `Gridpoints = {` for lines of position and
value up to `}`; comments begin with //; mm and rad, positions mm. The variant is the one that they call Vendor. As of
ISG CSV, they do not say the sign: the tables are those of tool_side.py, as of `isg`.
"""

from pathlib import Path
from typing import Final

from stepdiag._core import Calibration
from stepdiag.exporting.common import in_ascii, require, rows_of
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, coverage_of, heading
from stepdiag.exporting.tool_side import tool_side
from stepdiag.findings.meaning import provenance_rows
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

UNTRIED: Final = "written from the manual (Beckhoff TF5280, ISG FCT-C26), not tried on a controller"
MOST_ROWS: Final = 5000


def etalon(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """The file."""
    rows = rows_of(options, MOST_ROWS)
    missing = require(calibration, [*FUNCTIONS, *SQUARENESSES], options)
    written = tool_side(calibration, options, rows, apart=options.squareness == "parameters")
    where = "as parameters" if written.squareness else "in the straightnesses: EXY - C0Y y, EXZ + B0Z z, EYZ - A0Z z"
    lines = [
        UNTRIED,
        *heading(calibration, options),
        "units: mm and rad, positions in mm",
        "sign: errors, actual - commanded of the tool relative to the workpiece (ISO 230-1); if the machine gets "
        "worse, set negate XYZ",
        "straightness: of the functional point, other axes at 0 (every axis taken as one that carries the tool)",
        f"squareness {where}; positive turns Y or Z by the right-hand rule",
        written.sentence(),
        f"compensation list: chain {written.letters}, workpiece_axes 0, interpolation GRID; file_format[0] is the "
        "manual's name of this format, which could not be read",
        *missing,
    ]
    blocks = [f"[{name}]\nVALUE = {angle:.12f}" for name, angle in written.squareness.items()]
    for x, functions in written.tables.values():
        for name, values in functions.items():
            digits = 9 if name[1] in "XYZ" else 12
            points = [f"{p:.9f} {value + 0.0:.{digits}f}" for p, value in zip(x, values, strict=True)]
            blocks.append("\n".join([f"[{name}]", "Gridpoints = {", *points, "}"]))
    said = ["stepdiag export --to etalon", *provenance_rows(calibration), *lines]
    head = "".join(f"// {line}\n" for line in said)
    return Export(
        {output: in_ascii(head) + "\n".join([*blocks, ""])},
        lines,
        coverage_of(calibration, [*FUNCTIONS, *SQUARENESSES]),
    )
