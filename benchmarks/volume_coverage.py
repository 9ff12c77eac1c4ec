"""Coverage of the 95 % intervals of the largest error over a volume, and their widths beside virtual calibrations.

    ./run python benchmarks/volume_coverage.py [--machines 2000] [--steps 10] [--samples 2000] [--workers N]

Random machines, set-ups and noise (those of benchmarks/coverage.py, case adjustment), simulated and evaluated once,
with the stated noise and with multiples of it: from a noise that is far below the machine's errors to one that is not.
For each level the table shows the share of machines whose interval covers the true largest error, rms error and ranges
at the nodes, and how often the true largest error lies beyond each one-sided 95 % bound, on which verdicts rest
(benchmarks/volume_verdicts.py has the machines that are hardest to judge).
Then standard deviations of these figures over whole virtual calibrations stand beside those of draws of the covariance.

The exit code is 1 if the coverage of the largest error over all levels is below 94 %, if that of a level is below that
by more than four binomial standard deviations, or if a standard deviation differs by more than 3 % beyond four of its
own.
"""

from __future__ import annotations

import argparse
import functools
import multiprocessing
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import coverage_cases
import numpy as np
import one_thread  # noqa: F401 (for what its import does)

import stepdiag as sd
from stepdiag import _core

CASE = coverage_cases.CASES["adjustment"]
LEVELS = (1.0, 3.0, 10.0)
LOW = 0.94
CLOSE = 0.03
CHUNK = 20
FIGURES = ("largest", "rms", "range X", "range Y", "range Z")


def of_machine(level: float, seed: int, steps: int, samples: int) -> list[float]:
    """Whether each figure is covered; whether the largest error is below the lower bound, above the upper one; its
    standard uncertainty relative to itself."""
    drawn, rng = coverage_cases.draw(CASE, seed, steps)
    u = drawn.uncertainty
    noisy = sd.methods.ReadingUncertainty(distance=level * u.distance, tilt=level * u.tilt, spot=level * u.spot)
    drawn = replace(drawn, uncertainty=noisy)
    calibration = coverage_cases.evaluated(CASE, drawn, coverage_cases.measured(drawn, rng))
    found = sd.volume(calibration, between_nodes=0.0, ranking=False, samples=samples, seed=seed)
    truth = sd.volume(drawn.machine, box=found.box, grid=None, ranking=False)
    pairs = [(found.largest_interval, truth.largest), (found.rms_interval, truth.rms)]
    pairs += [(found.ranges[axis].interval, truth.ranges[axis].value) for axis in "XYZ"]
    covered = [float(interval[0] <= true <= interval[1]) for interval, true in pairs if interval is not None]
    assert found.bounds is not None
    assert found.largest_interval is not None
    low, high = found.bounds
    spread = (found.largest_interval[1] - found.largest_interval[0]) / 3.92 / found.largest
    return [*covered, float(truth.largest < low), float(truth.largest > high), spread]


def of_chunk(level: float, steps: int, samples: int, seeds: range) -> list[list[float]]:
    return [of_machine(level, seed, steps, samples) for seed in seeds]


def coverage(machines: int, steps: int, samples: int, workers: int) -> bool:
    print(f"coverage of 95 % intervals, {machines} machines a level, {steps} steps an axis, {samples} draws")
    print(f"  {'noise':>8}{'u/largest':>11}" + "".join(f"{name:>10}" for name in FIGURES) + "    below    above")
    everything, holds = [], True
    chunks = [range(i, min(i + CHUNK, machines)) for i in range(0, machines, CHUNK)]
    with multiprocessing.get_context("fork").Pool(workers) as pool:
        for level in LEVELS:
            start = time.monotonic()
            parts = pool.map(functools.partial(of_chunk, level, steps, samples), chunks)
            found = np.array([row for part in parts for row in part])
            everything.append(found)
            shares = found[:, :7].mean(axis=0)
            cells = "".join(f"{100 * share:9.1f}%" for share in shares[:5])
            tails = "".join(f"{100 * share:8.1f}%" for share in shares[5:])
            print(
                f"  {level:7g}x{np.median(found[:, 7]):11.4f}{cells}{tails}   ({time.monotonic() - start:.0f} s)",
                flush=True,
            )
            tolerance = 4.0 * np.sqrt(0.95 * 0.05 / machines)
            holds &= bool(LOW - tolerance <= shares[0])
    pooled = float(np.concatenate(everything)[:, 0].mean())
    print(f"  largest error, all levels: {100 * pooled:.2f} %, expected at least {100 * LOW:.0f} %")
    return holds and pooled >= LOW


def virtual(steps: int, samples: int) -> bool:
    """Standard deviations of the figures over whole virtual calibrations of one machine, each with set-ups and noise of
    its own, and over draws of the covariance of a calibration."""
    drawn, rng = coverage_cases.draw(CASE, 1, steps)
    machine, lines = drawn.machine, list(drawn.misalignment)
    aligned = replace(drawn, misalignment={})
    own = coverage_cases.evaluated(CASE, aligned, sd.simulate(machine, drawn.plan, drawn.head))
    grid = [np.linspace(0.0, edge, steps + 1) for edge in own.volume]
    whole = []
    for _ in range(samples):
        again = replace(drawn, misalignment={line: coverage_cases.setup_of(CASE, rng, line) for line in lines})
        calibration = coverage_cases.evaluated(CASE, again, coverage_cases.measured(again, rng))
        found = _core.summarise_volume(sd.Machine(drawn.chain, calibration.to_error_map(), machine.tool), *grid)
        whole.append([found.largest, found.rms, *(found.highest - found.lowest)])
    drawn_figures = _core.VolumeDraws(own, *grid, seed=1).draw(0, samples)[:, :5]
    a, b = np.std(whole, axis=0), np.std(drawn_figures, axis=0)
    allowed = CLOSE + 4.0 / np.sqrt(samples)  # of a ratio of two standard deviations
    print(f"\nstandard deviations, {samples} whole virtual calibrations and draws, {steps} steps an axis")
    for name, one, other in zip(FIGURES, a, b, strict=True):
        print(f"  {name:10}{1e3 * one:9.4f} um{1e3 * other:9.4f} um  ratio {other / one:.4f}")
    return bool(np.all(np.abs(b / a - 1.0) <= allowed))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=2000)
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--samples", type=int, default=2000, help="draws of a covariance")
    parser.add_argument("--virtual", type=int, default=10_000, help="whole virtual calibrations")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    good = [
        coverage(given.machines, given.steps, given.samples, given.workers),
        virtual(given.steps, given.virtual),
    ]
    print("\nas expected" if all(good) else "\nnot as expected")
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
