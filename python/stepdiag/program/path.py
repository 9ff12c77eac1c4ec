"""The actions of a measuring program one after the other, in no particular language.

Assumptions: the head of a line stands outside the volume, `standoff` before the first point of the
line, and nothing else obstructs the mirror in the volume and `overrun` around it. Between set-ups
the axes move one at a time, to the safe position in the order `retreat` and from there in the
reverse order. Within a set-up they stay on the line, so that the beam is not interrupted; they also
return to its beginning in a straight line.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument
from stepdiag.scenario.order_of_run import Visit

Vector = npt.NDArray[np.float64]

AXES = "XYZ"
SLACK = 1e-9  # mm; allows for rounding in sums of origin and position


@dataclass(frozen=True)
class Space:
    """Where the axes may move: controller's coordinates, mm."""

    origin: Vector  # home
    safe: Vector
    retreat: str = "ZXY"  # order of the axes, a permutation of XYZ
    overrun: float = 1.0
    lowest: Vector = field(default_factory=lambda: np.full(3, -np.inf))
    highest: Vector = field(default_factory=lambda: np.full(3, np.inf))


@dataclass(frozen=True)
class SetUp:
    """A stop at the safe position to set up head and mirror for the line of this visit."""

    visit: Visit


@dataclass(frozen=True)
class Align:
    """A stop at the first point of the line to align the beam."""

    visit: Visit


@dataclass(frozen=True)
class Begin:
    visit: Visit


@dataclass(frozen=True)
class Rapid:
    axis: int
    position: float


@dataclass(frozen=True)
class Feed:
    position: Vector  # (3,)


@dataclass(frozen=True)
class Read:
    visit: Visit
    point: int


Action = SetUp | Align | Begin | Rapid | Feed | Read


def actions_of(visits: list[Visit], space: Space, *, align: bool = True) -> Iterator[Action]:
    """All actions, from the safe position back to it.

    Raises InvalidArgument for positions outside the limits."""
    _check(visits, space)
    set_up = 0
    for visit in visits:
        positions = visit.positions + space.origin
        if visit.set_up != set_up:
            yield from _one_at_a_time(space.safe, space.retreat)
            yield SetUp(visit)
            yield from _one_at_a_time(positions[0], space.retreat[::-1])
            if align:
                yield Align(visit)
            set_up = visit.set_up
        yield Begin(visit)
        for index, (position, point) in enumerate(zip(positions, visit.points, strict=True)):
            if index == 0 or np.any((position - positions[index - 1]) * visit.approach < -SLACK):
                yield from _approach(position, visit, space)
            yield Feed(position)
            yield Read(visit, int(point))
    yield from _one_at_a_time(space.safe, space.retreat)


def _approach(point: Vector, visit: Visit, space: Space) -> Iterator[Feed]:
    """Move beyond a point, such that every axis approaches it from the specified side, as far as limits allow.

    That is needed for the first point, and where the way goes back to a check point. Steps keep the
    direction: moved axes continue as they came, the others stand still."""
    if space.overrun == 0.0:
        return
    yield Feed(np.clip(point - space.overrun * visit.approach, space.lowest, space.highest))


def _one_at_a_time(position: Vector, order: str) -> Iterator[Rapid]:
    for name in order:
        axis = AXES.index(name)
        yield Rapid(axis, float(position[axis]))


def _check(visits: list[Visit], space: Space) -> None:
    if sorted(space.retreat) != list(AXES):
        raise InvalidArgument(f'retreat: expected a permutation of XYZ, got "{space.retreat}"')
    for axis, (low, high) in enumerate(zip(space.lowest, space.highest, strict=True)):
        if not low < high:
            raise InvalidArgument(f"limits of {AXES[axis]}: expected the lower one first, got {low:g} and {high:g}")
    places = [("the safe position", space.safe[None, :])]
    places += [(f"line {visit.line}", visit.positions + space.origin) for visit in visits]
    for name, positions in places:
        outside = (positions < space.lowest - SLACK) | (positions > space.highest + SLACK)
        if outside.any():
            row, axis = (int(index) for index in np.argwhere(outside)[0])
            raise InvalidArgument(
                f"{name}: {AXES[axis]} {positions[row, axis]:g} is out of its limits, "
                f"{space.lowest[axis]:g} to {space.highest[axis]:g} mm"
            )
