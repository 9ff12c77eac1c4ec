"""Rechecks and verifications of random machines: false alarms, coverage, and what an update is worth.

    ./run python benchmarks/recheck.py [--machines 20000] [--changed 4000] [--events 60] [--steps 4] [--workers N]

Each machine (benchmarks/coverage.py, case adjustment: random chain, volume, tool, errors, set-ups and noise) is
calibrated once. Then a short run of one, two or four of its diagonals, set up anew, is read and

- rechecked and verified, the machine being as it was: how often is it said to have changed, how often not to be
  explained, how often is E_n beyond 1;
- of others, rechecked after a change drawn from the priors: how often do the 95 % intervals of the terms cover it, how
  far are the baseline and the updated calibration from the machine (root mean square by family), and is the updated one
  as far from it as its covariance says (chi-square).

Machines of other kinds, with all three heads and noise of 0.01 to 0.1 um, meet what no change of low order is (helper
`rechecked.after`: a new screw error, a cubic bow, a wrong reading, a slip): what do recheck and verify say?

The exit code is 1 if a share is off by more than four binomial standard deviations, if an updated family is worse
than the baseline's, or if an event ends in an error.
"""

from __future__ import annotations

import argparse
import functools
import multiprocessing
import os
import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import coverage_cases
import numpy as np
import one_thread  # noqa: F401 (for what its import does)
from rechecked import (
    CHANGES,
    EVENTS,
    LAYOUTS,
    after,
    calibrated,
    changed_machine,
    options,
    random_change,
    read_again,
    short_plan,
)

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS, KINDS, NATIVE_UNIT, SQUARENESSES, kind_of
from stepdiag.presentation.verification import agrees
from stepdiag.rechecking.recheck import Judged
from stepdiag.rechecking.verification import ALPHA
from stepdiag.units import report_value

ALPHAS = (0.05, 0.01, 0.001)
WITHIN_1 = 0.9544997361036416  # of E_n: two standard deviations
CHUNK = 20


def unchanged(seed: int, steps: int) -> tuple[float, float, list[float], list[float], float]:
    """Probabilities of recheck and verify, E_n of the lines and of the readings; probability of recheck's fit."""
    drawn, baseline, rng = calibrated(seed, steps)
    plan = short_plan(drawn, seed, steps)
    run = read_again(drawn, drawn.machine, plan, rng)
    given = (baseline, run, plan, drawn.head, sd.Chain(drawn.chain), drawn.machine.tool)
    found = sd.methods.recheck(*given, options=options(drawn))
    verified = sd.methods.verify(*given, options=options(drawn))
    of_lines = [line.normalised for line in verified.lines]
    of_readings = [float(value) for values in verified.normalised.values() for value in values if value != 0.0]
    return found.probability, verified.probability, of_lines, of_readings, found.fit_probability


def deviations(calibration: sd.Calibration, errors: sd.ErrorMap) -> np.ndarray:
    """Of the calibration from the machine, in the order of its covariance."""
    values = {
        name: function[1] - errors.function(name, function[0]) for name, function in calibration.functions.items()
    }
    found, place = [], dict.fromkeys(values, 0)
    for name, position in calibration.covariance_labels:
        if position is None:
            found.append(calibration.squareness[name][0] - errors.squareness[name])
        else:
            found.append(values[name][place[name]])
            place[name] += 1
    return np.array(found)


def chi_square(deviation: np.ndarray, covariance: np.ndarray) -> tuple[float, int]:
    scale = np.sqrt(np.diag(covariance))
    used = scale > 0.0
    correlation = covariance[np.ix_(used, used)] / np.outer(scale[used], scale[used])
    values, vectors = np.linalg.eigh(correlation)
    parts = vectors.T @ (deviation[used] / scale[used])
    kept = values > 1e-8
    return float((parts[kept] ** 2 / values[kept]).sum()), int(kept.sum())


def updated_unchanged(seed: int, steps: int) -> tuple[list[float], list[float], list[float], float, int]:
    """As changed(), of a machine that has not changed."""
    return changed(seed, steps, size=0.0)


def changed(
    seed: int, steps: int, size: float = 1.0
) -> tuple[list[float], list[float], list[float], float, int, float]:
    """Deviations of the terms by their uncertainty; mean squares by family of baseline and update; chi-square;
    probability of the fit."""
    drawn, baseline, rng = calibrated(1_000_000 + seed, steps)
    plan = short_plan(drawn, seed, steps)
    change = random_change(rng, size)
    machine = changed_machine(drawn, change)
    run = read_again(drawn, machine, plan, rng)
    found = sd.methods.recheck(
        baseline, run, plan, drawn.head, sd.Chain(drawn.chain), machine.tool, options=options(drawn)
    )
    normalised = [(term.value - change[term.parameter]) / term.standard_uncertainty for term in found.terms]
    kinds = np.array([kind_of(name) for name, _ in baseline.covariance_labels])
    squares = []
    for calibration in (baseline, found.updated):
        deviation = deviations(calibration, machine.errors)
        squares.append([float(np.mean(deviation[kinds == kind] ** 2)) for kind in KINDS])
    assert found.updated.covariance is not None
    return normalised, squares[0], squares[1], *chi_square(deviation, found.updated.covariance), found.fit_probability


def eventful(seed: int, steps: int) -> tuple[str, str, str, str, bool]:
    """Event and layout; what recheck and verify say; whether the wrong reading is named by both."""
    event, layout = EVENTS[seed % len(EVENTS)], LAYOUTS[seed // len(EVENTS) % len(LAYOUTS)]
    one = after(event, layout, seed // (len(EVENTS) * len(LAYOUTS)), 2 * steps)
    try:
        judged = Judged(sd.methods.recheck(*one.given, options=one.options), one.baseline, ALPHA)
        verified = sd.methods.verify(*one.given, options=one.options)
    except sd.InvalidArgument as error:
        return event, layout, f"error: {error}", "", False
    named = [
        any(one.hit == (fault.line, fault.point) for found in left_out for fault in found.members)
        for left_out in (judged.recheck.left_out, verified.left_out)
    ]
    said = f"{judged.verdict}{', readings left out' if judged.recheck.left_out else ''}"
    also = f"{'agrees' if agrees(verified, ALPHA) else 'does not agree'}"
    return event, layout, said, f"{also}{', readings left out' if verified.left_out else ''}", all(named)


OF_A_MACHINE = {one.__name__: one for one in (unchanged, changed, updated_unchanged, eventful)}


def of_chunk(function: str, steps: int, seeds: range) -> list[tuple]:
    return [OF_A_MACHINE[function](seed, steps) for seed in seeds]


def everything(function: str, count: int, steps: int, workers: int) -> list[tuple]:
    chunks = [range(i, min(i + CHUNK, count)) for i in range(0, count, CHUNK)]
    start = time.monotonic()
    with multiprocessing.get_context("fork").Pool(workers) as pool:
        parts = pool.map(functools.partial(of_chunk, function, steps), chunks, chunksize=1)
    print(f"{count} machines, {function}, {steps} steps an axis, {time.monotonic() - start:.0f} s")
    return [one for part in parts for one in part]


def share_is(name: str, share: float, expected: float, count: int) -> bool:
    scatter = 4.0 * np.sqrt(expected * (1.0 - expected) / count)
    good = abs(share - expected) <= scatter
    print(f"  {name:44}{100 * share:8.3f} %, expected {100 * expected:.3g} %{'' if good else '   <-- off'}", flush=True)
    return bool(good)


def print_deviations(found: list[tuple]) -> list[bool]:
    """Root mean squares by family; whether that of the updated calibration is no larger."""
    before = np.sqrt(np.mean([one[1] for one in found], axis=0))
    after = np.sqrt(np.mean([one[2] for one in found], axis=0))
    for kind, old, new in zip(KINDS, before, after, strict=True):
        (a, unit), b = report_value(NATIVE_UNIT[kind], old), report_value(NATIVE_UNIT[kind], new)[0]
        print(f"  rms deviation, {kind:14}{a:8.2f} {unit} by the baseline, {b:6.2f} {unit} by the updated one")
    return [bool(new <= old) for old, new in zip(before, after, strict=True)]


def print_events(found: list[tuple]) -> bool:
    """By event and head, how often each is said; whether all is said without an error."""
    for event in EVENTS:
        for layout in LAYOUTS:
            those = [one for one in found if one[:2] == (event, layout)]
            said = [", ".join(f"{n} {text}" for text, n in Counter(one[k] for one in those).items()) for k in (2, 3)]
            print(f"  {event}, {layout}: recheck {said[0]}; verify {said[1]}; named {sum(one[4] for one in those)}")
    return not any(one[2].startswith("error") for one in found)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=20_000)
    parser.add_argument("--changed", type=int, default=4_000)
    parser.add_argument("--events", type=int, default=60, help="machines of each event and head")
    parser.add_argument("--steps", type=int, default=4)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    good = []

    found = everything("unchanged", given.machines, given.steps, given.workers)
    for name, index in (("recheck: false alarms", 0), ("recheck: not explained", 4), ("verify: false alarms", 1)):
        probabilities = np.array([one[index] for one in found])
        for alpha in ALPHAS:
            share = float(np.mean(probabilities < alpha))
            good.append(share_is(f"{name} at {100 * alpha:g} %", share, alpha, len(found)))
    # Lines and readings of one machine are correlated: as many independent ones as machines.
    of_lines = np.array([value for one in found for value in one[2]])
    good.append(
        share_is("verify: |E_n| of lines at most 1", float(np.mean(np.abs(of_lines) <= 1.0)), WITHIN_1, len(found))
    )
    of_readings = np.array([value for one in found for value in one[3]])
    within = float(np.mean(np.abs(of_readings) <= 1.0))
    good.append(share_is("verify: |E_n| of readings at most 1", within, WITHIN_1, len(found)))

    found = everything("changed", given.changed, given.steps, given.workers)
    normalised = np.array([one[0] for one in found])
    within = np.abs(normalised) <= coverage_cases.FACTOR
    for parameters, kind in CHANGES.items():
        of_kind = [kind_of(name) == parameters for name in (*FUNCTIONS, *SQUARENESSES)]
        good.append(share_is(f"changes: {kind} covered by 95 %", float(np.mean(within[:, of_kind])), 0.95, len(found)))
    good.append(share_is("changes: all covered by 95 %", float(np.mean(within)), 0.95, len(found)))
    probabilities = np.array([one[5] for one in found])
    for alpha in ALPHAS:
        share = float(np.mean(probabilities < alpha))
        good.append(share_is(f"changes: not explained at {100 * alpha:g} %", share, alpha, len(found)))
    good += print_deviations(found)
    squares, freedom = np.array([one[3] for one in found]), np.array([one[4] for one in found])
    ratio, scatter = squares.sum() / freedom.sum(), np.sqrt(2.0 / freedom.sum())
    print(f"  chi-square of the updated by its freedom {ratio:.5f}, expected 1 within {4 * scatter:.5f}")
    good.append(abs(ratio - 1.0) <= 4.0 * scatter)
    print_deviations(everything("updated_unchanged", given.changed // 4, given.steps, given.workers))
    found = everything("eventful", given.events * len(EVENTS) * len(LAYOUTS), given.steps, given.workers)
    good.append(print_events(found))
    print("\nas expected" if all(good) else "\nnot as expected")
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
