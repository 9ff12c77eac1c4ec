"""Tables of one axis by the position of one axis: all that most controllers can add up.

Nine functions f_ab, the error of axis a by the position of axis b, are what such a set of tables can carry:

    m_a = P_a - sum over b of f_ab(P_b).

Of all sums of functions of one position, that of the means over the other two positions deviates least from the error
of the functional point, in the mean of squares over the volume (the main effects of an analysis of variance). On the
lines through a point instead, the errors there are compensated, and others less. The tables are those of the two that
leave the smaller largest error, or on the lines if the user names the point. Each is 0 at home in + direction.

Controllers that take equidistant points only get them; the loss is stated.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from stepdiag._core import Calibration, ErrorMap, InvalidArgument, Machine
from stepdiag.exporting.common import (
    FloatArray,
    common_nodes,
    compensated_map,
    inside,
    line_point,
    require,
    spread,
    tool_of,
    words,
)
from stepdiag.exporting.left_in_volume import LeftInVolume, left_in_volume, trapezoidal
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Coverage, coverage_of
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES

ACROSS: Final = 21  # positions of each other axis in a mean
NOTHING: Final = 1e-6  # mm: below it a function is not written
Pair = tuple[int, int]  # axis in error, axis on whose position it depends
EVERY: Final[Sequence[Pair]] = tuple((axis, by) for axis in range(3) for by in range(3))


@dataclass(frozen=True)
class AxisTables:
    """Equidistant positions of each axis, mm from home, and the functions there, (directions, points), mm.

    One direction if the table holds for both, else + and -. `where`: of which line or mean the functions are;
    `loss`: their largest deviation between the points, mm; `left_out`: functions that had to be left out."""

    positions: Sequence[FloatArray]
    functions: Mapping[Pair, FloatArray]
    where: str
    loss: float
    left_out: Sequence[Pair]

    @property
    def count(self) -> int:
        """The number of tables: those of both directions count twice."""
        return sum(len(values) for values in self.functions.values())

    @property
    def directions(self) -> str:
        """In words; empty: as the options say."""
        two = [f"{AXES[axis]} by {AXES[by]}" for (axis, by), values in self.functions.items() if len(values) == 2]
        rest = " (mean of both for the others)" if two and len(two) < len(self.functions) else ""
        return f"each by itself: {', '.join(two)}{rest}" if two else ""

    def motors(self, commanded: FloatArray, direction: int) -> FloatArray:
        """Where a controller sends the motors that subtracts the tables, interpolated linearly and held at the ends."""
        sent = commanded.copy()
        for (axis, by), values in self.functions.items():
            sent[:, axis] -= np.interp(commanded[:, by], self.positions[by], values[min(direction, len(values) - 1)])
        return sent

    def coverage(self, calibration: Calibration) -> Coverage:
        """Rotations act in part: at one position of the other axes, or in the mean over them."""
        whole = [f"E{AXES[axis]}{AXES[by]}" for axis, by in self.functions]
        whole += [name for name, pair in _SQUARENESS_IS.items() if pair in self.functions]
        return coverage_of(calibration, whole, [f"E{turn}{axis}" for turn in "ABC" for axis in AXES])

    def sentences(self) -> list[str]:
        """What the tables are."""
        left_out = ", ".join(f"{AXES[axis]} by {AXES[by]}" for axis, by in self.left_out)
        return [
            f"tables: {self.count}, of the error of one axis by the position of one, {self.where}; 0 at home",
            f"points: {', '.join(f'{AXES[n]} {len(self.positions[n])}' for n in range(3))}, equidistant; between them "
            f"the tables deviate from their functions by at most {self.loss * 1e3:.2g} µm",
            *([f"note: left out, because of `tables`: {left_out}"] if left_out else []),
        ]


# The function of which a squareness is the slope: C0Y moves X as Y goes, and so on.
_SQUARENESS_IS: Final[Mapping[str, Pair]] = {"C0Y": (0, 1), "B0Z": (0, 2), "A0Z": (1, 2)}


def axis_tables(
    calibration: Calibration,
    options: ExportOptions,
    points: int,
    pairs: Collection[Pair] = EVERY,
    both: Collection[Pair] = EVERY,
) -> tuple[AxisTables, LeftInVolume | None, list[str]]:
    """The tables that leave least, what they leave, and notes.

    `points`: of a table, at most. `pairs`: functions that the format can carry; of these `options.tables` are chosen
    such that the mean of squares falls most. `both`: of which it can carry two directions of approach; of the others it
    carries the mean. Raises InvalidArgument."""
    if options.tables is not None and options.tables < 1:
        raise InvalidArgument(f"`tables`: expected at least 1, got {options.tables}")
    missing = require(calibration, [*FUNCTIONS, *SQUARENESSES], options)
    tool, at = tool_of(calibration, options), line_point(calibration, options)
    machine = Machine(calibration.chain, _errors(calibration, options), tool)
    ways: list[tuple[str, FloatArray | None]] = [(f"on the lines through {words(at)} mm from home", at)]
    if options.at is None:
        ways.insert(0, ("in the mean over the positions of the other two axes", None))
    tried = [_tables(machine, calibration.volume, points, pairs, both, options.tables, *way) for way in ways]
    left = [left_in_volume(calibration, tool, one.motors) for one in tried]
    best = min(range(len(tried)), key=lambda k: (one.with_it.largest if (one := left[k]) else 0.0, k))
    return tried[best], left[best], missing


def _errors(calibration: Calibration, options: ExportOptions) -> ErrorMap:
    """Both directions of approach, unless the user asks for one or the mean."""
    return calibration.to_error_map() if options.approach is None else compensated_map(calibration, options.approach)


def _tables(
    machine: Machine,
    volume: FloatArray,
    points: int,
    pairs: Collection[Pair],
    both: Collection[Pair],
    most: int | None,
    where: str,
    at: FloatArray | None,
) -> AxisTables:
    positions, functions, losses = [], {}, []
    for by, letter in enumerate(AXES):
        nodes = inside(common_nodes(machine.errors, letter), float(volume[by]))
        exact = _functions(machine, volume, by, nodes, at)
        equal = _equidistant(nodes, points)
        positions.append(equal)
        for axis in range(3):
            own = exact[:, :, axis] if (axis, by) in both else exact[:, :, axis].mean(axis=0, keepdims=True)
            own = own - own[0, 0]
            if (axis, by) in pairs and np.max(np.abs(own)) > NOTHING:
                values = np.array([np.interp(equal, nodes, one) for one in own])
                functions[axis, by] = values
                losses.append(np.max(np.abs([np.interp(nodes, equal, one) for one in values] - own)))
    order = sorted(functions, key=lambda pair: -_falls_by(positions[pair[1]], functions[pair]))
    kept: list[Pair] = []
    for pair in order:  # the means of squares add up, because the functions are orthogonal
        if most is None or sum(len(functions[one]) for one in [*kept, pair]) <= most:
            kept.append(pair)
    left_out = [pair for pair in functions if pair not in kept]
    chosen = {pair: functions[pair] for pair in EVERY if pair in kept}
    return AxisTables(tuple(positions), chosen, where, float(max(losses, default=0.0)), left_out)


def _falls_by(positions: FloatArray, values: FloatArray) -> float:
    """By how much the mean square error falls with this table, mm^2."""
    weights = trapezoidal(positions)
    return float(np.mean([weights @ (one - weights @ one) ** 2 for one in values]))


def _equidistant(nodes: FloatArray, most: int) -> FloatArray:
    """The nodes themselves if they are equidistant and not too many, else as many points as may be.

    The step has six digits after the point, as it is written."""
    steps = np.diff(nodes)
    intervals = len(steps) if len(nodes) <= most and np.ptp(steps) < 1e-6 else most - 1
    return np.asarray(np.arange(intervals + 1) * float(f"{nodes[-1] / intervals:.6f}"))


def _functions(machine: Machine, volume: FloatArray, by: int, nodes: FloatArray, at: FloatArray | None) -> FloatArray:
    """The errors of all axes at the nodes of one, (directions, nodes, 3), mm."""
    others = [n for n in range(3) if n != by]
    if at is None:
        grid, weights = _across(machine.errors, volume, others)
    else:
        grid, weights = at[None, others], np.ones(1)
    places = np.empty((len(nodes), len(grid), 3))
    places[:, :, by] = nodes[:, None]
    places[:, :, others] = grid
    letter = AXES[by]
    two = any(name[2] == letter for name in machine.errors.negative_functions)
    found = []
    for sign in "+-" if two else "+":
        approach = "".join(sign if n == by else "+" for n in range(3))
        error = machine.error(places.reshape(-1, 3), approach).reshape(places.shape)
        found.append(np.einsum("g,ngk->nk", weights, error))
    return np.asarray(found)


def _across(errors: ErrorMap, volume: FloatArray, others: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Positions of the other two axes, (n, 2), and their weights in the mean, by the trapezoidal rule."""
    axes, weights = [], []
    for n in others:
        nodes = np.append(common_nodes(errors, AXES[n]), np.linspace(0.0, volume[n], ACROSS))
        axes.append(spread(inside(np.unique(nodes), float(volume[n])), 2 * ACROSS))
        weights.append(trapezoidal(axes[-1]))
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    return grid, np.outer(*weights).ravel()
