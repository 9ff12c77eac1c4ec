"""Compares complete virtual calibrations by stepdiag with parts of them by other packages.

NumPy calculates the linear model with noise only, raysect the traces only. Times are in us of one thread's processor
time per calibration. The plan is that of benchmarks/uncertainty.cpp: four body diagonals at 50 steps and three scale
lines, 610 poses. NumPy multiplies the gain of the enhanced evaluation (900 values by 1,830 readings) by normal
numbers, without set-ups, traces and second-order effects. raysect traces the beams of a head, without evaluation.
"""

import argparse
import importlib
import math
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np  # reads the variables above
from peers import INTERACTIONS, Raysect, run_own

ROOT = Path(__file__).resolve().parents[2]
VOLUME, STEPS = (800.0, 600.0, 500.0), 50
DIAGONALS, SCALE_LINES = ["ppp", "npp", "pnp", "nnp"], ["p00", "0p0", "00p"]
SIGMA = {"distance": 0.1e-3, "alpha": 1e-6, "beta": 1e-6, "spot_x": 1e-3, "spot_y": 1e-3}


class Row(NamedTuple):
    """A line of the table: us per calibration."""

    name: str
    one_beam: float
    layout_b: float
    does: str


def cpu_time(job: Callable[[], float], repeats: int = 3) -> float:
    """Time in us for each item of the job, which returns their number: the fastest of several repetitions."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        done = job()
        times.append((time.process_time() - start) / done)
    return 1e6 * min(times)


class Linear:
    """y = y0 + A e: noise e of every reading, and gain A of the enhanced evaluation."""

    def __init__(self, core: Any, layout: str) -> None:
        errors = core.random_error_map(VOLUME, seed=1)
        machine = core.Machine("[w X' b Y Z t]", errors)
        plan = core.Plan(VOLUME, DIAGONALS, STEPS, scale_lines=SCALE_LINES)
        head = core.Head(layout, psd_distance=50.0) if layout == "psd" else core.Head(layout)
        run = core.simulate(machine, plan, head)
        evaluator = core.BatchEvaluator(run, plan, head, machine.chain)
        gain = evaluator.gain()
        self.gain = gain.reshape(gain.shape[0], -1)
        self.sigma = np.tile([SIGMA[name] for name in head.signals], gain.shape[1])
        self.nominal = evaluator.evaluate(np.stack([run.channels[name] for name in head.signals], axis=1)[np.newaxis])[
            0
        ]
        noise = [
            core.ReadingNoise("channel", core.Distribution(spread=SIGMA[name]), channel=name) for name in head.signals
        ]
        self.own = core.VirtualCalibrations(machine, plan, head, core.UncertainInputs([], noise), seed=1)
        self.rng = np.random.default_rng(1)

    def samples(self, count: int) -> np.ndarray:
        noise = self.rng.standard_normal((self.sigma.size, count))
        return self.nominal[:, np.newaxis] + self.gain @ (self.sigma[:, np.newaxis] * noise)

    def check(self, count: int = 4000) -> float:
        """Largest relative difference of a standard uncertainty from that of stepdiag with noise only."""
        u = np.std(self.samples(count), axis=1)
        own = np.std(self.own.evaluate(0, count), axis=1)
        known = own > 1e-15
        return float(np.max(np.abs(u[known] / own[known] - 1.0)))

    def numbers_and_product(self) -> float:
        count = 2000
        return self.samples(count).shape[1]

    def with_statistics(self) -> float:
        """Mean, standard deviation and ends of the symmetric interval, from stored samples."""
        values = self.samples(10_000)
        values.mean(axis=1), values.std(axis=1), np.quantile(values, [0.025, 0.975], axis=1)
        return values.shape[1]


class OneBeam:
    """raysect: a beam to a moving mirror and back to a plane, with two interactions per pose."""

    def __init__(self) -> None:
        from raysect.core import AffineMatrix3D, Point3D, Vector3D, translate
        from raysect.optical import Ray, World
        from raysect.optical.material import AbsorbingSurface
        from raysect.optical.material.debug import PerfectReflectingSurface
        from raysect.primitive import Box

        self.world = World()
        low, high = Point3D(-50, -50, 0), Point3D(50, 50, 1)
        self.mirror = Box(low, high, parent=self.world, material=PerfectReflectingSurface())
        Box(low, high, parent=self.world, material=AbsorbingSurface(), transform=translate(0, 0, -2))
        self.poses = []
        for i in range(610):
            x, y = 0.7e-4 * math.sin(1.7 * i), 0.7e-4 * math.cos(2.3 * i)
            rows = [[1, 0, x, 0], [0, 1, y, 0], [-x, -y, 1, 300.0 + 2 * i], [0, 0, 0, 1]]
            self.poses.append(AffineMatrix3D(rows))
        settings = {"min_wavelength": 1529, "max_wavelength": 1531, "bins": 1, "extinction_prob": 0.0, "max_depth": 60}
        self.ray = lambda: Ray(Point3D(0, 0, 0), Vector3D(0, 0, 1), **settings)

    def calibration(self) -> float:
        for pose in self.poses:
            self.mirror.transform = pose
            ray = self.ray()
            ray.trace(self.world)
            if ray.ray_count != 2:
                sys.exit(f"raysect: expected two interactions, got {ray.ray_count}")
        return 1


def own_rows(build: Path) -> list[Row]:
    """Complete calibrations, their parts, and the statistics of all parameters."""
    results = run_own(build / "bench_uncertainty", 0.5)

    def row(part: str, name: str, does: str) -> Row:
        each = {
            layout: next(1e6 / r["calibrations/s"] for key, r in results.items() if key.startswith(f"{part}/{layout}"))
            for layout in ("one_beam", "layout_b")
        }
        return Row(name, each["one_beam"], each["layout_b"], does)

    return [
        row("with_statistics", "stepdiag, with statistics", "draws, traces, evaluates; u and intervals of all values"),
        row("virtual_calibrations", "stepdiag, calibrations", "draws, traces, evaluates"),
        row("part/random_numbers", "  of that random numbers", "set-ups and 1,830 normal numbers"),
        row("part/trace", "  of that traces", "by replay, 610 poses; spot and distance"),
        row("part/evaluation", "  of that evaluation", "reduction, 900 values"),
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=ROOT / "build/release/benchmarks", help="bench_uncertainty's")
    build = parser.parse_args().build
    sys.path.insert(0, str(ROOT / "python"))
    core = importlib.import_module("stepdiag._core")

    from importlib.metadata import version

    rows = own_rows(build)
    linear = {layout: Linear(core, layout) for layout in ("ideal", "psd")}
    for layout, model in linear.items():
        # With 4,000 samples, the quotient of two standard deviations scatters by 1.6 %. For 900 values, the limit is
        # six times that.
        if (difference := model.check()) > 0.1:
            sys.exit(f"NumPy's uncertainties of {layout} are not ours: {difference:.1%}")
    numpy = f"NumPy {version('numpy')}"
    rows += [
        Row(
            f"{numpy}, linear",
            *(cpu_time(model.numbers_and_product) for model in linear.values()),
            "normal numbers times a matrix of 900 x 1,830",
        ),
        Row(
            f"{numpy}, with statistics",
            *(cpu_time(model.with_statistics) for model in linear.values()),
            "and mean, u, ends of 95 %; keeps all samples",
        ),
    ]
    one_beam, head = OneBeam(), Raysect()
    moving = head.times()[1] * INTERACTIONS * 610 / 1000.0
    rows.append(
        Row(
            f"raysect {version('raysect')}, traces",
            cpu_time(one_beam.calibration),
            moving,
            "a mirror that moves; of layout b one beam of 12 interactions",
        )
    )
    print(f"{'us a virtual calibration':30}{'one beam':>12}{'layout b':>12}  what it does")
    for row in rows:
        print(f"{row.name:30}{row.one_beam:12.1f}{row.layout_b:12.1f}  {row.does}")
    whole = rows[0]
    print()
    for row in rows[5:]:
        print(
            f"{row.name:30}takes {row.one_beam / whole.one_beam:.1f} and {row.layout_b / whole.layout_b:.1f} times "
            "what stepdiag takes for all, statistics included"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
