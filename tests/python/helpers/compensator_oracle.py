"""What a compensator must answer, from the written conventions alone, with 40 digits: a table's text in, errors out.

Shares nothing with the package: the file is read here, the pose is that of reference.py. Lengths in mm, angles in rad.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from reference import AXES, DIGITS_40, FORWARD, MP, ErrorTable, Scales, Table, Vector, pose

OUTSIDE, CAPPED, REFUSED = 1, 2, 4
Three = tuple[float, float, float]


def vector(values: Any) -> Vector:
    return DIGITS_40.vector([float(v) for v in values])


def length(v: Vector) -> Any:
    return MP.sqrt(v @ v)


@dataclass(frozen=True)
class Answer:
    position: Vector
    orientation: Vector
    status: int


class Oracle:
    def __init__(
        self,
        text: str,
        *,
        origin: Three = (0.0, 0.0, 0.0),
        outside: str = "hold",
        margin: float = 0.0,
        largest_correction: float = 1.0,
        approach: str = "mean",
    ) -> None:
        keys = dict(re.findall(r"^# *(\w+)=(.*)$", text, re.MULTILINE))
        self.chain = keys["chain"]
        self.volume = [MP.mpf(v) for v in keys["volume_mm"].split()]
        self.tool = [float(v) for v in keys["tool_mm"].split()]
        self.origin = vector(origin)
        self.keys = keys
        self.outside, self.margin, self.largest_correction = outside, MP.mpf(margin), largest_correction
        table = read_table(text, approach)
        if margin:
            edges = dict(zip(AXES, self.volume, strict=True))
            functions = {name: continued(f, edges[name[2]], self.margin) for name, f in table.functions.items()}
            table = ErrorTable(functions, table.squareness)
        self.table = table

    def error(self, position: Any, tool: Any = None, temperature: Any = None) -> Answer:
        """Actual minus nominal functional point at an axis position, and the rotation vector of the tool.

        temperature: of the scales, °C; without it they are as in the table."""
        at = vector(position) - self.origin
        status = self._status(at)
        if status & REFUSED:
            return Answer(vector((0, 0, 0)), vector((0, 0, 0)), status)
        e, rotation = self._model(at, tool, temperature)
        return Answer(e, rotation_vector(rotation), status | (CAPPED if length(e) > self.largest_correction else 0))

    def forward(self, command: Any, tool: Any = None, temperature: Any = None) -> Vector:
        return vector(command) + self._correction(vector(command), tool, temperature)

    def command(self, target: Any, tool: Any = None, temperature: Any = None) -> Vector:
        """c with c + e(c) = t, to 30 digits."""
        c = t = vector(target)
        for _ in range(100):
            before, c = c, t - self._correction(c, tool, temperature)
            if length(c - before) < MP.mpf("1e-30"):
                return c
        raise AssertionError("the errors are too steep for the oracle")

    def _status(self, at: Vector) -> int:
        beyond = max(*-at, *(at - self.volume))
        if beyond <= MP.mpf("1e-6"):
            return 0
        held = self.outside == "hold" or (self.outside == "linear" and beyond <= self.margin)
        return OUTSIDE if held else OUTSIDE | REFUSED

    def _model(self, at: Vector, tool: Any, temperature: Any) -> tuple[Vector, Any]:
        """Beyond the volume and its margin, the error of the nearest point."""
        at = np.array([min(max(p, -self.margin), edge + self.margin) for p, edge in zip(at, self.volume, strict=True)])
        tool = self.tool if tool is None else tool
        scales = None if temperature is None else self._scales(temperature)
        rotation, point = pose(self.chain, self.table, tool, at, DIGITS_40, FORWARD, scales)
        return point - at - vector(tool), rotation

    def _scales(self, temperature: Any) -> Scales:
        def three(key: str) -> Three:
            x, y, z = map(float, self.keys.get(key, "0 0 0").split())
            return x, y, z

        reference = float(self.keys["temperature_reference_c"])
        return Scales(three("expansion_per_k"), temperature, fixed_point=three("fixed_point_mm"), reference=reference)

    def _correction(self, command: Vector, tool: Any, temperature: Any) -> Vector:
        e, _ = self._model(command - self.origin, tool, temperature)
        return e if length(e) <= self.largest_correction else e * (self.largest_correction / length(e))


def read_table(text: str, approach: str) -> ErrorTable:
    """Functions corrected for a direction of approach ("mean" of both), and squarenesses."""
    rows = [line for line in text.lstrip("\ufeff").splitlines() if line.strip() and not line.startswith("#")]
    directed: dict[str, dict[str, Table]] = {"": {}, "+": {}, "-": {}}
    squareness: dict[str, Any] = {}
    for row in csv.DictReader(rows):
        native = MP.mpf(row["value"]) * (MP.mpf("1e-3") if row["unit"] == "um" else MP.mpf("1e-6"))
        if not row["position_mm"]:
            squareness[row["parameter"]] = native
            continue
        nodes, values = directed[row.get("direction") or ""].setdefault(row["parameter"], ([], []))
        nodes.append(MP.mpf(row["position_mm"]))
        values.append(native)
    functions = dict(directed[""])
    for name in {**directed["+"], **directed["-"]}:
        plus = directed["+"].get(name) or directed["-"][name]
        minus = directed["-"].get(name) or directed["+"][name]
        if approach == "mean":
            nodes = sorted({*plus[0], *minus[0]})
            both = ErrorTable({"+": plus, "-": minus})
            functions[name] = (nodes, [(both.value("+", p) + both.value("-", p)) / 2 for p in nodes])
        else:
            functions[name] = plus if approach == "positive" else minus
    return ErrorTable(functions, squareness)


def continued(function: Table, edge: Any, margin: Any) -> Table:
    """The function within [0, edge], and on both sides the straight line of its last interval, as far as the margin."""
    table = ErrorTable({"f": function})
    inner = [p for p in function[0] if 0 < p < edge]
    nodes = [MP.mpf(0), *inner, edge]
    values = [table.value("f", p) for p in nodes]
    first = (values[1] - values[0]) / (nodes[1] - nodes[0])
    last = (values[-1] - values[-2]) / (nodes[-1] - nodes[-2])
    return [-margin, *nodes, edge + margin], [values[0] - first * margin, *values, values[-1] + last * margin]


def rotation_vector(rotation: Any) -> Vector:
    """Log of a rotation by less than a quarter turn: its antisymmetric part is sin(angle) times the axis."""
    r = rotation
    axial = np.array([r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]) / 2
    sine = length(axial)
    return axial * (MP.asin(sine) / sine) if sine else axial
