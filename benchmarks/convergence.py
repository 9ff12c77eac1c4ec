"""Convergence of the adjustment from zero: random sound runs, each evaluated once, against the known truth.

    ./run python benchmarks/convergence.py [--runs 1000] [--first 0] [--case NAME]... [--workers N]

A run is drawn from its number alone: volume, chain, machine, noise, 1 to 10 repeats. Mirror and laser stand at angles
uniform within ±5 mrad; all else of a set-up comes from the default priors of the adjustment. In the cases "prior" the
laser's angles come from its prior of 2 mrad, which is what the adjustment takes them for where beams have constants. A
run is refused where no solution is found. It is at a wrong place where the square sum is `SQUARES` standard deviations
of chi-square above its expectation, or a value is `FAR` standard uncertainties from the truth. The exit code is 1 if
any run is either.
"""

from __future__ import annotations

import argparse
import functools
import multiprocessing
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import numpy as np
import one_thread  # noqa: F401 (for what its import does)
from usual import ALL_CHAINS, DIAGONALS, FACES, ORDERS, SCALE_LINES

import stepdiag as sd

STEPS = 10
SQUARES = 6.0  # 1e-9 of sound runs, and what normal approximation leaves
FAR = 10.0
ANGLE = 5e-3
RING = 50.0  # mm, of the beams: a circle of 100 mm


@dataclass(frozen=True)
class Case:
    layout: str
    laser: float = 0.0  # standard deviation; 0: uniform, as the mirror
    faces: bool = False
    reflector: tuple[float, float] | None = None  # this, with the laser aligned


CASES = {
    "ideal": Case("ideal"),
    "ideal, faces": Case("ideal", faces=True),
    "psd": Case("psd"),
    "psd, faces": Case("psd", faces=True),
    "multi_beam": Case("multi_beam"),
    "multi_beam, prior": Case("multi_beam", laser=2e-3),
    "multi_beam, prior, faces": Case("multi_beam", laser=2e-3, faces=True),
    "multi_beam, 100 urad": Case("multi_beam", reflector=(100e-6, -100e-6)),
}


@dataclass(frozen=True)
class Outcome:
    refused: bool = False
    excess: float = 0.0  # of the square sum, in standard deviations of chi-square
    far: float = 0.0  # largest deviation of a value, in its standard uncertainty
    steps: int = 0
    fit: str = ""

    @property
    def wrong(self) -> bool:
        return self.excess > SQUARES or self.far > FAR


def set_up(case: Case, rng: np.random.Generator, single: bool) -> sd.Misalignment:
    """Scale lines are aligned."""
    psd, beams = case.layout == "psd", case.layout == "multi_beam"
    common = {
        "distance_constant": rng.normal(),
        "lateral": rng.normal(size=2),
        "beam_constants": list(0.05 * rng.normal(size=3)) if beams else [],
        "psd_zero": 1.0 * rng.normal(size=2) if psd else (0.0, 0.0),
    }
    if single:
        return sd.Misalignment(**common)
    if case.reflector:
        return sd.Misalignment(case.reflector, **(common | {"lateral": (0.0, 0.0)}))
    laser = case.laser * rng.normal(size=2) if case.laser else rng.uniform(-ANGLE, ANGLE, 2)
    return sd.Misalignment(
        rng.uniform(-ANGLE, ANGLE, 2), laser, **common, roll=20e-3 * rng.normal(), gain=0.01 * rng.normal()
    )


def outcome(case: Case, number: int) -> Outcome:
    rng = np.random.default_rng([14, number])
    volume = rng.uniform(250.0, 1000.0, 3)
    errors = sd.random_error_map(volume, seed=number, intervals=STEPS)
    chain = str(rng.choice(ALL_CHAINS))
    tool = rng.uniform(-100.0, 100.0, 3)
    turn = rng.uniform(0.0, 2.0 * np.pi) + np.arange(3) * 2.0 * np.pi / 3.0
    head = sd.Head(
        case.layout,
        standoff=rng.uniform(50.0, 250.0),
        psd_distance=rng.uniform(20.0, 80.0) if case.layout == "psd" else 0.0,
        beam_offsets=RING * np.column_stack([np.cos(turn), np.sin(turn)]) if case.layout == "multi_beam" else [],
        mirror=(1e4, 1e4),
        aperture=1e3,
    )
    lines = DIAGONALS + (FACES[::2] if case.faces else [])
    plan = sd.Plan(volume, lines, STEPS, order=str(rng.choice(ORDERS)), scale_lines=SCALE_LINES)
    repeats = int(rng.integers(1, 11))
    misalignment = {line: set_up(case, rng, line in SCALE_LINES) for line in [*lines, *SCALE_LINES]}
    run = sd.simulate(sd.Machine(chain, errors, tool), plan, head, misalignment=misalignment, repeats=repeats)
    u = sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6, spot=1e-3)
    noise = {"d": u.distance, "a": u.tilt, "b": u.tilt, "s": u.spot}
    channels = {name: v + noise[name[0]] * rng.normal(size=len(run)) for name, v in run.channels.items()}
    noisy = sd.Measurement(run.line, run.point, run.position, channels, run=run.run)
    try:
        found = sd.methods.adjust(noisy, plan, head, chain, tool, uncertainty=u, outlier_probability=0.0)
    except sd.InvalidArgument:
        return Outcome(refused=True)
    freedom = found.degrees_of_freedom
    # What the laser's angles, uniform within ±ANGLE, put into their priors' part of the square sum.
    priors = sum(
        max(0.0, (e.value / e.prior) ** 2 - 1.0)
        for e in found.setup
        if e.quantity == "laser" and e.value is not None and 0.0 < e.prior < np.inf
    )
    if case.laser or case.layout != "multi_beam":
        priors = 0.0
    excess = (found.weighted_square_sum - priors - freedom) / np.sqrt(2.0 * freedom)
    return Outcome(False, excess, largest_deviation(found.calibration, errors), found.iterations, found.verdict.fit)


def largest_deviation(calibration: sd.Calibration, truth: sd.ErrorMap) -> float:
    largest = 0.0
    for name, (position, value, u) in calibration.functions.items():
        if name in calibration.undetermined_slopes:
            continue
        deviation = np.abs(value - truth.function(name, position))[u > 0.0] / u[u > 0.0]
        largest = max(largest, float(deviation.max()))
    for name, (angle, u) in calibration.squareness.items():
        largest = max(largest, abs(angle - truth.squareness[name]) / u)
    return largest


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--case", action="append", choices=list(CASES), help="one of them; may be given again")
    given = parser.parse_args()
    numbers = range(given.first, given.first + given.runs)
    print(f"{'case':28}{'runs':>6}{'refused':>9}{'wrong':>7}{'accepted':>10}{'steps':>7}{'most':>6}{'far':>7}{'s':>6}")
    all_sound = True
    with multiprocessing.get_context("fork").Pool(given.workers) as pool:
        for name in given.case or CASES:
            start = time.monotonic()
            found = pool.map(functools.partial(outcome, CASES[name]), numbers, chunksize=4)
            refused = [n for n, o in zip(numbers, found, strict=True) if o.refused]
            wrong = [n for n, o in zip(numbers, found, strict=True) if o.wrong]
            steps = [o.steps for o in found if not o.refused] or [0]
            print(
                f"{name:28}{len(found):6}{len(refused):9}{len(wrong):7}{sum(o.fit == 'accepted' for o in found):10}"
                f"{np.median(steps):7.0f}{max(steps):6}{max(o.far for o in found):7.1f}{time.monotonic() - start:6.0f}"
            )
            for what, which in (("refused", refused), ("wrong", wrong)):
                if which:
                    print(f"    {what}: {', '.join(map(str, which[:20]))}{', ...' if len(which) > 20 else ''}")
            all_sound = all_sound and not refused and not wrong
    return 0 if all_sound else 1


if __name__ == "__main__":
    sys.exit(main())
