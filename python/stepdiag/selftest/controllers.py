"""The cases of the self-test for controllers: tables read by their own rules, beside numbers worked out by hand.

The machine is that of ways.py: errors that are straight lines between three nodes, home away from the controller's 0.
"""

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, ErrorMap
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.write import write_export
from stepdiag.importing.controller_tables import read_controller_tables
from stepdiag.selftest.table import SelfTestRow
from stepdiag.selftest.ways import (
    BY_HAND,
    EDGE,
    ERRORS,
    HOME,
    PARABOLA,
    SECOND_ORDER,
    SLOPE,
    SQUARE,
    known_machine,
    largest,
)

FloatArray = npt.NDArray[np.float64]

MIDDLE: Final = (0.5 * EDGE,) * 3
DIGITS: Final = 6e-7  # mm: half of the sixth, and terms of second order
# On lines through the middle, mm, at 0, half of the edge and the edge. X by X is EXX - ECX y with y = 100 mm, X by Y is
# -(C0Y + ECX) y with ECX at 100 mm, X by Z is B0Z z, Y by Z is -A0Z z, and Y by X is EYX.
ON_LINES: Final[Mapping[str, tuple[float, float, float]]] = {
    "XX": (0.0, 8e-3, 13e-3),
    "YY": (0.0, -4e-3, 6e-3),
    "ZZ": (0.0, 3e-3, 9e-3),
    "YX": (0.0, 2e-3, 0.0),
    "XY": (0.0, -7e-3, -14e-3),
    "XZ": (0.0, -3e-3, -6e-3),
    "YZ": (0.0, -2e-3, -4e-3),
}
# Tangents by which the axes are more than 90 degrees apart.
OBTUSE: Final = {"XY": 50e-6, "XZ": 30e-6, "YZ": 20e-6}


def controllers(_: Path) -> Iterator[SelfTestRow]:
    bent, square = known_machine(ERRORS), known_machine({})
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def written(to: str, **options: object) -> Path:
            machine = square if to in ("rrf", "marlin", "klipper") else bent
            write_export(machine, to, folder / to, ExportOptions(**options))  # type: ignore[arg-type]
            return folder / to

        text = written("siemens-cec", origin=HOME, at=MIDDLE).read_text(encoding="ascii")
        off = list(_cec(text))
        text = written("siemens-cec", at=MIDDLE, tables=1).read_text(encoding="ascii")
        off += _differences(_found(r"PUT_AXIS\[0\]=\(AX(\d)\)", text), (2.0, 1.0))  # X by Y varies most
        yield SelfTestRow("export", "siemens-cec", BY_HAND, largest(off), DIGITS, "mm")

        text = written("siemens-enc-comp", origin=HOME, at=MIDDLE).read_text(encoding="ascii")
        off = []
        for n, axis in enumerate("XYZ", 1):
            values = _found(rf"ENC_COMP\[0,\d,AX{n}\]=(\S+)", text)
            off += _differences(values, ON_LINES[2 * axis])
            off += _differences(
                _found(rf"ENC_COMP_M(?:IN|AX)\[0,AX{n}\]=(\S+)", text), (HOME[n - 1], HOME[n - 1] + EDGE)
            )
        yield SelfTestRow("export", "siemens-enc-comp", BY_HAND, largest(off), DIGITS, "mm")

        tables_of = written("heidenhain-com", origin=HOME, at=MIDDLE)
        off = []
        for n, by in enumerate("XYZ"):
            rows = _rows((tables_of / f"{by.lower()}.com").read_text(encoding="ascii"))
            off += _differences([row[1] for row in rows], [HOME[n] + place for place in (0.0, 0.5 * EDGE, EDGE)])
            for k, axis in enumerate("XYZ", 3):
                off += _differences([row[k] for row in rows], ON_LINES.get(axis + by, (0.0, 0.0, 0.0)))
        yield SelfTestRow("export", "heidenhain-com", BY_HAND, largest(off), DIGITS, "mm")

        # As of isg: the controller takes Y for the lever of ECX, and home is at -3 mm there. ECX in degrees.
        tables_of = written("heidenhain-kinematics", origin=HOME)
        rows = _rows((tables_of / "x.com").read_text(encoding="ascii"))
        expected = (
            (10e-3 - 6e-5, 2e-3, 0.0, 0.0, 0.0, 1.1459155902616465e-3),
            (16e-3 - 9e-5, 0.0, 0.0, 0.0, 0.0, 1.7188733853924697e-3),
        )
        off = [d for row, want in zip(rows[1:], expected, strict=True) for d in _differences(row[2:], want)]
        # With 10 mm of fixed lines in Y beside the 3 mm from home the lever is -7 mm.
        rows = _rows(
            (written("heidenhain-kinematics", origin=HOME, fixed=(0.0, 10.0, 0.0)) / "x.com").read_text("ascii")
        )
        off += _differences([row[2] for row in rows[1:]], (10e-3 + 1.4e-4, 16e-3 + 2.1e-4))
        yield SelfTestRow("export", "heidenhain-kinematics", BY_HAND, largest(off), DIGITS)

        text = written("etalon", origin=HOME).read_text(encoding="ascii")
        off = [
            difference
            for name, want in {"EXX": (0.0, 10e-3 - 6e-5, 16e-3 - 9e-5), "ECX": (0.0, 20e-6, 30e-6)}.items()
            for difference in _differences(
                _found(r"\S+ (\S+)\n", re.split(rf"\[{name}\]\n.*\n", text)[1].split("}")[0]), want
            )
        ]
        yield SelfTestRow("export", "etalon", BY_HAND, largest(off), 1e-9)

        # In the order of the words: M556 has X for XY, Y for YZ, Z for XZ; M852 I J K for XY XZ YZ, with the minus.
        values = _found(r"M556 S100 X(\S+) Y(\S+) Z(\S+)", written("rrf").read_text(encoding="ascii"))
        off = _differences([value / 100.0 for value in values], [OBTUSE[axes] for axes in ("XY", "YZ", "XZ")])
        values = _found(r"M852 I(\S+) J(\S+) K(\S+)", written("marlin").read_text(encoding="ascii"))
        off += _differences([-value for value in values], [OBTUSE[axes] for axes in ("XY", "XZ", "YZ")])
        # AC^2 - BD^2 = 4 AD^2 sin(atan(factor)); a factor of 5e-5 and its sine differ by 6e-14.
        text = written("klipper").read_text(encoding="ascii")
        for axes, tangent in OBTUSE.items():
            ac, bd, ad = _found(rf"{axes}=([\d.]+),([\d.]+),([\d.]+)", text)
            off.append((bd**2 - ac**2) / (4.0 * ad**2) - tangent)
        yield SelfTestRow("export", "rrf, marlin, klipper", BY_HAND, largest(off), 6e-9)


# What comes back of a table, at half of the edge and the edge, mm and rad, and the squarenesses, rad. On lines through
# the middle C0Y and ECX there are one. Of reversal -: 3 µm less than +, at 0 too.
LINES: Final = {"EXX": (8e-3, 13e-3), "EYY": (-4e-3, 6e-3), "EZZ": (3e-3, 9e-3), "EYX": (2e-3, 0.0), "EXY": (0.0, 0.0)}
WHOLE: Final = {
    **{"EXX": (10e-3, 16e-3), "EYX": (2e-3, 0.0), "EYY": (-4e-3, 6e-3), "ECX": (20e-6, 30e-6)},
    **dict.fromkeys(("EXY", "EXZ", "EYZ"), (0.0, 0.0)),
}
POSITIONING: Final = {name: LINES[name] for name in ("EXX", "EYY", "EZZ")}
SQUARE_IN_THE_MIDDLE: Final = SQUARE | {"C0Y": 70e-6}
Expected = Mapping[str, tuple[float, float]]
BACK: Final[Sequence[tuple[str, Mapping[str, object], Expected, Mapping[str, float]]]] = (
    ("siemens-cec", {"at": MIDDLE}, LINES, SQUARE_IN_THE_MIDDLE),
    ("siemens-enc-comp", {"at": MIDDLE}, POSITIONING, {}),
    ("heidenhain-com", {"at": MIDDLE}, LINES, SQUARE_IN_THE_MIDDLE),
    ("heidenhain-kinematics", {}, WHOLE, SQUARE),
    ("linuxcnc-comp", {}, POSITIONING, {}),
    ("isg", {"squareness": "parameters"}, WHOLE, SQUARE),
    ("etalon", {}, WHOLE, SQUARE),
    ("etalon", {"squareness": "parameters"}, WHOLE, SQUARE),
    ("squareness", {}, {}, SQUARE),
    ("position-error", {"axis": "X", "depends_on": "X"}, {"EXX": LINES["EXX"]}, {}),
)


def tables_read_back(_: Path) -> Iterator[SelfTestRow]:
    """What is exported comes back as an error map."""
    bent, square = known_machine(ERRORS), known_machine({})
    two = known_machine(ERRORS, reversal={"EYY": 3.0})
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def back(machine: Calibration, to: str, **options: object) -> ErrorMap:
            write_export(machine, to, folder / to, ExportOptions(**options))  # type: ignore[arg-type]
            files = [folder / to]
            if to.startswith("heidenhain"):
                files = [folder / to / f"{axis}.com" for axis in "xyz"]
            elif to == "linuxcnc-comp":
                files = [folder / to / "compensation.ini"]
            said = {"origin": HOME, "volume": (EDGE,) * 3} if to.startswith("heidenhain") else {}
            return read_controller_tables(files, chain="[w b X Y Z t]", **said).errors

        for to, options, functions, angles in BACK:
            found = back(bent, to, origin=HOME, **options)
            off = [d for name, want in functions.items() for d in _at_nodes(found.functions, name, want)]
            off += [EDGE * (found.squareness[name] - want) for name, want in angles.items()]
            apart = ", squareness apart" if "squareness" in options else ""
            yield SelfTestRow("import", f"map of {to}{apart}", BY_HAND, largest(off), SECOND_ORDER, "mm")

        off = []
        for to in ("siemens-cec", "linuxcnc-comp", "heidenhain-com"):
            found = back(two, to, origin=HOME, at=MIDDLE)
            off += _at_nodes(found.negative_functions, "EYY", (-7e-3, 3e-3))
            off.append(float(found.negative_functions["EYY"][1][0]) + 3e-3)
        yield SelfTestRow("import", "maps of two directions", BY_HAND, largest(off), SECOND_ORDER, "mm")

        off = [
            found.squareness[name] - want
            for to in ("rrf", "marlin", "klipper", "matrix")
            for found in [back(square, to)]
            for name, want in SQUARE.items()
        ]
        yield SelfTestRow("import", "maps of commands and a matrix", BY_HAND, largest(off), 6e-9, "rad")

        found = back(known_machine({}, {}, parabola=PARABOLA), "calibxyzkins", origin=HOME)
        want = tuple(SLOPE * x + PARABOLA * x**2 for x in (0.5 * EDGE, EDGE))
        off = _at_nodes(found.functions, "EXX", (want[0], want[1]))
        yield SelfTestRow("import", "map of a polynomial", BY_HAND, largest(off), 1e-8, "mm")


def _at_nodes(tables: Mapping[str, tuple[FloatArray, FloatArray]], name: str, want: tuple[float, float]) -> list[float]:
    """Differences, mm; of rotations what they do over the edge."""
    position, value = tables[name]
    arm = EDGE if name[1] in "ABC" else 1.0
    places = zip((0.5 * EDGE, EDGE), want, strict=True)
    return [arm * (float(np.interp(place, position, value)) - one) for place, one in places]


def _cec(text: str) -> Iterator[float]:
    """Differences of all tables from those on the lines, in values and places."""
    axis_of = {"AX1": "X", "AX2": "Y", "AX3": "Z"}
    pairs = re.findall(r"INPUT_AXIS\[(\d)\]=\((\w+)\)\n\$AN_CEC_OUTPUT_AXIS\[\d\]=\((\w+)\)", text)
    named = {axis_of[axis] + axis_of[by]: t for t, by, axis in pairs}
    yield float(set(named) != {pair for pair, values in ON_LINES.items() if any(values)})
    for pair, t in named.items():
        yield from _differences(_found(rf"AN_CEC\[{t},\d\]=(\S+)", text), ON_LINES[pair])
        home = HOME["XYZ".index(pair[1])]
        yield from _differences(_found(rf"CEC_(?:STEP|MIN|MAX)\[{t}\]=(\S+)", text), (0.5 * EDGE, home, home + EDGE))


def _found(pattern: str, text: str) -> list[float]:
    """The numbers of a pattern's groups, of all matches."""
    words = [word for match in re.finditer(pattern, text) for word in match.groups()]
    return [float(word) for word in words]


def _rows(text: str) -> list[list[float]]:
    return [[float(word) for word in line.split()] for line in text.splitlines()[2:-1]]


def _differences(values: Sequence[float], expected: Sequence[float]) -> list[float]:
    """NaN where their number differs: that passes nothing."""
    if len(values) != len(expected):
        return [float("nan")]
    return [value - want for value, want in zip(values, expected, strict=True)]
