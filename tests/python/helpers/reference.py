"""The conventions' closed-form simulation, written a second time: frames, poses and readings, nothing of the package.

Every function works in double precision, or with 40 digits where it is given `DIGITS_40` as its arithmetic.
Lengths in mm, angles in rad.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import mpmath
import numpy as np

Vector = np.ndarray
Number = Any
AXES = "XYZ"


@dataclass(frozen=True)
class Arithmetic:
    number: Callable[[float], Number]
    sqrt: Callable[[Number], Number]
    sin: Callable[[Number], Number]
    cos: Callable[[Number], Number]

    def vector(self, values: Any) -> Vector:
        items = [self.number(v) for v in values]
        return np.array(items, dtype=float if isinstance(items[0], float) else object)


MP = mpmath.MPContext()
MP.dps = 40
DOUBLE = Arithmetic(float, np.sqrt, np.sin, np.cos)
DIGITS_40 = Arithmetic(lambda x: MP.mpf(float(x)) if not isinstance(x, MP.mpf) else x, MP.sqrt, MP.sin, MP.cos)


Table = tuple[list[float], list[float]]
Approach = tuple[int, int, int]  # per axis, the direction in which it came to where it stands: +1 or -1
FORWARD = (1, 1, 1)


@dataclass(frozen=True)
class ErrorTable:
    """Functions of either direction, or those of the + direction beside `negative`, those of the - direction."""

    functions: dict[str, Table] = field(default_factory=dict)
    squareness: dict[str, float] = field(default_factory=dict)
    negative: dict[str, Table] = field(default_factory=dict)

    def value(self, name: str, position: Number, direction: int = 1) -> Number:
        """Linear between nodes, the end values outside."""
        table = self.negative.get(name, self.functions.get(name)) if direction < 0 else self.functions.get(name)
        if table is None:
            return position * 0
        nodes, values = table
        if position <= nodes[0]:
            return position * 0 + values[0]
        for a, b, u, v in zip(nodes, nodes[1:], values, values[1:], strict=False):
            if position <= b:
                share = (position - a) / ((position * 0 + b) - a)
                return (1 - share) * u + share * v
        return position * 0 + values[-1]


def frame(line: str, volume: Any, a: Arithmetic = DOUBLE) -> np.ndarray:
    """Columns local x, y, z of a line (equation 2), built from cross products instead of its formulas."""
    travel = a.vector([{"p": 1, "n": -1, "0": 0}[s] * e for s, e in zip(line, volume, strict=True)])
    z = travel / a.sqrt(travel @ travel)
    across = a.vector([travel[1], -travel[0], 0]) if travel[0] != 0 or travel[1] != 0 else a.vector([0, -1, 0])
    x = across / a.sqrt(across @ across)
    return np.column_stack([x, cross(z, x), z])


def cross(u: Vector, v: Vector) -> Vector:
    return np.array([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])


def turn(vector: Any, a: Arithmetic = DOUBLE) -> np.ndarray:
    """Exp of a rotation vector, by a unit quaternion."""
    v = a.vector(vector)
    size2 = v @ v
    if size2 == 0:
        w, q = a.number(1), v
    else:
        size = a.sqrt(size2)
        w, q = a.cos(size / 2), v * (a.sin(size / 2) / size)
    x, y, z = q
    one, two = a.number(1), a.number(2)
    return np.array(
        [
            [one - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)],
            [two * (x * y + w * z), one - two * (x * x + z * z), two * (y * z - w * x)],
            [two * (x * z - w * y), two * (y * z + w * x), one - two * (x * x + y * y)],
        ]
    )


def axis_errors(
    table: ErrorTable, axis: str, p: Number, a: Arithmetic = DOUBLE, direction: int = 1
) -> tuple[Vector, Vector]:
    """delta_a and theta_a at a position approached in a direction, squarenesses (of both directions) included."""
    delta = a.vector([table.value(f"E{c}{axis}", p, direction) for c in "XYZ"])
    theta = a.vector([table.value(f"E{c}{axis}", p, direction) for c in "ABC"])
    if axis == "Y":
        delta[0] -= table.squareness.get("C0Y", 0.0) * p
    if axis == "Z":
        delta[0] += table.squareness.get("B0Z", 0.0) * p
        delta[1] -= table.squareness.get("A0Z", 0.0) * p
    return delta, theta


@dataclass(frozen=True)
class Scales:
    """How the scales of X, Y, Z expand (1/K, mm, °C), and how warm they are: at the first reading (°C), and K/s."""

    coefficient: tuple[float, float, float]
    start: tuple[float, float, float]
    rate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fixed_point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    reference: float = 20.0

    def temperature(self, time: float) -> list[float]:
        return [start + rate * time for start, rate in zip(self.start, self.rate, strict=True)]

    def position(self, axis: int, p: Number, time: float, a: Arithmetic) -> Number:
        """Where an axis stands that is told to go to p."""
        warmth = a.number(self.temperature(time)[axis]) - a.number(self.reference)
        return p + a.number(self.coefficient[axis]) * warmth * (p - a.number(self.fixed_point[axis]))


def pose(
    chain: str,
    table: ErrorTable,
    tool: Any,
    commanded: Any,
    a: Arithmetic = DOUBLE,
    approach: Approach = FORWARD,
    scales: Scales | None = None,
    time: float = 0.0,
    drift: Any = (0.0, 0.0, 0.0),
) -> tuple[Any, Vector]:
    """(rotation, functional point) by homogeneous 4x4 matrices, from w to t; each axis approached as said. `drift`: of
    each axis along itself, mm/s."""
    links = re.findall(r"[XYZ]|b", chain)
    bed = links.index("b")
    total = np.array([[a.number(float(i == j)) for j in range(4)] for i in range(4)])
    for place, link in enumerate(links):
        if link == "b":
            continue
        p = a.number(commanded[AXES.index(link)])
        delta, theta = axis_errors(table, link, p, a, approach[AXES.index(link)])
        delta[AXES.index(link)] += scales.position(AXES.index(link), p, time, a) if scales else p
        delta[AXES.index(link)] += a.number(drift[AXES.index(link)]) * a.number(time)
        rotation, shift = homogeneous(turn(theta, a), None, a), homogeneous(None, delta, a)
        total = total @ rotation @ shift if place < bed else total @ shift @ rotation
    total = total @ homogeneous(None, a.vector(tool), a)
    return total[:3, :3], total[:3, 3]


def homogeneous(rotation: Any, shift: Any, a: Arithmetic) -> np.ndarray:
    matrix = np.array([[a.number(float(i == j)) for j in range(4)] for i in range(4)])
    if rotation is not None:
        matrix[:3, :3] = rotation
    if shift is not None:
        matrix[:3, 3] = shift
    return matrix


@dataclass(frozen=True)
class Scenario:
    """`misalignment` says by line: reflector, laser (rad), psd_zero, lateral (mm), pairs all; roll (rad), gain (1),
    drift (mm/s), distance_constant (mm); beam_constants (mm, one a beam). What is missing is 0."""

    volume: tuple[float, float, float]
    chain: str
    lines: list[str]
    steps: int
    tool: tuple[float, float, float] = (0.0, 0.0, 0.0)
    order: str = "XYZ"
    scale_lines: list[str] = field(default_factory=list)
    scale_points: str = "ends"  # or "steps"
    block: int = 1  # steps of an axis one after the other
    layout: str = "ideal"
    standoff: float = 100.0
    psd_distance: float = 0.0
    beam_offsets: list[list[float]] = field(default_factory=list)
    misalignment: dict[str, dict[str, Any]] = field(default_factory=dict)
    noise: dict[str, float] = field(default_factory=dict)
    repeats: int = 1
    backward: bool = False
    seconds_per_reading: float | None = None
    scales: Scales | None = None
    machine_drift: tuple[float, float, float] = (0.0, 0.0, 0.0)  # along X, Y, Z since the run's first reading, mm/s
    check_points: tuple[int, int] = (0, 0)  # after every so many steps back to where the line is after so many


def commanded_points(scenario: Scenario, line: str) -> list[tuple[float, float, float]]:
    ends = line in scenario.scale_lines and scenario.scale_points == "ends"
    steps = 1 if ends else scenario.steps
    node = [steps if s == "n" else 0 for s in line]

    def position() -> tuple[float, float, float]:
        x, y, z = (k * e / steps for k, e in zip(node, scenario.volume, strict=True))
        return x, y, z

    points = [position()]
    every, at = (0, 0) if line in scenario.scale_lines else scenario.check_points
    home = [steps if s == "n" else 0 for s in line]
    way = {"p": 1, "n": -1, "0": 0}
    check = tuple((h + way[s] * at) * e / steps for h, s, e in zip(home, line, scenario.volume, strict=True))
    for before in range(0, steps, scenario.block):
        after = min(before + scenario.block, steps)
        for axis in scenario.order:
            i = AXES.index(axis)
            for _ in range(before, after) if line[i] != "0" else ():
                node[i] += way[line[i]]
                points.append(position())
        passed = [step for step in range(before + 1, after + 1) if every and step % every == 0]
        if passed and after > at:
            points.append(check)
    return points


def approach_of(line: str, backward: bool = False) -> Approach:
    """How the axes come to each point of a visit: in its own travel's direction; one that stays at home in +."""
    x, y, z = ((-1 if (s == "n") != backward else 1) if s != "0" else 1 for s in line)
    return x, y, z


def head_of(scenario: Scenario, line: str, a: Arithmetic = DOUBLE) -> tuple[Vector, np.ndarray]:
    """Origin and sensor axes of the head as it is set up on a line."""
    setup = scenario.misalignment.get(line, {})
    local = frame(line, scenario.volume, a)
    start = a.vector(commanded_points(scenario, line)[0]) + a.vector(scenario.tool)
    beside = local[:, :2] @ a.vector(setup.get("lateral", (0.0, 0.0)))
    laser = turn([*setup.get("laser", (0.0, 0.0)), 0.0], a)
    origin = start - a.number(scenario.standoff) * local[:, 2] + beside
    return origin, local @ laser @ turn([0.0, 0.0, setup.get("roll", 0.0)], a)


def mirror_of(
    scenario: Scenario,
    table: ErrorTable,
    line: str,
    commanded: Any,
    a: Arithmetic = DOUBLE,
    backward: bool = False,
    time: float = 0.0,
) -> tuple[Vector, Vector]:
    """The functional point and the mirror's normal, in the machine frame; `time` since the run's first reading."""
    reflector = scenario.misalignment.get(line, {}).get("reflector", (0.0, 0.0))
    approach = approach_of(line, backward)
    rotation, point = pose(
        scenario.chain, table, scenario.tool, commanded, a, approach, scenario.scales, time, scenario.machine_drift
    )
    local = frame(line, scenario.volume, a)
    return point, rotation @ local @ turn([*reflector, 0.0], a) @ a.vector([0, 0, 1])


def readings(
    scenario: Scenario,
    table: ErrorTable,
    line: str,
    commanded: Any,
    a: Arithmetic = DOUBLE,
    backward: bool = False,
    elapsed: Number = 0.0,
    mirror: tuple[Vector, Vector] | None = None,
) -> dict[str, Number]:
    """What the head reads on a line with the machine at a commanded position; by the conventions' words.

    `elapsed`: seconds since the first reading of the set-up, by which the distances have drifted.
    `mirror`: point and normal, where they are not those of `mirror_of`."""
    setup = scenario.misalignment.get(line, {})
    gain = 1 + a.number(setup.get("gain", 0.0))
    origin, sensor = head_of(scenario, line, a)
    point, normal = mirror or mirror_of(scenario, table, line, commanded, a, backward)
    beam = sensor[:, 2]

    def length_from(start_of_beam: Vector) -> Number:
        return ((point - start_of_beam) @ normal) / (normal @ beam)

    back = beam - 2 * (normal @ beam) * normal
    cos_2phi = -(back @ beam)
    offset = setup.get("distance_constant", 0.0) + a.number(setup.get("drift", 0.0)) * a.number(elapsed)

    def distance_from(start_of_beam: Vector) -> Number:
        length = length_from(start_of_beam)
        return (length + length / cos_2phi) / 2 + offset

    if scenario.layout == "multi_beam":
        starts = [origin + gain * (sensor[:, :2] @ a.vector(uv)) for uv in scenario.beam_offsets]
        constants = setup.get("beam_constants") or [0.0] * len(starts)
        beams = zip(starts, constants, strict=True)
        return {f"d{i}": distance_from(s) + constant for i, (s, constant) in enumerate(beams, start=1)}
    distance = distance_from(origin)
    if scenario.layout == "psd":
        x, y, z = sensor.T @ back
        lever = gain * (length_from(origin) + scenario.psd_distance) / -z
        zero = setup.get("psd_zero", (0.0, 0.0))
        return {"distance": distance, "spot_x": lever * x + zero[0], "spot_y": lever * y + zero[1]}
    n = sensor.T @ normal
    return {"distance": distance, "alpha": -gain * n[1] / n[2], "beta": gain * n[0] / n[2]}


def simulate(scenario: Scenario, table: ErrorTable, a: Arithmetic = DOUBLE) -> Iterator[dict[str, Any]]:
    """Rows in the order in which they are read: each of the plan's lines, then of its scale lines, all of its runs one
    after the other: numbers 0, 1, 2, ...; or 0, 2, ... and after each a backward run, 1, 3, ..., points descending.

    `time`: seconds since the run's first reading; the drift counts from a forward run's first one."""
    count = 0
    seconds = scenario.seconds_per_reading or 0.0
    for line in [*scenario.lines, *scenario.scale_lines]:
        points = list(enumerate(commanded_points(scenario, line)))
        visits = [(points, False), (points[::-1], True)] if scenario.backward else [(points, False)]
        for repeat in range(scenario.repeats):
            first = count
            for i, (visit, backward) in enumerate(visits):
                for point, commanded in visit:
                    row = {"line": line, "point": point, "position": commanded, "run": repeat * len(visits) + i}
                    row["direction"] = "backward" if backward else "forward"
                    if scenario.seconds_per_reading is not None:
                        row["time"] = count * seconds
                    elapsed, time = (count - first) * seconds, count * seconds
                    if scenario.scales is not None:
                        warm = scenario.scales.temperature(time)
                        row |= {f"temperature_{axis}": t for axis, t in zip("xyz", warm, strict=True)}
                    mirror = mirror_of(scenario, table, line, commanded, a, backward, time)
                    yield {**row, **readings(scenario, table, line, commanded, a, backward, elapsed, mirror)}
                    count += 1
