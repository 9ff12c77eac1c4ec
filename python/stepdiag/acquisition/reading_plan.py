"""What an acquisition reads: channels of the head, visits, and positions of head and mirror."""

import hashlib
from collections.abc import Sequence

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.raw_records import Visited
from stepdiag.instruments.ids3010 import AXES
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit, visits_of


def channels_of_axes(known: Known) -> list[str]:
    """Channels filled by the axes of an IDS3010. Raises InvalidArgument for an unsuitable head."""
    head = known.head
    if head.layout == "multi_beam":
        if len(head.signals) != AXES:
            raise InvalidArgument(
                f"{known.path}: head: expected {AXES} beams, one for each axis of the IDS3010, got {len(head.signals)}"
            )
        return list(head.signals)
    if head.layout == "ideal":
        return ["distance"]  # the conventional evaluation needs no other channel
    raise InvalidArgument(
        f'{known.path}: head: the layout "{head.layout}" cannot be read: the IDS3010 gives distances and no spot; '
        f'expected "multi_beam" with {AXES} beams, or "ideal" of which one axis reads the distance, or a source of '
        "lines, which gives anything"
    )


def check_axes(axes: Sequence[int], channels: Sequence[str]) -> None:
    """Raise InvalidArgument unless there is one instrument axis (from 1) for each channel."""
    good = len(set(axes)) == len(axes) == len(channels) and all(1 <= axis <= AXES for axis in axes)
    if not good:
        raise InvalidArgument(
            f"axes: expected {len(channels)} different numbers from 1 to {AXES} ({', '.join(channels)}), "
            f"got {','.join(map(str, axes)) or 'none'}"
        )


def nominal_distances(known: Known, visit: Visit) -> list[float]:
    """Readings in mm of an ideal head along a visit, on a machine without errors."""
    start = known.plan.points(visit.line, visit.run)[0]
    along = known.plan.frame(visit.line)[:, 2]
    return [float(d) for d in known.heads[visit.line].standoff + (visit.positions - start) @ along]


def described_plan(known: Known) -> list[Visited]:
    """The visits as records of a raw file."""
    return [
        Visited(
            visit=visit.number,
            set_up=visit.set_up,
            line=visit.line,
            run=visit.run,
            direction=visit.direction,
            scale_line=visit.is_scale_line,
            points=[int(point) for point in visit.points],
            position_mm=[(float(x), float(y), float(z)) for x, y, z in visit.positions],
            nominal_mm=nominal_distances(known, visit),
        )
        for visit in visits_of(known)
    ]


def digest_of(channels: Sequence[str], plan: Sequence[Visited]) -> str:
    """Digest of everything that must be unchanged for an acquisition to be resumed."""
    text = ",".join(channels) + "".join(visit.model_dump_json() for visit in plan)
    return hashlib.sha256(text.encode()).hexdigest()
