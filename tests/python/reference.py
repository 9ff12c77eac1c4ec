"""The conventions' closed-form simulation, written a second time: frames, poses and readings, nothing of the package.

Every function works in double precision, or with 40 digits where it is given `DIGITS_40` as its arithmetic.
Lengths in mm, angles in rad.
"""

from __future__ import annotations

import csv
import re
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
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


@dataclass(frozen=True)
class ErrorTable:
    functions: dict[str, tuple[list[float], list[float]]] = field(default_factory=dict)
    squareness: dict[str, float] = field(default_factory=dict)

    def value(self, name: str, position: Number) -> Number:
        """Linear between nodes, the end values outside."""
        if name not in self.functions:
            return position * 0
        nodes, values = self.functions[name]
        if position <= nodes[0]:
            return position * 0 + values[0]
        for a, b, u, v in zip(nodes, nodes[1:], values, values[1:], strict=False):
            if position <= b:
                share = (position - a) / ((position * 0 + b) - a)
                return (1 - share) * u + share * v
        return position * 0 + values[-1]


def read_error_table(path: Path) -> ErrorTable:
    functions: dict[str, tuple[list[float], list[float]]] = {}
    squareness: dict[str, float] = {}
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            value = float(row["value"]) * {"um": 1e-3, "urad": 1e-6}[row["unit"]]
            if row["position_mm"] == "":
                squareness[row["parameter"]] = value
            else:
                nodes, values = functions.setdefault(row["parameter"], ([], []))
                nodes.append(float(row["position_mm"]))
                values.append(value)
    return ErrorTable(functions, squareness)


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Rows of a measurement file with native units; an empty field is None."""
    factor = {"mm": 1.0, "urad": 1e-6}
    rows = []
    with open(path, newline="", encoding="utf-8") as file:
        for text in csv.DictReader(file):
            row: dict[str, Any] = {"line": text.pop("line"), "point": int(text.pop("point"))}
            for column, value in text.items():
                name, unit = column.rsplit("_", 1)
                row[name] = float(value) * factor[unit] if value else None
            rows.append(row)
    return rows


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


def axis_errors(table: ErrorTable, axis: str, p: Number, a: Arithmetic = DOUBLE) -> tuple[Vector, Vector]:
    """delta_a and theta_a at a position, squarenesses included."""
    delta = a.vector([table.value(f"E{c}{axis}", p) for c in "XYZ"])
    theta = a.vector([table.value(f"E{c}{axis}", p) for c in "ABC"])
    if axis == "Y":
        delta[0] -= table.squareness.get("C0Y", 0.0) * p
    if axis == "Z":
        delta[0] += table.squareness.get("B0Z", 0.0) * p
        delta[1] -= table.squareness.get("A0Z", 0.0) * p
    return delta, theta


def pose(chain: str, table: ErrorTable, tool: Any, commanded: Any, a: Arithmetic = DOUBLE) -> tuple[Any, Vector]:
    """(rotation, functional point) by homogeneous 4x4 matrices, from w to t."""
    links = re.findall(r"[XYZ]|b", chain)
    bed = links.index("b")
    total = np.array([[a.number(float(i == j)) for j in range(4)] for i in range(4)])
    for place, link in enumerate(links):
        if link == "b":
            continue
        p = a.number(commanded[AXES.index(link)])
        delta, theta = axis_errors(table, link, p, a)
        delta[AXES.index(link)] += p
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
    volume: tuple[float, float, float]
    chain: str
    lines: list[str]
    steps: int
    tool: tuple[float, float, float] = (0.0, 0.0, 0.0)
    order: str = "XYZ"
    scale_lines: list[str] = field(default_factory=list)
    layout: str = "ideal"
    standoff: float = 100.0
    psd_distance: float = 0.0
    beam_offsets: list[list[float]] = field(default_factory=list)
    misalignment: dict[str, dict[str, tuple[float, float]]] = field(default_factory=dict)
    noise: dict[str, float] = field(default_factory=dict)


def read_scenario(path: Path) -> Scenario:
    """As much of a scenario as the runs with known truth use."""
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    head, plan, machine = data["head"], data["plan"], data["machine"]
    misalignment = {}
    for line, keys in data.get("misalignment", {}).items():
        pairs = {"reflector": (0.0, 0.0), "laser": (0.0, 0.0), "psd_zero": (0.0, 0.0)}
        for key, (u, v) in keys.items():
            name, unit = key.rsplit("_", 1)
            pairs[name] = (u * 1e-6, v * 1e-6) if unit == "urad" else (u, v)
        misalignment[line] = pairs
    return Scenario(
        volume=(data["volume"]["x_mm"], data["volume"]["y_mm"], data["volume"]["z_mm"]),
        chain=machine["chain"],
        tool=tuple(machine["tool_mm"]),
        lines=plan["lines"],
        steps=plan["steps"],
        order=plan["order"],
        scale_lines=plan["scale_lines"],
        layout=head["layout"],
        standoff=head["standoff_mm"],
        psd_distance=head.get("psd_distance_mm", 0.0),
        beam_offsets=head.get("beam_offsets_mm", []),
        misalignment=misalignment,
        noise=data.get("noise", {}),
    )


def commanded_points(scenario: Scenario, line: str) -> list[tuple[float, float, float]]:
    steps = 1 if line in scenario.scale_lines else scenario.steps
    node = [steps if s == "n" else 0 for s in line]

    def position() -> tuple[float, float, float]:
        x, y, z = (k * e / steps for k, e in zip(node, scenario.volume, strict=True))
        return x, y, z

    points = [position()]
    for _ in range(steps):
        for axis in scenario.order:
            i = AXES.index(axis)
            if line[i] != "0":
                node[i] += 1 if line[i] == "p" else -1
                points.append(position())
    return points


def readings(
    scenario: Scenario, table: ErrorTable, line: str, commanded: Any, a: Arithmetic = DOUBLE
) -> dict[str, Number]:
    """What the head reads on a line with the machine at a commanded position; by the conventions' words."""
    pairs = scenario.misalignment.get(line, {})
    reflector, laser = pairs.get("reflector", (0.0, 0.0)), pairs.get("laser", (0.0, 0.0))
    zero = pairs.get("psd_zero", (0.0, 0.0))
    local = frame(line, scenario.volume, a)
    start = a.vector(commanded_points(scenario, line)[0]) + a.vector(scenario.tool)
    origin = start - a.number(scenario.standoff) * local[:, 2]
    sensor = local @ turn([*laser, 0.0], a)
    rotation, point = pose(scenario.chain, table, scenario.tool, commanded, a)
    normal = rotation @ local @ turn([*reflector, 0.0], a) @ a.vector([0, 0, 1])
    beam = sensor[:, 2]

    def length_from(start_of_beam: Vector) -> Number:
        return ((point - start_of_beam) @ normal) / (normal @ beam)

    back = beam - 2 * (normal @ beam) * normal
    cos_2phi = -(back @ beam)

    def half_round_trip(start_of_beam: Vector) -> Number:
        length = length_from(start_of_beam)
        return (length + length / cos_2phi) / 2

    distance = half_round_trip(origin)
    if scenario.layout == "multi_beam":
        starts = [origin + u * sensor[:, 0] + v * sensor[:, 1] for u, v in scenario.beam_offsets]
        return {f"d{i}": half_round_trip(s) for i, s in enumerate(starts, start=1)}
    if scenario.layout == "psd":
        x, y, z = sensor.T @ back
        way = length_from(origin) + scenario.psd_distance
        return {"distance": distance, "spot_x": way * x / -z + zero[0], "spot_y": way * y / -z + zero[1]}
    n = sensor.T @ normal
    return {"distance": distance, "alpha": -n[1] / n[2], "beta": n[0] / n[2]}


def simulate(scenario: Scenario, table: ErrorTable, a: Arithmetic = DOUBLE) -> Iterator[dict[str, Any]]:
    """Rows of the run: the plan's lines, then its scale lines."""
    for line in [*scenario.lines, *scenario.scale_lines]:
        for point, commanded in enumerate(commanded_points(scenario, line)):
            yield {"line": line, "point": point, "position": commanded, **readings(scenario, table, line, commanded, a)}
