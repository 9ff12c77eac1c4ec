"""Time and errors of the exact adjustment by stepdiag, Ceres, and two methods with SciPy.

The run is that of benchmarks/adjustment_run.hpp, without noise. The unknowns are the 18 functions and 3 squarenesses at
all nodes, and reflector, laser and distance constant of the set-ups. All programs start from zero. Times are processor
time of one thread, ms.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np  # reads the variables above
import scipy
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu

import stepdiag

VOLUME = np.array([800.0, 600.0, 500.0])
MISALIGNED = {  # reflector, laser
    "ppp": ((1e-3, -0.5e-3), (0.4e-3, 0.8e-3)),
    "npp": ((-0.7e-3, 0.2e-3), (-0.9e-3, 0.1e-3)),
    "pnp": ((0.3e-3, 0.6e-3), (0.2e-3, -1e-3)),
    "nnp": ((-0.1e-3, -0.8e-3), (-0.3e-3, 0.5e-3)),
}
SCALE_LINES = ("p00", "0p0", "00p")
STANDOFF = 100.0
UNCERTAINTY = np.array([1e-4, 1e-6, 1e-6])  # distance, alpha, beta


class Answer(NamedTuple):
    """Largest errors of a node's translation (mm) and rotation (rad), and the time, ms."""

    translation: float
    rotation: float
    time: float


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i", a, b)


def rotation(vector: np.ndarray) -> np.ndarray:
    """Exp of small rotation vectors, also complex ones, to eighth order: relative error 1e-24 for a milliradian."""
    square = dot(vector, vector)[..., None, None]
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    cross = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), (0, 1), (-2, -1))
    sine = 1 - square / 6 * (1 - square / 20 * (1 - square / 42))
    versine = 0.5 - square / 24 * (1 - square / 30 * (1 - square / 56))
    return np.eye(3) + sine * cross + versine * (cross @ cross)


class Problem:
    """Readings of a run, and their model for errors of the nodes and set-ups, vectorised with NumPy."""

    def __init__(self, steps: int) -> None:
        self.steps = steps
        plan = stepdiag.Plan(VOLUME, list(MISALIGNED), steps, scale_lines=list(SCALE_LINES))
        self.map = stepdiag.random_error_map(VOLUME, seed=0)
        machine = stepdiag.Machine("[w X' b Y Z t]", self.map)
        misalignment = {line: stepdiag.Misalignment(*pair) for line, pair in MISALIGNED.items()}
        run = stepdiag.simulate(machine, plan, stepdiag.Head(standoff=STANDOFF), misalignment=misalignment)
        lines = [*MISALIGNED, *SCALE_LINES]
        self.setup = np.array([lines.index(line) for line in run.line])
        self.commanded = np.asarray(run.position)
        self.node = np.rint(self.commanded / VOLUME * steps).astype(int)
        self.frame = np.array([plan.frame(line) for line in lines])
        first = np.array([self.commanded[self.setup == i][0] for i in range(len(lines))])
        self.origin = first - STANDOFF * self.frame[:, :, 2]
        self.reading = np.column_stack([run.channels[name] for name in ("distance", "alpha", "beta")])
        self.used = np.ones_like(self.reading, dtype=bool)
        self.used[self.setup >= len(MISALIGNED), 1:] = False  # scale lines: distances only
        self._number_unknowns(len(lines))
        self._make_pattern()

    def _number_unknowns(self, lines: int) -> None:
        """Indices of the unknowns: six errors of a node; reflector, laser, distance constant of a set-up; -1: known."""
        free = np.ones((3, self.steps + 1, 6), dtype=bool)
        free[:, 0] = False  # home
        free[0, -1, 1:3] = free[1, -1, 2] = False  # the choice of frame: EYX, EZX and EZY are 0 at the end of travel
        free_setup = np.ones((lines, 5), dtype=bool)
        free_setup[len(MISALIGNED) :, :4] = False
        self.node_unknown = np.full(free.shape, -1)
        self.node_unknown[free] = np.arange(free.sum())
        self.setup_unknown = np.full(free_setup.shape, -1)
        self.setup_unknown[free_setup] = free.sum() + np.arange(free_setup.sum())
        self.size = int(free.sum() + free_setup.sum())

    def _make_pattern(self) -> None:
        """Each reading depends on one node of every axis and one set-up: 23 columns, some of them known."""
        nodes = [self.node_unknown[a, self.node[:, a]] for a in range(3)]
        columns = np.concatenate([*nodes, self.setup_unknown[self.setup]], axis=1)
        columns = np.broadcast_to(columns[:, None, :], (*self.reading.shape, 23))[self.used]
        self.known = columns < 0
        self.columns = columns[~self.known]
        self.row_ends = np.concatenate([[0], np.cumsum((~self.known).sum(axis=1))])

    def unpack(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Errors of the nodes and of the set-ups."""
        padded = np.append(x, 0.0)  # the 0 at index -1 is for known values
        return padded[self.node_unknown], padded[self.setup_unknown]

    def model(self, nodes: np.ndarray, setups: np.ndarray) -> np.ndarray:
        """Distance, alpha and beta of every point: pose of the chain, then the mirror seen from the head."""
        position: Any = 0.0
        turn: Any = np.eye(3)
        for axis in range(3):
            errors = nodes[axis, self.node[:, axis]]
            shift = errors[:, :3] + self.commanded[:, axis, None] * np.eye(3)[axis]
            if axis == 0:  # the axis that carries the workpiece
                turn = rotation(errors[:, 3:])
                position = (turn @ shift[:, :, None])[:, :, 0]
            else:
                position = position + (turn @ shift[:, :, None])[:, :, 0]
                turn = turn @ rotation(errors[:, 3:])

        def angles(pair: np.ndarray) -> np.ndarray:
            return rotation(np.concatenate([pair, np.zeros_like(pair[:, :1])], axis=1))

        mirror = (self.frame @ angles(setups[:, :2]))[self.setup, :, 2]
        sensor = (self.frame @ angles(setups[:, 2:4]))[self.setup]
        normal = ((turn @ mirror[:, :, None]).transpose(0, 2, 1) @ sensor)[:, 0]
        seen = ((position - self.origin[self.setup])[:, None, :] @ sensor)[:, 0]
        alpha, beta = -normal[:, 1] / normal[:, 2], normal[:, 0] / normal[:, 2]
        length = seen[:, 2] + beta * seen[:, 0] - alpha * seen[:, 1]
        distance = length / (1 - alpha**2 - beta**2) + setups[self.setup, 4]
        return np.column_stack([distance, alpha, beta])

    def residuals(self, x: np.ndarray) -> np.ndarray:
        return ((self.model(*self.unpack(x)) - self.reading) / UNCERTAINTY)[self.used]

    def jacobian(self, x: np.ndarray) -> csr_matrix:
        """Exact derivatives by complex steps: imaginary parts of 23 evaluations, one for each column."""
        nodes, setups = (part.astype(complex) for part in self.unpack(x))
        tiny = 1e-30
        by_column = np.empty((*self.reading.shape, 23))
        for column in range(23):
            part, place = (nodes, np.s_[column // 6, :, column % 6]) if column < 18 else (setups, np.s_[:, column - 18])
            part[place] += 1j * tiny
            by_column[:, :, column] = self.model(nodes, setups).imag / tiny
            part[place] = part[place].real
        values = (by_column / UNCERTAINTY[:, None])[self.used][~self.known]
        return csr_matrix((values, self.columns, self.row_ends), shape=(int(self.used.sum()), self.size))

    def answer(self, x: np.ndarray, seconds: float) -> Answer:
        """Compares the node values with the machine's errors, including squareness terms."""
        nodes, _ = self.unpack(x)
        worst = np.zeros(2)
        for axis, name in enumerate("XYZ"):
            position = np.arange(self.steps + 1) / self.steps * VOLUME[axis]
            for component, letter in enumerate(["EX", "EY", "EZ", "EA", "EB", "EC"]):
                truth = self.map.function(letter + name, position)
                for squareness, where, sign in (("C0Y", (1, 0), -1), ("B0Z", (2, 0), 1), ("A0Z", (2, 1), -1)):
                    if where == (axis, component):
                        truth = truth + sign * self.map.squareness[squareness] * position
                largest = float(np.abs(nodes[axis, :, component] - truth).max())
                worst[component // 3] = max(worst[component // 3], largest)
        return Answer(float(worst[0]), float(worst[1]), 1e3 * seconds)


def gauss_newton(problem: Problem) -> np.ndarray:
    """Normal equations with scaled columns, solved by SuperLU. Stops when the steps no longer become smaller."""
    x = np.zeros(problem.size)
    before = math.inf
    while True:
        jacobian = problem.jacobian(x).tocsc()
        scale = 1.0 / np.sqrt(jacobian.multiply(jacobian).sum(axis=0).A1)
        jacobian = jacobian.multiply(scale[None, :]).tocsc()
        normal = (jacobian.T @ jacobian).tocsc()
        factor = splu(normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        step = factor.solve(jacobian.T @ problem.residuals(x))
        x -= scale * step
        size = float(np.abs(step).max())
        if size > 0.25 * before:
            return x
        before = size


def trust_region(problem: Problem) -> np.ndarray:
    """scipy.optimize.least_squares, which uses LSMR for sparse derivatives. Scales of a million times those of the
    columns make the first trust region large enough for Gauss-Newton steps: 1, 1e-1, 1e-6, 1e-11; the last one is
    rounding."""
    start = np.zeros(problem.size)
    jacobian = problem.jacobian(start)
    found = least_squares(
        problem.residuals,
        start,
        problem.jacobian,
        x_scale=1e6 / np.sqrt(jacobian.multiply(jacobian).sum(axis=0).A1),
        ftol=None,
        gtol=None,
        xtol=1e-9,
        tr_solver="lsmr",
        tr_options={"atol": 1e-8, "btol": 1e-8, "maxiter": 20 * problem.size},
    )
    return np.asarray(found.x)


def timed(job: Callable[[Problem], np.ndarray], steps: int, repeats: int) -> Answer:
    problem = Problem(steps)
    times = []
    for _ in range(repeats):
        start = time.process_time()
        x = job(problem)
        times.append(time.process_time() - start)
    return problem.answer(x, min(times))


def run_benchmark(executable: Path, leave_out: str) -> dict[str, dict[str, Any]]:
    """Results of a benchmark executable by name: the fastest of several repetitions."""
    command = [executable, "--benchmark_format=json", "--benchmark_repetitions=5", "--benchmark_min_time=0.2"]
    command.append(f"--benchmark_filter=-{leave_out}")
    output = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout
    fastest: dict[str, dict[str, Any]] = {}
    for result in json.loads(output)["benchmarks"]:
        name = result["run_name"].removeprefix("slow/").split("/iterations")[0]
        if result["run_type"] == "iteration" and (
            name not in fastest or result["cpu_time"] < fastest[name]["cpu_time"]
        ):
            fastest[name] = result
    return fastest


class Row(NamedTuple):
    """A line of the table, ms; None if it is not measured."""

    name: str
    unknowns: list[float | None]
    variances: list[float | None]
    errors: tuple[float, float] | None


def own_rows(build: Path) -> list[Row]:
    found = run_benchmark(build / "bench_adjustment", "defaults|exponent|/(100|200|500)$")

    def ms(name: str) -> list[float | None]:
        return [float(found[f"{name}/{steps}"]["cpu_time"]) for steps in (50, 1000)]

    whole = found["adjusted/three_quantities/50"]
    return [
        Row("stepdiag, block-band solver", ms("solve"), ms("variances"), None),
        Row("stepdiag, adjust(), with all", ms("adjusted/three_quantities"), [0.0, 0.0], (whole["mm"], whole["rad"])),
    ]


def ceres_row(build: Path, long: bool) -> Row:
    found = run_benchmark(build / "bench_adjustment_ceres", "nothing" if long else "slow/")

    def ms(name: str) -> list[float | None]:
        return [found[key]["cpu_time"] if (key := f"{name}/{steps}") in found else None for steps in (50, 1000)]

    return Row("Ceres 2.1", ms("solve"), ms("variances"), (found["solve/50"]["mm"], found["solve/50"]["rad"]))


def scipy_row(name: str, job: Callable[[Problem], np.ndarray], repeats: int, long: bool) -> Row:
    small = timed(job, 50, repeats)
    large = timed(job, 1000, 1).time if long else None
    return Row(name, [small.time, large], [None, None], (small.translation, small.rotation))


def cell(value: float | None) -> str:
    return "-" if value is None else "in it" if value == 0.0 else f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def ratios(row: Row, own: Row) -> str:
    def of(values: list[float | None], best: list[float | None]) -> str:
        return ", ".join("-" if v is None or not b else f"{v / b:.1f}" for v, b in zip(values, best, strict=True))

    return f"{row.name:38} takes {of(row.unknowns, own.unknowns)} times as long, for variances " + (
        f"{of(row.variances, own.variances)}" if row.variances[0] else "nothing ready"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=Path("build/release/benchmarks"), help="folder of the benchmarks")
    parser.add_argument("--long", action="store_true", help="also what takes minutes")
    arguments = parser.parse_args()

    rows = own_rows(arguments.build)
    if (arguments.build / "bench_adjustment_ceres").exists():
        rows.append(ceres_row(arguments.build, arguments.long))
    else:
        print("without Ceres: it was not found when the benchmarks were built", file=sys.stderr)
    version = scipy.__version__
    rows.append(scipy_row(f"NumPy, SuperLU of SciPy {version}", gauss_newton, 3, True))
    rows.append(scipy_row(f"SciPy {version}, least_squares, LSMR", trust_region, 3, arguments.long))

    print(f"{'ms, of one thread':38}{'unknowns':^20}{'their variances':^20}{'largest error at 50 steps':^28}")
    print(f"{'steps per axis':38}{'50':>10}{'1000':>10}{'50':>10}{'1000':>10}{'mm':>16}{'rad':>12}")
    for row in rows:
        errors = f"{row.errors[0]:16.1e}{row.errors[1]:12.1e}" if row.errors else f"{'as below':>28}"
        print(f"{row.name:38}" + "".join(f"{cell(v):>10}" for v in [*row.unknowns, *row.variances]) + errors)
    print()
    for row in rows[2:]:
        print(ratios(row, rows[0]))
    if any(row.errors and (row.errors[0] > 2e-11 or row.errors[1] > 1e-13) for row in rows):
        sys.exit("an answer is not the truth")  # floor of double precision, benchmarks/adjustment_run.hpp
    return 0


if __name__ == "__main__":
    sys.exit(main())
