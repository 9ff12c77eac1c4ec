"""Traces one beam with stepdiag, raysect and optiland, and compares times and results.

The scene is that of benchmarks/peers.cpp: a ray from a laser through a cube beam splitter (N-BK7 at 1530 nm) and a
window to a mirror, and back over the splitting face to a position sensing device, with 12 interactions. The mirror
moves from 0.3 to 1.5 m in 604 poses, tilted by up to 1 mrad. Times are in ns of one thread's processor time per
interaction.
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

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", NUMBA_NUM_THREADS="1")

import numpy as np  # reads the variables above

POSES, INTERACTIONS = 604, 12
FIXED = POSES // 2  # pose of the fixed mirror
AIR, GLASS = 1.000268, 1.500902


class Answer(NamedTuple):
    """Optical path from the source to the sensor, and position of the spot, mm."""

    path: float
    y: float
    z: float


class Row(NamedTuple):
    """A line of the table: ns per interaction, and the largest difference of a result from stepdiag's ray tree, mm."""

    name: str
    fixed: float
    moving: float
    difference: float | None
    does: str


def mirror_pose(i: int) -> tuple[np.ndarray, np.ndarray]:
    """Centre of the mirror, and its axes as columns; the last one is the normal."""
    alpha, beta = 0.7e-3 * math.sin(1.7 * i), 0.7e-3 * math.cos(2.3 * i)
    point = np.array([1.4 * math.sin(0.9 * i), 2.1 * math.cos(1.3 * i), 300.0 + 1200.0 * i / (POSES - 1)])
    normal = np.array([beta, -alpha, 1.0])
    normal /= np.linalg.norm(normal)
    x = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
    x /= np.linalg.norm(x)
    return point, np.column_stack([x, np.cross(normal, x), normal])


def cpu_time(job: Callable[[], float], repeats: int = 5) -> float:
    """Time in ns for each item of the job, which returns their number: the fastest of several repetitions."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        done = job()
        times.append((time.process_time() - start) / done)
    return 1e9 * min(times)


class Raysect:
    """Compiled materials of raysect.optical only: a transmitting dielectric, a perfect mirror, and for the splitting
    face a blend of mirror and nothing, which chooses at random. It is 1 um thick, so transmitted light meets one more
    face than in the scene."""

    def __init__(self) -> None:
        from raysect.core import AffineMatrix3D, Point3D, Vector3D, rotate_y, translate
        from raysect.optical import ConstantSF, Ray, World
        from raysect.optical.loggingray import LoggingRay
        from raysect.optical.material import AbsorbingSurface, Blend, Dielectric, NullMaterial
        from raysect.optical.material.debug import PerfectReflectingSurface
        from raysect.primitive import Box

        def box(low: tuple[float, ...], high: tuple[float, ...], material: Any, transform: Any) -> Any:
            return Box(Point3D(*low), Point3D(*high), parent=self.world, material=material, transform=transform)

        self.world = World()
        glass = Dielectric(ConstantSF(GLASS), ConstantSF(1.0), ConstantSF(AIR), transmission_only=True)
        absorber, reflector = AbsorbingSurface(), PerfectReflectingSurface()
        blend = Blend(NullMaterial(), reflector, 0.5, surface_only=True)
        box((-10, -10, -35), (10, 10, -15), glass, translate(0, 0, 0))
        box((-30, -30, 17), (30, 30, 23), glass, translate(0, 0, 0))
        box((-13, -9, -1e-3), (13, 9, 0), blend, translate(0, 0, -25) * rotate_y(45))
        self.sensor = box((40, -10, -35), (41, 10, -15), absorber, translate(0, 0, 0))
        box((-5, -5, -66), (5, 5, -65), absorber, translate(0, 0, 0))  # behind the source
        self.mirror = box((-50, -50, 0), (50, 50, 1), reflector, translate(0, 0, 0))
        self.poses = []
        for i in range(POSES):
            point, axes = mirror_pose(i)
            rows = [[*axes[k], point[k]] for k in range(3)]
            self.poses.append(AffineMatrix3D([*rows, [0, 0, 0, 1]]))

        settings = {"min_wavelength": 1529, "max_wavelength": 1531, "bins": 1, "extinction_prob": 0.0, "max_depth": 60}
        self.ray = lambda: Ray(Point3D(0, 0, -60), Vector3D(0, 0, 1), **settings)
        self.logging_ray = lambda: LoggingRay(Point3D(0, 0, -60), Vector3D(0, 0, 1), **settings)

    def answer(self, i: int) -> Answer:
        """Traces rays until the splitting face transmits one, and reflects it on its return."""
        self.mirror.transform = self.poses[i]
        in_glass = [1, 2, 3, 5, 8, 10, 11]  # sections of the path, with that of 1 um inside the splitting face
        while True:
            ray = self.logging_ray()
            ray.trace(self.world)
            if len(ray.log) != INTERACTIONS + 1 or ray.log[-1].primitive is not self.sensor:
                continue
            points = np.array([[p.x, p.y, p.z] for p in ray.path_vertices])
            lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
            index = np.full(INTERACTIONS + 1, AIR)
            index[in_glass] = GLASS
            return Answer(float(index @ lengths), *map(float, points[-1, 1:]))

    def times(self) -> tuple[float, float]:
        """Time per interaction, on any path. A motion of the mirror counts for a path of twelve interactions."""
        traces = 4000

        def fixed() -> float:
            interactions = 0
            for _ in range(traces):
                ray = self.ray()
                ray.trace(self.world)
                interactions += ray.ray_count
            return interactions

        def moving() -> float:
            for i in range(traces):
                self.mirror.transform = self.poses[i % POSES]
                self.ray().trace(self.world)
            return traces

        def standing() -> float:
            for _ in range(traces):
                self.ray().trace(self.world)
            return traces

        self.mirror.transform = self.poses[FIXED]
        each = cpu_time(fixed)
        move = cpu_time(moving, 3) - cpu_time(standing, 3)
        return each, each + move / INTERACTIONS


class Optiland:
    """Sequential trace of NumPy arrays of rays: twelve surfaces in the order of the path, without outlines."""

    def __init__(self) -> None:
        from optiland.materials import IdealMaterial
        from optiland.optic import Optic
        from optiland.rays import RealRays

        air, glass = IdealMaterial(AIR), IdealMaterial(GLASS)
        self.surfaces = Optic().surfaces
        eighth, quarter = math.pi / 4, math.pi / 2
        after: list[tuple[Any, dict[str, float]]] = [
            (air, {"z": -60.0}),
            (glass, {"z": -35.0}),
            (glass, {"z": -25.0, "ry": eighth}),
            (air, {"z": -15.0}),
            (glass, {"z": 17.0}),
            (air, {"z": 23.0}),
            ("mirror", {"z": 300.0}),
            (glass, {"z": 23.0}),
            (air, {"z": 17.0}),
            (glass, {"z": -15.0}),
            ("mirror", {"z": -25.0, "ry": eighth}),
            (air, {"x": 10.0, "z": -25.0, "ry": quarter}),
            (air, {"x": 40.0, "z": -25.0, "ry": quarter}),
        ]
        for index, (material, place) in enumerate(after):
            where = {key: place.get(key, 0.0) for key in ("x", "y", "z", "rx", "ry", "rz")}
            self.surfaces.add(index=index, material=material, is_stop=index == 1, **where)
        self.mirror = self.surfaces[6].geometry.cs

        def rays(count: int) -> Any:
            zero, one = np.zeros(count), np.ones(count)
            return RealRays(zero, zero, zero - 60.0, zero, zero, one, one, 1.53 * one)

        self.rays = rays

    def move(self, i: int) -> None:
        """Angles such that Rz Ry Rx is the mirror's rotation."""
        point, axes = mirror_pose(i)
        self.mirror.x, self.mirror.y, self.mirror.z = point
        self.mirror.rx = math.atan2(axes[2, 1], axes[2, 2])
        self.mirror.ry = -math.asin(axes[2, 0])
        self.mirror.rz = math.atan2(axes[1, 0], axes[0, 0])

    def answer(self, i: int) -> Answer:
        self.move(i)
        rays = self.surfaces.trace(self.rays(1), skip=1, record=False)
        return Answer(float(rays.opd[0]), float(rays.y[0]), float(rays.z[0]))

    def times(self) -> tuple[float, float]:
        """Fixed mirror: ten thousand rays at once, the fastest number. Moving mirror: one ray for each pose."""
        together, moves = 10_000, 100
        rays = self.rays(together)

        def fixed() -> float:
            self.surfaces.trace(rays, skip=1, record=False)
            return together * INTERACTIONS

        def moving() -> float:
            for i in range(moves):
                self.move(i)
                self.surfaces.trace(self.rays(1), skip=1, record=False)
            return moves * INTERACTIONS

        self.move(FIXED)
        return cpu_time(fixed, 20), cpu_time(moving, 3)


def run_own(executable: Path, seconds: float) -> dict[str, dict[str, Any]]:
    """Results of a benchmark executable by name."""
    command = [str(executable), "--benchmark_format=json", f"--benchmark_min_time={seconds}"]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return {result["name"]: result for result in json.loads(output)["benchmarks"]}


def own_rows(build: Path) -> tuple[list[Row], dict[int, Answer]]:
    """The lines of stepdiag, and its results for each pose."""
    head = run_own(build / "bench_peers", 0.5)
    kernels = run_own(build / "bench_replay", 0.3)

    def ns(result: dict[str, Any]) -> float:
        return 1e9 * float(result["interaction"])

    answers = {
        int(name.split("/")[1]): Answer(result["path"], result["y"], result["z"])
        for name, result in head.items()
        if name.startswith("answer/")
    }
    tree = ns(head["ray_tree_with_fixed_mirror"]), ns(head["ray_tree_with_moving_mirror"])
    route = ns(kernels["embree_with_fixed_mirror"]), ns(kernels["embree_with_moving_mirror"])
    whole = ns(head["replay_with_moving_mirror"])
    fastest = next(name for name in kernels if name.startswith("replay/") and name.endswith("/mirror_by_lane"))
    kernel = ns(kernels[fastest])
    target = fastest.split("/")[1]
    return [
        Row("stepdiag, ray tree (Embree)", *tree, 0.0, "finds faces; all branches with their powers"),
        Row("stepdiag, one path (Embree)", *route, None, "finds faces; follows one branch"),
        Row("stepdiag, TracedHead::replay", whole, whole, None, "records, replays, checks each, re-traces 1 in 1000"),
        Row(f"stepdiag, replay() {target}", kernel, kernel, None, "known faces; outlines, events, NaN checked"),
    ], answers


def peer_row(name: str, peer: Raysect | Optiland, answers: dict[int, Answer], does: str) -> Row:
    difference = max(
        abs(found - own) for i, answer in answers.items() for found, own in zip(peer.answer(i), answer, strict=True)
    )
    return Row(name, *peer.times(), difference, does)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=Path("build/release/benchmarks"), help="folder of bench_peers")
    build = parser.parse_args().build

    from importlib.metadata import version

    own, answers = own_rows(build)
    raysect = peer_row(
        f"raysect {version('raysect')}", Raysect(), answers, "finds faces; a random branch; no path lengths but by log"
    )
    optiland = peer_row(
        f"optiland {version('optiland')}", Optiland(), answers, "known faces; no outlines; one mirror for all rays"
    )
    print(f"{'ns an interaction':32}{'fixed mirror':>14}{'moving':>12}{'largest difference, mm':>26}  what it does")
    for row in [*own, raysect, optiland]:
        difference = "asserted by the benchmark" if row.difference is None else f"{row.difference:.1e}"
        print(f"{row.name:32}{row.fixed:14.2f}{row.moving:12.2f}{difference:>26}  {row.does}")
    print()
    for row in own:
        print(
            f"{row.name:32} is faster than raysect {raysect.fixed / row.fixed:.0f} times with a fixed mirror, "
            f"{raysect.moving / row.moving:.0f} times with a moving one; "
            f"than optiland {optiland.fixed / row.fixed:.2g} and {optiland.moving / row.moving:.2g} times"
        )
    # raysect moves rays 1e-9 mm away from each face that they leave. For optiland and stepdiag, rounding over 3 m is
    # 1e-11 mm.
    if raysect.difference is None or raysect.difference > 1e-7:
        sys.exit("raysect's answers are not ours")
    if optiland.difference is None or optiland.difference > 1e-10:
        sys.exit("optiland's answers are not ours")
    return 0


if __name__ == "__main__":
    sys.exit(main())
