"""The cases of the demonstration: the paper's virtual machine, simulated, and evaluated by all methods.

They are the panels of the paper's Figure 5, and one more with an error that the steps alias. Every file is one
that the commands read and write, so a user can go on from any of them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from stepdiag import _core
from stepdiag.config.key_errors import show
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
PSD_DISTANCE: Final = 31.501425
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
    Case(
        "1d",
        "laser as in 1c, the mirror follows it",
        (
            *(LASER, LASER.replace("laser", "reflector")),
            # What the conventional evaluation makes of it is beyond what a machine can be, and is shown.
            *("", "[plausible]", "positioning_um_per_m = 2000.0"),
        ),
    ),
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
        calibrations[method] = evaluate_scenario(scenario.known, measurement, method=method)
        calibrations[method].write_csv(here / f"{method}.csv")
    return Result(case, scenario, scenario.machine().errors, measurement, calibrations)


def scenario_of(case: Case) -> str:
    """The scenario file of a case."""
    return "\n".join(
        [
            f"# Case {case.name} of stepdiag's demonstration: {case.title}",
            "format = 1",
            "",
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
