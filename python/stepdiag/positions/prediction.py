"""What the figures of ISO 230-2 and ISO 230-6 would be along a line in the volume, from a calibration.

The systematic part only: a calibration knows nothing of the scatter of positions. The line goes from `start` to `end`,
d its direction. The deviation of a target P is how much further along d than commanded the functional point has come
from the start, with the exact pose:

    x(P) = d · (e(P) - e(start)),  e: actual less nominal functional point

All axes that move are approached in the direction of the line (↑), or in the opposite one (↓, for calibrations with
reversal tables); axes that do not move are approached in + direction. Uncertainties are to first order.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final

import numpy as np

from stepdiag._core import Calibration, InvalidArgument, Machine
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.display import Displayed, Facts, point_text
from stepdiag.parameters import AXES
from stepdiag.positions.figures import FIGURES, PositionFigure, figure_facts, symbol
from stepdiag.positions.line_effects import LineEffects
from stepdiag.wrong_arguments import checked

Point = tuple[float, float, float]

COVERAGE: Final = 0.95
_NORMAL: Final = NormalDist().inv_cdf((1.0 + COVERAGE) / 2.0)
_SAMPLES: Final = 10_000
# Lengths that differ by less were rounded on the way, mm.
_ROUNDING: Final = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class PredictedPositions(Displayed):
    """Deviations at targets along a line, arrays (n,) in mm, and the figures that follow: symbol -> figure.

    Deviations are NaN, and figures absent, where the calibration lacks something; `reasons` says what. Figures and
    symbols are those of `MeasuredPositions`: E, E_up, E_down, M, B, B_mean."""

    start: Point  # commanded, mm
    end: Point
    tool: Point
    target: FloatArray  # mm from the start
    up: FloatArray
    up_standard_uncertainty: FloatArray  # NaN without covariance
    down: FloatArray  # NaN without reversal tables; known but for a constant where `reversal` is NaN
    reversal: FloatArray  # B_i; NaN where a reversal error is known but for a constant
    reversal_standard_uncertainty: FloatArray  # terms as independent: the covariance of reversal errors is not known
    figures: Mapping[str, PositionFigure]
    reasons: tuple[str, ...]  # why figures or intervals are missing, a sentence each

    def _facts(self) -> Facts:
        return [
            *figure_facts(self.figures),
            ("line", f"{point_text(self.start)} to {point_text(self.end)}, {len(self.target)} targets"),
            ("tool offset", point_text(self.tool)),
            *(("note", reason) for reason in self.reasons),
        ]


@checked
def axis_line(calibration: Calibration, axis: str, at: Point = (0.0, 0.0, 0.0)) -> tuple[Point, Point]:
    """Start and end of the line along a whole axis, through the point `at`. Raises InvalidArgument."""
    if axis not in AXES or len(axis) != 1:
        raise InvalidArgument(f"`axis`: expected X, Y or Z, got {axis!r}")
    start, end = list(at), list(at)
    start[AXES.index(axis)], end[AXES.index(axis)] = 0.0, float(calibration.volume[AXES.index(axis)])
    return _point(start), _point(end)


@checked
def diagonal_line(calibration: Calibration, name: str) -> tuple[Point, Point]:
    """Start and end of a body or face diagonal by its name, such as ppp or np0. Raises InvalidArgument."""
    if len(name) != 3 or not set(name) <= {"p", "n", "0"} or name.count("0") > 1:
        raise InvalidArgument(f"`diagonal`: expected a body or face diagonal such as ppp, npp or pp0, got {name!r}")
    edges = [float(edge) for edge in calibration.volume]
    ends = [
        (edge if sign == "n" else 0.0, edge if sign == "p" else 0.0) for sign, edge in zip(name, edges, strict=True)
    ]
    return _point([a for a, _ in ends]), _point([b for _, b in ends])


@checked
def predict_positions(
    calibration: Calibration,
    start: Point,
    end: Point,
    *,
    points: int | None = None,
    tool: Point | None = None,
    seed: int = 0,
) -> PredictedPositions:
    """Predict E, M and B along a line from its calibration, systematic part, with intervals of 95 %.

    `start`, `end`: commanded positions in the volume, mm. `points`: targets at equal distances, both ends included;
    None: as many as the axis with the most nodes has. `tool`: offset, mm; None: that of the calibration. Intervals of
    ranges come from 10,000 draws of the joint normal distribution of the deviations, reflected about the value as
    those of `volume`. Raises InvalidArgument for points outside the volume, a line without length, and
    fewer than two targets."""
    ends = np.array([start, end], dtype=float)
    _check_line(calibration, ends)
    if points is None:
        points = max([2, *(len(nodes) for nodes, _, _ in calibration.functions.values())])
    if points < 2:
        raise InvalidArgument(f"`points`: expected two or more, got {points}")
    offset = _point(calibration.tool if tool is None else tool)
    length = float(np.linalg.norm(ends[1] - ends[0]))
    direction = (ends[1] - ends[0]) / length
    share = np.arange(points) / (points - 1)
    commanded = ends[0] + share[:, None] * (ends[1] - ends[0])
    commanded[-1] = ends[1]

    upward = "".join("-" if component < 0.0 else "+" for component in direction)
    downward = "".join("-" if component > 0.0 else "+" for component in direction)
    machine = Machine(calibration.chain, calibration.to_error_map(), offset)
    origin = machine.error(commanded[:1], upward)[0]
    up = (machine.error(commanded, upward) - origin) @ direction
    down = (machine.error(commanded, downward) - origin) @ direction

    effects = LineEffects(calibration, commanded, direction, offset)
    reasons, constants = _blank_unknown(calibration, effects, upward, up, down)
    reversal, u_reversal = up - down, effects.reversal_uncertainty()
    if constants:
        reversal[:] = np.nan
    u_reversal[np.isnan(reversal)] = np.nan
    root, reason = effects.covariance_root(upward)
    if reason and not np.isnan(up).any():
        reasons.append(f"no interval of E↑: {reason}")
    target = share * length
    figures = _figures(target, up, down, reversal, u_reversal)
    without = [symbol(name) for name in ("E_down", "M", "E") if name in figures]
    if without:
        reasons.append(f"no interval of {', '.join(without)}: the covariance of reversal errors is not known")
    u_up = np.full(points, np.nan)
    if "E_up" in figures and root is not None:
        figures["E_up"] = _with_interval(figures["E_up"], up, root, seed)
        u_up = np.linalg.norm(root, axis=1)
    return PredictedPositions(
        _point(ends[0]),
        _point(ends[1]),
        offset,
        target,
        up,
        u_up,
        down,
        reversal,
        u_reversal,
        {name: figures[name] for name in FIGURES if name in figures},
        tuple(reasons),
    )


def _blank_unknown(
    calibration: Calibration, effects: LineEffects, upward: str, up: FloatArray, down: FloatArray
) -> tuple[list[str], list[str]]:
    """Set deviations to NaN where the calibration does not determine them. Returns why, a sentence each, and the
    reversal errors that are known but for a constant."""
    reasons = []
    missing = effects.missing()
    if missing:
        up[:] = np.nan
        reasons.append(f"not predicted: {', '.join(missing)} not determined")
    without_table, constants = effects.unknown_reversals()
    if missing or without_table:
        down[:] = np.nan
    if without_table:
        what = f"of {', '.join(without_table)}" if calibration.reversal else "(no backward lines)"
        reasons.append(f"B, M, E↓ and the bidirectional E are not predicted: no reversal tables {what}")
    elif constants:
        # Tables of the - direction count upward for axes that fall along the line, and downward for the others.
        changing = effects.changing(constants)
        fall = {axis for axis, sign in zip(AXES, upward, strict=True) if sign == "-"}
        figures_of = (("E↑", up, fall), ("E↓", down, set(AXES) - fall))
        lost = [(name, values) for name, values, axes in figures_of if axes & {one[2] for one in changing}]
        for _, values in lost:
            values[:] = np.nan
        reasons.append(
            f"{', '.join(['B', 'M', *(name for name, _ in lost)])} and the bidirectional E are not predicted: "
            f"the reversal error of {', '.join(constants)} is known but for a constant"
        )
    return reasons, constants


def _check_line(calibration: Calibration, ends: FloatArray) -> None:
    volume = calibration.volume
    for point in ends:
        if not np.all((point >= -_ROUNDING) & (point <= volume + _ROUNDING)):
            raise InvalidArgument(
                f"expected points in the volume of {' x '.join(f'{edge:g}' for edge in volume)} mm, "
                f"got {', '.join(f'{p:g}' for p in point)}"
            )
    if np.linalg.norm(ends[1] - ends[0]) <= _ROUNDING:
        raise InvalidArgument("expected a line between two different points, got the same point twice")


def _point(values: Sequence[float] | FloatArray) -> Point:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _figures(
    target: FloatArray, up: FloatArray, down: FloatArray, reversal: FloatArray, u_reversal: FloatArray
) -> dict[str, PositionFigure]:
    """The figures of the arrays that are known."""
    figures = {}
    for name, values in (("E_up", up), ("E_down", down)):
        if not np.isnan(values).any():
            figures[name] = _range(target, values)
    if not np.isnan(reversal).any():
        figures["E"] = _range(np.concatenate([target, target]), np.concatenate([up, down]))
        figures["M"] = _range(target, (up + down) / 2.0)
        worst = int(np.argmax(np.abs(reversal)))
        value, u = float(abs(reversal[worst])), float(u_reversal[worst])
        interval = None if math.isnan(u) else (max(value - _NORMAL * u, 0.0), value + _NORMAL * u)
        figures["B"] = PositionFigure(value, (float(target[worst]),), None if math.isnan(u) else u, interval)
        figures["B_mean"] = PositionFigure(float(np.mean(reversal)))
    return figures


def _range(target: FloatArray, values: FloatArray) -> PositionFigure:
    high, low = int(np.argmax(values)), int(np.argmin(values))
    return PositionFigure(float(values[high] - values[low]), (float(target[high]), float(target[low])))


def _with_interval(figure: PositionFigure, values: FloatArray, root: FloatArray, seed: int) -> PositionFigure:
    """The figure with the interval of its range. Noise widens ranges: reflected, the interval loses that bias."""
    numbers = np.random.default_rng(seed).standard_normal((root.shape[1], _SAMPLES))
    ranges = np.ptp(values[:, None] + root @ numbers, axis=0)
    low, high = np.quantile(ranges, [(1.0 - COVERAGE) / 2.0, (1.0 + COVERAGE) / 2.0])
    interval = (max(2.0 * figure.value - float(high), 0.0), max(2.0 * figure.value - float(low), 0.0))
    return PositionFigure(figure.value, figure.at, float(np.std(ranges, ddof=1)), interval)
