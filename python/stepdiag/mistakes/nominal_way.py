"""Distances beside the nominal way: what one line shows by itself, to millimetres, without an adjustment.

Along a line the distance grows as the functional point goes on, less what machine and set-up do to it, which is below
what a machine can be. What is grosser is a mistake."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag.mistakes.copies import Rows, Values, distances_of, passes_of
from stepdiag.scenario.known import Known

# Beside the way: what a machine and a head that is 0.05 rad askew may make.
ABSOLUTE: Final = 2.0  # mm
RELATIVE: Final = 2e-3
MOST: Final = 0.2  # share of a line's readings that may be wrong by themselves


@dataclass(frozen=True)
class Way:
    """One line of one run: the travel along it and the distance read there, mm, by row; NaN: lost."""

    run: int
    line: str
    rows: Rows
    travel: Values
    distance: Values

    @property
    def is_gross(self) -> bool:
        """Whether distances are not those of the plan, and not because single readings are wrong."""
        beside = self.distance - self.travel
        beside = beside[np.isfinite(beside)]
        limit = ABSOLUTE + RELATIVE * float(np.ptp(self.travel))
        half = len(beside) // 2
        if not half:
            return False
        median = np.partition(beside, half)[half]  # np.median imports numpy.ma, which takes longer than the rest
        return bool(np.mean(np.abs(beside - median) > limit) > MOST)


def ways_of(known: Known, run: _core.Measurement) -> list[Way]:
    """Every line of every run."""
    distance = distance_of(known, run)
    along = {line: known.plan.frame(line)[:, 2] for line in set(run.line)}
    position = run.position  # a copy of all
    return [
        Way(number, line, rows, position[rows] @ along[line], distance[rows])
        for (number, line), rows in passes_of(run).items()
    ]


def distance_of(known: Known, run: _core.Measurement) -> Values:
    """The distance of each row; of beams their mean."""
    channels = run.channels
    read = [channels[name] for name in distances_of(known) if name in channels]
    return np.add.reduce(read) / len(read) if read else np.full(len(run), np.nan)


@dataclass(frozen=True)
class Shift:
    """Readings of a line stand in the wrong rows from one on. `source`: which reading each row should have, -1: none;
    places in the line."""

    twice: bool  # else skipped
    place: int  # of the first row with a reading that does not belong there
    source: Rows


def shift_of(way: Way) -> Iterator[Shift]:
    """Of a point that was read twice or skipped, if the distances say so."""
    read, planned = np.diff(way.distance), np.diff(way.travel)
    count = len(planned)
    if count < 4:
        return
    least = float(np.min(np.abs(planned)))
    as_planned = np.abs(read - planned)
    usual = float(np.nansum(as_planned))
    later, before = np.abs(read[1:] - planned[:-1]), np.abs(read[:-1] - planned[1:])
    # Of a change at place i: what the increments before, at and after it are off.
    until = np.concatenate([[0.0], np.nancumsum(as_planned)])
    after_twice = _sum_from(later)  # increments i+1 ... are those planned one before
    after_skip = _sum_from(before)  # increments i+1 ... are those planned one later
    twice = [until[i] + abs(read[i]) + after_twice[i] for i in range(count)]
    skipped = [
        until[i] + abs(read[i] - planned[i] - (planned[i + 1] if i + 1 < count else 0.0)) + _at(after_skip, i + 1)
        for i in range(count - 1)
    ]
    for costs, is_twice in ((twice, True), (skipped, False)):
        found = np.array(costs)
        if not np.isfinite(found).any():
            continue
        i = int(np.nanargmin(found))
        if usual - found[i] > max(0.5 * least, 0.7 * usual):
            row = np.arange(count + 1)
            source = np.where(row > i, row + 1, row) if is_twice else np.where(row > i, row - 1, row)
            if not is_twice:
                source[i + 1] = -1
            source[source > count] = -1
            yield Shift(is_twice, i + 1, source)


def _sum_from(values: Values) -> Values:
    """Of `values[i:]`, for every i, one more included."""
    return np.concatenate([np.nancumsum(values[::-1])[::-1], [0.0]])


def _at(values: Values, place: int) -> float:
    return float(values[place]) if place < len(values) else 0.0


def axis_lengths(known: Known, ways: Sequence[Way]) -> Values | None:
    """The edges of a volume in which the distances are those of the plan, mm; None where they do not determine it."""
    edges, rows, lengths = np.array(known.plan.volume), [], []
    for way in ways:
        ends = np.flatnonzero(np.isfinite(way.distance))
        if len(ends) < 2 or abs(way.travel[ends[-1]] - way.travel[ends[0]]) < 0.5 * float(np.ptp(way.travel)):
            continue
        share = abs(way.travel[ends[-1]] - way.travel[ends[0]]) / float(np.ptp(way.travel))
        rows.append([float(sign != "0") for sign in way.line])
        lengths.append(((way.distance[ends[-1]] - way.distance[ends[0]]) / share) ** 2)
    moved = np.array(rows)
    if not len(rows) or np.linalg.matrix_rank(moved) < 3:
        return None
    # The squares of the edges add up to those of the lines.
    squares, *_ = np.linalg.lstsq(moved, np.array(lengths), rcond=None)
    found = np.sqrt(np.maximum(squares, 0.0))
    return found if np.all(found > 0.1 * edges) and np.all(found < 10.0 * edges) else None


def line_remark(way: Way, others: dict[str, npt.NDArray[np.float64]]) -> str | None:
    """What is odd about a line just read, by its distances alone. `others`: travel along other lines of the plan."""
    good = np.isfinite(way.distance)
    if np.count_nonzero(good) < 2:
        return None
    read, travel = way.distance[good], way.travel[good]
    extent = float(np.ptp(travel))
    if float(np.ptp(read)) < 0.02 * extent:
        return "the distances hardly change: does the mirror move, and is it this line's beam that is read?"
    if not way.is_gross:
        return None
    for shift in shift_of(way):
        return f"a point was {'read twice' if shift.twice else 'skipped'} at reading {shift.place + 1} of the line"
    growth = float(np.dot(read - read.mean(), travel - travel.mean()) / np.sum((travel - travel.mean()) ** 2))

    def fits(other: Values) -> bool:
        other = other[good]
        beside = read - other
        return bool(np.max(np.abs(beside - np.median(beside))) < ABSOLUTE + RELATIVE * float(np.ptp(other)))

    if fits(-way.travel):
        return "the distances fall as the plan's travel grows: the sign of distances is wrong, or the line is reversed"
    for line, other in others.items():
        if len(other) == len(way.travel) and fits(other):
            return f"the distances are those of line {line}"
    return f"the distances grow by {growth:.4g} mm for each mm of the plan's travel"
