"""Mistakes in runs: are they named, and is nothing named where there is none?

    ./run python benchmarks/mistakes.py [--runs 200] [--sound 10000] [--steps 10] [--head ideal]... [--only WORDS]
        [--workers N]

Every run is simulated: README's volume, a random machine, set-ups from their priors, usual noise. A mistake is named
right where its sentence is among those that are named. What it must be named for is a difference of at least 60 in
chi-square between the fit as read and that of the run without the mistake; of the others the table says what the
mistake then does to a calibration that nothing rejects. Binomial scatter is allowed for: three standard deviations. The
tables are Markdown; the exit code is 1 if a figure is not as it must be.
"""

from __future__ import annotations

import argparse
import functools
import math
import multiprocessing
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import numpy as np
from mistaken import HEADS, changed, described, moved, rows_of, simulated, step_plan
from usual import CHAIN

import stepdiag as sd
from stepdiag._core import fit_quality
from stepdiag.scenario.description import adjustment_options

MUST_BE_FOUND = 60.0  # in chi-square
Make = Callable[[sd.Scenario, int], sd.Measurement]


def scaled(names: list[str], factor: float, line: str | None = None) -> Make:
    def make(scenario: sd.Scenario, seed: int) -> sd.Measurement:
        run = simulated(scenario, seed=seed)
        factors = np.ones(len(run))
        factors[rows_of(run, line)] = factor
        return changed(run, {name: run.channels[name] * factors for name in names})

    return make


def exchanged(a: str, b: str, line: str | None = None, sign: float = 1.0) -> Make:
    def make(scenario: sd.Scenario, seed: int) -> sd.Measurement:
        run = simulated(scenario, seed=seed)
        first, second, rows = run.channels[a].copy(), run.channels[b].copy(), rows_of(run, line)
        first[rows], second[rows] = run.channels[b][rows], sign * run.channels[a][rows]
        return changed(run, {a: first, b: second})

    return make


def of_rows(new: Callable[[np.ndarray], np.ndarray], line: str, other: str | None = None) -> Make:
    def make(scenario: sd.Scenario, seed: int) -> sd.Measurement:
        run = simulated(scenario, seed=seed)
        source, rows = np.arange(len(run)), rows_of(run, line)
        source[rows] = new(rows) if other is None else rows_of(run, other)
        if other is not None:
            source[rows_of(run, other)] = rows
        return moved(run, source)

    return make


def really(plan: sd.Plan | None = None, head: sd.Head | None = None, chain: str = CHAIN) -> Make:
    return lambda scenario, seed: simulated(scenario, seed=seed, plan=plan, head=head, chain=chain)


def scale_lines_scaled(factor: float) -> Make:
    def make(scenario: sd.Scenario, seed: int) -> sd.Measurement:
        run = simulated(scenario, seed=seed)
        factors = np.where([line.count("0") == 2 for line in run.line], factor, 1.0)
        return changed(run, {name: values * factors for name, values in run.channels.items() if name[0] == "d"})

    return make


def mistakes(head: str, steps: int) -> Iterator[tuple[str, Make, str]]:
    """What was done, and words of the sentence that must be there."""
    tilts = {"ideal": ["alpha", "beta"], "psd": ["spot_x", "spot_y"], "multi_beam": []}[head]
    lengths = ["d1", "d2", "d3"] if head == "multi_beam" else ["distance"]
    k = steps + 1
    if tilts:
        a, b = tilts
        for where, line in (("on all lines", None), ("on line npp", "npp")):
            yield f"sign of one tilt {where}", scaled([a], -1.0, line), f"{a} has the wrong sign {where}"
            yield f"head upside down {where}", scaled(tilts, -1.0, line), f"(upside down) {where}"
            yield f"tilts exchanged {where}", exchanged(a, b, line), f"{a} and {b} are exchanged {where}"
            yield f"head turned by 90° {where}", exchanged(a, b, line, -1.0), f"turned by 90° about its beam {where}"
            yield f"tilts times 2 {where}", scaled(tilts, 2.0, line), f"large by a factor of 2 {where}"
        for factor, said in ((0.5, "small by a factor of 2"), (1000.0, "a factor of 1000"), (1e-3, "a factor of 1000")):
            yield f"tilts times {factor:g}", scaled(tilts, factor), f"{said} on all lines"
        yield "tilts times 1.2", scaled(tilts, 1.2), "a gain that is not applied"
    else:
        for where, line in (("on all lines", None), ("on line npp", "npp")):
            yield f"d1 and d2 exchanged {where}", exchanged("d1", "d2", line), f"d1 and d2 are exchanged {where}"
        offsets = described(head, steps=steps).known.head.beam_offsets
        for degrees, turn in ((90, [[0.0, -1.0], [1.0, 0.0]]), (180, [[-1.0, 0.0], [0.0, -1.0]])):
            actual = sd.Head("multi_beam", beam_offsets=offsets @ np.array(turn).T)
            yield f"head turned by {degrees}°", really(head=actual), f"turned by {degrees}°"
        wide = sd.Head("multi_beam", beam_offsets=2.0 * offsets)
        yield "beam_offsets_mm halved", really(head=wide), "beam_offsets_mm is too small by a factor of 2"
    if head == "psd":
        yield "psd_distance_mm 100, really 300", really(head=sd.Head("psd", psd_distance=300.0)), "psd_distance_mm is"
    yield "sign of distances", scaled(lengths, -1.0), "the wrong sign on all lines"
    yield "distances times 2", scaled(lengths, 2.0), "large by a factor of 2 on all lines"
    yield "distances times 1e-3", scaled(lengths, 1e-3), "small by a factor of 1000 on all lines"
    yield "lines ppp and npp exchanged", of_rows(np.copy, "ppp", "npp"), "lines ppp and npp are exchanged"
    yield "line npp reversed", of_rows(np.flip, "npp"), "line npp is reversed: its points"
    other_end = step_plan(steps, lines=["ppp", "npp", "pnp", "ppn"])
    yield "ppn measured as nnp", really(other_end), "line nnp is reversed: it was measured as ppn"
    yield "step order ZXY", really(step_plan(steps, order="ZXY")), "the step order is ZXY"
    yield "point read twice", of_rows(lambda rows: rows[[*range(k), *range(k - 1, 3 * steps)]], "pnp"), "read twice"
    yield "point skipped", of_rows(lambda rows: np.append(np.delete(rows, k), -1), "pnp"), "skipped"
    yield "x_mm 800, really 810", really(step_plan(steps, volume=(810.0, 600.0, 500.0))), "x_mm = 810"
    yield "chain with Y before X", really(chain="[w Y' b X Z t]"), "in the order Y X Z from workpiece to tool"
    yield "index on scale lines alone", scale_lines_scaled(1.000271), "on the scale lines"
    # Small enough not to be found.
    if tilts:
        yield "tilts times 1.02", scaled(tilts, 1.02), "a gain that is not applied"
    yield "scale lines times 1 + 5e-6", scale_lines_scaled(1.0 + 5e-6), "on the scale lines"


def square_sum(scenario: sd.Scenario, run: sd.Measurement) -> tuple[float, int]:
    known = scenario.known
    try:
        fit = fit_quality(run, known.plan, known.head, known.chain, known.tool, adjustment_options(known), 30)
    except sd.InvalidArgument:
        fit = None
    return (math.inf, 1) if fit is None else (fit.weighted_square_sum, fit.degrees_of_freedom)


def one(head: str, steps: int, number: int, seed: int) -> tuple[float, bool, int, float, float]:
    """Difference in chi-square; named right; how many were named; largest effect of what is not rejected, µm, µrad."""
    scenario = described(head, steps=steps)
    _, make, words = list(mistakes(head, steps))[number]
    sound, wrong = simulated(scenario, seed=seed), make(scenario, seed)
    (as_read, freedom), (truth, _) = square_sum(scenario, wrong), square_sum(scenario, sound)
    found = sd.find_mistakes(scenario, wrong)
    right = any(words in mistake.text for mistake in found)
    difference, effect = as_read - truth, (0.0, 0.0)
    if difference < MUST_BE_FOUND and as_read < 4.0 * freedom:
        try:
            effect = largest_effect(scenario, wrong, sound)
        except sd.InvalidArgument:  # no machine can be so
            difference = math.inf
    return difference, right, len(found), *effect


def largest_effect(scenario: sd.Scenario, wrong: sd.Measurement, sound: sd.Measurement) -> tuple[float, float]:
    """Largest difference of two calibrations, µm and µrad; 0 where the wrong one is rejected."""
    adjustment = sd.methods.adjust_scenario(scenario, wrong)
    if adjustment.verdict.fit == "rejected":
        return 0.0, 0.0
    largest = {"um": 0.0, "urad": 0.0}
    other = sd.methods.adjust_scenario(scenario, sound).calibration
    for name, (_, values, _) in adjustment.calibration.functions.items():
        of = "urad" if sd.kind_of(name) == "angle" else "um"
        largest[of] = max(largest[of], float(np.max(np.abs(values - other.functions[name][1]))))
    for name, (value, _) in adjustment.calibration.squareness.items():
        largest["urad"] = max(largest["urad"], abs(value - other.squareness[name][0]))
    return 1e3 * largest["um"], 1e6 * largest["urad"]


def false_names(steps: int, seed: int) -> int:
    """Mistakes named in a run without one: every other one is noisy by a factor from 1.2 to 5."""
    head = list(HEADS)[seed % 3]
    scenario = described(head, steps=steps)
    noise = 1.0 if seed % 2 else float(np.random.default_rng([18, seed]).uniform(1.2, 5.0))
    return len(sd.find_mistakes(scenario, simulated(scenario, seed=1_000_000 + seed, noise=noise)))


def most(share: float, count: int) -> float:
    """As many as chance makes of this share."""
    return share * count + 3.0 * math.sqrt(share * (1.0 - share) * count)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=200, help="of each mistake with each head")
    parser.add_argument("--sound", type=int, default=10_000, help="sound and noisy runs")
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--head", action="append", choices=list(HEADS))
    parser.add_argument("--only", default="", help="mistakes whose name has these words")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    start, good = time.monotonic(), True
    with multiprocessing.get_context("fork").Pool(given.workers) as pool:
        print("| head | mistake | runs | Δχ² ≥ 60 | of these named right, % | other names | largest effect unseen | |")
        print("|---|---|---|---|---|---|---|---|")
        for head in given.head or HEADS:
            for number, (name, _, _) in enumerate(mistakes(head, given.steps)):
                if given.only not in name:
                    continue
                work = functools.partial(one, head, given.steps, number)
                results = pool.map(work, range(given.runs), chunksize=1)
                seen = [right for difference, right, *_ in results if difference >= MUST_BE_FOUND]
                wrong = sum(1 for _, right, count, *_ in results if count and not right)
                length, angle = (max(result[i] for result in results) for i in (3, 4))
                fine = seen.count(False) <= most(0.01, len(seen))
                good &= fine
                share = f"{100.0 * statistics.fmean(seen):.1f}" if seen else ""
                effect = f"{length:.2g} µm, {angle:.2g} µrad" if length or angle else ""
                print(
                    f"| {head} | {name} | {given.runs} | {len(seen)} | {share} | {wrong} | {effect} | "
                    f"{'as it must be' if fine else '**not as it must be**'} |",
                    flush=True,
                )
        named = sum(map(bool, pool.imap(functools.partial(false_names, given.steps), range(given.sound), chunksize=10)))
    fine = named <= most(1e-3, given.sound)
    good &= fine
    print(f"\nfalse names: {named} of {given.sound} sound and noisy runs: {'as' if fine else '**not** as'} it must be")
    print(f"{'all as it must be' if good else 'not all as it must be'}, {time.monotonic() - start:.0f} s")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
