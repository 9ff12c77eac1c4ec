"""What a measuring program does, one action after the other, whatever the language it is written in.

Assumed: a line's head stands outside the volume, `standoff` before the line's first point, and nothing else is in the
way of the mirror within the volume and `overrun` around it. Between set-ups the axes move one at a time, to the safe
position in the order `retreat`, from there in the reverse order; within a set-up they keep to the line, so that the
beam is not interrupted, on a straight way even when they go back to its beginning.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument
from stepdiag.scenario.order_of_run import Visit

Vector = npt.NDArray[np.float64]

AXES = "XYZ"
SLACK = 1e-9  # mm: sums of origins and positions round


@dataclass(frozen=True)
class Space:
    """Where the axes may go: controller's coordinates, mm."""

    origin: Vector  # of home
    safe: Vector
    retreat: str = "ZXY"  # a permutation of XYZ
    overrun: float = 1.0
    lowest: Vector = field(default_factory=lambda: np.full(3, -np.inf))
    highest: Vector = field(default_factory=lambda: np.full(3, np.inf))


@dataclass(frozen=True)
class SetUp:
    """The axes are at the safe position. Head and mirror are set up for the line of this visit."""

    visit: Visit


@dataclass(frozen=True)
class Align:
    """The axes are at the line's first point, for the beam to be aligned."""

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
    short: tuple[int, ...] = ()  # axes that the travel kept from overrunning in full


@dataclass(frozen=True)
class Read:
    visit: Visit
    point: int


Action = SetUp | Align | Begin | Rapid | Feed | Read


def actions_of(visits: list[Visit], space: Space, *, align: bool = True) -> Iterator[Action]:
    """All actions, from the safe position back to it. Raises InvalidArgument for what is out of the travel."""
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
        yield from _approach(positions[0], visit, space)
        for position, point in zip(positions, visit.points, strict=True):
            yield Feed(position)
            yield Read(visit, int(point))
    yield from _one_at_a_time(space.safe, space.retreat)


def _approach(first: Vector, visit: Visit, space: Space) -> Iterator[Feed]:
    """Beyond the first point, for every axis to come to it from its side. From there on the steps of a line keep to
    that: an axis that it moves goes on as it came, and the others stand still."""
    if space.overrun == 0.0:
        return
    wanted = first - space.overrun * visit.approach
    beyond = np.clip(wanted, space.lowest, space.highest)
    short = tuple(int(axis) for axis in np.flatnonzero(np.abs(beyond - wanted) > SLACK))
    yield Feed(beyond, short)


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
