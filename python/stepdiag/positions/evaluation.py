"""Figures of ISO 230-2 (axes) and ISO 230-6 (diagonals) from repeated readings.

With x_i the mean and s_i the sample standard deviation (n - 1) of a target's deviations in one direction, ↑ or ↓:

    B_i = x_i↑ - x_i↓, B = max |B_i|, mean B = mean of B_i        x_i = (x_i↑ + x_i↓)/2, M = max x_i - min x_i
    E↑ = max x_i↑ - min x_i↑, E = the same of all x_i↑ and x_i↓  R_i↑ = 4 s_i↑, R↑ = max R_i↑
    R_i = max(2 s_i↑ + 2 s_i↓ + |B_i|, R_i↑, R_i↓), R = max R_i  A↑ = max(x_i↑ + 2 s_i↑) - min(x_i↑ - 2 s_i↑), A of all

Standard uncertainties are those that follow from the scatter of the readings alone (GUM, Type A): readings of different
cycles are taken as independent and normal, so that u(x_i) = s_i/√n and u(s_i) = s_i/√(2(n - 1)), and a figure as
occurring where it was found. Instrument, alignment and temperature are not in them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.display import Displayed, Facts
from stepdiag.positions.figures import FIGURES, PositionFigure, figure_facts
from stepdiag.positions.readings import PositionReadings
from stepdiag.wrong_arguments import checked

CYCLES_OF_THE_STANDARD: Final = 5


@dataclass(frozen=True)
class TargetScatter:
    """Mean and sample standard deviation (mm) of the deviations at a target in one direction."""

    target: float  # mm
    mean: float
    deviation: float
    count: int

    @property
    def mean_variance(self) -> float:
        """Variance of the mean, mm^2."""
        return self.deviation**2 / self.count

    @property
    def deviation_variance(self) -> float:
        """Variance of the standard deviation, mm^2, of normal readings (GUM E.4.3)."""
        return self.deviation**2 / (2 * (self.count - 1))


@dataclass(frozen=True, repr=False)
class MeasuredPositions(Displayed):
    """Figures of repeated readings: symbol -> figure (`FIGURES`); those of a direction without readings are absent."""

    readings: PositionReadings
    up: tuple[TargetScatter, ...]  # targets approached in + direction
    down: tuple[TargetScatter, ...]
    reversal: Mapping[float, float]  # target -> B_i, mm
    repeatability: Mapping[float, float]  # target -> R_i, mm
    figures: Mapping[str, PositionFigure]
    left_out: tuple[tuple[float, str, int], ...]  # target, direction and number of readings, below two

    @property
    def fewest_readings(self) -> int:
        """Of any target and direction that counts."""
        return min(scatter.count for scatter in (*self.up, *self.down))

    def _facts(self) -> Facts:
        left_out = [("left out", f"{len(self.left_out)} targets with fewer than two readings in a direction")]
        return [*(left_out if self.left_out else ()), *figure_facts(self.figures), *self.readings._facts()]


@checked
def evaluate_positions(readings: PositionReadings) -> MeasuredPositions:
    """Evaluate repeated readings of targets: A, E, M, R, B and what belongs to them.

    A target that has fewer than two readings in a direction is left out in that direction, and named in `left_out`.
    Raises InvalidArgument if fewer than two targets are left in every direction."""
    scatters: dict[str, list[TargetScatter]] = {"+": [], "-": []}
    left_out = []
    for direction in readings.directions:
        for target in readings.targets:
            values = readings.at(target, direction)
            if len(values) < 2:
                left_out.append((target, direction, len(values)))
            else:
                scatters[direction].append(TargetScatter(target, fmean(values), stdev(values), len(values)))
    up, down = scatters["+"], scatters["-"]
    if max(len(up), len(down)) < 2:
        raise InvalidArgument(
            "readings: expected two or more cycles at two or more targets in one direction: the scatter of one "
            "reading is not known"
        )
    figures: dict[str, PositionFigure] = {}
    for name, own in (("up", up), ("down", down)):
        if len(own) >= 2:
            figures |= {f"{figure}_{name}": value for figure, value in _unidirectional(own).items()}
    both = [(a, b) for a in up for b in down if a.target == b.target]
    if both:
        figures |= _bidirectional(both)
        ranges = _unidirectional([*up, *down])
        figures |= {"A": ranges["A"], "E": ranges["E"]}
    return MeasuredPositions(
        readings,
        tuple(up),
        tuple(down),
        {a.target: a.mean - b.mean for a, b in both},
        {a.target: _repeatability(a, b).value for a, b in both},
        {name: figures[name] for name in FIGURES if name in figures},
        tuple(left_out),
    )


def _unidirectional(scatters: Sequence[TargetScatter]) -> dict[str, PositionFigure]:
    high, low = max(scatters, key=lambda s: s.mean), min(scatters, key=lambda s: s.mean)
    systematic = PositionFigure(
        high.mean - low.mean, (high.target, low.target), math.sqrt(high.mean_variance + low.mean_variance)
    )
    worst = max(scatters, key=lambda s: s.deviation)
    repeatability = PositionFigure(4.0 * worst.deviation, (worst.target,), 4.0 * math.sqrt(worst.deviation_variance))
    high = max(scatters, key=lambda s: s.mean + 2.0 * s.deviation)
    low = min(scatters, key=lambda s: s.mean - 2.0 * s.deviation)
    value = high.mean + 2.0 * high.deviation - (low.mean - 2.0 * low.deviation)
    if high is low:  # the means are one mean, and cancel
        variance = 16.0 * high.deviation_variance
    else:
        variance = sum(s.mean_variance + 4.0 * s.deviation_variance for s in (high, low))
    accuracy = PositionFigure(value, (high.target, low.target), math.sqrt(variance))
    return {"A": accuracy, "E": systematic, "R": repeatability}


def _bidirectional(both: Sequence[tuple[TargetScatter, TargetScatter]]) -> dict[str, PositionFigure]:
    def mean(pair: tuple[TargetScatter, TargetScatter]) -> float:
        return (pair[0].mean + pair[1].mean) / 2.0

    def variance(pair: tuple[TargetScatter, TargetScatter]) -> float:
        return pair[0].mean_variance + pair[1].mean_variance

    worst = max(both, key=lambda pair: abs(pair[0].mean - pair[1].mean))
    high, low = max(both, key=mean), min(both, key=mean)
    reversals = [a.mean - b.mean for a, b in both]
    return {
        "B": PositionFigure(abs(worst[0].mean - worst[1].mean), (worst[0].target,), math.sqrt(variance(worst))),
        "B_mean": PositionFigure(fmean(reversals), (), math.sqrt(sum(map(variance, both))) / len(both)),
        "M": PositionFigure(
            mean(high) - mean(low),
            (high[0].target, low[0].target),
            math.sqrt(variance(high) + variance(low)) / 2.0,
        ),
        "R": max((_repeatability(*pair) for pair in both), key=lambda figure: figure.value),
    }


def _repeatability(up: TargetScatter, down: TargetScatter) -> PositionFigure:
    """R_i of a target."""
    at = (up.target,)
    spread = 2.0 * up.deviation + 2.0 * down.deviation + abs(up.mean - down.mean)
    variance = 4.0 * (up.deviation_variance + down.deviation_variance) + up.mean_variance + down.mean_variance
    alone = max(up, down, key=lambda s: s.deviation)
    return max(
        PositionFigure(spread, at, math.sqrt(variance)),
        PositionFigure(4.0 * alone.deviation, at, 4.0 * math.sqrt(alone.deviation_variance)),
        key=lambda figure: figure.value,
    )
