"""CSV for volumetric compensation in ISG-CNC and Beckhoff TwinCAT CNC; not tried on a controller.

Sources: ISG kernel [FCT-C26] and Beckhoff TF5280, "Volumetric Compensation" (sections ISG CSV
format, Units of measure, List of parameters supported, Interpolation mode, General configuration),
and P-VOLC-00001 .. -00020. According to them a header line names the columns, arguments X Y Z and
ISO 230-1 parameters; rows follow; comments begin with //; a # begins a new header; units are mm and
rad; interpolation on the grid is linear. The parts that were available state neither the sign
(error or correction; `negate` inverts it), nor how a squareness turns the axes after it. The file
is therefore written such that it depends little on their interpretation: every axis is one that carries the tool
(tool_side.py), workpiece_axes 0.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from stepdiag._core import Calibration
from stepdiag.exporting.common import (
    APPROACH_WORDS,
    FloatArray,
    in_ascii,
    origin_of,
    require,
    rows_of,
    temperature_row,
    tool_of,
    words,
)
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, coverage_of
from stepdiag.exporting.tool_side import Table, tool_side
from stepdiag.findings.meaning import provenance_rows, trust_rows
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

UNTRIED: Final = "written from the manual (ISG FCT-C26, Beckhoff TF5280), not tried on a controller"
MOST_ROWS: Final = 5000


def isg(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """The file, and the entries of the compensation list that belong to it."""
    rows = rows_of(options, MOST_ROWS)
    missing = require(calibration, [*FUNCTIONS, *SQUARENESSES], options)
    tool, origin = tool_of(calibration, options), origin_of(options)
    approach = options.approach or "mean"
    apart = options.squareness == "parameters"
    written = tool_side(calibration, options, rows, apart=apart)
    tables, squareness = written.tables, written.squareness
    known = calibration.squareness

    records = sum(len(x) for x, _ in tables.values()) + bool(squareness) + 1
    angles = ", ".join(f"{name} = {angle * 1e6:.6g} µrad" for name, (angle, _) in known.items())
    where = "as parameters" if apart else "in the straightnesses: EXY - C0Y y, EXZ + B0Z z, EYZ - A0Z z"
    lines = [
        *trust_rows(calibration),
        temperature_row(calibration),
        *provenance_rows(calibration),
        UNTRIED,
        f"chain {calibration.chain}, volume {words(calibration.volume)} mm, home at {words(origin)} mm in the "
        f"controller's coordinates, direction of approach {APPROACH_WORDS[approach]}",
        "sign: errors, actual - commanded of the tool relative to the workpiece (ISO 230-1); if the machine gets "
        "worse, set negate XYZ",
        f"straightness: of the functional point, tool offset {words(tool)} mm, other axes at 0 (every axis taken as "
        "one that carries the tool)",
        f"squareness {where}: {angles or 'none known'}; positive turns Y or Z by the right-hand rule",
        written.sentence(),
        f"compensation list: chain {written.letters}, workpiece_axes 0, interpolation GRID, file_format[0] ISG_CSV; "
        f"start-up list: vol_comp[0].max_records {records} or more",
        *missing,
    ]
    text = _text(lines, tables, squareness, tool)
    return Export({output: text}, lines, coverage_of(calibration, [*FUNCTIONS, *SQUARENESSES]))


def _text(lines: list[str], tables: Mapping[str, Table], squareness: Mapping[str, float], tool: FloatArray) -> str:
    """Decimals without exponent: nine places for mm, twelve for rad."""
    blocks = []
    for axis, (x, columns) in tables.items():
        rows = [f"{axis} {' '.join(columns)}"]
        for k, position in enumerate(x):
            moved = " ".join(f"{column[k]:.9f}" for column in list(columns.values())[:3])
            turned = " ".join(f"{column[k]:.12f}" for column in list(columns.values())[3:])
            rows.append(f"{position:.9f} {moved} {turned}")
        blocks.append("\n".join(rows))
    if squareness:
        blocks.append(f"{' '.join(squareness)}\n{' '.join(f'{angle:.12f}' for angle in squareness.values())}")
    blocks.append(f"P0X P0Y P0Z\n{' '.join(f'{t:.9f}' for t in tool)}")
    # A # begins a new header anywhere. The manuals do not say what comments may contain.
    head = "".join(f"// {line}\n" for line in ["stepdiag export --to isg", *lines]).replace("#", "")
    return in_ascii(head) + "\n#\n".join(blocks) + "\n"
