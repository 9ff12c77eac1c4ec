"""Risks and power of the verdicts on a machine against a limit: of `volume --limit`, and of the rule before it.

    ./run python benchmarks/volume_verdicts.py [--runs 10000] [--power-runs 2000] [--samples 1000] [--only WORDS]

A run draws the values of a calibration about a true machine from the joint normal distribution that it states, and
takes the bounds of `volume_errors`. The limit is the true largest error itself, so that "within" and "not within" are
both wrong: their shares are the risks where they are largest, just beyond and just below the limit. For power, the true
largest error is 0.8 and 1.25 of the limit. Its standard uncertainty is 3 % of the limit, as that of a plan: the root of
the variances along X, Y and Z together. ("u across": 3 % along itself, and 16 % in each direction across.)

Cases: machines as they are drawn, with the covariances of their evaluations, times 1, 9 and 100; three equal scale
errors, with nodes that are equally uncertain and with the covariance of an evaluation; a place that is uncertain along
a line askew to its error; a machine with eight equal corners; one with ten equal places; one whose largest error is at
a place that is less certain than another; noise that is as large as the errors; what lies between the nodes, as one
shift of the functional point and as a curve of every function in every interval.

The former rule was value - b -/+ 1.645 sqrt(max(s, u)^2 + (b/2)^2 + u_n^2), b and s: bias and scatter of the draws.

The exit code is 1 if a risk of the rule is above 5 % by more than two binomial standard deviations, or if it gives
fewer right verdicts than the former rule by more than 3 %.
"""

from __future__ import annotations

import argparse
import functools
import math
import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import coverage_cases
import numpy as np
import one_thread  # noqa: F401 (for what its import does)

import stepdiag as sd
from stepdiag import _core
from stepdiag.calibration.volume import ONE_SIDED, VolumeErrors
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

ADJUSTMENT = coverage_cases.CASES["adjustment"]
CHAIN = "[w X' b Y Z t]"
EDGE = 500.0  # mm, of the machines that are not drawn
RISK = 0.05
LOST = 0.03  # of the right verdicts
POWER_U = 0.03  # of the limit
OUTSIDE = "three equal scale errors, u across"  # of what is promised; shown
MACHINES = 100  # that are drawn, each for as many runs
STEPS = 5  # of theirs


@dataclass(frozen=True)
class Truth:
    """The true machine, the covariance of its calibration, and what lies between the nodes; mm."""

    chain: str
    volume: np.ndarray
    tool: np.ndarray
    functions: dict[str, tuple[np.ndarray, np.ndarray]]
    squareness: dict[str, float]
    covariance: np.ndarray
    box: np.ndarray
    between: float = 0.0  # the standard uncertainty that is stated
    curves: bool = False  # a curve in every interval; else one shift at the largest error

    @functools.cached_property
    def values(self) -> np.ndarray:
        of_functions = [self.functions[name][1] for name in FUNCTIONS]
        return np.concatenate([*of_functions, [self.squareness[name] for name in SQUARENESSES]])

    @functools.cached_property
    def root(self) -> np.ndarray:
        scale = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))  # angles beside lengths
        values, vectors = np.linalg.eigh(self.covariance / np.outer(scale, scale))
        return scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))

    def calibration(self, values: np.ndarray, covariance: np.ndarray) -> sd.Calibration:
        u, at, functions = np.sqrt(np.diag(covariance)), 0, {}
        for name in FUNCTIONS:
            position = self.functions[name][0]
            part = slice(at, at + len(position))
            functions[name] = (position, values[part], u[part])
            at += len(position)
        angles = {name: (values[at + k], u[at + k]) for k, name in enumerate(SQUARENESSES)}
        return sd.Calibration(
            method="adjustment",
            chain=self.chain,
            volume=self.volume,
            tool=self.tool,
            functions=functions,
            squareness=angles,
            covariance=covariance,
        )

    @functools.cached_property
    def summary(self) -> tuple[float, np.ndarray, float, float]:
        """The true largest error at the nodes, its components, and its standard uncertainty along itself, and along X,
        Y and Z together."""
        own = self.calibration(self.values, self.covariance)
        found = sd.volume(own, box=self.box, between_nodes=0.0, ranking=False, samples=1000)
        assert found.largest_chosen is not None
        chosen = found.largest_chosen
        return found.largest, found.largest_components, float(chosen.u[0]), math.sqrt(float(chosen.variance[0]))

    def largest_with_curves(self, rng: np.random.Generator) -> float:
        """The true largest error with a parabola in every interval of every function of translation, whose standard
        deviation over all of them makes `between` in any direction: three functions, one of each axis."""
        peak = self.between / math.sqrt(3.0 * 8.0 / 15.0)  # the mean square of 4 t (1 - t) is 8/15
        share = np.linspace(0.0, 1.0, 5)[:-1]
        functions = {}
        for name, (position, value) in self.functions.items():
            fine = np.append((position[:-1, None] + np.diff(position)[:, None] * share).ravel(), position[-1])
            curve = np.interp(fine, position, value)
            if name[1] in "XYZ":
                heights = peak * rng.normal(size=(len(position) - 1, 1))
                curve[:-1] += (heights * 4.0 * share * (1.0 - share)).ravel()
            functions[name] = (fine, curve)
        machine = sd.Machine(self.chain, sd.ErrorMap(functions, self.squareness), self.tool)
        return float(sd.volume(machine, box=self.box, ranking=False).largest)


def drawn_machine(seed: int, level: float) -> Truth:
    """A machine of benchmarks/coverage.py with the covariance of its evaluation, times level^2."""
    drawn, rng = coverage_cases.draw(ADJUSTMENT, seed, STEPS)
    calibration = coverage_cases.evaluated(ADJUSTMENT, drawn, coverage_cases.measured(drawn, rng))
    errors = drawn.machine.errors
    functions = {name: (table[0], errors.function(name, table[0])) for name, table in calibration.functions.items()}
    return Truth(
        drawn.chain,
        calibration.volume,
        np.asarray(drawn.machine.tool),
        functions,
        {name: errors.squareness[name] for name in SQUARENESSES},
        level**2 * calibration.covariance,
        np.stack([np.zeros(3), calibration.volume]),
    )


def with_u(
    truth: Truth, relative_u: float | None, between: float = 0.0, curves: bool = False, of_all: bool = False
) -> Truth:
    """The same with another covariance, so that u is this share of the largest error; between: in u. of_all: u is that
    along X, Y and Z together, else along the largest error."""
    largest, _, u, together = truth.summary
    u = together if of_all else u
    factor = 1.0 if relative_u is None else relative_u * largest / u
    parts = {name: getattr(truth, name) for name in ("chain", "volume", "tool", "functions", "squareness", "box")}
    return Truth(**parts, covariance=factor**2 * truth.covariance, between=between * factor * u, curves=curves)


def made(
    own: dict[str, np.ndarray],
    u: dict[str, np.ndarray],
    box: np.ndarray | None = None,
    covariance: np.ndarray | None = None,
) -> Truth:
    """A machine with these functions at equidistant nodes, others 0; standard uncertainties relative to each other, of
    nodes that are independent, unless a covariance is given."""
    count = len(next(iter(own.values())))
    nothing = {axis: np.zeros(count if f"E{axis}{axis}" in own else 2) for axis in "XYZ"}
    values = {name: own.get(name, nothing[name[2]]) for name in FUNCTIONS}
    functions = {name: (np.linspace(0.0, EDGE, len(value)), value) for name, value in values.items()}
    if covariance is None:
        uncertain = [u.get(name, nothing[name[2]]) for name in FUNCTIONS]
        covariance = np.diag(np.concatenate([*uncertain, np.zeros(3)]) ** 2)
    volume = np.full(3, EDGE)
    whole = np.stack([np.zeros(3), volume])
    angles = dict.fromkeys(SQUARENESSES, 0.0)
    return Truth(CHAIN, volume, np.zeros(3), functions, angles, covariance, whole if box is None else box)


def equal_scales() -> Truth:
    """10 um at the end of each axis, whose nodes are equally uncertain."""
    share = np.linspace(0.0, 1.0, 5)
    own = dict.fromkeys(("EXX", "EYY", "EZZ"), 0.01 * share)
    return made(own, dict.fromkeys(own, np.sign(share)))


def equal_scales_evaluated() -> Truth:
    """The same, with the covariance of an evaluation: the error is much less certain across itself than along."""
    plan = sd.Plan(np.full(3, EDGE), coverage_cases.DIAGONALS, 5, scale_lines=coverage_cases.SCALE_LINES)
    nodes = np.linspace(0.0, EDGE, 6)
    errors = sd.ErrorMap(dict.fromkeys(("EXX", "EYY", "EZZ"), (nodes, 0.01 * nodes / EDGE)), {})
    run = sd.simulate(sd.Machine(CHAIN, errors, np.zeros(3)), plan, sd.Head(), noise=sd.Noise(distance=1e-4, tilt=1e-6))
    options = {"uncertainty": sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6), "full_covariance": True}
    calibration = sd.methods.adjust(run, plan, sd.Head(), sd.Chain(CHAIN), np.zeros(3), **options).calibration
    own = {name: errors.function(name, nodes) for name in ("EXX", "EYY", "EZZ")}
    return made(own, {}, covariance=calibration.covariance)


def equal_corners() -> Truth:
    """+- 10 um at both ends of each axis; every function of translation is uncertain there."""
    nodes = np.array([0.0, -1.0, -0.5, 0.5, 1.0])  # 0 at home; the box begins at the second
    own = dict.fromkeys(("EXX", "EYY", "EZZ"), 0.01 * nodes)
    u = {name: np.array([0.0, 1.0, 1.0, 1.0, 1.0]) for name in FUNCTIONS if name[1] in "XYZ"}
    return made(own, u, np.stack([np.full(3, EDGE / 4), np.full(3, EDGE)]))


def equal_places() -> Truth:
    """10 um at ten positions of X, and everywhere between them."""
    value = np.append(0.0, np.full(10, 1e-2))
    return made({"EXX": value}, {name: np.append(0.0, np.ones(10)) for name in ("EXX", "EYX", "EZX")})


def less_certain_place() -> Truth:
    """10 um at the end of X; 9 um in its middle, ten times as certain."""
    return made({"EXX": np.array([0.0, 0.0, 9e-3, 0.0, 1e-2])}, {"EXX": np.array([0.0, 0.1, 0.1, 0.1, 1.0])})


def uncertain_askew() -> Truth:
    """10 um along X at the end of X, which is uncertain along a line askew to it, cosine 0.36, and hardly across."""
    count = 2
    truth = made({"EXX": np.array([0.0, 1e-2])}, {})
    along, covariance = np.array([0.36, math.sqrt(1.0 - 0.36**2), 0.0]), truth.covariance.copy()
    ends = [count * FUNCTIONS.index(name) + 1 for name in ("EXX", "EYX", "EZX")]
    covariance[np.ix_(ends, ends)] = np.outer(along, along) + 0.01 * np.eye(3)
    return replace(truth, covariance=covariance)


Maker = Callable[[int], Truth]  # by the number of the machine


def one(truth: Callable[[], Truth], relative_u: float, **options: Any) -> Maker:
    return lambda _: with_u(truth(), relative_u, **options)


def many(level: float = 1.0, relative_u: float | None = None, **options: Any) -> Maker:
    return lambda seed: with_u(drawn_machine(seed, level), relative_u, **options)


RISKS: dict[str, Maker] = {
    "drawn machines, noise x 1": many(1.0),
    "drawn machines, noise x 3": many(3.0),
    "drawn machines, noise x 10": many(10.0),
    "three equal scale errors, u 3 %": one(equal_scales, 0.03),
    "three equal scale errors, u 10 %": one(equal_scales, 0.1),
    "three equal scale errors, evaluated": one(equal_scales_evaluated, 0.03),
    "uncertain askew, u 4 %": one(uncertain_askew, 0.036),
    "eight equal corners, u 3 %": one(equal_corners, 0.03),
    "eight equal corners, u 10 %": one(equal_corners, 0.1),
    "ten equal places, u 3 %": one(equal_places, 0.03),
    "ten equal places, u 10 %": one(equal_places, 0.1),
    "less certain place, u 10 %": one(less_certain_place, 0.1),
    "noise dominates, u 30 %": many(relative_u=0.3),
    "noise dominates, u 100 %": many(relative_u=1.0),
    "eight equal corners, u 100 %": one(equal_corners, 1.0),
    "between nodes, shift of u": many(relative_u=0.02, between=1.0),
    "between nodes, shift of 3 u": many(relative_u=0.01, between=3.0),
    "between nodes, curves of u": many(relative_u=0.02, between=1.0, curves=True),
    "between nodes, curves of 3 u": many(relative_u=0.01, between=3.0, curves=True),
    "between nodes, equal places, u": one(equal_places, 0.02, between=1.0, curves=True),
    "between nodes, equal places, 3 u": one(equal_places, 0.01, between=3.0, curves=True),
}
POWERS: dict[str, Callable[[float], Maker]] = {
    "drawn machines": lambda u: many(relative_u=u, of_all=True),
    "three equal scale errors": lambda u: one(equal_scales, u, of_all=True),
    "three equal scale errors, evaluated": lambda u: one(equal_scales_evaluated, u, of_all=True),
    "eight equal corners": lambda u: one(equal_corners, u, of_all=True),
    "ten equal places": lambda u: one(equal_places, u, of_all=True),
    "less certain place": lambda u: one(less_certain_place, u, of_all=True),
    "between nodes, shift of 3 u": lambda u: many(relative_u=u / math.sqrt(10.0), of_all=True, between=3.0),
    OUTSIDE: lambda u: one(equal_scales_evaluated, u),
}


def former_bounds(
    found: VolumeErrors, calibration: sd.Calibration, samples: int, seed: int, between: float
) -> tuple[float, float]:
    draws = _core.VolumeDraws(calibration, *found.grid, tool=found.tool, seed=seed)
    drawn, value = draws.draw(0, samples)[:, 0], draws.values[0]
    assert found.largest_chosen is not None
    bias = float(drawn.mean()) - value
    u = math.hypot(max(float(drawn.std(ddof=1)), float(found.largest_chosen.u[0])), 0.5 * bias, between)
    return found.largest - bias - ONE_SIDED * u, found.largest - bias + ONE_SIDED * u


def of_run(truth: Truth, seed: int, samples: int) -> list[float]:
    """Bounds, interval, and bounds by the former rule, all divided by the true largest error; u of that."""
    rng = np.random.default_rng([7, seed])
    values = truth.values + truth.root @ rng.normal(size=len(truth.values))
    calibration = truth.calibration(values, truth.covariance)
    found = sd.volume(
        calibration, box=truth.box, between_nodes=truth.between, ranking=False, samples=samples, seed=seed
    )
    largest, components, u, _ = truth.summary
    if truth.curves:
        largest = truth.largest_with_curves(rng)
    else:
        largest = float(np.linalg.norm(components + truth.between * rng.normal(size=3)))
    assert found.bounds is not None
    assert found.largest_interval is not None
    former = former_bounds(found, calibration, samples, seed, truth.between)
    return [end / largest for end in (*found.bounds, *found.largest_interval, *former, math.hypot(u, truth.between))]


def of_machine(case: tuple[str, float], samples: int, runs: range) -> list[list[float]]:
    name, power_u = case
    make = POWERS[name](power_u) if power_u else RISKS[name]
    truth = make(runs.start // len(runs))
    return [of_run(truth, run, samples) for run in runs]


def runs_of(pool: multiprocessing.pool.Pool, case: tuple[str, float], runs: int, samples: int) -> np.ndarray:
    each = max(runs // MACHINES, 1)
    chunks = [range(i, i + each) for i in range(0, runs, each)]
    return np.concatenate([np.array(part) for part in pool.imap(functools.partial(of_machine, case, samples), chunks)])


def risks(pool: multiprocessing.pool.Pool, chosen: list[str], runs: int, samples: int) -> bool:
    deviation = math.sqrt(RISK * (1.0 - RISK) / runs)
    allowed, holds = RISK + 2.0 * deviation, True
    print(f"wrong verdicts, {runs} runs a case, {samples} draws; allowed: {100 * allowed:.2f} %")
    print(f"  {'':36}{'wrong within':>18}{'wrong not within':>20}{'interval':>10}")
    print(f"  {'':30}{'u':>6}{'before':>9}{'now':>9}{'before':>11}{'now':>9}{'covers':>10}{'no verdict':>12}")
    for name in chosen:
        start = time.monotonic()
        low, high, least, most, low_before, high_before, u = runs_of(pool, (name, 0.0), runs, samples).T
        within, beyond = np.mean(high <= 1.0), np.mean(low > 1.0)
        good = max(within, beyond) <= allowed
        holds &= bool(good)
        shares = [np.mean(high_before <= 1.0), within, np.mean(low_before > 1.0), beyond]
        shares += [np.mean((least <= 1.0) & (most >= 1.0)), np.mean((low <= 1.0) & (high > 1.0))]
        cells = "".join(f"{100 * share:{n}.2f} %" for share, n in zip(shares, (7, 7, 9, 7, 8, 10), strict=True))
        mark = "" if good else "  ABOVE"
        print(f"  {name:36}{100 * np.median(u):4.0f} %{cells}{mark}   ({time.monotonic() - start:.0f} s)", flush=True)
    return holds


def power(pool: multiprocessing.pool.Pool, chosen: list[str], runs: int, samples: int) -> bool:
    holds = True
    print(f"\nright verdicts where u is {100 * POWER_U:.0f} % of the limit, {runs} runs a case")
    print(f"  {'':36}{'0.8 of the limit':>18}{'1.25 of the limit':>20}")
    print(f"  {'':36}{'before':>9}{'now':>9}{'before':>11}{'now':>9}")
    for name in chosen:
        cells = ""
        for share in (0.8, 1.25):
            found = runs_of(pool, (name, POWER_U / share), runs, samples).T
            if share < 1.0:
                now, before = np.mean(found[1] <= 1.0 / share), np.mean(found[5] <= 1.0 / share)
            else:
                now, before = np.mean(found[0] > 1.0 / share), np.mean(found[4] > 1.0 / share)
            holds &= bool(now >= before - LOST) or name == OUTSIDE
            cells += f"{100 * before:{7 if share < 1.0 else 9}.2f} %{100 * now:7.2f} %"
        print(f"  {name:36}{cells}", flush=True)
    return holds


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--power-runs", type=int, default=2000)
    parser.add_argument("--samples", type=int, default=1000, help="draws of a covariance")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--only", default="", help="cases that have these words in their names")
    given = parser.parse_args()
    with multiprocessing.get_context("fork").Pool(given.workers) as pool:
        good = [
            risks(pool, [name for name in RISKS if given.only in name], given.runs, given.samples),
            power(pool, [name for name in POWERS if given.only in name], given.power_runs, given.samples),
        ]
    print("\nas expected" if all(good) else "\nnot as expected")
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
