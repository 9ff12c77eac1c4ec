"""The cases of the self-test for controllers: tables read by their own rules, beside numbers worked out by hand.

The machine is that of ways.py: errors that are straight lines between three nodes, home away from the controller's 0.
"""

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.write import write_export
from stepdiag.importing.controller_tables import read_controller_tables
from stepdiag.selftest.table import SelfTestRow
from stepdiag.selftest.ways import BY_HAND, EDGE, ERRORS, HOME, known_machine, largest

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
        yield SelfTestRow("export", "heidenhain-kinematics", BY_HAND, largest(off), DIGITS)

        file = written("etalon", origin=HOME)
        text = file.read_text(encoding="ascii")
        off = [
            difference
            for name, want in {"EXX": (0.0, 10e-3 - 6e-5, 16e-3 - 9e-5), "ECX": (0.0, 20e-6, 30e-6)}.items()
            for difference in _differences(
                _found(r"\S+ (\S+)\n", re.split(rf"\[{name}\]\n.*\n", text)[1].split("}")[0]), want
            )
        ]
        yield SelfTestRow("export", "etalon", BY_HAND, largest(off), 1e-9)

        back = read_controller_tables([file])
        off = [
            float(back.errors.functions[name][1][k]) - value * (1e-3 if name[1] in "XYZ" else 1e-6)
            for name, both in ERRORS.items()
            for k, value in ((1, both[0]), (2, both[1]))
        ]
        off += [
            abs(back.errors.squareness[name]) - OBTUSE[axes]
            for name, axes in (("C0Y", "XY"), ("B0Z", "XZ"), ("A0Z", "YZ"))
        ]
        yield SelfTestRow("import", "error map of etalon", BY_HAND, largest(off), 1e-8)

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
