"""Heidenhain: axis tables, and KinematicsComp; written from the manuals, not tried on a controller.

Read: MANUALplus 620, pp. 716-718 (tables .COM and .CMA: columns, relation); iTNC 530 HSCI, pp. 666-686 and 722 (errors
by ISO 230-1, description table, order, limits); TNC 407, pp. 151-153 (an error is positive where the travel is too
long; tables of errors). According to them

- a row of a .COM table has the position AXISPOS from the machine datum, and in the column of an axis its error there;
  BACKLASH has the error of the axis itself in negative direction. Column AXIS of the .CMA names the .COM file of the
  axis whose position counts; the row with * in ACTIVE is in force.
- KinematicsComp: a description of the machine runs from the tool to the workpiece. A line `Trans` before `MachAxis`
  moves or turns by what column COMPTAB names: column C2 to C6 of the axis's .COM table for EYX, EZX, EAX, EBX, ECX.
  EXX is in the axis's own column. At most 100 entries, from which those of MachAxis are subtracted.

Not read, and therefore as said here: the head of a table (BEGIN, NR, END are those of other tables of these
controllers); the unit of a rotation (degrees, as in COORD); the name of the axis in COMPTAB (the manual's line for an X
axis has A..C2; here X..C2).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration
from stepdiag.exporting.axis_tables import axis_tables
from stepdiag.exporting.common import FloatArray, in_ascii, origin_of, require, rows_of
from stepdiag.exporting.left_in_volume import what_is_left
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, coverage_of, heading
from stepdiag.exporting.tool_side import tool_side
from stepdiag.findings.meaning import provenance_rows
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES

COMPANION: Final = "compensation.txt"
UNTRIED: Final = "written from the manual ({}), not tried on a controller"
MOST_POINTS: Final = 200  # unless more are asked for
MOST_ENTRIES: Final = 100  # of COMPTAB, with those of MachAxis
SIGN: Final = (
    "sign: errors, actual - commanded of the tool relative to the workpiece, positive where the travel is too long; "
    "prove it before cutting"
)


def heidenhain_com(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """A .COM table for each axis, and the .CMA table that assigns them."""
    itself = [(n, n) for n in range(3)]
    tables, left, missing = axis_tables(calibration, options, rows_of(options, 5000, MOST_POINTS), both=itself)
    origin = origin_of(options)
    lines = [
        UNTRIED.format("MANUALplus 620"),
        *heading(calibration, options, directions=tables.directions),
        "units: mm, positions from the machine datum; the axes have the keys X, Y, Z",
        *tables.sentences(),
        SIGN,
        "steps: copy the .com files and config.cma into the folder of the machine's compensation tables, open "
        "config.cma in the table editor: the row with * is in force; reference the axes",
        *missing,
        "left out: what rotations do where the other axes stand elsewhere",
        *what_is_left(calibration, left),
    ]
    files = {}
    for by, letter in enumerate(AXES):
        own = tables.functions.get((by, by), np.zeros((1, len(tables.positions[by]))))
        columns = {"AXISPOS": tables.positions[by] + origin[by], "BACKLASH": own[-1]}
        for axis, name in enumerate(AXES):
            columns[name] = tables.functions.get((axis, by), np.zeros((1, len(tables.positions[by]))))[0]
        files[output / f"{letter.lower()}.com"] = _table(f"{letter}.COM", columns)
    named = {"ACTIVE": "*"} | {axis: f"{axis}.COM" for axis in AXES}
    files[output / "config.cma"] = _words_table("CONFIG.CMA", [named])
    files[output / COMPANION] = _companion("heidenhain-com", calibration, lines)
    return Export(files, lines, tables.coverage(calibration), left, motors=tables.motors)


def heidenhain_kinematics(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """KinematicsComp: .COM tables with the six errors of each axis, and the lines of the description."""
    missing = require(calibration, [*FUNCTIONS, *SQUARENESSES], options)
    zero = np.array(options.fixed or (0.0, 0.0, 0.0))
    written = tool_side(calibration, options, rows_of(options, 5000, MOST_POINTS), zero=zero)
    description = []
    for axis in reversed(written.letters):
        straight = [name for name in AXES if name != axis]
        errors = [f"E{name}{axis}" for name in [*straight, *"ABC"]]
        description += [
            {"DOC": error, "KEY": "Trans", "AXIS": error[1], "COMPTAB": f"{axis}..C{k}"}
            for k, error in enumerate(errors, start=2)
        ]
        description.append({"KEY": "MachAxis", "AXIS": axis})
    assert len(description) <= MOST_ENTRIES
    lines = [
        UNTRIED.format("iTNC 530 HSCI"),
        *heading(calibration, options),
        "units: mm and degrees, positions from the machine datum",
        f"model: from tool to workpiece {', '.join(reversed(written.letters))}; every axis as one that carries the "
        f"tool; fixed Trans lines between the tool and the axes: {' '.join(f'{z:g}' for z in zero)} mm in all",
        "squareness: in the straightnesses of Y and Z",
        written.sentence(),
        SIGN,
        f"entries: {len(description)} of {MOST_ENTRIES}, with those of MachAxis",
        "steps: copy the .com files, enter them in the .CMA table in the columns of their axes, and insert the lines "
        "of kinematics.tab before the lines MachAxis of the machine's description; keep a copy of the description",
        *missing,
    ]
    files = {}
    for axis, (x, functions) in written.tables.items():
        straight = [name for name in AXES if name != axis]
        columns = {"AXISPOS": x, axis: functions[f"E{axis}{axis}"]}
        columns |= {f"C{k}": functions[f"E{name}{axis}"] for k, name in enumerate(straight, start=2)}
        columns |= {f"C{k}": np.degrees(functions[f"E{name}{axis}"]) for k, name in enumerate("ABC", start=4)}
        files[output / f"{axis.lower()}.com"] = _table(f"{axis}.COM", columns)
    files[output / "kinematics.tab"] = _words_table(
        "KINEMATICS.TAB", description, ("DOC", "KEY", "AXIS", "COORD", "COMPTAB")
    )
    files[output / COMPANION] = _companion("heidenhain-kinematics", calibration, lines)
    return Export(files, lines, coverage_of(calibration, [*FUNCTIONS, *SQUARENESSES]))


def _table(name: str, columns: Mapping[str, FloatArray]) -> str:
    """Rows with six digits after the point; rotations, in degrees, with nine."""
    rows = []
    for k in range(len(columns["AXISPOS"])):
        digits = {column: 9 if column in ("C4", "C5", "C6") else 6 for column in columns}
        rows.append({column: f"{values[k] + 0.0:.{digits[column]}f}" for column, values in columns.items()})
    return _words_table(name, rows, tuple(columns))


def _words_table(name: str, rows: Sequence[Mapping[str, str]], columns: Sequence[str] = ()) -> str:
    columns = columns or tuple(rows[0])
    cells = [["NR", *columns], *([str(n), *(row.get(one, "") for one in columns)] for n, row in enumerate(rows))]
    widths = [max(len(row[k]) for row in cells) + 2 for k in range(len(cells[0]))]
    lines = ["".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells]
    return "\n".join([f"BEGIN {name} MM", *lines, "[END]", ""])


def _companion(to: str, calibration: Calibration, lines: Sequence[str]) -> str:
    return in_ascii("\n".join([f"stepdiag export --to {to}", *provenance_rows(calibration), *lines, ""]))
