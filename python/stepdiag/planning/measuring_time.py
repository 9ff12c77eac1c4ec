"""How long a plan takes to measure: moves of a trapezoidal speed, settling, readings, and a set-up for each line."""

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument, Plan
from stepdiag.config.plan_by_time_keys import PlanByTimeSection
from stepdiag.units import MINUTE

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Times:
    """In s and mm."""

    feed: float  # mm/s
    acceleration: float  # mm/s^2, infinite: at once
    settle: float
    measure: float
    line_change: float
    scale_line_change: float

    def move(self, length: FloatArray) -> FloatArray:
        """Time of moves from rest to rest, s: at full speed, and as long again as it takes to get there; a short move
        never gets there, and speeds up for one half of its length and slows down for the other."""
        reached = self.feed**2 / self.acceleration
        short = 2.0 * np.sqrt(length / self.acceleration)
        return np.where(length < reached, short, length / self.feed + self.feed / self.acceleration)


def times_of(keys: PlanByTimeSection, place: str) -> Times:
    """Of a scenario's [plan_by_time]; `place` names it in messages. Raises InvalidArgument."""
    change = keys.line_change_min
    scale_change = change if keys.scale_line_change_min is None else keys.scale_line_change_min
    feed, acceleration = keys.feed_mm_per_min / MINUTE, keys.acceleration_mm_per_s2
    if keys.seconds_per_mm is not None:
        for name in ("feed_mm_per_min", "acceleration_mm_per_s2"):
            if name in keys.model_fields_set:
                raise InvalidArgument(f"{place}.seconds_per_mm: expected it or {name}, got both")
        feed, acceleration = 1.0 / keys.seconds_per_mm, np.inf
    return Times(feed, acceleration, keys.settle_s, keys.measure_s, change * MINUTE, scale_change * MINUTE)


def measuring_time(plan: Plan, times: Times, *, repeats: int = 1, backward: bool = False) -> tuple[float, float]:
    """Seconds from home to the last reading, and the mean time from a reading to the next one on a line.

    `repeats`: runs of each line, backward ones not counted. A backward run begins where the forward one ended; a
    forward run after another goes back to the line's first point."""
    total, place = 0.0, np.zeros(3)
    on_lines, gaps = 0.0, 0
    for line, passes in itertools.groupby(plan.passes(repeats, backward=backward), key=lambda planned: planned.line):
        total += times.scale_line_change if line in plan.scale_lines else times.line_change
        way = np.concatenate([planned.positions for planned in passes])
        total += float(times.move(np.linalg.norm(way[:1] - place, axis=1)).sum())
        moving = float(times.move(np.linalg.norm(np.diff(way, axis=0), axis=1)).sum())
        reading = times.settle + times.measure
        total += moving + len(way) * reading
        on_lines += moving + (len(way) - 1) * reading
        gaps += len(way) - 1
        place = way[-1]
    return total, on_lines / gaps
