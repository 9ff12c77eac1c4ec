"""Covariance of a million virtual calibrations with noise only, compared with linear propagation.

    ./run python benchmarks/million.py [--samples 1000000] [--method enhanced]... [--layout ideal]... [--steps 50]

For each method and layout it prints rate, memory, and the largest deviation of a standard uncertainty (limit 0.5 %) and
of a correlation (limit 0.01). For n samples they scatter by 1/sqrt(2 n), which is 0.07 % for a million, and by
(1 - r^2)/sqrt(n), which is 0.001. The largest of hundreds of thousands of deviations is five times as large. The exit
code is 1 if a limit is exceeded.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time

import numpy as np

import stepdiag as sd
from stepdiag import _core

VOLUME = (800.0, 600.0, 500.0)
DIAGONALS = ["ppp", "npp", "pnp", "nnp"]
SCALE_LINES = ["p00", "0p0", "00p"]
NOISE = {"alpha": 1e-6, "beta": 1e-6, "spot_x": 1e-3, "spot_y": 1e-3}  # mm, rad; distances 0.1 um
METHODS = ["conventional", "enhanced", "adjustment", "one_step"]
HEADS = {
    "ideal": sd.Head(),
    "psd": sd.Head("psd", psd_distance=50.0),
    "multi_beam": sd.Head("multi_beam", beam_offsets=[[0, 0], [20, 0], [0, 20]]),
}
ALLOWED_UNCERTAINTY, ALLOWED_CORRELATION = 0.005, 0.01


def virtual(method: str, layout: str, steps: int, seed: int = 1) -> _core.VirtualCalibrations:
    """The demonstration's machine with a mirror misaligned by 300 urad and noise on every channel."""
    head = HEADS[layout]
    errors = sd.random_error_map(VOLUME, seed=7, intervals=steps)
    noise = [
        _core.ReadingNoise("channel", _core.Distribution("normal", spread=NOISE.get(name, 1e-4)), channel=name)
        for name in head.signals
    ]
    return _core.VirtualCalibrations(
        sd.Machine("[w X' b Y Z t]", errors),
        sd.Plan(VOLUME, DIAGONALS, steps, scale_lines=SCALE_LINES),
        head,
        _core.UncertainInputs([], noise),
        method=method,
        seed=seed,
        misalignment=dict.fromkeys(DIAGONALS, sd.Misalignment((1e-4, 3e-4))),
    )


def correlations(covariance: np.ndarray, moves: np.ndarray) -> np.ndarray:
    part = covariance[np.ix_(moves, moves)]
    u = np.sqrt(np.diag(part))
    return np.asarray(part / np.outer(u, u))


def compare(calibrations: _core.VirtualCalibrations, samples: int, threads: int) -> tuple[float, float, float]:
    """Largest relative deviation of u, largest deviation of a correlation, time in s."""
    expected = _core.propagate(calibrations, covariance=True)
    options = _core.StatisticsOptions(covariance=True)
    start = time.monotonic()
    bins = _core.make_bins(calibrations, options, threads)
    result = _core.run_leaves(calibrations, bins, 0, -(-samples // _core.leaf_samples), threads=threads).result()
    seconds = time.monotonic() - start
    covariance = np.asarray(expected.covariance)
    u = np.asarray(expected.standard_uncertainty)
    angle = np.array([o.unit == "rad" for o in calibrations.outputs])
    # Values that are 0 by the choice of frame vary by rounding only.
    moves = u > np.where(angle, 1e-12, 1e-9)
    found = np.sqrt(np.diag(np.asarray(result.covariance)))
    assert np.allclose(found, result.standard_uncertainty, rtol=1e-6, atol=1e-15)
    deviation = float(np.max(np.abs(found[moves] / u[moves] - 1.0)))
    difference = correlations(np.asarray(result.covariance), moves) - correlations(covariance, moves)
    return deviation, float(np.max(np.abs(difference))), seconds


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--steps", type=int, default=50)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--method", action="append", choices=METHODS)
    parser.add_argument("--layout", action="append", choices=list(HEADS))
    given = parser.parse_args()
    too_far = False
    print(f"{given.samples} samples of noise only, {given.steps} steps an axis, statistics with full covariance")
    for method in given.method or ["enhanced"]:
        for layout in given.layout or ["ideal"]:
            calibrations = virtual(method, layout, given.steps)
            u, r, seconds = compare(calibrations, given.samples, given.threads)
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            count = len(calibrations.outputs)
            print(
                f"{method}, {layout}: {count} outputs, {seconds:.1f} s, {given.samples / seconds:.0f} a second with "
                f"full covariance, peak memory {memory:.0f} MB; u off by at most {100 * u:.3f} %, "
                f"correlations by at most {r:.5f}",
                flush=True,
            )
            too_far = too_far or u > ALLOWED_UNCERTAINTY or r > ALLOWED_CORRELATION
    return 1 if too_far else 0


if __name__ == "__main__":
    sys.exit(main())
