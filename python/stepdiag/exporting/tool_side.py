"""All 21 errors for controllers that take every axis as one that carries the tool: ISG, Etalon, KinematicsComp.

The tables are those of the functional point,

    e = sum over axes of delta + theta x L,  L = zero position of the tool + axes after it in the chain.

For an axis that carries the workpiece the straightnesses are those of the functional point (docs/files.md). So little
depends on how a controller turns what an axis carries. Squarenesses are slopes of straightness, unless they are wanted
apart: a controller may or may not turn with them the axes that follow.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from stepdiag._core import Calibration, Chain, ErrorMap, Machine
from stepdiag.exporting.common import FloatArray, common_nodes, compensated_map, inside, origin_of, spread, tool_of
from stepdiag.exporting.fewest_nodes import best_subset
from stepdiag.exporting.options import ExportOptions
from stepdiag.parameters import AXES

# Largest deviation of a parabola between two nodes, mm: ten times below what can be measured.
HIDDEN: Final = 1e-5
Table = tuple[FloatArray, dict[str, FloatArray]]  # positions of an axis in the controller's coordinates; six functions


@dataclass(frozen=True)
class ToolSide:
    """The tables by axis, squarenesses where they are apart, and the largest difference in the volume, mm, from the
    exact errors. `letters`: the axes from workpiece to tool."""

    tables: Mapping[str, Table]
    squareness: Mapping[str, float]
    letters: str
    loss: float

    def sentence(self) -> str:
        return (
            f"rows: {', '.join(f'{axis} {len(x)}' for axis, (x, _) in self.tables.items())}; this model differs from "
            f"the exact one by at most {self.loss * 1e3:.2g} µm in the volume"
        )


def tool_side(
    calibration: Calibration, options: ExportOptions, rows: int, *, apart: bool = False, zero: FloatArray | None = None
) -> ToolSide:
    """The tables of a calibration, of at most `rows` rows.

    `apart`: squarenesses as parameters. `zero`: what the controller has in L beside tool and positions, mm."""
    tool, origin = tool_of(calibration, options), origin_of(options)
    beside = np.zeros(3) if zero is None else zero
    exact = Machine(calibration.chain, compensated_map(calibration, options.approach or "mean"), tool)
    letters = "".join(letter for letter in calibration.chain.name if letter in AXES)
    tables = {
        axis: _axis_table(exact, axis, letters, float(calibration.volume[n]), origin, beside, rows, apart)
        for n, axis in enumerate(AXES)
    }
    squareness = exact.errors.squareness if apart else {}
    functions = {name: (x, column) for x, named in tables.values() for name, column in named.items()}
    written = Machine(Chain(f"[w b {' '.join(letters)} t]"), ErrorMap(functions, squareness), tool + beside)
    return ToolSide(tables, squareness, letters, _largest_loss(exact, written, tables, origin))


def _axis_table(
    exact: Machine,
    axis: str,
    letters: str,
    edge: float,
    origin: FloatArray,
    beside: FloatArray,
    rows: int,
    apart: bool,
) -> Table:
    """Positions of an axis in the controller's coordinates, and its six functions there.

    The functions are those of an axis that carries the tool."""
    own = {name: table for name, table in exact.errors.functions.items() if name[2] == axis}
    squareness = {} if apart else {n: a for n, a in exact.errors.squareness.items() if n[2] == axis}
    alone = ErrorMap(own, squareness)
    # The controller's L contains positions from its own origin, and what it has beside. Both are subtracted.
    after = [AXES.index(letter) for letter in letters[letters.index(axis) + 1 :]]
    lever = -beside
    lever[after] -= origin[after]
    nodes = inside(common_nodes(alone, axis), edge)
    if exact.chain.carries_workpiece(axis):
        nodes = _where_parabolas_hide_little(alone, axis, nodes)
    line = np.zeros((len(nodes), 3))
    line[:, AXES.index(axis)] = nodes
    delta = Machine(exact.chain, alone, lever).first_order_error(line)
    if apart:
        # The controller's squareness refers to its own 0, not to home.
        slopes = ErrorMap({}, {n: a for n, a in exact.errors.squareness.items() if n[2] == axis})
        shift = np.where(np.arange(3) == AXES.index(axis), -origin, 0.0)
        delta = delta + Machine(exact.chain, slopes).first_order_error(shift[None, :])
    theta = np.array([alone.function(f"E{turn}{axis}", nodes) for turn in "ABC"])
    # Rotations are weighted by the displacement that they cause at the farthest point.
    kept = best_subset(nodes, np.concatenate([delta.T, theta * 3.0 * edge]), rows)
    columns = dict(zip((f"E{component}{axis}" for component in "XYZABC"), [*delta.T, *theta], strict=True))
    return nodes[kept] + origin[AXES.index(axis)], {name: column[kept] for name, column in columns.items()}


def _where_parabolas_hide_little(errors: ErrorMap, axis: str, nodes: FloatArray) -> FloatArray:
    """Add nodes such that chords hide little.

    Between two nodes theta p is a parabola; it deviates from its chord by step · d(theta) / 4."""
    theta = np.array([errors.function(f"E{turn}{axis}", nodes) for turn in "ABC"])
    step = np.diff(nodes)
    bulge = 0.25 * step * np.max(np.abs(np.diff(theta, axis=1)), axis=0)
    parts = np.clip(np.ceil(np.sqrt(bulge / HIDDEN)), 1, 100).astype(int)
    finer = [a + h / n * np.arange(n) for a, h, n in zip(nodes, step, parts, strict=False)]
    return np.concatenate([*finer, nodes[-1:]])


def _largest_loss(exact: Machine, written: Machine, tables: dict[str, Table], origin: FloatArray) -> float:
    """Largest distance in the volume between the written model's errors and the exact ones, mm."""
    samples = []
    for n, axis in enumerate(AXES):
        x = tables[axis][0]
        nodes = np.union1d(x, inside(common_nodes(exact.errors, axis), float(x[-1] - x[0])) + origin[n])
        samples.append(np.union1d(nodes, 0.5 * (nodes[1:] + nodes[:-1])))

    def distance(places: FloatArray) -> FloatArray:
        there = exact.error(places - origin)
        # The manuals do not say whether a controller includes products of two errors.
        models = (written.error(places), written.first_order_error(places))
        return np.asarray(np.max([np.linalg.norm(model - there, axis=1) for model in models], axis=0))

    grid = np.stack(np.meshgrid(*(spread(s, 41) for s in samples), indexing="ij"), axis=-1)
    found = distance(grid.reshape(-1, 3)).reshape(grid.shape[0], -1)
    # From the worst point of each slice along one axis after the other, as long as it gets worse.
    starts = grid.reshape(len(grid), -1, 3)[np.arange(len(grid)), np.argmax(found, axis=1)]
    return max(_climbed(place, samples, distance) for place in starts)


def _climbed(place: FloatArray, samples: list[FloatArray], distance: Callable[[FloatArray], FloatArray]) -> float:
    best, before = float(distance(place[None, :])[0]), -1.0
    while best > before:
        before = best
        for n, along in enumerate(samples):
            line = np.tile(place, (len(along), 1))
            line[:, n] = along
            found = distance(line)
            if found.max() > best:
                best, place = float(found.max()), line[int(np.argmax(found))]
    return best
