"""Time and memory of an evaluation by the number of runs: both are to grow in proportion to it.

    ./run python benchmarks/runs.py [--runs 20 60 200] [--steps 10] [--head ideal]... [--method adjustment]...

Repeated noisy runs of README's volume: four body diagonals and three scale lines, a set-up for each line of each run.
Each evaluation is a process of its own. Values of the machine have to be as near to the truth as their uncertainties
say, apart from the conventional method, which takes angular errors for errors of position. The exit code is 1 where
they are not, or where the processor time grows, from the fewest to the most runs, with more than their power 1.5.
"""

from __future__ import annotations

import argparse
import math
import resource
import subprocess
import sys
import time

import numpy as np

import stepdiag as sd

VOLUME, CHAIN = (800.0, 600.0, 500.0), "[w X' b Y Z t]"
LINES, SCALE_LINES = ["ppp", "npp", "pnp", "nnp"], ["p00", "0p0", "00p"]
BEAMS = [(0.0, 0.0), (12.0, 0.0), (0.0, 12.0), (12.0, 12.0)]
HEADS = {
    "ideal": sd.Head(),
    "psd": sd.Head("psd", psd_distance=200.0),
    "multi_beam": sd.Head("multi_beam", beam_offsets=BEAMS),
}
METHODS = ["adjustment", "enhanced", "conventional"]
LARGEST_POWER = 1.5  # a tape that leaves the cache takes longer
LARGEST_MISS = 6.0  # in standard uncertainties, of some hundred values
UNCERTAINTY = sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6, spot=1e-3)


def miss(calibration: sd.Calibration, truth: sd.ErrorMap) -> float:
    """The largest error of a value, in its standard uncertainties."""
    worst = 0.0
    for name, (position, value, uncertainty) in calibration.functions.items():
        known = uncertainty > 0.0
        error = np.abs(value - truth.function(name, position))[known]
        worst = max(worst, float((error / uncertainty[known]).max()))
    return worst


def measure(head: str, method: str, runs: int, steps: int) -> None:
    """Prints seconds, peak resident memory in MiB above that before, and the miss."""
    truth = sd.random_error_map(VOLUME, seed=1)
    plan = sd.Plan(VOLUME, LINES, steps, scale_lines=SCALE_LINES)
    noise = sd.Noise(UNCERTAINTY.distance, UNCERTAINTY.tilt, UNCERTAINTY.spot, seed=2)
    run = sd.simulate(sd.Machine(CHAIN, truth), plan, HEADS[head], repeats=runs, noise=noise)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start = time.process_time()
    if method == "adjustment":
        calibration = sd.methods.adjust(run, plan, HEADS[head], CHAIN, uncertainty=UNCERTAINTY).calibration
    else:
        calibration = sd.methods.evaluate(run, plan, HEADS[head], CHAIN, method=method, uncertainty=UNCERTAINTY)
    seconds = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 - before
    print(seconds, peak, 0.0 if method == "conventional" else miss(calibration, truth))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, nargs="+", default=[20, 60, 200])
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--head", action="append", choices=HEADS)
    parser.add_argument("--method", action="append", choices=METHODS)
    parser.add_argument("--measure", action="store_true", help="this run itself")
    arguments = parser.parse_args()
    if arguments.measure:
        measure(arguments.head[0], arguments.method[0], arguments.runs[0], arguments.steps)
        return 0
    sound = True
    print("| head | method | runs | seconds | power of runs | MiB | largest error, u |")
    print("| - | - | - | - | - | - | - |")
    for head in arguments.head or HEADS:
        for method in arguments.method or METHODS:
            first: tuple[int, float] | None = None
            power = math.nan
            for runs in sorted(arguments.runs):
                command = [sys.executable, __file__, "--measure", "--runs", str(runs), "--steps", str(arguments.steps)]
                command += ["--head", head, "--method", method]
                output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
                seconds, mebibytes, missed = map(float, output.split())
                if first:
                    power = math.log(seconds / first[1]) / math.log(runs / first[0])
                print(f"| {head} | {method} | {runs} | {seconds:.3f} | {power:.2f} | {mebibytes:.0f} | {missed:.1f} |")
                sound = sound and missed <= LARGEST_MISS
                first = first or (runs, seconds)
            sound = sound and not power > LARGEST_POWER
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
