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
import multiprocessing
import multiprocessing.pool
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import NormalDist
from types import SimpleNamespace
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import numpy as np
import one_thread  # noqa: F401 (for what its import does)
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
CERTAIN = 7.6  # root of lambda from which on 99 % are found
LEVELS = (3.0, 4.5, THRESHOLD**0.5, 6.0, CERTAIN, 10.0)
FITS = ("accepted", "doubtful", "rejected", "unchecked", "error")
NORMAL = NormalDist()
Tasks = Callable[[Callable[[int], Any], int], Iterable[Any]]  # results of a function for 0, 1, ...


@dataclass(frozen=True)
class Setting:
    """A plan, a head, and how set-ups are drawn (standard deviations, rad)."""

    lines: Sequence[str] = tuple(DIAGONALS)
    repeats: int = 1
    head: str = "ideal"
    steps: int = 10
    face_laser: float | None = None
    scale_laser: float = 500 * URAD
    mirror_square_to_axis: bool = False  # on scale lines; otherwise to the beam
    small_setups: bool = False  # the mirror off by 100 µrad, nothing else
    drift: float = 0.0  # of the distances by line, mm/h, standard deviation
    drift_of_run: float = 0.0  # mm/h
    options: Mapping[str, Any] = field(default_factory=dict)

    @functools.cached_property
    def plan(self) -> sd.Plan:
        return sd.Plan(VOLUME, list(self.lines), self.steps, scale_lines=SCALE_LINES)

    def misalignment(self, line: str, rng: np.random.Generator) -> sd.Misalignment:
        """As drawn from the priors that an adjustment has by default; a free quantity from a usual one."""
        if self.small_setups:
            return sd.Misalignment((0.0, 0.0) if line in SCALE_LINES else (100 * URAD, -100 * URAD))
        drift = (self.drift * rng.normal() + self.drift_of_run) / 3600.0
        common = {"distance_constant": rng.normal(), "lateral": rng.normal(size=2), "drift": drift}
        if line in SCALE_LINES:
            laser = self.scale_laser * rng.normal(size=2)
            return sd.Misalignment(0.0 * laser if self.mirror_square_to_axis else laser, laser, **common)
        beams = self.head == "multi_beam"
        laser = self.face_laser if "0" in line and self.face_laser else 2e-3 if beams else 1e-3
        return sd.Misalignment(
            1e-3 * rng.normal(size=2),
            laser * rng.normal(size=2),
            rng.normal(size=2) if self.head == "psd" else (0.0, 0.0),
            beam_constants=list(0.05 * rng.normal(size=len(BEAMS))) if beams else [],
            roll=20e-3 * rng.normal(),
            gain=0.01 * rng.normal(),
            **common,
        )

    def run(self, seed: int, *, perfect: bool = False) -> tuple[sd.Measurement, sd.Machine]:
        """A run of the machine of this seed; `perfect`: no noise, all set-ups true."""
        rng = np.random.default_rng([14, seed])
        machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=seed, intervals=self.steps))
        lines = [] if perfect else [*self.lines, *SCALE_LINES]
        run = sd.simulate(
            machine,
            self.plan,
            HEADS[self.head],
            misalignment={line: self.misalignment(line, rng) for line in lines},
            noise=sd.Noise(seed=seed, **({} if perfect else NOISE)),
            repeats=self.repeats,
            seconds_per_reading=SECONDS_PER_READING if self.drift or self.drift_of_run else None,
        )
        return run, machine

    def adjust(self, run: sd.Measurement, **more: Any) -> sd.Adjustment | None:
        """None for an error."""
        given = {"uncertainty": sd.ReadingUncertainty(**NOISE), **self.options, **more}
        try:
            return sd.adjust(run, self.plan, HEADS[self.head], CHAIN, **given)
        except sd.InvalidArgument:
            return None


def changed(run: sd.Measurement, by: Mapping[str, Any]) -> sd.Measurement:
    channels = {name: value + by[name] if name in by else value for name, value in run.channels.items()}
    return sd.Measurement(run.line, run.point, run.position, channels, run=run.run, direction=run.direction)


def distances(run: sd.Measurement) -> list[str]:
    return [name for name in run.channels if name[0] == "d"]


@dataclass(frozen=True)
class Fault:
    """The same offset of one channel in some rows. `kind`: "reading", "slip" or another that has no name."""

    kind: str
    channel: str
    rows: Sequence[int]

    def into(self, run: sd.Measurement, size: float) -> sd.Measurement:
        offset = np.zeros(len(run))
        offset[list(self.rows)] = size
        return changed(run, {self.channel: offset})

    def is_in(self, adjustment: sd.Adjustment) -> bool:
        """Whether a class of faults has it among its members; a slip between two readings is also either of them."""
        return any(
            (member.channel, member.row) == (self.channel, self.rows[0])
            and (member.kind == self.kind or len(self.rows) == 1)
            for found in classes(adjustment)
            for member in found
        )


def classes(adjustment: sd.Adjustment) -> list[Any]:
    """Of faults that were found; before there were classes, each outlier."""
    if hasattr(adjustment, "faults"):
        return [found.members for found in adjustment.faults]
    return [[SimpleNamespace(kind="reading", channel=o.channel, row=o.row)] for o in adjustment.outliers]


def series(run: sd.Measurement, *, scale_lines: bool = False) -> list[list[int]]:
    """The rows of each line of each run, in order."""
    rows: dict[tuple[int, str], list[int]] = {}
    for k, key in enumerate(zip(run.run.tolist(), run.line, strict=True)):
        rows.setdefault(key, []).append(k)
    return [own for (_, line), own in rows.items() if (line in SCALE_LINES) == scale_lines]


def pick(kind: str, run: sd.Measurement, rng: np.random.Generator) -> Fault:
    """A fault of this kind, anywhere in the run."""
    lengths = distances(run)
    tilts = [name for name in run.channels if name not in (*lengths, "time")] or lengths
    channel = str(rng.choice(tilts if "tilt" in kind else lengths))
    own = series(run, scale_lines=kind == "scale line")
    rows = own[rng.integers(len(own))]
    if kind == "scale line":
        return Fault("reading", channel, [rows[rng.integers(2)]])
    first = int(rng.integers(1, len(rows) - 5))
    if kind.startswith("single"):
        return Fault("reading", channel, [rows[first]])
    return (
        Fault("five", channel, rows[first : first + 5]) if kind == "five rows" else Fault("slip", channel, rows[first:])
    )


KINDS_OF_FAULTS = ("single distance", "single tilt", "slip of distance", "slip of tilt", "scale line", "five rows")


def family_counts(adjustment: sd.Adjustment, truth: sd.ErrorMap) -> dict[str, tuple[int, int]]:
    """Values within their 95 % interval, and all, by family."""
    counts = dict.fromkeys(KINDS, (0, 0))
    for name, z, _, _ in deviations(adjustment.calibration, truth):
        inside, total = counts[kind_of(name)]
        counts[kind_of(name)] = (inside + int(np.sum(np.abs(z) < 1.96)), total + len(z))
    return counts


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


@functools.cache
def hypotheses(cell: str, count: int = 24) -> list[tuple[Fault, float]]:
    """Single distances, single tilts and slips, with q: the chi-square that size 1 leaves in perfect readings."""
    setting, rng, found = CELLS[cell], np.random.default_rng(len(cell)), []
    run, _ = setting.run(0, perfect=True)
    while len(found) < count:
        fault = pick(("single distance", "single tilt", "slip of distance", "slip of tilt")[len(found) % 4], run, rng)
        size = 20.0 * noise_of(fault.channel)
        left = setting.adjust(fault.into(run, size), outlier_probability=0.0)
        if left is not None and left.weighted_square_sum > 0.02 * 20.0**2:  # otherwise nothing controls it
            found.append((fault, left.weighted_square_sum / size**2))
    return found


def noise_of(channel: str) -> float:
    return NOISE["distance" if channel[0] == "d" else "spot" if channel.startswith("spot") else "tilt"]


def sound(cell: str, seed: int) -> str:
    adjusted = CELLS[cell].adjust(CELLS[cell].run(seed)[0])
    return "error" if adjusted is None else adjusted.verdict.fit


def faulty(cell: str, seed: int) -> tuple[float, bool, bool]:
    """Level, found, and named rightly."""
    known = hypotheses(cell)
    (fault, q), level = known[seed // len(LEVELS) % len(known)], LEVELS[seed % len(LEVELS)]
    run, _ = CELLS[cell].run(10_000_000 + seed)
    adjusted = CELLS[cell].adjust(fault.into(run, (-1) ** (seed % 2) * level / q**0.5))
    return level, adjusted is not None and bool(classes(adjusted)), adjusted is not None and fault.is_in(adjusted)


def slack(share: float, count: int) -> float:
    return 3.0 * (share * (1.0 - share) / max(count, 1)) ** 0.5


def detection(tasks: Tasks, runs: int) -> Iterator[bool]:
    each, rows, alarms = max(50, runs // len(CELLS)), [], []
    for cell in CELLS:
        fits = Counter(tasks(functools.partial(sound, cell), each))
        good = fits["rejected"] + fits["error"] <= (0.001 + slack(0.001, each)) * each
        good &= fits["doubtful"] <= (0.02 + slack(0.02, each)) * each
        alarms.append([cell, each, *(percent(fits[fit], each) for fit in FITS), tick(good)])
        yield good
        found = list(tasks(functools.partial(faulty, cell), each))
        shares, good, right = [], True, Counter[bool]()
        for level in LEVELS:
            of_level = [(seen, named) for at, seen, named in found if at == level]
            expected = NORMAL.cdf(level - THRESHOLD**0.5) + NORMAL.cdf(-level - THRESHOLD**0.5)
            count, share = len(of_level), float(np.mean([seen for seen, _ in of_level]))
            near = share >= 0.99 - slack(0.01, count) if level >= CERTAIN else None
            good &= near if near is not None else abs(share - expected) <= 0.02 + slack(expected, count)
            shares.append(f"{100 * share:.1f} ({100 * expected:.1f})")
            if level >= CERTAIN:
                right.update(named for seen, named in of_level if seen)
        total = right[True] + right[False]
        good &= right[True] >= (0.99 - slack(0.01, total)) * total
        rows.append([cell, *shares, percent(right[True], total), tick(good)])
        yield good
    table("Sound runs, %", ["plan, head", "runs", *FITS, ""], alarms)
    levels = [f"√λ = {level:.2f}" for level in LEVELS]
    table("Faults found, % (predicted)", ["plan, head", *levels, "class right", ""], rows)


# --- coverage --------------------------------------------------------------------------------------------------------
SIX = tuple(DIAGONALS + FACES)
COVERED = {
    "sound": Setting(),
    **{f"one run in three has a fault, {plan}": Setting(tuple(lines), n) for plan, (lines, n) in PLANS.items()},
    "a fault, slips estimated": Setting(options={"slips": "estimate"}),
    "drift 5 µm/h by line": Setting(drift=5 * UM),
    "drift 20 µm/h by line": Setting(drift=20 * UM),
    "drift 20 µm/h of the run": Setting(drift_of_run=20 * UM),
    "lasers of scale lines 1 mrad": Setting(scale_laser=1e-3, mirror_square_to_axis=True),
    "six faces, 2 mrad": Setting(SIX, face_laser=2e-3),
    "six faces, 3 mrad": Setting(SIX, face_laser=3e-3),
    "three beams": Setting(head="multi_beam"),
    "three beams, twice, small set-ups": Setting(head="multi_beam", repeats=2, small_setups=True),
}


def covered(name: str, seed: int) -> tuple[str, dict[str, tuple[int, int]]]:
    setting, rng = COVERED[name], np.random.default_rng([15, seed])
    run, machine = setting.run(20_000_000 + seed)
    if "fault" in name and seed % 3 == 0:
        fault = pick(KINDS_OF_FAULTS[seed // 3 % len(KINDS_OF_FAULTS)], run, rng)
        unit = 2.0 * (sum(VOLUME) / 3) * URAD if fault.channel.startswith("spot") else URAD
        size = 10.0 ** rng.uniform(-1.0, 4.0) * UM if fault.channel[0] == "d" else 10.0 ** rng.uniform(0.0, 4.0) * unit
        run = fault.into(run, float(rng.choice([-1.0, 1.0])) * size)
    adjusted = setting.adjust(run)
    return ("error", {}) if adjusted is None else (adjusted.verdict.fit, family_counts(adjusted, machine.errors))


def coverage(tasks: Tasks, runs: int) -> Iterator[bool]:
    rows, each = [], max(50, runs // 10)
    for name, setting in COVERED.items():
        if not has_options(setting):
            continue
        outcomes = list(tasks(functools.partial(covered, name), each))
        fits = Counter(fit for fit, _ in outcomes)
        accepted = [counts for fit, counts in outcomes if fit == "accepted"]
        shares = [
            percent(*map(sum, zip(*(c[family] for c in accepted), strict=True))) if accepted else "" for family in KINDS
        ]
        low = 94.0 - 100.0 * slack(0.05, len(accepted))
        good = all(float(share) >= low for share in shares if share)
        rows.append([name, *(percent(fits[fit], each) for fit in FITS), *shares, tick(good)])
        yield good
    table("Coverage of the 95 % intervals of accepted results, %", ["runs", *FITS, *KINDS, ""], rows)


def has_options(setting: Setting) -> bool:
    return all(hasattr(sd.AdjustmentOptions, name) for name in setting.options)


# --- as users reported it --------------------------------------------------------------------------------------------
def shifted(run: sd.Measurement, offsets: Mapping[tuple[str, int], float], count: int | None = None) -> sd.Measurement:
    """Distances of a line from a point on, `count` of them, read this much too long."""
    by = np.zeros(len(run))
    for (name, first), size in offsets.items():
        rows = [k for k, line in enumerate(run.line) if line == name]
        by[rows[first : None if count is None else first + count]] += size
    return changed(run, {"distance": by})


def simulated(steps: int = 20, **options: Any) -> tuple[Setting, sd.Machine, sd.Measurement]:
    setting = Setting(steps=steps)
    machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=0))
    noise = sd.Noise(seed=1, **NOISE)
    return setting, machine, sd.simulate(machine, setting.plan, HEADS["ideal"], noise=noise, **options)


def lasers(size: float) -> dict[str, sd.Misalignment]:
    return {line: sd.Misalignment(laser=(size, 0.0)) for line in SCALE_LINES}


SCATTERED = {("ppp", 7): 0.1, ("npp", 33): 0.1, ("npp", 50): 0.1, ("pnp", 21): 0.1, ("nnp", 44): 0.1}


def cases() -> Iterator[tuple[str, Setting, sd.Machine, sd.Measurement]]:
    setting, machine, run = simulated()
    yield "none", setting, machine, run
    for size in (0.01, 1.0):
        yield f"1: end of p00 off by {size:g} mm", setting, machine, shifted(run, {("p00", 1): size})
    yield "2: npp slips 50 µm", setting, machine, shifted(run, {("npp", 30): 0.05})
    yield "2: nnp slips 1 mm", setting, machine, shifted(run, {("nnp", 30): 1.0})
    fine, same, longer = simulated(50)
    yield "2: five rows of npp +100 µm, 50 steps", fine, same, shifted(longer, {("npp", 70): 0.1}, 5)
    yield "3: five scattered readings +100 µm", setting, machine, shifted(run, SCATTERED, 1)
    for size in (1e-3, 2e-3):
        yield f"4: lasers of scale lines {size * 1e3:g} mrad", *simulated(misalignment=lasers(size))
    signs = zip((*DIAGONALS, *SCALE_LINES), itertools.cycle((1.0, -1.0)), strict=False)
    drifts = {line: sd.Misalignment(drift=sign * 10 * UM / 3600.0) for line, sign in signs}
    yield "5: ±10 µm/h by line", *simulated(misalignment=drifts, seconds_per_reading=SECONDS_PER_READING)


def reported(tasks: Tasks, runs: int) -> Iterator[bool]:
    """Points 6 and 7, of many runs each, are in the part coverage."""
    rows = []
    for name, setting, machine, run in cases():
        adjusted = setting.adjust(run)
        found = [] if adjusted is None else [f"{len(members)}" for members in classes(adjusted)]
        rows.append([name, *said(adjusted and adjusted.calibration, machine), ", ".join(found)])
        yield rows[-1][1] != "accepted" or abs(float(rows[-1][-2])) < 5.0
    setups = {line: sd.Misalignment(reflector=(100 * URAD, 300 * URAD)) for line in DIAGONALS}
    large = {line: sd.Misalignment(reflector=(1e-3, -1e-3), laser=(1e-3, 1e-3)) for line in DIAGONALS}
    for method, misalignment in (("conventional", setups), ("enhanced", large)):
        setting, machine, run = simulated(misalignment=misalignment)
        given = {"method": method, "uncertainty": sd.ReadingUncertainty(**NOISE)}
        calibration = sd.evaluate(run, setting.plan, HEADS["ideal"], CHAIN, **given)
        rows.append([f"8: {method}", *said(calibration, machine), ""])
        yield rows[-1][1] != "accepted"
    columns = ["fault", "fit", "worst value", "error, µm or µrad", "u", "error/u", "members of the classes found"]
    table("Mistakes that users made", columns, rows)


def said(calibration: sd.Calibration | None, machine: sd.Machine) -> list[str]:
    if calibration is None:
        return ["error", "", "", "", ""]
    worst = max(
        (abs(z[k]), name, error[k], u[k], z[k])
        for name, z, error, u in deviations(calibration, machine.errors)
        for k in [int(np.argmax(np.abs(z)))]
    )
    scale = 1e3 if worst[1][1] == worst[1][2] or worst[1][1] in "XYZ" else 1e6
    return [calibration.fit or "", worst[1], *(f"{x:.3g}" for x in (worst[2] * scale, worst[3] * scale, worst[4]))]


# --- all of it -------------------------------------------------------------------------------------------------------
def percent(some: int, of: int) -> str:
    return f"{100.0 * some / of:.2f}" if of else ""


def tick(good: bool) -> str:
    return "as it must be" if good else "**NOT AS IT MUST BE**"


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    print(f"\n### {title}\n")
    for row in [columns, ["---"] * len(columns), *rows]:
        print(f"| {' | '.join(map(str, row))} |", flush=True)


PARTS = {"detection": detection, "coverage": coverage, "reported": reported}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--part", action="append", choices=list(PARTS), help="one of them; may be given again")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    start, good = time.monotonic(), True
    with multiprocessing.get_context("fork").Pool(given.workers) as pool:

        def tasks(work: Callable[[int], Any], count: int) -> Iterable[Any]:
            return pool.imap(work, range(count), chunksize=10)

        for part in given.part or PARTS:
            good &= all(list(PARTS[part](tasks, given.runs)))
    print(f"\n{'all as it must be' if good else 'not all as it must be'}, {time.monotonic() - start:.0f} s")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
