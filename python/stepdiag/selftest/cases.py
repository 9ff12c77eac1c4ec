"""The cases of the self-test. Each says how far stepdiag is from a truth that comes from elsewhere.

What is allowed is either stated with the truth (known/statistics.csv), or below with its reason."""

import csv
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files as resources
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag import _core
from stepdiag._core import Environment, InvalidArgument, StatisticsOptions
from stepdiag.calibration.largest_by_kind import largest_deviations
from stepdiag.head.description import find_shipped_head, parse_head_design
from stepdiag.scenario.description import Scenario, adjust_scenario, evaluate_scenario, read_scenario
from stepdiag.selftest.controllers import controllers, tables_read_back
from stepdiag.selftest.jcgm import UNIFORM, B, gauge_block, straight_line, sum_of_four
from stepdiag.selftest.table import SelfTest, SelfTestRow, this_installation
from stepdiag.selftest.ways import exports, files, units
from stepdiag.uncertainty.monte_carlo import run_monte_carlo

KNOWN: Final = Path(str(resources("stepdiag.selftest") / "known"))

NIST: Final = "NIST Engineering Metrology Toolbox, refractive index of air"
INDICES: Final = "the published equations, computed by a separate program with 40 digits"
SCHOTT: Final = "SCHOTT, data sheet of N-BK7"
RUNS: Final = "runs made from the conventions (docs/conventions.md) by a separate closed-form program"
LIMITS: Final = "the same runs; the limits are those of the published equations (docs/method.md)"
GUM: Final = "JCGM 100:2008 (GUM), H.3"
JCGM_101: Final = "JCGM 101:2008, 9.2.3 and 9.5"
DIGITS_40: Final = "the conventions, computed by a separate program with 40 digits"
FILES: Final = "files of these runs with one fault each"

# Ciddor's and the modified Edlén equation as NIST prints them: nine decimals. The two programs differ in the last one
# for the vapour pressure, which each takes from a formula of its own.
AIR: Final = 1e-9
GLASS: Final = 1e-6  # six decimals
# A root, exponentials and quotients near 1: some units in the last place.
INDEX: Final = 2e-15
# Readings near 1 m are rounded to 1e-13 mm, and steps add up as a random walk. Tilts of a head with several beams are
# differences of them over 20 mm.
ADJUSTED: Final = {"ideal": (2e-11, 1e-13), "psd": (2e-11, 1e-13), "multi_beam": (1e-10, 1e-12)}
# Of 882 values one is further than 4.5 standard uncertainties once in 170 runs.
IN_UNCERTAINTIES: Final = 4.5
# The enhanced evaluation leaves terms of second order: a few products of the machine's angles, each 60 µrad x 60 µrad x
# 1 m = 4 nm; of a laser that is misaligned by 1 mrad 0.6 µm over 1.1 m, which some directions amplify.
CLEAN: Final = (15e-6, 5e-9)
MISALIGNED: Final = (2.5e-3, 50e-9)
# No large numbers are subtracted: errors of 0.1 mm, sums of a dozen products, each rounded by 1.4e-17 mm at most. How a
# compiler orders and fuses them differs: 1.3e-16 by GCC for x86-64, 2.2e-16 by clang, and by GCC for ARM64.
ERROR: Final = 3e-16  # mm
ROTATION: Final = 1e-18  # rad


def air(known: Path) -> Iterator[SelfTestRow]:
    printed, exact = _rows(known / "air.csv"), _rows(known / "air_exact.csv")
    for equation in ("ciddor", "modified_edlen"):
        off = [_index(row, 1e3 * float(row["pressure_kpa"]), equation) - float(row[equation]) for row in printed]
        yield SelfTestRow("index of air", f"{equation}, {len(off)} states", NIST, _largest(off), AIR)
    for equation in ("ciddor", "modified_edlen", "edlen_1966"):
        off = [_index(row, float(row["pressure_pa"]), equation) - float(row[equation]) for row in exact]
        yield SelfTestRow("index of air", f"{equation}, {len(off)} states", INDICES, _largest(off), INDEX)


def _rows(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def _index(row: dict[str, str], pressure: float, equation: str) -> float:
    environment = Environment.from_air(
        temperature=float(row["temperature_c"]),
        pressure=pressure,
        relative_humidity=1e-2 * float(row["humidity_percent"]),
        carbon_dioxide=float(row.get("co2_ppm", "450")),
        equation=equation,
    )
    return float(environment.refractive_index(float(row["wavelength_nm"])))


def glass(known: Path) -> Iterator[SelfTestRow]:
    off = [_in_window(row) - float(row["index"]) for row in _rows(known / "glass.csv")]
    yield SelfTestRow("index of glass", f"N-BK7, {len(off)} wavelengths", SCHOTT, _largest(off), GLASS)
    off = [_in_window(row) - float(row["index"]) for row in _rows(known / "glass_exact.csv")]
    yield SelfTestRow("index of glass", f"6 glasses, {len(off)} indices", INDICES, _largest(off), INDEX)


def _in_window(row: dict[str, str]) -> float:
    """Index of the window of a shipped head. Index and wavelength of the catalogue are those in air, of a head in
    vacuum."""
    window = find_shipped_head("three_beams").read_text(encoding="utf-8")
    in_air, air = float(row["wavelength_nm"]), Environment.from_air(relative_humidity=0.0)
    wavelength = in_air
    for _ in range(3):
        wavelength = in_air * air.refractive_index(wavelength)
    text = window.replace("wavelength_nm = 1530.0", f"wavelength_nm = {wavelength!r}")
    design = parse_head_design(text.replace('"N-BK7"', f'"{row["glass"]}"'))
    light = _core.trace_beams(_core.Head.from_design(design, standoff=100.0), distance=100.0)
    return max(one.index for one in light) / float(air.refractive_index(wavelength))


def runs(known: Path) -> Iterator[SelfTestRow]:
    """All evaluations of runs whose machine is known."""
    for folder in sorted(path for path in (known / "runs").iterdir() if path.is_dir()):
        scenario = read_scenario(folder / "scenario.toml")
        run, truth = _core.read_measurement(folder / "measurement.csv"), _core.read_error_map(folder / "truth.csv")
        name = f"run {folder.name}"
        noise = scenario.known.keys.noise
        found = adjust_scenario(scenario, run)
        if noise.distance_um > 0.0:
            largest = _in_uncertainties(found.calibration, truth)
            yield SelfTestRow(name, "adjustment, errors / uncertainties", RUNS, largest, IN_UNCERTAINTIES)
        else:
            off = Off.of(found.calibration, truth, scenario)
            yield from off.rows(name, "adjustment", RUNS, ADJUSTED[scenario.known.head.layout])
            yield from _published(name, scenario, run, truth)


def _published(name: str, scenario: Scenario, run: _core.Measurement, truth: _core.ErrorMap) -> Iterator[SelfTestRow]:
    """The enhanced evaluation to its limits; and verdicts of evaluations that leave something out."""
    enhanced = evaluate_scenario(scenario, run, method="enhanced")
    is_clean = name == "run clean"
    if scenario.known.head.layout == "psd":  # displaced detectors, which the method takes for angles of the machine
        yield _verdict(name, "enhanced", enhanced, "rejected")
    else:
        off = Off.of(enhanced, truth, scenario)
        yield from off.rows(name, "enhanced", LIMITS, CLEAN if is_clean else MISALIGNED)
    if is_clean:
        conventional = evaluate_scenario(scenario, run, method="conventional")
        yield _verdict(name, "conventional", conventional, "rejected")  # it has no rotations


def _verdict(name: str, method: str, found: _core.Calibration, expected: str) -> SelfTestRow:
    return SelfTestRow(name, f"{method}, verdict {expected}", LIMITS, float(found.fit != expected), 0.0)


@dataclass(frozen=True)
class Off:
    """How far a calibration is from the truth: lengths (mm), with squarenesses over the axis that they tilt, and angles
    (rad). None: not all 21 errors were determined."""

    length: float | None
    angle: float | None

    @staticmethod
    def of(found: _core.Calibration, truth: _core.ErrorMap, scenario: Scenario) -> "Off":
        if set(found.functions) != set(truth.functions) or set(found.squareness) != set(truth.squareness):
            return Off(None, None)
        edges = dict(zip("XYZ", scenario.known.plan.volume, strict=True))
        tilts = [edges[name[2]] * (found.squareness[name][0] - truth.squareness[name]) for name in truth.squareness]
        by_kind = {kind: one.value for kind, one in largest_deviations(found, truth).items()}
        return Off(_largest([by_kind["positioning"], by_kind["straightness"], *tilts]), abs(by_kind["angle"]))

    def rows(self, name: str, method: str, source: str, allowed: tuple[float, float]) -> Iterator[SelfTestRow]:
        yield SelfTestRow(name, f"{method}, lengths", source, self.length, allowed[0], "mm")
        yield SelfTestRow(name, f"{method}, angles", source, self.angle, allowed[1], "rad")


def _in_uncertainties(found: _core.Calibration, truth: _core.ErrorMap) -> float:
    """The largest error of a value, in its standard uncertainties."""
    off = [
        (found.squareness[name][0] - truth.squareness[name]) / found.squareness[name][1] for name in truth.squareness
    ]
    for name in truth.functions:
        position, value, uncertainty = found.functions[name]
        free = uncertainty > 0.0
        off += list((value - truth.function(name, position))[free] / uncertainty[free])
    return _largest(off)


def propagation(known: Path) -> Iterator[SelfTestRow]:
    """A straight line through readings that share one standard deviation."""
    line, deviation = straight_line()
    found = _core.propagate_linear(line @ B, line, np.full(len(B), deviation), covariance=True)
    u, covariance = found.standard_uncertainty, found.covariance
    assert covariance is not None
    values = dict(zip(("y1", "y2", "b(30 °C)"), found.value, strict=True))
    values |= dict(zip(("u(y1)", "u(y2)", "u(b(30 °C))"), u, strict=True))
    yield from _printed(known, "GUM H.3", values | {"r(y1; y2)": covariance[0, 1] / (u[0] * u[1])}, GUM)


def monte_carlo(known: Path) -> Iterator[SelfTestRow]:
    """By the adaptive procedure, to two digits of u and one more where the interval is compared with two decimals."""
    for case, model, coverage, digits in (
        ("JCGM 101 9.2.3", sum_of_four(UNIFORM), 0.95, 3),
        ("JCGM 101 9.5", gauge_block(), 0.99, 2),
    ):
        options = StatisticsOptions(coverage=coverage, digits=digits)
        found = run_monte_carlo(model, samples=10_000_000, adaptive=True, options=options)
        low, high = found.symmetric[0]
        values = {"mean": found.mean[0], "u": found.standard_uncertainty[0]}
        values |= {f"{100 * coverage:.0f} % low": low, f"{100 * coverage:.0f} % high": high}
        yield from _printed(known, case, values, JCGM_101)


def _printed(known: Path, case: str, found: Mapping[str, float], source: str) -> Iterator[SelfTestRow]:
    """What known/statistics.csv has of a case."""
    for row in csv.DictReader((known / "statistics.csv").read_text(encoding="utf-8").splitlines()):
        if row["case"] == case:
            off = abs(float(found[row["quantity"]]) - float(row["value"]))
            yield SelfTestRow(case, row["quantity"], source, off, float(row["allowed"]), row["unit"])


def compensator(known: Path) -> Iterator[SelfTestRow]:
    """The errors that a controller compensates, and the rotations of the tool."""
    numbers = np.loadtxt(known / "compensator.csv", delimiter=",", skiprows=1)
    table = _core.read_error_map(known / "compensator_table.csv")
    found = _core.Compensator(table, table.header["chain"])
    positions, errors, rotations = numbers[:, :3], numbers[:, 3:6], numbers[:, 6:]
    what = f"{len(numbers)} positions"
    yield SelfTestRow(
        "compensator", f"errors, {what}", DIGITS_40, _largest(found.error(positions) - errors), ERROR, "mm"
    )
    off = _largest(found.orientation(positions) - rotations)
    yield SelfTestRow("compensator", f"rotations, {what}", DIGITS_40, off, ROTATION, "rad")


def refusals(known: Path) -> Iterator[SelfTestRow]:
    """A file that is not whole is refused, and the line or key is named."""
    clean = known / "runs" / "clean"
    measurement, truth, scenario = (
        (clean / name).read_text(encoding="utf-8") for name in ("measurement.csv", "truth.csv", "scenario.toml")
    )
    rows, entries = measurement.splitlines(), truth.splitlines()
    cut = rows[20].rsplit(",", 2)[0]
    doubled = rows[20]
    with tempfile.TemporaryDirectory() as folder:
        for what, text, read, named in (
            ("a row that is cut", [*rows[:20], cut, *rows[21:]], _core.read_measurement, "21"),
            ("a row given twice", [*rows[:21], doubled, *rows[21:]], _core.read_measurement, "22"),
            ("an error map with a letter", [*entries[:9], f"{entries[9]}x", *entries[10:]], _core.read_error_map, "10"),
            ("an unknown key", [*scenario.splitlines(), "colour = 1"], read_scenario, "head.colour"),
        ):
            path = Path(folder) / ("file.toml" if read is read_scenario else "file.csv")
            path.write_text("\n".join(text) + "\n", encoding="utf-8")
            yield SelfTestRow("refused files", what, FILES, float(not _is_refused(read, path, named)), 0.0)


def _is_refused(read: Callable[[Path], object], path: Path, named: str) -> bool:
    try:
        read(path)
    except InvalidArgument as error:
        return named in str(error)
    return False


def _largest(values: object) -> float:
    """NaN where there are none, or one is NaN: that passes nothing."""
    sizes = np.abs(np.asarray(values, dtype=float))
    return float(sizes.max()) if sizes.size else float("nan")


CASES: Final[tuple[Callable[[Path], Iterator[SelfTestRow]], ...]] = (
    air,
    glass,
    runs,
    propagation,
    monte_carlo,
    compensator,
    refusals,
    units,
    files,
    exports,
    controllers,
    tables_read_back,
)


def run_selftest(known: Path = KNOWN) -> SelfTest:
    """Run all cases; about two seconds. What raises an exception has failed.

    known: the folder of what is compared with; another one than the package's is for tests."""
    rows: list[SelfTestRow] = []
    for case in CASES:
        try:
            rows += case(known)
        except Exception as error:
            message = f"{type(error).__name__}: {' '.join(str(error).split())}"
            rows.append(
                SelfTestRow(case.__name__.replace("_", " "), "runs to its end", "none", None, 0.0, error=message)
            )
    return SelfTest(this_installation(), rows)
