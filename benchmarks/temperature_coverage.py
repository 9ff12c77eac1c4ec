"""Coverage of the 95 % intervals of positioning errors with random temperatures, coefficients, sensors and ramps.

    ./run python benchmarks/temperature_coverage.py [--machines 10000] [--steps 5] [--workers N]

Every machine is random, as are its chain, its scales' fixed points, their temperatures (15 to 30 °C), ramps to 3 K/h,
true coefficients (normal around what is stated, 1 ppm/K), and the deviations of the sensors (normal, 0.1 K): one
coefficient and one sensor for all axes, or three of each. Noise of 0.1 µm and 1 µrad. The table has the share of true
errors at the ends of travel that their intervals cover, and how wrong the same is evaluated without temperatures. The
exit code is 1 if a share is not within 94 to 96 %, beyond four binomial standard deviations.
"""

from __future__ import annotations

import argparse
import functools
import math
import multiprocessing
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "helpers"))

import numpy as np
import one_thread  # noqa: F401 (for what its import does)
from usual import ALL_CHAINS, DIAGONALS, SCALE_LINES, VOLUME

import stepdiag as sd

STATED, U_COEFFICIENT, U_SENSOR = 11.5e-6, 1e-6, 0.1
NOISE = sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6)
LOW, HIGH = 0.94, 0.96
ENDS = ("EXX", "EYY", "EZZ")
SENSORS = ("temperature_x", "temperature_y", "temperature_z")


def with_channels(run: sd.Measurement, channels: dict[str, np.ndarray]) -> sd.Measurement:
    kept = {name: values for name, values in run.channels.items() if not name.startswith("temperature")}
    return sd.Measurement(run.line, run.point, run.position, kept | channels)


def of_machine(steps: int, seed: int) -> tuple[bool, list[bool], float]:
    """Whether all axes share coefficient and sensor; by axis, whether the end of travel is covered; the largest
    deviation without temperatures, mm."""
    rng = np.random.default_rng([21, seed])
    in_common = bool(seed % 2)
    axes = 1 if in_common else 3

    def three(values: np.ndarray) -> np.ndarray:
        return np.broadcast_to(values, 3) if in_common else values

    fixed_point = rng.uniform(0.0, 1.0, 3) * VOLUME if seed % 3 == 0 else np.zeros(3)
    true = sd.Expansion(three(rng.normal(STATED, U_COEFFICIENT, axes)), fixed_point=fixed_point)
    scales = sd.ScaleTemperatures(true, three(rng.uniform(15.0, 30.0, axes)), three(rng.uniform(-3, 3, axes) / 3600.0))
    plan = sd.Plan(VOLUME, DIAGONALS, steps, scale_lines=SCALE_LINES)
    errors = sd.random_error_map(VOLUME, seed=seed, intervals=steps)
    chain = sd.Chain(ALL_CHAINS[seed % len(ALL_CHAINS)])
    noise = sd.Noise(distance=NOISE.distance, tilt=NOISE.tilt, seed=seed)
    run = sd.simulate(sd.Machine(chain, errors), plan, sd.Head(), noise=noise, seconds_per_reading=10.0, scales=scales)
    deviations = three(rng.normal(0.0, U_SENSOR, axes))
    channels = {name: run.channels[name] + d for name, d in zip(SENSORS, deviations, strict=True)}
    if in_common:
        channels = {"temperature": channels[SENSORS[0]]}
    known = sd.methods.KnownExpansion(
        sd.Expansion(np.full(3, STATED), fixed_point=fixed_point),
        np.full(3, U_COEFFICIENT),
        one_coefficient=in_common,
        sensor_uncertainty=U_SENSOR,
    )
    told = (with_channels(run, channels), plan, sd.Head(), chain)
    found = sd.methods.adjust(*told, uncertainty=NOISE, expansion=known, outlier_probability=0.0).calibration
    without = sd.methods.adjust(*told, uncertainty=NOISE, outlier_probability=0.0).calibration
    covered, wrong = [], 0.0
    for name in ENDS:
        position, value, uncertainty = found.functions[name]
        truth = errors.function(name, position[-1:])[0]
        covered.append(abs(value[-1] - truth) <= 1.959964 * uncertainty[-1])
        wrong = max(wrong, abs(without.functions[name][1][-1] - truth))
    return in_common, covered, wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=10_000)
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    start = time.monotonic()
    with multiprocessing.get_context("fork").Pool(given.workers) as pool:
        results = pool.map(functools.partial(of_machine, given.steps), range(given.machines), chunksize=20)
    good = True
    print("| coefficient, sensor | machines | covered, %: EXX | EYY | EZZ | µm wrong without: median, largest | |")
    print("|---|---|---|---|---|---|---|")
    for in_common, name in ((True, "one for all axes"), (False, "one for each")):
        of = [(covered, wrong) for common, covered, wrong in results if common == in_common]
        shares = np.mean([covered for covered, _ in of], axis=0)
        margin = 4.0 * math.sqrt(0.95 * 0.05 / len(of))
        fine = bool(np.all((shares >= LOW - margin) & (shares <= HIGH + margin)))
        good &= fine
        wrong = [1e3 * each for _, each in of]
        print(
            f"| {name} | {len(of)} | {' | '.join(f'{100 * share:.1f}' for share in shares)} | "
            f"{np.median(wrong):.1f}, {max(wrong):.1f} | {'as it must be' if fine else '**not as it must be**'} |"
        )
    print(f"\n{'all as it must be' if good else 'not all as it must be'}, {time.monotonic() - start:.0f} s")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
