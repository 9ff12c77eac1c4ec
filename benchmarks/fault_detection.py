"""Faults in runs: are they found, named by the right class, and never in an accepted result with a small uncertainty?

    ./run python benchmarks/fault_detection.py [--runs 10000] [--part detection|coverage|reported]... [--workers N]

Every run is simulated with known truth: README's volume, a random machine, set-ups from their priors. Three parts:
detection (against the noncentral chi-square distribution, and false alarms), coverage of the 95 % intervals of accepted
results, and mistakes that users made. The tables are Markdown; the exit code is 1 if a figure is not as it must be.
`--runs` is the number of sound runs in all; the other parts take proportionally many. Binomial scatter is allowed for:
three standard deviations of the number of runs, whose own values are correlated.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import math
import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import numpy as np
import one_thread  # noqa: F401 (for what its import does)
from scipy.stats import chi2, norm
from usual import CHAIN, DIAGONALS, FACES, SCALE_LINES, VOLUME

import stepdiag as sd
from stepdiag.parameters import KINDS, kind_of

UM, URAD = 1e-3, 1e-6
NOISE = {"distance": 0.1 * UM, "tilt": URAD, "spot": UM}
SECONDS_PER_READING = 10.0
BEAMS = [(50.0 * np.cos(a), 50.0 * np.sin(a)) for a in np.radians([90.0, 210.0, 330.0])]
HEADS = {
    "ideal": sd.Head("ideal"),
    "psd": sd.Head("psd", psd_distance=100.0),
    "multi_beam": sd.Head("multi_beam", beam_offsets=BEAMS),
}
# Lines, and how often each is measured.
PLANS = {"standard": (DIAGONALS, 1), "three faces": (DIAGONALS + FACES[::2], 1), "twice": (DIAGONALS, 2)}
THRESHOLD = 28.0  # of a fault's gain in chi-square
CERTAIN = 7.6  # root of lambda from which on 99 % are found where the noise is known
LEVELS = (3.0, 4.5, THRESHOLD**0.5, 6.0, CERTAIN, 10.0)
FITS = ("accepted", "doubtful", "rejected", "unchecked", "error")
Tasks = Callable[[Callable[[int], Any], int], Iterable[Any]]  # results of a function for 0, 1, ...


@dataclass(frozen=True)
class Setting:
    """A plan, a head, and how set-ups are drawn (standard deviations, rad)."""

    lines: Sequence[str] = tuple(DIAGONALS)
    repeats: int = 1
    head: str = "ideal"
    steps: int = 10
    scale_points: str = "ends"
    face: float = 1e-3  # laser and mirror of face diagonals
    scale_laser: float = 500 * URAD  # at most
    square_to_axis: bool = False  # the mirrors of scale lines; otherwise to the beam
    small: float | None = None  # lasers, with a mirror that is 100 µrad off and nothing else
    drift: float = 0.0  # of the distances by line, mm/h, standard deviation
    drift_of_run: float = 0.0  # mm/h
    options: Mapping[str, Any] = field(default_factory=dict)

    @functools.cached_property
    def plan(self) -> sd.Plan:
        return sd.Plan(VOLUME, list(self.lines), self.steps, scale_lines=SCALE_LINES, scale_points=self.scale_points)

    def misalignment(self, line: str, rng: np.random.Generator) -> sd.Misalignment:
        """As drawn from the priors that an adjustment has by default; a free quantity from a usual one."""
        measured, beams = line not in SCALE_LINES, self.head == "multi_beam"
        if self.small is not None:
            return sd.Misalignment(
                (100 * URAD * measured, -100 * URAD * measured), self.small * rng.normal(size=2) * measured
            )
        angle = self.face if "0" in line else 1e-3
        laser = (
            (2e-3 if beams else angle) * rng.normal(size=2)
            if measured
            else self.scale_laser * rng.uniform(-1.0, 1.0, 2)
        )
        mirror = angle * rng.normal(size=2) if measured else 0.0 * laser if self.square_to_axis else laser
        return sd.Misalignment(
            mirror,
            laser,
            rng.normal(size=2) if measured and self.head == "psd" else (0.0, 0.0),
            rng.normal(),
            list(0.05 * rng.normal(size=len(BEAMS))) if measured and beams else [],
            lateral=rng.normal(size=2),
            roll=20e-3 * rng.normal() * measured,
            gain=0.01 * rng.normal() * measured,
            drift=(self.drift * rng.normal() + self.drift_of_run) / 3600.0,
        )

    def run(self, seed: int, *, noisy: bool = True) -> tuple[sd.Measurement, sd.Machine]:
        """A run of the machine of this seed."""
        rng = np.random.default_rng([14, seed])
        machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=seed, intervals=self.steps))
        run = sd.simulate(
            machine,
            self.plan,
            HEADS[self.head],
            misalignment={line: self.misalignment(line, rng) for line in [*self.lines, *SCALE_LINES]},
            noise=sd.Noise(seed=seed, **(NOISE if noisy else {})),
            repeats=self.repeats,
            seconds_per_reading=SECONDS_PER_READING if self.drift or self.drift_of_run else None,
        )
        return run, machine

    def adjust(self, run: sd.Measurement, **more: Any) -> sd.Adjustment | None:
        """None for an error."""
        given: dict[str, Any] = {"uncertainty": sd.methods.ReadingUncertainty(**NOISE), **self.options, **more}
        try:
            return sd.methods.adjust(run, self.plan, HEADS[self.head], CHAIN, **given)
        except sd.InvalidArgument:
            return None


def changed(run: sd.Measurement, by: Mapping[str, Any]) -> sd.Measurement:
    channels = {name: value + by[name] if name in by else value for name, value in run.channels.items()}
    return sd.Measurement(run.line, run.point, run.position, channels, run=run.run, direction=run.direction)


@dataclass(frozen=True)
class Fault:
    """An offset of one channel in some rows. `kind`: "reading", "slip", "factor" or another that has no name.

    `shares`: of the offset in each of the rows; none: all of it."""

    kind: str
    channel: str
    rows: Sequence[int]
    shares: Sequence[float] | None = None

    def into(self, run: sd.Measurement, size: float) -> sd.Measurement:
        offset = np.zeros(len(run))
        offset[list(self.rows)] = size * np.array(self.shares or 1.0)
        return changed(run, {self.channel: offset})

    def is_in(self, adjustment: sd.Adjustment) -> bool:
        """Whether a class of faults has it among its members."""
        return any(self.is_among(found) for found in classes(adjustment))

    def is_among(self, members: Iterable[Any]) -> bool:
        """A slip between two readings is also either of them."""
        return any(
            (member.channel, member.row) == (self.channel, self.rows[0])
            and (member.kind == self.kind or len(self.rows) == 1)
            for member in members
        )


def classes(adjustment: sd.Adjustment) -> list[Any]:
    """Of faults that were found; before there were classes, each outlier."""
    if hasattr(adjustment, "faults"):
        return [found.members for found in adjustment.faults]
    return [[SimpleNamespace(kind="reading", channel=o.channel, row=o.row)] for o in adjustment.outliers]


def pick(kind: str, run: sd.Measurement, rng: np.random.Generator) -> Fault:
    """A fault of this kind, anywhere in the run."""
    series: dict[tuple[int, str], list[int]] = {}  # rows of each line of each run
    for row, (number, line) in enumerate(zip(run.run.tolist(), run.line, strict=True)):
        if (line in SCALE_LINES) == (kind == "scale line"):
            series.setdefault((number, line), []).append(row)
    rows = list(series.values())[rng.integers(len(series))]
    lengths = [name for name in run.channels if name[0] == "d"]
    tilts = [name for name in run.channels if name not in (*lengths, "time")] or lengths
    channel = str(rng.choice(tilts if "tilt" in kind else lengths))
    if kind == "scale line":
        return Fault("reading", channel, [rows[rng.integers(2)]])
    first = int(rng.integers(1, len(rows) - 5))
    name, count = {"slip": ("slip", None), "five": ("five", 5)}.get(kind[:4], ("reading", 1))
    return Fault(name, channel, rows[first:][:count])


KINDS_OF_FAULTS = ("single distance", "single tilt", "slip of distance", "slip of tilt", "scale line", "five rows")


def deviations(calibration: sd.Calibration, truth: sd.ErrorMap) -> Iterator[tuple[str, Any, Any, Any]]:
    """Name, deviation by u, deviation and u of all values that are determined and not 0 by the choice of frame."""
    tables = {name: (v - truth.function(name, p), u) for name, (p, v, u) in calibration.functions.items()}
    tables |= {n: (np.array([v - truth.squareness[n]]), np.array([u])) for n, (v, u) in calibration.squareness.items()}
    for name, (error, u) in tables.items():
        some = u > 0.0
        if name not in calibration.undetermined_slopes and np.any(some):
            yield name, error[some] / u[some], error[some], u[some]


# --- detection -------------------------------------------------------------------------------------------------------
CELLS = {
    f"{plan}, {head}": Setting(tuple(lines), repeats, head)
    for (plan, (lines, repeats)), head in itertools.product(PLANS.items(), HEADS)
}


def controlled(setting: Setting, seed: int, fault: Fault) -> float:
    """What a fault of its noise's size adds to chi-square, from this run without noise: its set-ups are part of it.

    0 where it cannot be: one of the two adjustments ended elsewhere.
    """
    run, _ = setting.run(seed, noisy=False)
    few = 5.0  # small: of first order
    left = [
        setting.adjust(r, outlier_probability=0.0, variance_components=False)
        for r in (run, fault.into(run, few * noise_of(fault.channel)))
    ]
    sound, faulty = (math.nan if a is None else a.weighted_square_sum for a in left)
    added = (faulty - sound) / few**2
    return added if 0.0 < added <= len(fault.rows) else 0.0


def noise_of(channel: str) -> float:
    return NOISE[{"d": "distance", "s": "spot"}.get(channel[0], "tilt")]


@functools.cache
def hypotheses(cell: str, count: int = 24) -> list[Fault]:
    """Single distances, single tilts and slips that the readings control."""
    setting, rng = CELLS[cell], np.random.default_rng(len(cell))
    found: list[Fault] = []
    run, _ = setting.run(0)
    while len(found) < count:
        fault = pick(KINDS_OF_FAULTS[len(found) % 4], run, rng)
        if controlled(setting, 0, fault) > 0.02:
            found.append(fault)
    return found


def sound(cell: str, seed: int) -> str:
    adjusted = CELLS[cell].adjust(CELLS[cell].run(seed)[0])
    return "error" if adjusted is None else adjusted.verdict.fit


def faulty(cell: str, seed: int) -> tuple[float, bool, bool] | None:
    """Root of lambda; whether a fault was found; whether it was this one. None: no fault's root of lambda is known."""
    setting, other = CELLS[cell], seed // len(LEVELS)
    level, run_seed = LEVELS[seed % len(LEVELS)], 10_000_000 + seed
    known = hypotheses(cell)
    for fault in known[other % len(known) :] + known:
        if (part := controlled(setting, run_seed, fault)) > 0.02:
            break
    else:
        return None
    run, _ = setting.run(run_seed)
    size = (-1) ** other * level * noise_of(fault.channel) / part**0.5
    adjusted = setting.adjust(fault.into(run, size))
    return level, adjusted is not None and bool(classes(adjusted)), adjusted is not None and fault.is_in(adjusted)


def predicted(root: float, freedom: int) -> float:
    """The share that is found: the limit grows with the variance factor that is left, where that exceeds 1."""
    factor = np.maximum(1.0, chi2.ppf((np.arange(1000) + 0.5) / 1000.0, freedom) / freedom)
    limit = np.sqrt(THRESHOLD * factor)
    return float(np.mean(norm.sf(limit - root) + norm.cdf(-limit - root)))


def detection(tasks: Tasks, runs: int) -> bool:
    each, rows, alarms = max(60, runs // len(CELLS)), [], []
    for cell in CELLS:
        fits = Counter(tasks(functools.partial(sound, cell), each))
        good = fits["rejected"] + fits["error"] <= most(0.001, each) and fits["doubtful"] <= most(0.02, each)
        alarms.append([cell, each, *percents(fits), good])
        found = [outcome for outcome in tasks(functools.partial(faulty, cell), each // 2) if outcome]
        some = CELLS[cell].adjust(CELLS[cell].run(0)[0])
        shares, good = [], some is not None
        for level in LEVELS if some else ():
            seen = [of_fault for at, of_fault, _ in found if at == level]
            expected = predicted(level, some.degrees_of_freedom)
            off = abs(sum(seen) - expected * len(seen))
            good &= off <= most(expected, len(seen)) - (expected - 0.02) * len(seen)
            shares.append(f"{100 * sum(seen) / len(seen):.1f} ({100 * expected:.1f})")
        named = Counter(right for at, seen_at_all, right in found if at >= CERTAIN and seen_at_all)
        good &= named[False] <= most(0.01, named.total())
        rows.append([cell, *shares, percents(named, (True,))[0], good])
    levels = [f"√λ = {level:.2f}" for level in LEVELS]
    good = table("Sound runs, %", ["plan, head", "runs", *FITS], alarms)
    return table("Faults found, % (predicted)", ["plan, head", *levels, "class right"], rows) and good


# --- coverage --------------------------------------------------------------------------------------------------------
COVERED = {
    "sound": Setting(),
    **{f"one run in three has a fault, {plan}": Setting(tuple(lines), n) for plan, (lines, n) in PLANS.items()},
    "one run in three has a fault, slips estimated": Setting(options={"slips": "estimate"}),
    "drift 5 µm/h by line": Setting(drift=5 * UM),
    "drift 20 µm/h by line": Setting(drift=20 * UM),
    "drift 20 µm/h of the run": Setting(drift_of_run=20 * UM),
    "lasers of scale lines to 1 mrad": Setting(scale_laser=1e-3, square_to_axis=True),
    "six face diagonals, 2 mrad": Setting(tuple(FACES), face=2e-3),
    "six face diagonals, 3 mrad": Setting(tuple(FACES), face=3e-3),
    "three beams": Setting(head="multi_beam"),
    "three beams, twice, lasers from their prior": Setting(head="multi_beam", repeats=2, small=2e-3),
    "three beams, four times, mirrors 100 µrad": Setting(head="multi_beam", repeats=4, small=0.0),
}


def covered(name: str, seed: int) -> tuple[str, Counter[str], Counter[str]]:
    """The verdict, and by family how many values are within their 95 % interval, and how many there are."""
    setting, rng, inside, total = COVERED[name], np.random.default_rng([15, seed]), Counter[str](), Counter[str]()
    run, machine = setting.run(20_000_000 + seed)
    if "fault" in name and seed % 3 == 0:
        fault = pick(KINDS_OF_FAULTS[seed // 3 % len(KINDS_OF_FAULTS)], run, rng)
        size = 10.0 ** rng.uniform(-1.0, 4.0) * UM if fault.channel[0] == "d" else 10.0 ** rng.uniform(0.0, 4.0) * URAD
        run = fault.into(run, float(rng.choice([-1.0, 1.0])) * size)
    adjusted = setting.adjust(run)
    if adjusted is None:
        return "error", inside, total
    for parameter, z, _, _ in deviations(adjusted.calibration, machine.errors):
        inside[kind_of(parameter)] += int(np.sum(np.abs(z) < 1.96))
        total[kind_of(parameter)] += len(z)
    return adjusted.verdict.fit, inside, total


def coverage(tasks: Tasks, runs: int) -> bool:
    rows, each = [], max(60, runs // 10)
    for name, setting in COVERED.items():
        if not all(hasattr(sd.methods.AdjustmentOptions, option) for option in setting.options):
            continue
        outcomes = list(tasks(functools.partial(covered, name), each))
        fits = Counter(fit for fit, _, _ in outcomes)
        accepted = [outcome for outcome in outcomes if outcome[0] == "accepted"]
        inside, total = (sum((outcome[i] for outcome in accepted), Counter[str]()) for i in (1, 2))
        good = all(total[k] - inside[k] <= most(0.06, fits["accepted"]) / fits["accepted"] * total[k] for k in total)
        good &= "fault" in name or fits["error"] == 0
        rows.append([name, *percents(fits), *(f"{100 * inside[k] / max(total[k], 1):.2f}" for k in KINDS), good])
    return table("Coverage of the 95 % intervals of accepted results, %", ["runs", *FITS, *KINDS], rows)


# --- as users reported it --------------------------------------------------------------------------------------------
def simulated(steps: int = 20, **options: Any) -> tuple[Setting, sd.Machine, sd.Measurement]:
    setting, machine = Setting(steps=steps), sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=0))
    noise = sd.Noise(seed=1, **NOISE)
    return setting, machine, sd.simulate(machine, setting.plan, HEADS["ideal"], noise=noise, **options)


def cases() -> Iterator[tuple[str, Setting, sd.Machine, sd.Measurement]]:
    setting, machine, run = simulated()

    def longer(
        line: str, first: int, size: float, count: int | None = None, of: sd.Measurement = run
    ) -> sd.Measurement:
        """Distances of the line from this point on, `count` of them, read longer."""
        rows = [row for row, name in enumerate(of.line) if name == line]
        return Fault("", "distance", rows[first:][:count]).into(of, size)

    yield "none", setting, machine, run
    yield "1: end of p00 off by 10 µm", setting, machine, longer("p00", 1, 0.01)
    yield "1: end of p00 off by 1 mm", setting, machine, longer("p00", 1, 1.0)
    yield "2: npp slips 50 µm", setting, machine, longer("npp", 30, 0.05)
    yield "2: nnp slips 1 mm", setting, machine, longer("nnp", 30, 1.0)
    fine = simulated(50)
    yield "2: five rows of npp +100 µm, 50 steps", *fine[:2], longer("npp", 70, 0.1, 5, fine[2])
    scattered = run
    for line, point in ("ppp", 7), ("npp", 33), ("npp", 50), ("pnp", 21), ("nnp", 44):
        scattered = longer(line, point, 0.1, 1, scattered)
    yield "3: five scattered readings +100 µm", setting, machine, scattered
    for size in (1e-3, 2e-3):
        lasers = {line: sd.Misalignment(laser=(size, 0.0)) for line in SCALE_LINES}
        yield f"4: lasers of scale lines {size * 1e3:g} mrad", *simulated(misalignment=lasers)
    signs = zip(DIAGONALS, (1.0, -1.0, 1.0, -1.0), strict=True)
    drifts = {line: sd.Misalignment(drift=sign * 10 * UM / 3600.0) for line, sign in signs}
    yield "5: ±10 µm/h by line", *simulated(misalignment=drifts, seconds_per_reading=SECONDS_PER_READING)


def reported(tasks: Tasks, runs: int) -> bool:
    """Beams from their priors and face diagonals, which take many runs, are in the part coverage."""
    rows = []
    for name, setting, machine, run in cases():
        adjusted = setting.adjust(run)
        found = "" if adjusted is None else ", ".join(str(len(members)) for members in classes(adjusted))
        rows.append([name, *worst(None if adjusted is None else adjusted.calibration, machine, found)])
    small = {line: sd.Misalignment(reflector=(100 * URAD, 300 * URAD)) for line in DIAGONALS}
    large = {line: sd.Misalignment(reflector=(1e-3, -1e-3), laser=(1e-3, 1e-3)) for line in DIAGONALS}
    for method, misalignment in (("conventional", small), ("enhanced", large)):
        setting, machine, run = simulated(misalignment=misalignment)
        told = (run, setting.plan, HEADS["ideal"], CHAIN)
        calibration = sd.methods.evaluate(*told, method=method, uncertainty=sd.methods.ReadingUncertainty(**NOISE))
        rows.append([f"8: {method}", *worst(calibration, machine, "")])
    columns = ["fault", "fit", "worst value", "error, µm or µrad", "u", "error/u", "members of the classes found"]
    return table("Mistakes that users made", columns, rows)


def worst(calibration: sd.Calibration | None, machine: sd.Machine, found: str) -> list[object]:
    """Columns of the table: the value that is most u off. Good is an error below 4 u, or a verdict that says no."""
    if calibration is None:
        return ["error", "", "", "", "", found, False]
    values = list(deviations(calibration, machine.errors))
    name, z, error, u = max(values, key=lambda value: float(np.max(np.abs(value[1]))))
    k, micro = int(np.argmax(np.abs(z))), 1e3 if kind_of(name) in ("positioning", "straightness") else 1e6
    shown = [f"{number:.3g}" for number in (error[k] * micro, u[k] * micro, z[k])]
    return [calibration.fit, name, *shown, found, calibration.fit != "accepted" or abs(z[k]) < 4.0]


# --- all of it -------------------------------------------------------------------------------------------------------
def most(share: float, count: int) -> float:
    """As many as chance makes of this share."""
    return share * count + 3.0 * math.sqrt(share * (1.0 - share) * count)


def percents(counts: Mapping[Any, int], of: Sequence[Any] = FITS) -> list[str]:
    return [f"{100.0 * counts[key] / max(sum(counts.values()), 1):.2f}" for key in of]


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> bool:
    """Whether all rows are good, which their last entries say."""
    print(f"\n### {title}\n\n| {' | '.join(columns)} | |\n|{' --- |' * (len(columns) + 1)}")
    for *row, good in rows:
        print(f"| {' | '.join(map(str, row))} | {'as it must be' if good else '**not as it must be**'} |", flush=True)
    return all(row[-1] for row in rows)


PARTS = {"detection": detection, "coverage": coverage, "reported": reported}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--part", action="append", choices=list(PARTS), help="one of them; may be given again")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    start = time.monotonic()
    with multiprocessing.get_context("fork").Pool(given.workers) as pool:

        def tasks(work: Callable[[int], Any], count: int) -> Iterable[Any]:
            return pool.imap(work, range(count), chunksize=10)

        good = {part: PARTS[part](tasks, given.runs) for part in given.part or PARTS}
    print(
        f"\n{'all as it must be' if all(good.values()) else 'not all as it must be'}, {time.monotonic() - start:.0f} s"
    )
    return 0 if all(good.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
