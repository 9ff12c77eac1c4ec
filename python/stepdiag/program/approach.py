"""From which side the axes come to the points of a program, as its moves are written."""

from collections.abc import Iterable, Iterator
from itertools import groupby

import numpy as np

from stepdiag.program.gcode import Writer
from stepdiag.program.path import AXES, Action, Feed, Rapid, Read, Vector
from stepdiag.scenario.order_of_run import Visit

Approach = tuple[Read, Vector]  # of every axis the signed way since it last turned; NaN if it has not moved yet


def approaches(actions: Iterable[Action], writer: Writer) -> Iterator[Approach]:
    """How the axes come to each reading. Where they stand before the program is unknown."""
    place, ways = np.full(3, np.nan), np.full(3, np.nan)
    for action in actions:
        there = place.copy()
        if isinstance(action, Rapid):
            there[action.axis] = float(writer.number(action.position))
        elif isinstance(action, Feed):
            there = np.array([float(writer.number(float(value))) for value in action.position])
        elif isinstance(action, Read):
            yield action, ways.copy()
        moved = there - place
        for axis in np.flatnonzero(np.abs(moved) > 0.0):  # not the first moves, which begin at NaN
            ways[axis] = moved[axis] + (ways[axis] if moved[axis] * ways[axis] > 0.0 else 0.0)
        place = there


def otherwise(found: Iterable[Approach], overrun: float, writer: Writer) -> dict[int, str]:
    """By the number of a visit: which of its points the axes do not come to as it says, and how they do.

    An axis has to come from its side, by the overrun or more. Visits that keep to that are left out."""
    texts = {}
    for visit, readings in groupby(found, key=lambda one: one[0].visit):
        readings_of_visit = list(readings)
        parts = []
        for axis, name in enumerate(AXES):
            ways = [_way(visit, axis, float(way[axis]), overrun, writer) for _, way in readings_of_visit]
            points = [read.point for read, _ in readings_of_visit]
            for way in dict.fromkeys(filter(None, ways)):
                at = [point for point, its in zip(points, ways, strict=True) if its == way]
                parts.append(f"{name} comes to {_ranges(at)} {way}")
        if parts:
            texts[visit.number] = "; ".join(parts)
    return texts


def _way(visit: Visit, axis: int, way: float, overrun: float, writer: Writer) -> str:
    """Empty if it is as the visit says."""
    if np.isnan(way):
        return "from where it stood before the program"
    side = "below" if way > 0.0 else "above"
    if way * visit.approach[axis] < 0.0:
        return f"from {side}"
    rounding = 10.0**-writer.decimals  # of both ends of the way
    return "" if abs(way) >= overrun - 1.5 * rounding else f"from {side} by {abs(way):.3g} mm only"


def _ranges(points: list[int]) -> str:
    """Such as "points 0 to 5, 7"; the points of a visit ascend or descend by 1, check points too."""
    ranges: list[list[int]] = []
    for point in points:
        if ranges and abs(point - ranges[-1][-1]) == 1:
            ranges[-1] = [ranges[-1][0], point]
        else:
            ranges.append([point, point])
    texts = [f"{first}" if first == last else f"{first} to {last}" for first, last in ranges]
    return f"{'point' if len(points) == 1 else 'points'} {', '.join(texts)}"
