"""How long a plan takes to measure: moves of a trapezoidal speed, settling, readings, and a set-up for each line."""

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument, Plan
from stepdiag.config.plan_by_time_keys import PlanByTimeSection
from stepdiag.units import MINUTE

FloatArray = npt.NDArray[np.float64]

Place = tuple[float, ...]  # (3,) mm

HOME: Final[Place] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Times:
    """In s and mm."""

    feed: float  # mm/s
    acceleration: float  # mm/s^2, infinite: at once
    settle: float
    measure: float
    line_change: float
    scale_line_change: float

    def move(self, length: npt.ArrayLike) -> FloatArray:
        """Time of moves from rest to rest, s: at full speed, and as long again as it takes to get there; a short move
        never gets there, and speeds up for one half of its length and slows down for the other."""
        length = np.asarray(length, dtype=float)
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


@dataclass(frozen=True)
class OnLine:
    """What a line takes whatever is measured before and after it."""

    set_up: float  # s
    seconds: float  # from its first point to its last reading, that of the first point included
    readings: int
    reading: float  # s
    first: Place  # where it begins and ends
    last: Place


def on_lines(plan: Plan, times: Times, *, repeats: int = 1, backward: bool = False) -> dict[str, OnLine]:
    """Of each line of a plan, in its order.

    `repeats`: runs of each line, backward ones not counted. A backward run begins where the forward one ended; a
    forward run after another goes back to the line's first point."""
    found = {}
    reading = times.settle + times.measure
    for line, passes in itertools.groupby(plan.passes(repeats, backward=backward), key=lambda planned: planned.line):
        way = np.concatenate([planned.positions for planned in passes])
        moving = float(times.move(np.linalg.norm(np.diff(way, axis=0), axis=1)).sum())
        set_up = times.scale_line_change if line in plan.scale_lines else times.line_change
        ends = tuple(way[0].tolist()), tuple(way[-1].tolist())
        found[line] = OnLine(set_up, moving + len(way) * reading, len(way), reading, *ends)
    return found


def in_turn(lines: Iterable[OnLine], times: Times) -> tuple[float, float]:
    """Seconds from home to the last reading of lines that are measured one after another, and the mean time from a
    reading to the next one on a line."""
    total, place = 0.0, HOME
    measuring, gaps = 0.0, 0
    for line in lines:
        total += line.set_up + _move(times, place, line.first) + line.seconds
        measuring += line.seconds - line.reading
        gaps += line.readings - 1
        place = line.last
    return total, measuring / gaps


@lru_cache(maxsize=4096)  # a search for plans asks for the same few moves again and again
def _move(times: Times, start: Place, end: Place) -> float:
    return float(times.move(np.linalg.norm(np.subtract(end, start))))


def measuring_time(plan: Plan, times: Times, *, repeats: int = 1, backward: bool = False) -> tuple[float, float]:
    """As `in_turn`, of a plan with so many runs of each line."""
    return in_turn(on_lines(plan, times, repeats=repeats, backward=backward).values(), times)
