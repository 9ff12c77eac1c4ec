"""Coverage of the 95 % intervals, from random machines, set-ups and noise, each simulated and evaluated once.

    ./run python benchmarks/coverage.py [--machines 10000] [--case NAME]... [--workers N]

For every parameter family the table shows the share of machines whose interval covers the truth: the lowest share of
all nodes, the mean over the nodes, and the highest share. The share of a single node is a binomial count over machines;
four standard deviations are allowed. The nodes of one machine are correlated and do not count as separate machines.
Some cases show the effect of a wrong model. The exit code is 1 if a result is not as expected. Intervals propagated
from uncertain inputs (set-ups, scales, air, drift, walks, repeatability) use a fifth of the machines.
"""

from __future__ import annotations

import argparse
import functools
import multiprocessing
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import coverage_cases
import coverage_propagated
import numpy as np
import one_thread  # noqa: F401 (for what its import does)
from coverage_cases import PROBABILITY, STEPS, coverages, labels

import stepdiag as sd

CHUNK = 50
MANY = 10_000
SLOWER = 5  # divisor of the machines: propagation differentiates whole calibrations with respect to about sixty inputs
CASES = coverage_cases.CASES | coverage_cases.SCALE_LINE_CASES | coverage_propagated.CASES


def of_chunk(name: str, steps: int, seeds: range) -> np.ndarray:
    return np.array([of_machine(name, seed, steps) for seed in seeds])


def of_machine(name: str, seed: int, steps: int) -> np.ndarray:
    part = coverage_propagated if name in coverage_propagated.CASES else coverage_cases
    try:
        return part.outcome(CASES[name], seed, steps)
    except sd.InvalidArgument:
        if not CASES[name].wrong:
            raise
        return np.full(len(labels(steps)), np.nan)  # no solution explains the readings


def all_outcomes(pool: multiprocessing.pool.Pool, name: str, machines: int, steps: int) -> np.ndarray:
    chunks = [range(i, min(i + CHUNK, machines)) for i in range(0, machines, CHUNK)]
    done, found = 0, []
    for part in pool.imap(functools.partial(of_chunk, name, steps), chunks):
        found.append(part)
        done += len(part)
        if sys.stderr.isatty():
            print(f"\r{name}: {done} of {machines} machines", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print("\r\033[K", end="", file=sys.stderr)
    return np.concatenate(found)


def report(name: str, z: np.ndarray, steps: int, seconds: float) -> bool:
    """Prints the table of a case. Returns whether the results are as expected."""
    nothing = np.all(np.isnan(z), axis=1)
    case, found = CASES[name], coverages(z[~nothing], steps)
    tolerance = next(iter(found.values())).tolerance
    allowed = f"{100 * (PROBABILITY - tolerance):.1f} .. {100 * (PROBABILITY + tolerance):.1f} %"
    print(f"\n{name}: {len(z)} machines, {seconds:.0f} s")
    if case.wrong:
        print(f"  the model does not hold: {case.wrong}")
    if np.any(nothing):
        print(f"  without a result: {np.sum(nothing)} machines, which are not counted below")
    print(f"  {'family':15}{'lowest':>9}{'mean':>9}{'highest':>9}{'rms/u':>8}")
    for family, c in found.items():
        verdict = f"within {allowed}" if c.holds else f"not within {allowed}"
        shares = "".join(f"{100 * share:8.2f}%" for share in (c.lowest, c.pooled, c.highest))
        print(f"  {family:15}{shares}{c.spread:8.3f}  {verdict}")
    if case.wrong:  # a wrong model need not affect every family, and few machines may not show it
        return len(z) < MANY or not any(found[family].holds for family in case.concerned)
    return all(c.holds for c in found.values())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=MANY)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--case", action="append", choices=list(CASES), help="one of them; may be given again")
    given = parser.parse_args()
    print(f"coverage of 95 % intervals: {given.machines} random machines a case, {given.steps} steps an axis")
    unexpected = []
    with multiprocessing.get_context("fork").Pool(given.workers) as pool:
        for name in given.case or CASES:
            start = time.monotonic()
            machines = -(-given.machines // SLOWER) if name in coverage_propagated.CASES else given.machines
            z = all_outcomes(pool, name, machines, given.steps)
            if not report(name, z, given.steps, time.monotonic() - start):
                unexpected.append(name)
    print(f"\nnot as expected: {', '.join(unexpected)}" if unexpected else "\nall as expected")
    return 1 if unexpected else 0


if __name__ == "__main__":
    sys.exit(main())
