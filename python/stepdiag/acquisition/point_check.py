"""A reading beside the plan, at once: has the distance changed by what the commanded positions say?

The sum of what a machine and a set-up may do to a distance is far below what a mistake does:
errors of tenths of a millimetre, and a mirror that is some milliradians askew, which the steps
across the line turn into a change of the distance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag.acquisition.triggers import AXES
from stepdiag.instruments.instrument import ReadColumn, Row
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit

# By how much a change of the distance may differ from the plan's.
ABSOLUTE: Final = 0.5  # mm: errors of a machine
RELATIVE: Final = 0.02  # of the way between the two points: a mirror that is 20 mrad askew
STILL: Final = 0.05  # mm, or a tenth of the step: the mirror did not move
MOST: Final = 3  # messages in a visit

Vector = npt.NDArray[np.float64]


@dataclass(frozen=True)
class _Place:
    """A reading: where it was taken, and its distances by channel, mm."""

    visit: Visit
    index: int
    distances: Mapping[str, float]

    @property
    def key(self) -> tuple[int, int]:
        return self.visit.number, self.index

    @property
    def position(self) -> Vector:
        return np.asarray(self.visit.positions[self.index])


@dataclass(frozen=True)
class _State:
    """What a reading is compared with, all of one set-up. One of the first two will do."""

    agreed: _Place | None = None  # the last that was as planned
    last: _Place | None = None
    first: _Place | None = None  # of its visit
    told: int = 0  # in its visit


class PointCheck:
    """Compares each reading with those before it on its set-up."""

    def __init__(self, known: Known, columns: Sequence[ReadColumn], sign: int) -> None:
        self._known, self._columns, self._sign = known, columns, sign
        self._state = self._before = _State()

    def look(self, visit: Visit, index: int, row: Row) -> str | None:
        """What is odd about a reading, if anything. It takes the place of an earlier one of the same point."""
        place = _Place(visit, index, self._distances(row))
        if self._state.last is not None and self._state.last.key == place.key:
            self._state = self._before  # read once more
        self._before = state = self._of_this_set_up(visit)
        if not place.distances:
            return None
        self._state = _State(place, place, state.first or place, state.told)
        if state.agreed is None or state.last is None or state.first is None:
            return None
        text = None
        if self._is_odd(state.agreed, place) and self._is_odd(state.last, place):
            text = self._text(state.last if state.last.visit.number == visit.number else state.agreed, place)
        elif not state.told and self._is_odd(state.first, place):  # steps too short to tell each
            text = self._text(state.first, place)
        if text is None:
            return None
        told = state.told + 1
        self._state = _State(state.agreed, place, state.first, told)
        if told > MOST:
            return None
        return text + ("; no more is said of this visit" if told == MOST else "")

    def _of_this_set_up(self, visit: Visit) -> _State:
        state = self._state
        if state.last is None or state.last.visit.set_up != visit.set_up:
            return _State()
        if state.last.visit.number != visit.number:
            return _State(state.agreed, state.last)
        return state

    def _distances(self, row: Row) -> dict[str, float]:
        return {
            column.channel: self._sign * float(column.native(value))
            for column, value in zip(self._columns, row, strict=True)
            if column.is_distance and value is not None
        }

    def _step(self, last: _Place, place: _Place) -> float:
        """The change of the distance that the plan says."""
        return float((place.position - last.position) @ self._known.plan.frame(place.visit.line)[:, 2])

    def _off(self, last: _Place, place: _Place) -> dict[str, float]:
        """The changes of the distances that are not those of the plan."""
        step, limit = self._step(last, place), _limit(last, place)
        return {
            name: now - last.distances[name]
            for name, now in place.distances.items()
            if name in last.distances and abs(now - last.distances[name] - step) > limit
        }

    def _is_odd(self, last: _Place, place: _Place) -> bool:
        return bool(self._off(last, place))

    def _text(self, last: _Place, place: _Place) -> str:
        off = self._off(last, place)
        both = place.distances.keys() & last.distances.keys()
        step, change = self._step(last, place), sum(off.values()) / len(off)
        since = f"point {int(last.visit.points[last.index])}"
        if last.visit.number != place.visit.number:
            since += f" of visit {last.visit.number}"
        names = "the distance" if len(off) == len(both) else ", ".join(off)
        changed = f"{names} changed by {change:+.3f} mm since {since}, where the plan has {step:+.3f} mm"
        if len(off) < len(both):
            return f"{changed} and the others have that: is this beam on the mirror, and is it read by the right axis?"
        return f"{changed}: {self._guess(last, place, step, change)}"

    def _guess(self, last: _Place, place: _Place, step: float, change: float) -> str:
        limit = _limit(last, place)
        if abs(change) <= max(STILL, 0.1 * abs(step)):
            return "did the mirror move?"
        if abs(change + step) <= limit:
            moved = [AXES[axis] for axis in np.flatnonzero(np.abs(place.position - last.position) > 1e-6)]
            return (
                f"it is the other way round: {' or '.join(moved)} may move the wrong way, the machine may follow "
                "another line, or the sign of distances is wrong (`sign`)"
            )
        others = [_Place(place.visit, index, {}) for index in range(len(place.visit.points)) if index != place.index]
        beside = [abs(change - self._step(last, other)) for other in others]
        if others and min(beside) <= ABSOLUTE:
            other = others[int(np.argmin(beside))]
            return f"this is the distance of point {int(other.visit.points[other.index])}"
        plan, run = self._known.plan, place.visit.run
        for line in (*plan.lines, *plan.scale_lines):
            points = plan.points(line, run)
            if line != place.visit.line and len(points) > max(place.visit.points):
                there = points[place.visit.points[place.index]] - points[last.visit.points[last.index]]
                if abs(change - float(there @ plan.frame(line)[:, 2])) <= ABSOLUTE:
                    return f"this is the step of line {line}"
        return "is it this point, and this line's head?"


def _limit(last: _Place, place: _Place) -> float:
    return ABSOLUTE + RELATIVE * float(np.linalg.norm(place.position - last.position))
