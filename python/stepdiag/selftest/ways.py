"""The cases of the self-test that go the ways in and out: sheets with every unit, and exports in every format.

The truths are small enough to be worked out by hand: powers of ten, legal definitions of units, and a machine with a
few errors that are straight lines between three nodes.
"""

import csv
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np

from stepdiag import _core
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.write import export
from stepdiag.importing.numbers import clock, shown_by
from stepdiag.importing.run import import_files
from stepdiag.io.data_files import read_calibration
from stepdiag.parameters import FUNCTIONS
from stepdiag.positions.readings import read_positions
from stepdiag.selftest.table import SelfTestRow
from stepdiag.units import (
    HECTOPASCAL,
    HOUR,
    MICRO,
    MICROMETRE,
    MICRORADIAN,
    MILLIRADIAN,
    MINUTE,
    NANOMETRE,
    PERCENT,
    PPM,
    UNITS,
    report_value,
    unit_of,
)

BY_HAND: Final = "worked out by hand (python/stepdiag/selftest/ways.py)"
DEFINED: Final = "SI Brochure; NIST SP 811, appendix B (inch, conventional mmHg and inHg, °F)"

# Unit of a column: what 2.5 of it are in mm, rad, s, °C, Pa, 1.
SHEETS: Final[Mapping[str, Mapping[str, float]]] = {
    "distance": {"mm": 2.5, "µm": 2.5e-3, "m": 2500.0, "cm": 25.0, "nm": 2.5e-6, "in": 63.5},
    "alpha": {
        "µrad": 2.5e-6,
        "mrad": 2.5e-3,
        "rad": 2.5,
        "°": 0.043633231299858237,
        "″": 1.2120342027738399e-5,
    },
    "time": {"s": 2.5, "ms": 2.5e-3, "min": 150.0, "h": 9000.0},
    "temperature": {"°C": 2.5, "K": -270.65, "°F": -16.388888888888889},
    "air_pressure": {
        "hPa": 250.0,
        "mbar": 250.0,
        "Pa": 2.5,
        "kPa": 2500.0,
        "mmHg": 333.3059685375,
        "Torr": 333.30592105263158,
        "inHg": 8465.9716008525,
    },
    "air_humidity": {"%": 0.025},
}
# What keys of files with these endings mean, and how reports show 2.5 of a native unit.
KEYS: Final = {
    "um": 1e-3,
    "mm": 1.0,
    "urad": 1e-6,
    "um_per_h": 1e-3 / 3600.0,
    "um_per_sqrt_h": 1e-3 / 60.0,
    "um_per_k": 1e-3,
    "um_per_m_k": 1e-6,
    "ppm": 1e-6,
    "c": 1.0,
    "c_per_h": 1.0 / 3600.0,
    "hpa": 100.0,
    "percent": 0.01,
}
CONSTANTS: Final = (
    (NANOMETRE, 1e-6),
    (MICROMETRE, 1e-3),
    (MILLIRADIAN, 1e-3),
    (MICRORADIAN, 1e-6),
    (MICRO, 1e6),
    (PERCENT, 0.01),
    (PPM, 1e-6),
    (HECTOPASCAL, 100.0),
    (MINUTE, 60.0),
    (HOUR, 3600.0),
)
REPORTED: Final = {"mm": (2500.0, "µm"), "rad": (2.5e6, "µrad"), "1": (2.5, ""), "°C": (2.5, "°C")}

CLOCKS: Final = {"10:23:45.5": 37425.5, "0:00": 0.0, "1:02:03": 3723.0, "28.11.2026 23:59:59": 86399.0}
# Number formats of workbooks: by what they multiply, and what stands beside the number.
FORMATS: Final = {
    "0.00%": (Decimal(100), ""),
    "#,##0.0": (Decimal(1), ""),
    "0.0,": (Decimal("0.001"), ""),
    '0.000" mm";[Red]-0.000" mm"': (Decimal(1), "mm"),
    "[$-407]0.0\\ \\µ\\m": (Decimal(1), "µm"),
    '_-* 0.0" °C"': (Decimal(1), "°C"),
}
PARABOLA: Final = 1e-7  # 1/mm: 4 µm at 200 mm
SLOPE: Final = 20e-6
HOME: Final = (7.0, -3.0, 20.0)  # mm, in a controller's coordinates
EDGE: Final = 200.0  # mm, of a cube with nodes at 0, 100 and 200
# Errors at 100 and 200 mm, µm and µrad; the others are 0. They act at the tool as sums of theta x L.
ERRORS: Final = {"EXX": (10.0, 16.0), "EYX": (2.0, 0.0), "EYY": (-4.0, 6.0), "EZZ": (3.0, 9.0), "ECX": (20.0, 30.0)}
SQUARE: Final = {"C0Y": 50e-6, "B0Z": -30e-6, "A0Z": 20e-6}
# At X 200, Y 100, Z 100 mm, µm: dx = EXX - C0Y y + B0Z z - ECX y, dy = EYX + EYY - A0Z z, dz = EZZ.
AT_POINT: Final = ((200.0, 100.0, 100.0), (16.0 - 5.0 - 3.0 - 3.0, 0.0 - 4.0 - 2.0, 3.0))
SECOND_ORDER: Final = 2e-6  # mm: an error of 16 µm moves the place at which it is looked up
ROUNDING: Final = 1e-15  # relative
LINES: Final = 1e-8  # angles of 5e-5 rad, squared, of which formats leave out some


def units(_: Path) -> Iterator[SelfTestRow]:
    """Of keys, reports and sheets."""
    off = [UNITS[key].native / factor - 1.0 if key in UNITS else np.nan for key, factor in KEYS.items()]
    off += [0.0 if set(UNITS) == set(KEYS) and unit_of("number").native == 1.0 else np.nan]
    off += [constant / value - 1.0 for constant, value in CONSTANTS]
    yield SelfTestRow("units", f"of keys, {len(KEYS)}", DEFINED, largest(off), ROUNDING)
    shown = [report_value(unit, 2.5) for unit in REPORTED]
    off = [
        value / want - 1.0 if name == word else np.nan
        for (value, name), (want, word) in zip(shown, REPORTED.values(), strict=True)
    ]
    yield SelfTestRow("units", f"of reports, {len(off)}", DEFINED, largest(off), ROUNDING)
    with tempfile.TemporaryDirectory() as folder:
        for channel, words in SHEETS.items():
            off = []
            for word, expected in words.items():
                for sign in (1, -1):
                    off.append(_imported(Path(folder), channel, word, sign) / (sign * expected) - 1.0)
                if channel not in ("distance", "alpha"):  # only readings have a sign
                    off.pop()
            yield SelfTestRow("import", f"{channel}, {len(words)} units", DEFINED, largest(off), ROUNDING)
    off = [float(seconds) - CLOCKS[text] for text in CLOCKS for _, seconds in [clock(text) or (0, np.nan)]]
    yield SelfTestRow("import", f"clock times, {len(CLOCKS)}", BY_HAND, largest(off), 0.0)
    off = [float(shown_by(code) != shown) for code, shown in FORMATS.items()]
    yield SelfTestRow("import", f"number formats, {len(FORMATS)}", BY_HAND, largest(off), 0.0)


def _imported(folder: Path, channel: str, unit: str, sign: int) -> float:
    has_sign = channel in ("distance", "alpha")
    own = {"distance": [], "alpha": ["Distance [mm]", "Beta [µrad]"]}.get(channel, ["Distance [mm]"])
    path = folder / "sheet.csv"
    path.write_text(
        "\n".join(
            ";".join(row)
            for row in (
                ["Line", "Point", "X [mm]", "Y [mm]", "Z [mm]", *own, "Measured"],
                *(["ppp", str(k), f"{k},0", "0,0", "0,0", *["1,0"] * len(own), "2,5"] for k in range(2)),
            )
        ),
        encoding="utf-8",
    )
    minus = "-" if sign < 0 and has_sign else ""
    found = import_files([path], column=[f"Measured={minus}{channel} [{unit}]"])
    return float(found.measurement.channels[channel][1])


def exports(_: Path) -> Iterator[SelfTestRow]:
    """Each format, written and read by its own rules, beside numbers worked out by hand."""
    bent, square = known_machine(ERRORS), known_machine({})
    place, error = AT_POINT
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def written(to: str, calibration: _core.Calibration, **options: object) -> str:
            path = folder / f"{to}.{'hal' if to in ('matrix', 'calibxyzkins') else 'csv'}"
            export(calibration, path, to=to, options=ExportOptions(**options))  # type: ignore[arg-type]
            return path.read_text(encoding="utf-8")

        export(bent, folder / "comp", to="linuxcnc-comp", origin=HOME)
        # Through the middle of the volume: EXX - ECX y, EYY, EZZ.
        rows = [
            [float(word) for word in line.split()]
            for j in range(3)
            for line in (folder / f"comp/joint{j}.comp").read_text().splitlines()
        ]
        actual = {(k // 3, row[0]): row[1:] for k, row in enumerate(rows)}
        expected = {0: (8e-3, 13e-3), 1: (-4e-3, 6e-3), 2: (3e-3, 9e-3)}
        off = [
            one - (HOME[j] + x + e)
            for j, (a, b) in expected.items()
            for x, e in ((0.0, 0.0), (100.0, a), (200.0, b))
            for one in actual[j, HOME[j] + x]
        ]
        yield SelfTestRow("export", "linuxcnc-comp", BY_HAND, largest(off), SECOND_ORDER, "mm")

        text = written("linuxcnc-kins", bent)
        back = read_calibration(folder / "linuxcnc-kins.csv")
        off = [
            back[name].value[k] - value * (1e-3 if name[1] in "XYZ" else 1e-6)
            for name, both in ERRORS.items()
            for k, value in ((1, both[0]), (2, both[1]))
        ]
        off += [back.squareness[name][0] - value for name, value in SQUARE.items()]
        yield SelfTestRow("export", "linuxcnc-kins", BY_HAND, largest(off if "EXX" in text else []), 1e-17)

        table = _isg(written("isg", bent, origin=HOME))
        # The controller takes Y for the lever of ECX, and home is at -3 mm there.
        expected_isg = {
            ("X", 100.0): (10e-3 - 6e-5, 2e-3, 0.0, 0.0, 0.0, 20e-6),
            ("X", 200.0): (16e-3 - 9e-5, 0.0, 0.0, 0.0, 0.0, 30e-6),
            ("Y", 100.0): (-5e-3, -4e-3, 0.0, 0.0, 0.0, 0.0),
            ("Z", 200.0): (-6e-3, -4e-3, 9e-3, 0.0, 0.0, 0.0),
        }
        off = [
            a - b
            for key, row in expected_isg.items()
            for a, b in zip(table.get((key[0], key[1] + HOME["XYZ".index(key[0])]), [np.nan] * 6), row, strict=True)
        ]
        yield SelfTestRow("export", "isg", BY_HAND, largest(off), 1e-9)
        # With its own squarenesses, which turn about the controller's 0: EXY = C0Y y0, EXZ = -B0Z z0, EYZ = A0Z z0.
        table = _isg(written("isg", bent, origin=HOME, squareness="parameters"))
        expected_isg = {
            ("Y", 0.0): (50e-6 * HOME[1], 0.0, 0.0, 0.0, 0.0, 0.0),
            ("Z", 0.0): (30e-6 * HOME[2], 20e-6 * HOME[2], 0.0, 0.0, 0.0, 0.0),
            ("Z", 200.0): (30e-6 * HOME[2], 20e-6 * HOME[2], 9e-3, 0.0, 0.0, 0.0),
        }
        off = [
            a - b
            for (axis, at), row in expected_isg.items()
            for a, b in zip(table.get((axis, at + HOME["XYZ".index(axis)]), [np.nan] * 6), row, strict=True)
        ]
        yield SelfTestRow("export", "isg, squareness apart", BY_HAND, largest(off), 1e-9)

        grid = _csv(written("csv-grid", bent, step=100.0, origin=HOME))
        row = next(
            (row for row in grid if tuple(float(row[f"{a}_mm"]) for a in "xyz") == tuple(np.add(place, HOME))), None
        )
        off = (
            [np.nan]
            if row is None
            else [1e-3 * (float(row[f"e{a}_um"]) - want) for a, want in zip("xyz", error, strict=True)]
        )
        yield SelfTestRow("export", "csv-grid", BY_HAND, largest(off), SECOND_ORDER, "mm")

        turned = known_machine({"EAX": (10.0, 40.0), "EBX": (20.0, 50.0), "ECX": (30.0, 60.0)})
        grid = _csv(written("csv-grid", turned, step=100.0, orientation=True))
        row = next((row for row in grid if tuple(float(row[f"{a}_mm"]) for a in "xyz") == place), None)
        off = (
            [np.nan]
            if row is None
            else [1e-6 * (float(row[f"e{a}_urad"]) - want) for a, want in zip("abc", (40.0, 50.0, 60.0), strict=True)]
        )
        # Squarenesses turn no tool. Rotations of 60 µrad do not commute by 2 nrad.
        yield SelfTestRow("export", "csv-grid, rotations", BY_HAND, largest(off), 2e-9, "rad")

        angles = {row["parameter"]: row for row in _csv(written("squareness", square))}
        larger = {"C0Y": 50.0, "B0Z": 30.0, "A0Z": 20.0}  # each of them opens the angle of its axes
        arcsec = {"C0Y": 10.313240312354818, "B0Z": -6.1879441874128908, "A0Z": 4.1252961249419272}
        off = [float(angles[name]["value_urad"]) - 1e6 * value for name, value in SQUARE.items()]
        off += [float(angles[name]["value_mm_per_m"]) - 1e3 * value for name, value in SQUARE.items()]
        off += [float(angles[name]["value_arcsec"]) - value for name, value in arcsec.items()]
        off += [float(angles[name]["fitted_urad"]) - 1e6 * value for name, value in SQUARE.items()]
        off += [float(angles[name]["larger_than_90_urad"]) - value for name, value in larger.items()]
        yield SelfTestRow("export", "squareness", BY_HAND, largest(off), 1e-11)

        # The inverse of (1, -C0Y, B0Z; 0, 1, -A0Z; 0, 0, 1), and this matrix itself.
        pins = _pins(written("matrix", square))
        wanted = {
            "C_xx": 1.0,
            "C_yy": 1.0,
            "C_zz": 1.0,
            "C_xy": 50e-6,
            "C_xz": 30e-6,
            "C_yz": 20e-6,
            "C_yx": 0.0,
            "C_zx": 0.0,
            "C_zy": 0.0,
        }
        yield SelfTestRow(
            "export", "matrix", BY_HAND, largest([pins.get(k, np.nan) - v for k, v in wanted.items()]), LINES
        )
        pins = _pins(written("calibxyzkins", square))
        wanted = {
            "calib-a.xx": 1.0,
            "calib-a.yy": 1.0,
            "calib-a.zz": 1.0,
            "calib-a.xy": -50e-6,
            "calib-a.xz": -30e-6,
            "calib-a.yz": -20e-6,
        }
        yield SelfTestRow(
            "export", "calibxyzkins", BY_HAND, largest([pins.get(k, np.nan) - v for k, v in wanted.items()]), LINES
        )

        # EXX = s x + k x^2 of x = m - h, and X - h = x + EXX.
        k, s, h = PARABOLA, SLOPE, HOME[0]
        pins = _pins(written("calibxyzkins", known_machine({}, {}, parabola=k), origin=HOME))
        wanted = {"calib-a.xx": 1.0 + s - 2.0 * k * h, "calib-b.xx": k, "calib-c.x": k * h**2 - s * h}
        off = [pins.get(name, np.nan) - value for name, value in wanted.items()]
        yield SelfTestRow("export", "calibxyzkins, parabola", BY_HAND, largest(off), 1e-9)

        # One table for both directions has their mean: EYY less half of what + has more than -.
        table = _isg(written("isg", known_machine(ERRORS, reversal={"EYY": 3.0}), origin=HOME))
        off = [table.get(("Y", 100.0 + HOME[1]), [np.nan] * 6)[1] - (-4e-3 - 1.5e-3)]
        yield SelfTestRow("export", "isg, mean of two directions", BY_HAND, largest(off), 1e-9, "mm")

        positions = {
            float(row["position_mm"]): float(row["error_um"])
            for row in _csv(written("position-error", bent, axis="X", depends_on="X", origin=HOME))
        }
        off = [
            1e-3 * (positions.get(HOME[0] + at, np.nan) - want)
            for at, want in ((0.0, 0.0), (100.0, 8.0), (200.0, 13.0))
        ]
        yield SelfTestRow("export", "position-error", BY_HAND, largest(off), SECOND_ORDER, "mm")


def files(_: Path) -> Iterator[SelfTestRow]:
    """Columns of a run and of a positioning test."""
    with tempfile.TemporaryDirectory() as name:
        run = Path(name) / "run.csv"
        run.write_text(
            "line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad,temperature_c,air_pressure_hpa,air_humidity_percent\n"
            + "".join(f"ppp,{k},{k}.0,0.0,0.0,2.5,2.5,-2.5,2.5,2.5,2.5\n" for k in range(2)),
            encoding="utf-8",
        )
        found = _core.read_measurement(run).channels
        expected = {
            "distance": 2.5,
            "alpha": 2.5e-6,
            "beta": -2.5e-6,
            "temperature": 2.5,
            "air_pressure": 250.0,
            "air_humidity": 0.025,
        }
        off = [float(found[channel][1]) / value - 1.0 for channel, value in expected.items()]
        yield SelfTestRow("files", "columns of a run", BY_HAND, largest(off), ROUNDING)
        tested = Path(name) / "positions.csv"
        tested.write_text("target_mm,direction,cycle,deviation_um\n0,+,1,2.5\n100,-,1,-2.5\n", encoding="utf-8")
        deviations = read_positions(tested).deviations
        off = [deviations[0.0, "+", 1] / 2.5e-3 - 1.0, deviations[100.0, "-", 1] / -2.5e-3 - 1.0]
        tested.write_text("target_mm,direction,cycle,position_mm\n0,+,1,0.25\n100,+,1,100.5\n", encoding="utf-8")
        deviations = read_positions(tested).deviations
        off += [deviations[0.0, "+", 1] / 0.25 - 1.0, deviations[100.0, "+", 1] / 0.5 - 1.0]
        tested.write_text(
            "target_mm,direction,cycle,deviation_um\n0,+,1,\n100,+,1,1\n99.75,+,2,1\n0,+,2,1\n", encoding="utf-8"
        )
        found_targets = read_positions(tested)
        off += [found_targets.lost - 1.0, found_targets.apart / 0.25 - 1.0, found_targets.targets[-1] / 100.0 - 1.0]
        yield SelfTestRow("files", "columns of a positioning test", BY_HAND, largest(off), ROUNDING)


def known_machine(
    errors: Mapping[str, tuple[float, float]],
    squareness: Mapping[str, float] = SQUARE,
    reversal: Mapping[str, float] = MappingProxyType({}),
    parabola: float = 0.0,
) -> _core.Calibration:
    """Of a gantry, whose X carries Y, and Y carries Z and the tool.

    reversal: that of a function, + less -, µm. parabola: of EXX over the square of X, 1/mm, beside SLOPE."""
    functions = {}
    for name in FUNCTIONS:
        factor = 1e-3 if name[1] in "XYZ" else 1e-6
        values = [0.0, *(factor * value for value in errors.get(name, (0.0, 0.0)))]
        functions[name] = ([0.0, 0.5 * EDGE, EDGE], values, [0.0] * 3)
    if parabola:
        nodes = np.linspace(0.0, EDGE, 801)
        functions["EXX"] = (nodes.tolist(), (parabola * nodes**2 + SLOPE * nodes).tolist(), [0.0] * len(nodes))
    return _core.Calibration(
        "adjustment",
        "[w b X Y Z t]",
        [EDGE] * 3,
        [0.0] * 3,
        functions,
        {name: (squareness.get(name, 0.0), 0.0) for name in SQUARE},
        reversal={name: ([0.0, 0.5 * EDGE, EDGE], [1e-3 * value] * 3, [0.0] * 3) for name, value in reversal.items()},
        date="2026-01-01T00:00:00Z",
    )


def _csv(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def _isg(text: str) -> dict[tuple[str, float], Sequence[float]]:
    """By axis and position, six errors."""
    found: dict[tuple[str, float], Sequence[float]] = {}
    axis = ""
    for line in text.splitlines():
        words = line.split()
        if len(words) == 7 and words[0] in ("X", "Y", "Z"):
            axis = words[0]
        elif len(words) == 7 and not line.startswith("//"):
            position, *errors = map(float, words)
            found[axis, position] = errors
    return found


def _pins(text: str) -> dict[str, float]:
    return {name: float(value) for name, value in re.findall(r"(?m)^setp \w+\.(\S+) (\S+)$", text)}


def largest(values: Sequence[float]) -> float:
    """NaN where there are none, or one is NaN: that passes nothing."""
    sizes = np.abs(np.asarray(values, dtype=float))
    return float(sizes.max()) if sizes.size else float("nan")
