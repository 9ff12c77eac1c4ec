"""The demonstration: the paper's virtual machine, simulated, evaluated by all methods and compared with its truth.

The cases are the panels of the paper's Figure 5, and one more with an error that the steps alias. Every file is one
that the commands read and write, so a user can go on from any of them.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from stepdiag.parameters import KINDS, REPORT_UNIT, Kind, in_report_units, kind_of
from stepdiag.units import MICRO

from stepdiag import _core
from stepdiag.calibration.largest_by_kind import largest_deviations
from stepdiag.config.key_errors import show
from stepdiag.io import outputs
from stepdiag.io.whole_files import make_folder, write_whole
from stepdiag.scenario.description import Scenario, evaluate_scenario, read_scenario, simulate_scenario

VOLUME: Final = (800.0, 600.0, 500.0)
STEPS: Final = 50
CHAIN: Final = "[w X' b Y Z t]"
SEED: Final = 0
SCALE_LINES: Final = ("p00", "0p0", "00p")
METHODS: Final = ("conventional", "enhanced", "adjustment")
POSITIONING: Final = ("EXX", "EYY", "EZZ")

# Nodes of the screw's truth are 8 times finer than the steps, so that the truth has something between the nodes.
FINER: Final = 8
SCREW_PITCH: Final = 10.0  # mm
SCREW_AMPLITUDE: Final = 0.003  # mm

# The traced head of case 3; what its nominal calibration says of the PSD and of the laser beside the interferometer; by
# how much its window of 5 mm N-BK7 (n = 1.5009) is shorter for the angle. In mm.
HEAD: Final = "beam_and_psd"
PSD_DISTANCE: Final = 31.501488
LASER_OFFSET: Final = 25.0
WINDOW_SHORTENS: Final = 5.0 * (1.0 - 1.0 / 1.5009)

REFLECTOR: Final = "reflector_urad = [100.0, 300.0]"
LASER: Final = "laser_urad = [700.0, 1000.0]"
PSD_ZERO: Final = "psd_zero_mm = [1.5, 2.0]"


@dataclass(frozen=True)
class Case:
    """One set-up: its folder, what it shows, and the lines of its scenario that differ."""

    name: str
    title: str
    misalignment: tuple[str, ...] = ()
    head: tuple[str, ...] = ('layout = "ideal"',)
    truth: str = "truth.csv"


CASES: Final = (
    Case("1a", "kinematic errors only"),
    Case("1b", "reflector misaligned by 100, 300 µrad", (REFLECTOR,)),
    Case("1c", "laser misaligned by 700, 1000 µrad", (LASER,)),
    Case("1d", "laser as in 1c, the mirror follows it", (LASER, LASER.replace("laser", "reflector"))),
    Case(
        "3",
        "as 1b and 1c, PSD displaced by 1.5, 2 mm",
        (REFLECTOR, LASER),
        (
            f'description = "{HEAD}"',
            *("", "[head.pose_errors.psd]", "shift_mm = [0.0, -2.0, 1.5]"),
            *("", "[environment]", "temperature_c = 20.0"),
        ),
    ),
    Case(
        "3d",
        "as 3 by the definition of its readings",
        (REFLECTOR, LASER, PSD_ZERO, *(f"{line}.{PSD_ZERO}" for line in SCALE_LINES)),
        ('layout = "psd"', f"psd_distance_mm = {PSD_DISTANCE}"),
    ),
    Case("4", "screw error of 10 mm pitch, kinematic errors", truth="truth_screw.csv"),
)


@dataclass(frozen=True)
class Result:
    """A case's truth and what each method made of its run."""

    case: Case
    scenario: Scenario
    truth: _core.ErrorMap
    measurement: _core.Measurement
    calibrations: Mapping[str, _core.Calibration] = field(default_factory=dict)


def claim_demo(folder: Path) -> Path:
    """The folder, if nothing would be lost in it but what an earlier demonstration wrote. Raises InvalidArgument."""
    scenarios = {f"{case.name}/scenario.toml": scenario_of(case) for case in CASES}
    files: dict[str, outputs.Kind | str] = {
        **scenarios,
        **dict.fromkeys(("truth.csv", "truth_screw.csv"), outputs.ERROR_MAP),
        **{f"{case.name}/run.csv": outputs.MEASUREMENT for case in CASES},
        **{f"{case.name}/{method}.csv": outputs.CALIBRATION for case in CASES for method in METHODS},
        **{"report.txt": outputs.REPORT, "figure.png": outputs.PNG, "figure.svg": outputs.SVG},
    }
    return outputs.claim_folder(folder, files, marks=scenarios)


def run_demo(folder: Path, progress: Callable[[str], None] = lambda text: None) -> list[str]:
    """Writes all files of the demonstration into `folder`, and returns the lines of its report."""
    make_folder(folder)
    write_truths(folder)
    results = []
    for case in CASES:
        progress(f"{case.name:<3}simulate, evaluate: {case.title}")
        results.append(run_case(case, folder))
    report = [*error_table(results), "", *trend_note(results), "", *traced_note(results), "", *screw_note(results[-1])]
    write_whole(folder / "report.txt", "\n".join(report) + "\n")
    progress("   draw the figure")
    from stepdiag.demo.paper_figure import draw_figure

    for name, content in draw_figure(results).items():
        write_whole(folder / name, content)
    return [
        *report,
        "",
        f"All files are in {folder}: figure.png, figure.svg, report.txt, the truths, and for every case",
        "scenario.toml, run.csv, conventional.csv, enhanced.csv and adjustment.csv. To go on, for example:",
        f"  stepdiag evaluate {folder / '1b' / 'scenario.toml'} {folder / '1b' / 'run.csv'} -o calibration.csv",
    ]


def write_truths(folder: Path) -> None:
    truth = _core.random_error_map(VOLUME, seed=SEED, intervals=STEPS)
    truth.write(folder / "truth.csv", chain=_core.Chain(CHAIN), volume=VOLUME, tool=(0.0, 0.0, 0.0))
    screw = _core.random_error_map(
        VOLUME, seed=SEED, intervals=FINER * STEPS, screw_pitch=SCREW_PITCH, screw_amplitude=SCREW_AMPLITUDE
    )
    screw.write(folder / "truth_screw.csv", chain=_core.Chain(CHAIN), volume=VOLUME, tool=(0.0, 0.0, 0.0))


def run_case(case: Case, folder: Path) -> Result:
    """Goes the way of the commands, through the files."""
    here = folder / case.name
    make_folder(here)
    write_whole(here / "scenario.toml", scenario_of(case))
    scenario = read_scenario(here / "scenario.toml")
    simulate_scenario(scenario).write(here / "run.csv")
    measurement = _core.read_measurement(here / "run.csv")
    calibrations = {}
    for method in METHODS:
        calibrations[method] = evaluate_scenario(scenario, measurement, method=method)
        calibrations[method].write(here / f"{method}.csv")
    return Result(case, scenario, scenario.machine().errors, measurement, calibrations)


def scenario_of(case: Case) -> str:
    """The scenario file of a case."""
    return "\n".join(
        [
            f"# Case {case.name} of stepdiag's demonstration: {case.title}",
            "[volume]",
            *(f"{axis}_mm = {edge}" for axis, edge in zip("xyz", VOLUME, strict=True)),
            "",
            "[machine]",
            f'chain = "{CHAIN}"',
            f'errors = "../{case.truth}"',
            "",
            "[plan]",
            'lines = ["ppp", "npp", "pnp", "nnp"]',
            f"steps = {STEPS}",
            f"scale_lines = {show(SCALE_LINES)}",
            "",
            "[head]",
            *case.head,
            *(["", "[misalignment]", *case.misalignment] if case.misalignment else []),
            "",
        ]
    )


def error_table(results: list[Result]) -> Iterator[str]:
    """Largest differences to the truth at the nodes, by case and method."""
    yield "Largest remaining errors at the nodes (calibration - truth)"
    yield f"{'':<52}" + "".join(f"{kind:>14}" for kind in KINDS)
    yield f"{'':<52}" + "".join(f"{REPORT_UNIT[kind]:>14}" for kind in KINDS)
    for result in results:
        yield f"{result.case.name:<3}{result.case.title}"
        for method, calibration in result.calibrations.items():
            largest = largest_deviations(calibration, result.truth)
            cells = [
                f"{abs(in_report_units(kind, largest[kind].value)):14.3g}" if kind in largest else f"{'-':>14}"
                for kind in KINDS
            ]
            yield f"   {method:<49}" + "".join(cells)


def conventional_trend(result: Result, reference: Result) -> float:
    """How far a set-up moves the conventional positioning errors from those of the reference case, mm."""
    mine, base = (r.calibrations["conventional"].functions for r in (result, reference))
    return max(float(np.max(np.abs(mine[name][1] - base[name][1]))) for name in POSITIONING)


def trend_note(results: list[Result]) -> list[str]:
    """Which of 1c and 1d shows the trend that the paper's Figure 5 shows, by the numbers."""
    by_name = {result.case.name: result for result in results}
    alone, following = (conventional_trend(by_name[name], by_name["1a"]) * 1e3 for name in ("1c", "1d"))
    second_order = 0.5 * (700e-6**2 + 1000e-6**2) * math.dist(VOLUME, (0, 0, 0)) * 1e3
    if following < 10.0 * alone:
        return [f"Conventional positioning errors moved against 1a: 1c by {alone:.3g} µm, 1d by {following:.3g} µm."]
    return [
        "The paper's visible trend of a misaligned laser is that of 1d, where the mirror follows the laser (as when",
        f"it is set by autocollimation): it moves the conventional positioning errors by {following:.3g} µm.",
        f"A laser turned alone (1c) changes lengths at second order only, by about {second_order:.2g} µm over a",
        f"diagonal, and moves the conventional positioning errors by {alone:.2g} µm.",
    ]


def traced_differences(traced: Result, defined: Result) -> dict[str, tuple[float, float]]:
    """By how much the readings of case 3 differ from those of 3d, and what of it second order does not explain, mm.

    The laser starts at (u, 0) beside the interferometer, so its way to the mirror is L - u beta: the spot moves by
    2 u beta (beta, -alpha). The window's glass shortens L for the angle, so the distance loses that times tan^2 phi."""
    mine, theirs = traced.measurement.channels, defined.measurement.channels
    zero = defined.scenario.keys.misalignment.psd_zero_mm
    arm = 2.0 * (theirs["distance"] + PSD_DISTANCE)
    alpha, beta = (theirs["spot_y"] - zero[1]) / arm, -(theirs["spot_x"] - zero[0]) / arm
    expected = {
        "distance": -WINDOW_SHORTENS * (alpha**2 + beta**2),
        "spot_x": 2.0 * LASER_OFFSET * beta**2,
        "spot_y": -2.0 * LASER_OFFSET * alpha * beta,
    }
    found = {name: mine[name] - theirs[name] for name in expected}
    return {
        name: (float(np.max(np.abs(found[name]))), float(np.max(np.abs(found[name] - expected[name]))))
        for name in expected
    }


def traced_note(results: list[Result]) -> list[str]:
    """Case 3 has a sensor out of its place in a traced head, 3d a number that is added to its readings."""
    by_name = {result.case.name: result for result in results}
    traced, defined = by_name["3"], by_name["3d"]
    nanometres = {name: (a * 1e6, b * 1e6) for name, (a, b) in traced_differences(traced, defined).items()}
    distance, spot = nanometres["distance"][0], max(nanometres["spot_x"][0], nanometres["spot_y"][0])
    rest = max(left for _, left in nanometres.values())
    one, other = (result.calibrations["enhanced"].functions for result in (traced, defined))
    length, angle = (
        max(float(np.max(np.abs(one[name][1] - other[name][1]))) for name in one if kind_of(name) == kind)
        for kind in ("positioning", "angle")
    )
    return [
        f"Case 3 is traced through the head {HEAD} with its PSD out of place; 3d follows the definition of the",
        f"readings. They agree to first order. The readings differ by up to {distance:.2g} nm in distance, where the",
        f"window is shorter for the angle, and {spot:.2g} nm in the spot: the laser is {LASER_OFFSET:g} mm beside the",
        f"interferometer. Beyond these second-order terms {rest:.1g} nm are left. The enhanced evaluations differ by",
        f"{length * 1e3:.2g} µm in positioning and {angle * MICRO:.2g} µrad: that of case 3 allows for the laser's",
        "place by tilts which the displaced PSD makes wrong.",
        f"The adjustment has the PSD's zero among its unknowns: of case 3 it leaves {_left(traced, 'positioning')} in "
        "positioning",
        f"and {_left(traced, 'angle')}.",
    ]


def _left(result: Result, kind: Kind) -> str:
    """What the adjustment leaves of a case's truth."""
    value = largest_deviations(result.calibrations["adjustment"], result.truth)[kind].value
    return f"{abs(in_report_units(kind, value)):.1g} {REPORT_UNIT[kind]}"


def between_nodes(result: Result, name: str) -> tuple[float, float]:
    """Largest differences to the truth at the nodes of the calibration and at those of the finer truth, mm."""
    calibration = result.calibrations["enhanced"].to_error_map()
    coarse, _ = calibration.functions[name]
    fine, _ = result.truth.functions[name]
    at, between = (
        float(np.max(np.abs(calibration.function(name, p) - result.truth.function(name, p)))) for p in (coarse, fine)
    )
    return at, between


def screw_note(result: Result) -> Iterator[str]:
    """Errors at nodes and between them, apart: what the steps do not sample, no evaluation can find."""
    yield f"Case 4: a screw error of {SCREW_PITCH:g} mm pitch and {SCREW_AMPLITUDE * 1e3:g} µm amplitude, enhanced:"
    yield f"{'':<6}{'step':>10}{'seen as':>22}{'at nodes':>14}{'between nodes':>16}"
    for name, edge in zip(POSITIONING, VOLUME, strict=True):
        at, between = between_nodes(result, name)
        step = edge / STEPS
        yield (f"{name:<6}{step:7.3g} mm{alias_of(step):>22}{at * 1e3:11.3g} µm{between * 1e3:13.3g} µm")
    yield "The plan samples the screw once per step: at the nodes the calibration is right, between them it cannot be."


def alias_of(step: float) -> str:
    """What a screw error looks like when it is sampled once per step."""
    cycles = step / SCREW_PITCH
    folded = abs(cycles - round(cycles))
    return "nothing" if folded < 1e-9 else f"a period of {step / folded:.3g} mm"
