"""Which parameters a plan determines, by the rank of a whole first-order model differentiated from the reference.

All unknowns at once: the 21 parameters at their nodes, and of each line two angles of the laser, two of the reflector
and a constant. Shares nothing with the evaluators, which solve angles, slopes and steps one after the other.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import reference
from truth import SQUARENESS_AXIS, Setup

AXES = "XYZ"
ROTATION_STEP, LENGTH_STEP = 1e-6, 1e-3  # rad, mm: central differences, so that errors are of third order
NEGLIGIBLE = 1e-6  # of a column's length; what is determined stands clear of it by far


class RankModel:
    def __init__(self, setup: Setup, lost: Iterable[tuple[str, int]] = ()) -> None:
        self.setup = setup
        self.names: list[tuple[str, int]] = []
        for axis in AXES:
            for c in "XYZABC":
                straightness = c in AXES and c != axis
                self.names += [(f"E{c}{axis}", k) for k in range(1, setup.steps + (0 if straightness else 1))]
        self.names += [(name, 0) for name in SQUARENESS_AXIS]
        columns = [self.derivative(name, node) for name, node in self.names]
        for line in setup.lines:
            columns += [self.setup_derivative(line, kind, i) for kind in ("laser", "reflector") for i in (0, 1)]
            columns.append(self.constant(line))
        matrix = np.column_stack(columns)[self.kept_rows(set(lost))]
        length = np.linalg.norm(matrix, axis=0)
        self.scale = np.where(length > 0, length, 1.0)
        _, values, rows = np.linalg.svd(matrix / self.scale)
        rank = int(np.sum(values > NEGLIGIBLE * values[0]))
        self.null = rows[rank:] / self.scale  # a basis of what no reading sees

    def kept_rows(self, lost: set[tuple[str, int]]) -> np.ndarray:
        kept: list[bool] = []
        for line in [*self.setup.lines, *self.setup.scale_lines]:
            for point in range(len(self.setup.plan.points(line))):
                kept += [(line, point) not in lost] * (3 if line in self.setup.lines else 1)
        return np.array(kept)

    def rows(self, table: reference.ErrorTable, misalignment: dict[str, dict[str, tuple[float, float]]]) -> np.ndarray:
        """Distances and tilts of the lines, distances of the scale lines, in mm and in mm at a lever of 1 m."""
        s = self.setup
        scenario = reference.Scenario(
            s.volume, s.chain, s.lines, s.steps, s.tool, s.order, s.scale_lines, misalignment=misalignment
        )
        values = []
        for row in reference.simulate(scenario, table):
            values.append(row["distance"])
            if row["line"] in s.lines:
                values += [1e3 * row["alpha"], 1e3 * row["beta"]]
        return np.array(values)

    def table(self, name: str, node: int, value: float) -> reference.ErrorTable:
        if name in SQUARENESS_AXIS:
            return reference.ErrorTable(squareness={name: value})
        nodes = list(self.setup.plan.nodes(name[2]))
        values = [value if k == node else 0.0 for k in range(len(nodes))]
        return reference.ErrorTable({name: (nodes, values)})

    def derivative(self, name: str, node: int) -> np.ndarray:
        h = LENGTH_STEP if name[0] == "E" and name[1] in AXES else ROTATION_STEP
        return (self.rows(self.table(name, node, h), {}) - self.rows(self.table(name, node, -h), {})) / (2 * h)

    def setup_derivative(self, line: str, kind: str, i: int) -> np.ndarray:
        def at(h: float) -> np.ndarray:
            return self.rows(reference.ErrorTable(), {line: {kind: (h, 0.0) if i == 0 else (0.0, h)}})

        return (at(ROTATION_STEP) - at(-ROTATION_STEP)) / (2 * ROTATION_STEP)

    def constant(self, line: str) -> np.ndarray:
        plan = self.setup.plan
        size = {name: len(plan.points(name)) for name in [*self.setup.lines, *self.setup.scale_lines]}
        parts = []
        for name, points in size.items():
            row = [float(name == line), 0.0, 0.0] if name in self.setup.lines else [0.0]
            parts.append(np.tile(row, points))
        return np.concatenate(parts)

    def determines(self, weights: dict[tuple[str, int], float]) -> bool:
        """Whether a sum of parameters is the same for all solutions: no null vector has a part in it."""
        combination = sum(w * self.null[:, self.names.index(key)] for key, w in weights.items() if key in self.names)
        size = max(w / self.scale[self.names.index(key)] for key, w in weights.items() if key in self.names)
        return bool(np.linalg.norm(combination) <= 1e-4 * size)

    def shape_is_determined(self, name: str) -> bool:
        last = self.setup.steps
        whole = (name, last) in self.names and name[1] == name[2]  # positioning: less the line to its end
        return all(
            self.determines({(name, k): 1.0} | ({(name, last): -k / last} if whole else {}))
            for k in range(1, last + (0 if name[1] in AXES else 1))
        )

    def slope_is_determined(self, axis: str) -> bool:
        return self.determines({(f"E{axis}{axis}", self.setup.steps): 1.0})
