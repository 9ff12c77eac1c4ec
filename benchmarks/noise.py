"""Noise that is stated wrongly: is it called noise, with its size, and nothing else blamed?

    ./run python benchmarks/noise.py [--steps 20] [--seed 0]

A run of each head, whose noise is known, is judged with uncertainties that are too small or too large, channel by
channel and all at once, and with readings that were rounded. The table is Markdown. The exit status is 1 where a noise
factor is further than three of its standard uncertainties from the truth, where a fault or a mistake is named, or where
the verdict is not that of the factor: of what scatters more than 3 times as stated by two standard uncertainties
rejected, and accepted never where a channel scatters twice as stated.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import numpy as np
import one_thread  # noqa: F401 (for what its import does)

import stepdiag as sd

UNDERSTATED = (2.0, 3.17, 5.0, 10.0, 20.0, 100.0)
OVERSTATED = (0.7, 0.5, 0.2, 0.1)
NOISE = {"distance_um": 0.1, "tilt_urad": 1.0, "spot_um": 1.0}
HEADS = {
    "ideal": ("", ("distance_um", "tilt_urad")),
    "psd": ("psd_distance_mm = 100.0", ("distance_um", "spot_um")),
    "multi_beam": ("beam_offsets_mm = [[0.0, 50.0], [-43.3, -25.0], [43.3, -25.0]]", ("distance_um",)),
}
CHANNELS = {"distance_um": ("distance",), "tilt_urad": ("alpha", "beta"), "spot_um": ("spot_x", "spot_y")}
# Columns that are rounded, and to what (mm, rad).
ROUNDED = {"distance_um": (1e-2, 1e-3, 1e-4), "tilt_urad": (1e-5, 1e-6), "spot_um": (1e-2, 1e-3)}


@dataclass(frozen=True)
class Case:
    head: str
    what: str
    scenario: sd.Scenario
    run: sd.Measurement
    true: dict[str, float]  # noise factor by channel; empty where rounding is the noise


def scenario(head: str, steps: int, seed: int, stated: dict[str, float] | None = None) -> sd.Scenario:
    layout, keys = HEADS[head]
    lines = [
        "[volume]\nx_mm = 800.0\ny_mm = 600.0\nz_mm = 500.0",
        f'[machine]\nchain = "[w X\' b Y Z t]"\n[machine.random]\nseed = {seed}',
        f'[plan]\nlines = ["ppp", "npp", "pnp", "nnp"]\nsteps = {steps}\nscale_lines = ["p00", "0p0", "00p"]',
        f'[head]\nlayout = "{head}"\n{layout}',
        "[misalignment]\nreflector_urad = [100.0, 300.0]\nlaser_urad = [-200.0, 50.0]",
        f"[noise]\nseed = {seed}",
        *(f"{key} = {NOISE[key]}" for key in keys),
    ]
    if stated:
        lines += ["[uncertainty]", *(f"{key} = {value!r}" for key, value in stated.items())]
    return sd.parse_scenario("\n".join(lines))


def cases(head: str, steps: int, seed: int) -> Iterator[Case]:
    keys = HEADS[head][1]
    run = sd.simulate(scenario(head, steps, seed))
    some = [(key,) for key in keys] + ([keys] if len(keys) > 1 else [])
    for wrong in some:
        for factor in (*UNDERSTATED, *OVERSTATED):
            stated = {key: NOISE[key] / (factor if key in wrong else 1.0) for key in keys}
            true = {c: factor if key in wrong else 1.0 for key in keys for c in CHANNELS[key]}
            what = f"{' and '.join(wrong)}: {factor:g} times as stated"
            yield Case(head, what, scenario(head, steps, seed, stated), run, true)
    for key in keys:
        for step in ROUNDED[key]:
            columns = {n: v for n, v in run.channels.items() if n in CHANNELS[key] or (n[0] == "d" == key[0])}
            rounded = {name: step * np.round(values / step) for name, values in columns.items()}
            yield Case(
                head,
                f"{key} rounded to {step:g}",
                scenario(head, steps, seed),
                sd.Measurement(
                    run.line, run.point, run.position, {**run.channels, **rounded}, run=run.run, direction=run.direction
                ),
                {},
            )


def failures(case: Case, judged: sd.results.Judgement) -> list[str]:
    found = judged.adjustment
    assert found is not None
    wrong = []
    if found.faults or judged.mistakes:
        wrong.append("a fault or a mistake is named")
    for component in judged.variance_components:
        true = case.true.get(component.channel)
        if true is not None and abs(component.factor - true) > 3.0 * component.standard_uncertainty:
            wrong.append(f"{component.channel} is {component.factor:.3g}")
        if case.true and component.factor - 2.0 * component.standard_uncertainty > 3.0 and judged.fit != "rejected":
            wrong.append("not rejected")
    if judged.fit == "accepted" and max(case.true.values(), default=1.0) >= 2.0:
        wrong.append("accepted")
    if not case.true and judged.fit == "rejected":
        wrong.append("rejected")
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print("| head | what | verdict | noise factors | not as it must be |\n|---|---|---|---|---|")
    count = failed = 0
    for head in HEADS:
        for case in cases(head, options.steps, options.seed):
            try:
                judged = sd.judge(case.scenario, case.run)
            except sd.InvalidArgument as error:
                wrong, shown = [f"refused: {error}"], "refused |"
            else:
                wrong = failures(case, judged)
                factors = (
                    f"{c.channel} {c.factor:.3g} ± {c.standard_uncertainty:.2g}" for c in judged.variance_components
                )
                shown = f"{judged.fit} | {', '.join(factors)}"
            count += 1
            failed += bool(wrong)
            print(f"| {case.head} | {case.what} | {shown} | {'; '.join(wrong)} |", flush=True)
    print(f"\n{count - failed} of {count} as they must be")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
