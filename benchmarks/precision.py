"""How precise an instrument may be: relative noise by size of the machine, three heads.

    ./run python benchmarks/precision.py [--steps 5] [--head ideal]... [--seeds 1] [--workers N]

Machines of 1 mm to 100 m (edges 8 : 6 : 5), simulated with distances of a noise from 1e-6 to 1e-13 of the longest edge;
the noise of tilts and spots goes with it (balanced), or tilts have 1 µrad and spots the same angle (usual tilts). Below
100 mm head and errors are smaller in proportion. Each field: the first letter of the fit (a, d, r, u; E: an error, no
result; T: none within 5 s), the variance factor, and the largest error at a node of a table in its standard
uncertainties. Set-ups are better than their priors, so that the factor is below 1 where the priors count. The last
table is of runs without noise: rms of the residuals of distances, mm, where σ is 1e-9 of the size.
"""

from __future__ import annotations

import argparse
import functools
import json
import math
import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Callable
from multiprocessing.pool import ThreadPool
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import numpy as np
import one_thread  # noqa: F401 (for what its import does)

import stepdiag as sd

SIZES = [1.0, 10.0, 100.0, 1e3, 1e4, 1e5]  # mm, the longest edge
RELATIVE = [10.0**-n for n in range(6, 14)]
HEADS = ["ideal", "psd", "multi_beam"]
USUAL_TILT = 1e-6
PATIENCE = 5.0  # s; a fit takes some hundredths


def toml(table: dict[str, Any], prefix: str = "") -> str:
    own = "".join(f"{key} = {json.dumps(value)}\n" for key, value in table.items() if not isinstance(value, dict))
    deeper = (toml(v, f"{prefix}.{k}" if prefix else k) for k, v in table.items() if isinstance(v, dict))
    return (f"[{prefix}]\n" if prefix else "") + own + "".join(deeper)


def scenario(
    layout: str, size: float, relative: float, *, balanced: bool, noisy: bool, steps: int, seed: int
) -> sd.Scenario:
    share = min(1.0, size / 100.0)
    lever = 100.0 * share  # mm, from a tilt to a spot or a difference of beams
    tilt = relative if balanced else USUAL_TILT
    head = {
        "ideal": {},
        "psd": {"psd_distance_mm": lever},
        "multi_beam": {
            "beam_offsets_mm": [[0.0, 0.5 * lever], [-0.433 * lever, -0.25 * lever], [0.433 * lever, -0.25 * lever]]
        },
    }[layout]
    noise = {"distance_um": 1e3 * relative * size, "tilt_urad": 1e6 * tilt, "spot_um": 2e3 * tilt * lever}
    return sd.parse_scenario(
        toml(
            {
                "volume": {"x_mm": size, "y_mm": 0.75 * size, "z_mm": 0.625 * size},
                "machine": {
                    "chain": "[w X' b Y Z t]",
                    "random": {"seed": seed, "translation_um": 20.0 * share},
                },
                "plan": {"lines": ["ppp", "npp", "pnp", "nnp"], "steps": steps, "scale_lines": ["p00", "0p0", "00p"]},
                "head": {"layout": layout, "standoff_mm": 100.0 * share, **head},
                "misalignment": {"reflector_urad": [100.0, 300.0], "laser_urad": [-200.0, 50.0]},
                "noise": {**noise, "seed": seed} if noisy else {},
                "uncertainty": noise,
            }
        )
    )


def worst(calibration: sd.Calibration, truth: sd.ErrorMap) -> float:
    """The largest error of a value in its standard uncertainties."""
    largest = 0.0
    for name, (position, value, u) in calibration.functions.items():
        known = u > 0.0
        if known.any():
            largest = max(largest, float(np.max(np.abs(value - truth.function(name, position))[known] / u[known])))
    return largest


def cell(steps: int, seed: int, of: tuple[str, bool, float, float]) -> tuple[str, str]:
    """The field of a table, and the message of an error."""
    layout, balanced, size, relative = of
    try:
        described = scenario(layout, size, relative, balanced=balanced, noisy=True, steps=steps, seed=seed)
        found = sd.methods.adjust_scenario(described, sd.simulate(described))
    except (sd.InvalidArgument, MemoryError) as error:
        return "E", f"{layout} {size:g} mm: {error!r}" if isinstance(error, MemoryError) else str(error).splitlines()[
            0
        ][:120]
    factor = found.calibration.variance_factor
    deviation = worst(found.calibration, described.machine().errors)
    return f"{found.verdict.fit[0]} {factor:.3g} {deviation:.2g}", ""


def within(seconds: float, function: Callable[..., Any], *arguments: Any) -> Any:
    """What the function returns in a process of its own; None after this time."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=lambda: theirs.send(function(*arguments)))
    process.start()
    found = ours.recv() if ours.poll(seconds) else None
    process.kill()
    process.join()
    return found


def timed_cell(steps: int, seed: int, of: tuple[str, bool, float, float]) -> tuple[str, str]:
    return within(PATIENCE, cell, steps, seed, of) or ("T", "")


def floor(steps: int, of: tuple[str, float]) -> str:
    layout, size = of
    described = scenario(layout, size, 1e-9, balanced=True, noisy=False, steps=steps, seed=1)
    try:
        found = sd.methods.adjust_scenario(described, sd.simulate(described))
    except sd.InvalidArgument:
        return "E"
    residuals = [values for name, values in found.residuals.items() if name.startswith("d")]
    rms = math.sqrt(float(np.nanmean(np.concatenate([np.ravel(values) for values in residuals]) ** 2)))
    return f"{rms:.1e} {found.verdict.fit[0]}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--head", action="append", choices=HEADS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    start, heads = time.monotonic(), given.head or HEADS
    kinds, messages = Counter[str](), Counter[str]()
    sizes = " | ".join(f"{size:g} mm" for size in SIZES)
    print(f"stepdiag {sd.__version__}, {given.steps} steps, seed {given.seed}\n")
    with ThreadPool(given.workers) as pool:
        for layout in heads:
            for balanced in (True,) if layout == "multi_beam" else (True, False):
                print(f"{layout}, {'balanced' if balanced else 'usual tilts'}\n")
                print(f"| σ/size | {sizes} |\n|{'---|' * (1 + len(SIZES))}")
                for relative in RELATIVE:
                    work = [(layout, balanced, size, relative) for size in SIZES]
                    fields = pool.map(functools.partial(timed_cell, given.steps, given.seed), work, chunksize=1)
                    kinds.update(field[0] for field, _ in fields)
                    messages.update(message for _, message in fields if message)
                    print(f"| {relative:.0e} | {' | '.join(field for field, _ in fields)} |", flush=True)
                print()
        print(
            f"without noise: rms of the residuals of distances, mm\n\n| head | {sizes} |\n|{'---|' * (1 + len(SIZES))}"
        )
        for layout in heads:
            fields = pool.map(functools.partial(floor, given.steps), [(layout, size) for size in SIZES], chunksize=1)
            print(f"| {layout} | {' | '.join(fields)} |")
    counts = ", ".join(f"{n} {kind}" for kind, n in kinds.most_common())
    print(f"\n{counts} of {kinds.total()}; {time.monotonic() - start:.0f} s")
    for message, count in messages.most_common():
        print(f"{count} times: {message}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
