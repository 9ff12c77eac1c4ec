"""Peak resident memory of a Monte Carlo run at 10^4 and 10^6 samples, which must not grow with the samples.

    ./run python benchmarks/memory.py [--samples 10000 1000000] [--threads 2] [--covariance]

Each run is a separate process: virtual calibrations of the demonstration (921 outputs), then their intervals. The exit
code is 1 if a run takes 5 % more than the first one. A covariance takes additional memory: partial sums of a tree, each
6.8 MB, in a number proportional to the logarithm of the samples.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import time

from million import virtual

import stepdiag as sd


def measure(samples: int, threads: int, covariance: bool) -> None:
    """Prints the peak resident memory of this process in MiB."""
    model = virtual("enhanced", "psd", 50)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start = time.monotonic()
    options = sd.montecarlo.StatisticsOptions(covariance=covariance)
    result = sd.montecarlo.run_monte_carlo(model, samples=samples, threads=threads, options=options)
    seconds = time.monotonic() - start
    assert result.samples == samples
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{peak:.1f} {before:.1f} {seconds:.1f}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, nargs="+", default=[10_000, 1_000_000])
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--covariance", action="store_true")
    parser.add_argument("--measure", action="store_true", help="this run itself")
    arguments = parser.parse_args()
    if arguments.measure:
        measure(arguments.samples[0], arguments.threads, arguments.covariance)
        return 0
    peaks = []
    for samples in arguments.samples:
        command = [
            sys.executable,
            __file__,
            "--measure",
            "--samples",
            str(samples),
            "--threads",
            str(arguments.threads),
        ]
        command += ["--covariance"] * arguments.covariance
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        peak, before, seconds = map(float, output.split())
        peaks.append(peak)
        print(
            f"{samples:>10} samples: peak {peak:.1f} MiB (before the run {before:.1f} MiB), {seconds:.1f} s", flush=True
        )
    return int(not arguments.covariance and max(peaks) > 1.05 * peaks[0])


if __name__ == "__main__":
    sys.exit(main())
