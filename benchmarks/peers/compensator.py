"""Compares the compensator with NumPy and with a trilinear table.

The trilinear table (trilinear.c) has the errors for one tool at nodes in space. NumPy computes the
error vector from the same 18 tables by numpy.interp: 1,000 positions at once, to first order and
exactly, and one position at a time as for a controller. Times are in ns of one thread's processor
time per error vector, measured in one run with benchmarks/compensator.cpp.
"""

import argparse
import importlib
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np  # reads the variables above
from peers import run_own

ROOT = Path(__file__).resolve().parents[2]
VOLUME, TOOL, CHAIN = np.array([800.0, 600.0, 500.0]), np.array([5.0, -3.0, 80.0]), "[w X' b Y Z t]"
POINTS = 1000


class Tables:
    """18 functions by numpy.interp; X' carries the workpiece, Y and Z the tool."""

    def __init__(self, errors: Any) -> None:
        functions, self.squareness = errors.functions, errors.squareness
        self.functions = [[functions[f"E{component}{axis}"] for component in "XYZABC"] for axis in "XYZ"]

    def look_up(self, positions: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """delta (n, 3) and theta (n, 3) of each axis."""
        deltas, thetas = [], []
        for axis in range(3):
            values = [np.interp(positions[:, axis], *function) for function in self.functions[axis]]
            deltas.append(np.stack(values[:3], axis=1))
            thetas.append(np.stack(values[3:], axis=1))
        deltas[1][:, 0] -= self.squareness["C0Y"] * positions[:, 1]
        deltas[2][:, 0] += self.squareness["B0Z"] * positions[:, 2]
        deltas[2][:, 1] -= self.squareness["A0Z"] * positions[:, 2]
        return deltas, thetas

    def first_order(self, positions: np.ndarray) -> np.ndarray:
        deltas, thetas = self.look_up(positions)
        lever_y = TOOL + positions * [0.0, 0.0, 1.0]
        error = deltas[0] + deltas[1] + deltas[2] + np.cross(thetas[0], TOOL + positions)
        return error + np.cross(thetas[1], lever_y) + np.cross(thetas[2], TOOL)

    def exact(self, positions: np.ndarray) -> np.ndarray:
        deltas, thetas = self.look_up(positions)
        x, y, z = (positions[:, [axis]] * np.eye(3)[axis] + deltas[axis] for axis in range(3))
        rotated = turned(thetas[0], x + y + turned(thetas[1], z + turned(thetas[2], np.broadcast_to(TOOL, z.shape))))
        return rotated - positions - TOOL


def turned(theta: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Exp(theta) v by Rodrigues' formula."""
    angle = np.linalg.norm(theta, axis=1, keepdims=True)
    sine, versine = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2
    once = np.cross(theta, v)
    return v + sine * once + versine * np.cross(theta, once)


def cpu_time(job: Callable[[], Any], count: int, repeats: int = 7) -> float:
    """Time in ns for each of `count` results: the fastest of several repetitions of at least 50 ms."""
    times = []
    for _ in range(repeats):
        start, rounds = time.process_time(), 0
        while rounds == 0 or time.process_time() - start < 0.05:
            job()
            rounds += 1
        times.append((time.process_time() - start) / rounds / count)
    return 1e9 * min(times)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=ROOT / "build/release/benchmarks", help="bench_compensator's")
    build = parser.parse_args().build
    sys.path.insert(0, str(ROOT / "python"))
    core = importlib.import_module("stepdiag._core")

    errors = core.random_error_map(VOLUME, seed=0)  # as in benchmarks/compensator.cpp
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/table.csv"
        errors.write(path, chain=CHAIN, volume=VOLUME, tool=TOOL)
        compensator = core.Compensator(path, CHAIN)
    tables = Tables(errors)
    positions = np.random.default_rng(1).uniform(0.0, VOLUME, (POINTS, 3))
    own = compensator.error(positions)
    exact, first = (float(np.abs(other(positions) - own).max()) for other in (tables.exact, tables.first_order))
    # Positions of 1,000 mm are rounded to 1e-13 mm. The second order is about 60 urad times 100 um.
    if not (exact < 5e-12 and first < 5e-5):
        sys.exit(f"NumPy's errors are not ours: {exact:.1e} mm, to first order {first:.1e} mm")

    measured = run_own(build / "bench_compensator", 0.2)

    def ns(name: str) -> float:
        """Time of one position."""
        rate = measured[name].get("items_per_second")
        return 1e9 / float(rate) if rate else float(measured[name]["cpu_time"])

    def trilinear(nodes: int) -> list[tuple[str, float, str]]:
        of_table = measured[f"trilinear_at_once/{nodes}"]
        size = 24 * nodes**3 / 1000
        off = f"off by {of_table['rms']:.1e} mm rms, {of_table['largest']:.1e} at most"
        return [
            (f"trilinear, {nodes} nodes, one at a time", ns(f"trilinear/{nodes}"), f"{size:.0f} kB"),
            (f"trilinear, {nodes} nodes, many at once", ns(f"trilinear_at_once/{nodes}"), off),
        ]

    vector = ns("error_vector")
    one = positions[:1]
    rows = [
        ("stepdiag, error vector", vector, "one position after the other, exact"),
        ("stepdiag, with orientation", ns("error"), "and the rotation vector of the tool"),
        ("stepdiag, command", ns("command"), "the compensated position, to 1e-10 mm"),
        ("stepdiag, many errors at once", ns("errors_at_once/50"), "exact, each with its status"),
        ("  its floor", ns("floor/50"), f"loads and exact pose alone; ratio {measured['floor/50']['ratio']:.2f}"),
        ("stepdiag, many commands at once", ns("commands_at_once/50"), "to 1e-10 mm, each with its status"),
        ("stepdiag, Python, 1,000 at once", cpu_time(lambda: compensator.error(positions), POINTS), "exact"),
        (
            "stepdiag, Python, 1,000 commands",
            cpu_time(lambda: compensator.command(positions), POINTS),
            "to 1e-10 mm",
        ),
        ("stepdiag, Python, one at a time", cpu_time(lambda: compensator.error(one), 1), "most of it is the call"),
        *trilinear(9),
        *trilinear(51),
        (f"NumPy {np.__version__}, interp alone", cpu_time(lambda: tables.look_up(positions), POINTS), "18 tables"),
        (
            "  first order, 1,000 at once",
            cpu_time(lambda: tables.first_order(positions), POINTS),
            f"off by {first:.0e} mm",
        ),
        ("  exact, 1,000 at once", cpu_time(lambda: tables.exact(positions), POINTS), f"off by {exact:.0e} mm"),
        ("  exact, one at a time", cpu_time(lambda: tables.exact(one), 1), "what a controller would ask"),
    ]
    print(f"{'ns an error vector':36}{'ns':>10}{'ratio':>9}  what it does")
    for name, ns, does in rows:
        print(f"{name:36}{ns:10.1f}{ns / vector:9.1f}  {does}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
