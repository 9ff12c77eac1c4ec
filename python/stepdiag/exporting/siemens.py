"""SINUMERIK 840D sl, 828D, 802D sl: tables as %_N_..._INI files; written from the manuals, not tried on a controller.

Read: Function Manual Extended Functions (K3), 6FC5397-1BP40-3BA1, pp. 240-249 and 264; 802D sl, 6FC5397-1CP10-5BA0,
pp. 215-224; 808D, 01/2017, p. 106. According to them

- $AA_ENC_COMP[e,N,AXi] is the value at point N of measuring system e; $AN_CEC[t,N] that of table t, which influences
  the output axis by the setpoint of the input axis. Points are equidistant, from MIN by STEP to MAX; between them the
  value is linear, and the first and last value hold beyond. Values are mm.
- the total of an axis is the sum of its tables.
- a positive value moves the axis in negative direction (808D, of ENC_COMP): the value is the error, actual -
  commanded. The stored pages do not say it of CEC again, so that the proof of the sign is the user's.
- DIRECTION 0 is for both directions of the input axis, 1 and -1 for one.

Not used: the multiplication of tables, of which too little could be read.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from stepdiag._core import Calibration, InvalidArgument
from stepdiag.exporting.axis_tables import AxisTables, axis_tables
from stepdiag.exporting.common import FloatArray, in_ascii, origin_of, rows_of
from stepdiag.exporting.left_in_volume import what_is_left
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, heading
from stepdiag.findings.meaning import provenance_rows
from stepdiag.parameters import AXES

UNTRIED: Final = "written from the manual (SINUMERIK K3), not tried on a controller"
SIGN: Final = (
    "sign: a value is the error, actual - commanded of the tool relative to the workpiece; a positive value moves the "
    "axis in negative direction (as the manual says of ENC_COMP; of CEC it could not be read): prove it before cutting"
)
MOST_POINTS: Final = 200  # of a table of an 828D or 808D, which cannot be extended
MOST_OF_840D: Final = 5000  # $MA_MM_ENC_COMP_MAX_POINTS
BYTES: Final = 8  # of a value, in the controller's memory


def siemens_enc_comp(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """Leadscrew and measuring system error compensation: the positioning of each axis, alike in both directions."""
    names = _names(options)
    tables, left, missing = axis_tables(
        calibration, options, rows_of(options, MOST_OF_840D, MOST_POINTS), [(n, n) for n in range(3)], both=()
    )
    most = max((len(tables.positions[by]) for _, by in tables.functions), default=0)
    settings = [f"MD38000 $MA_MM_ENC_COMP_MAX_POINTS[0,{names[n]}] = {most}" for n in range(3)]
    lines = [
        *_head(calibration, options, tables, names),
        f"needs: {'; '.join(settings)} or more ({BYTES * most} bytes an axis); changing it "
        "reorganises the memory: save the tables before",
        "steps: set MD32700 $MA_ENC_COMP_ENABLE = 0 of the axis, load this file, set it to 1, reset, and reference the "
        "axis; the value should be 0 at the reference point, or the axis moves when it is referenced",
        *missing,
        "left out: straightness, squareness, and what the rotations do away from where the tables hold",
        *what_is_left(calibration, left),
    ]
    origin, body = origin_of(options), []
    for (_, by), (values,) in tables.functions.items():
        first, step, last = _range(tables.positions[by], float(origin[by]))
        name = names[by]
        body += [f"$AA_ENC_COMP[0,{n},{name}]={value:.6f}" for n, value in enumerate(values + 0.0)]
        body += [f"$AA_ENC_COMP_STEP[0,{name}]={step}", f"$AA_ENC_COMP_MIN[0,{name}]={first}"]
        body += [f"$AA_ENC_COMP_MAX[0,{name}]={last}", f"$AA_ENC_COMP_IS_MODULO[0,{name}]=0"]
    text = _text("%_N_AX_EEC_INI", "siemens-enc-comp", calibration, lines, body)
    return Export({output: text}, lines, tables.coverage(calibration), left, motors=tables.motors)


def siemens_cec(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """Sag and angularity error compensation: the error of each axis by each axis, also of its own direction."""
    names = _names(options)
    tables, left, missing = axis_tables(calibration, options, rows_of(options, MOST_OF_840D, MOST_POINTS))
    settings = "; ".join(f"[{t}] = {len(tables.positions[by])}" for t, _, by, _, _ in _numbered(tables))
    size = BYTES * sum(len(values) for *_, values in _numbered(tables))
    lines = [
        *_head(calibration, options, tables, names),
        f"needs: MD18342 $MN_MM_CEC_MAX_POINTS {settings} or more ({size} bytes; an 828D has eight tables of 200); "
        "changing it reorganises the memory: save the tables before",
        "steps: set SD41300 $SN_CEC_TABLE_ENABLE[t] = 0 of all tables, load this file, set MD32710 $MA_CEC_ENABLE = 1 "
        f"of the axes and SD41300 = 1 of tables 0 to {tables.count - 1}, reset, and reference the axes; tables of "
        "before that are not in this file stay off",
        *missing,
        "left out: what rotations do where the other axes stand elsewhere",
        *what_is_left(calibration, left),
    ]
    origin, body = origin_of(options), []
    for t, axis, by, direction, values in _numbered(tables):
        first, step, last = _range(tables.positions[by], float(origin[by]))
        body += [f"; error of {AXES[axis]} by the position of {AXES[by]}"]
        body += [f"$AN_CEC[{t},{n}]={value:.6f}" for n, value in enumerate(values + 0.0)]
        body += [f"$AN_CEC_INPUT_AXIS[{t}]=({names[by]})", f"$AN_CEC_OUTPUT_AXIS[{t}]=({names[axis]})"]
        body += [f"$AN_CEC_STEP[{t}]={step}", f"$AN_CEC_MIN[{t}]={first}", f"$AN_CEC_MAX[{t}]={last}"]
        body += [f"$AN_CEC_DIRECTION[{t}]={direction}", f"$AN_CEC_MULT_BY_TABLE[{t}]=0", f"$AN_CEC_IS_MODULO[{t}]=0"]
    text = _text("%_N_NC_CEC_INI", "siemens-cec", calibration, lines, body)
    return Export({output: text}, lines, tables.coverage(calibration), left, motors=tables.motors)


def _names(options: ExportOptions) -> tuple[str, str, str]:
    names = options.axis_names or ("AX1", "AX2", "AX3")
    if len(names) != 3 or len(set(names)) != 3 or not all(name.isascii() and name.isalnum() for name in names):
        raise InvalidArgument(f"`axis_names`: expected three different names such as AX1 AX2 AX3, got {names}")
    return names


def _numbered(tables: AxisTables) -> Iterator[tuple[int, int, int, int, FloatArray]]:
    """Number, output axis, input axis, direction and values of each table."""
    number = 0
    for (axis, by), directions in tables.functions.items():
        for direction, values in zip((1, -1) if len(directions) == 2 else (0,), directions, strict=True):
            yield number, axis, by, direction, values
            number += 1


def _range(positions: FloatArray, origin: float) -> tuple[str, str, str]:
    """First position, step and last position, such that (MAX - MIN) / STEP is whole to the last digit."""
    step = round(1e6 * float(positions[1]))
    first = round(1e6 * origin)
    last = first + step * (len(positions) - 1)
    return f"{first / 1e6:.6f}", f"{step / 1e6:.6f}", f"{last / 1e6:.6f}"


def _head(calibration: Calibration, options: ExportOptions, tables: AxisTables, names: Sequence[str]) -> list[str]:
    return [
        UNTRIED,
        *heading(calibration, options, directions=tables.directions),
        "units: mm, positions in the machine coordinate system; machine axes X, Y, Z: " + ", ".join(names),
        *tables.sentences(),
        SIGN,
    ]


def _text(name: str, to: str, calibration: Calibration, lines: Sequence[str], body: Sequence[str]) -> str:
    said = [f"stepdiag export --to {to}", *provenance_rows(calibration), *lines]
    return in_ascii("\n".join([name, *(f"; {line}" for line in said), "CHANDATA(1)", *body, "M17", ""]))
