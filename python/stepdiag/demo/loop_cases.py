"""The machines of the closed loop: their true errors, and the scenarios of their measurement.

The head has three beams in a triangle, one for each axis of an IDS3010. With a noise s of each
distance and a triangle of radius r, the mean distance is known to s/sqrt(3) and the mirror's tilts
to s/(r sqrt(3/2)). Noise of 0.1 µm and 1 µrad gives r = 81.65 mm.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from stepdiag import _core
from stepdiag.io.whole_files import make_folder, write_whole

VOLUME: Final = (800.0, 600.0, 500.0)
STEPS: Final = 50
CHAIN: Final = "[w X' b Y Z t]"
TOOL: Final = (0.0, 0.0, -50.0)
SEED: Final = 0
FINER: Final = 8  # nodes of the truth to a step of the plan, at least
SCREW_PITCH: Final = 10.0  # mm
SCREW_AMPLITUDE: Final = 0.003  # mm

DISTANCE_NOISE: Final = 1e-4  # mm, of each beam
TILT_NOISE: Final = 1e-6  # rad
# Scales of steel. They warm up during the measurement, and have other temperatures when the machine is used.
EXPANSION: Final = 11.5  # µm/(m K)
START: Final = 22.0  # °C
WARMING: Final = 3.0  # K/h
SECONDS: Final = 10.0  # from reading to reading
IN_USE: Final = (26.0, 25.0, 18.5)  # °C, of X, Y, Z
RANGE: Final = (10.0, 35.0)  # °C, that the controller is told

RADIUS: Final = DISTANCE_NOISE / TILT_NOISE / math.sqrt(1.5)


@dataclass(frozen=True)
class LoopCase:
    """A machine and how it is measured. Its name is used for folders and in tables."""

    name: str
    title: str
    screw: bool = False
    noise: bool = False
    warm: bool = False

    @property
    def truth(self) -> str:
        """The file with its errors."""
        return "truth_screw.csv" if self.screw else "truth.csv"


CLEAN: Final = LoopCase("clean", "no noise, mirror and laser out of true")
SCREW: Final = LoopCase("screw", "the same with a screw error of 10 mm pitch and 3 µm", screw=True)
NOISE: Final = LoopCase("noise", "as clean, with noise of 0.1 µm and 1 µrad", noise=True)
WARM: Final = LoopCase(
    "warm", "as clean, with scales that warm up by 3 K/h and are at 26, 25, 18.5 °C in use", warm=True
)
CASES: Final = (CLEAN, SCREW, NOISE, WARM)


def finer(steps: int) -> int:
    """Number of the truth's nodes per step: enough to resolve the screw, also with few steps."""
    return -(-FINER * STEPS // steps)


def write_truth(case: LoopCase, folder: Path, steps: int = STEPS) -> None:
    """Write a machine's errors, with the plan's nodes and at least FINER times as many."""
    screw = {"screw_pitch": SCREW_PITCH, "screw_amplitude": SCREW_AMPLITUDE} if case.screw else {}
    truth = _core.random_error_map(VOLUME, seed=SEED, intervals=steps * finer(steps), **screw)
    truth.write(folder / case.truth, chain=_core.Chain(CHAIN), volume=VOLUME, tool=TOOL)


def runs_of(case: LoopCase) -> tuple[tuple[str, bool], ...]:
    """Folders of the runs, and whether the machine is in use: before, compensated, and without the temperatures."""
    cold = ((f"{case.name}-cold", True),) if case.warm else ()
    return ((case.name, False), (f"{case.name}-again", True), *cold)


def write_scenario(case: LoopCase, folder: Path, steps: int = STEPS, *, in_use: bool = False) -> Path:
    """Write the scenario of a case; `in_use`: of the compensated machine, with other noise and temperatures.

    The truth is in the parent folder."""
    make_folder(folder)
    path = folder / "scenario.toml"
    write_whole(path, scenario_text(case, steps, in_use=in_use))
    return path


def scenario_text(case: LoopCase, steps: int = STEPS, seed: int | None = None, *, in_use: bool = False) -> str:
    """The scenario of a case as text; `seed` is that of its noise."""
    seed = (2 if in_use else 1) if seed is None else seed
    beams = [
        [round(RADIUS * math.cos(angle), 4), round(RADIUS * math.sin(angle), 4)]
        for angle in (math.radians(90), math.radians(210), math.radians(330))
    ]
    noise = ["", "[noise]", f"distance_um = {DISTANCE_NOISE * 1e3:g}", f"seed = {seed}"] if case.noise else []
    return "\n".join(
        [
            f"# The closed loop in a controller: {case.title}",
            "format = 1",
            "",
            "[volume]",
            *(f"{axis}_mm = {edge}" for axis, edge in zip("xyz", VOLUME, strict=True)),
            "",
            "[machine]",
            f'chain = "{CHAIN}"',
            f"tool_mm = {list(TOOL)}",
            f'errors = "../{case.truth}"',
            "",
            "[plan]",
            'lines = ["ppp", "npp", "pnp", "nnp"]',
            f"steps = {steps}",
            'scale_lines = ["p00", "0p0", "00p"]',
            *([f"seconds_per_reading = {SECONDS}"] if case.warm else []),
            "",
            "# Three beams, one for each axis of an IDS3010",
            "[head]",
            'layout = "multi_beam"',
            f"beam_offsets_mm = {beams}",
            "",
            "[misalignment]",
            "reflector_urad = [100.0, 300.0]",
            "laser_urad = [200.0, -150.0]",
            "",
            "# The three axes of the instrument begin to count at the same distance, and nothing else is out of true:",
            "# the uncertainties that are stated are of what is in the readings.",
            "[adjustment]",
            'beam_constants_um = "fixed"',
            'lateral_mm = "fixed"',
            'roll_urad = "fixed"',
            'gain = "fixed"',
            *(f'{line}.laser_urad = "fixed"' for line in ("p00", "0p0", "00p")),
            "",
            "# A virtual machine is at once where it is sent; what is left is the controller's own time.",
            "[plan_by_time]",
            "feed_mm_per_min = 60000000.0",
            "acceleration_mm_per_s2 = 1e9",
            "settle_s = 0.0",
            "measure_s = 0.02",
            "line_change_min = 0.0",
            *noise,
            *(_temperature(in_use=in_use) if case.warm else []),
            "",
        ]
    )


def _temperature(*, in_use: bool) -> list[str]:
    return [
        "",
        "[temperature]",
        f"expansion_um_per_m_k = {EXPANSION}",
        "u_expansion_um_per_m_k = 1.0",
        "u_temperature_c = 0.1",
        f"axes_c = {list(IN_USE) if in_use else START}",
        f"axes_c_per_h = {0.0 if in_use else WARMING}",
    ]
