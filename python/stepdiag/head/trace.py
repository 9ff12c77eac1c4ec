"""Where a head's light arrives and on which paths, and the range in which all readings exist."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag import _core

FloatArray = npt.NDArray[np.float64]
Pair = tuple[float, float]

LARGEST_TILT: Final = 0.1  # rad; no set-up has more
LARGEST_TRAVEL: Final = 1e3  # mm
SMALLEST: Final = 1e-5  # share of the largest, at which the search for a limit starts
ON_MIRROR: Final = 1e-6  # mm; rounding moves a point on a face by 1e-12 mm
HALVINGS: Final = 14  # bisections of the interval found by the search


@dataclass(frozen=True)
class Detector:
    """An interferometer's collimator, or a sensor."""

    name: str
    beam: str  # the beam that it detects
    position: FloatArray
    rotation: FloatArray  # head_R_detector

    def local(self, point: FloatArray) -> FloatArray:
        """A point of the head's frame in the detector's frame."""
        return (point - self.position) @ self.rotation


@dataclass(frozen=True)
class Arrival:
    """Light at the detector of its beam: the indices of its segments from the source on."""

    detector: Detector
    way: tuple[int, ...]
    spot: FloatArray  # detector frame, mm
    length: float  # optical path from the source, mm
    power: float  # share of the source's power


def detectors(design: _core.HeadDesign) -> list[Detector]:
    """One detector for each beam, in the order of the beams."""
    sensors = {sensor.name: sensor for sensor in design.sensors}
    found = []
    for beam in design.beams:
        place = sensors[beam.sensor] if beam.sensor else beam
        found.append(Detector(place.name, beam.name, place.position, place.rotation))
    return found


def arrivals(segments: Sequence[_core.BeamSegment], detector: Detector, distance: float) -> list[Arrival]:
    """Light of the detector's beam that arrives at it, for an aligned mirror at this distance (mm).

    Strongest first, then stray light that never met the mirror. All after the first are ghosts. The
    list is empty if only stray light arrives."""
    found = []
    for index, segment in enumerate(segments):
        if segment.beam != detector.beam or segment.arrives != detector.name:
            continue
        way = _way_to(segments, index)
        length = sum(segments[k].index * float(np.linalg.norm(segments[k].end - segments[k].start)) for k in way)
        spot = detector.local(segment.end)[:2]
        found.append(Arrival(detector, way, spot, length, segment.power))

    def is_straylight(arrival: Arrival) -> bool:
        return not any(meets_mirror(segments[k], distance) for k in arrival.way)

    found.sort(key=lambda arrival: (is_straylight(arrival), -arrival.power))
    return [] if not found or is_straylight(found[0]) else found


def angle_to_z(segments: Sequence[_core.BeamSegment], arrival: Arrival, distance: float) -> float:
    """Angle between z and the beam that first meets the mirror, rad."""
    (first, *_) = (segments[k] for k in arrival.way if meets_mirror(segments[k], distance))
    along = first.end - first.start
    return float(np.arctan2(np.hypot(along[0], along[1]), along[2]))


def meets_mirror(segment: _core.BeamSegment, distance: float) -> bool:
    """Whether a segment ends on an aligned mirror, which stands beyond all other faces."""
    return segment.fate != "left" and abs(float(segment.end[2]) - distance) < ON_MIRROR


def _way_to(segments: Sequence[_core.BeamSegment], index: int) -> tuple[int, ...]:
    way: list[int] = []
    while index >= 0:
        way.append(index)
        index = segments[index].parent
    return tuple(reversed(way))


@dataclass(frozen=True)
class Limits:
    """Lowest and highest value between which all readings exist; None if no limit was found."""

    low: float | None
    high: float | None


def tilt_limits(head: _core.Head, distance: float) -> dict[str, Limits]:
    """Limits of the mirror's tilts alpha and beta, rad, for a centred mirror."""
    return _limits(LARGEST_TILT, ("alpha", "beta"), lambda tilt: _is_read(head, distance, tilt, (0.0, 0.0)))


def travel_limits(head: _core.Head, distance: float) -> dict[str, Limits]:
    """Limits of the mirror's displacement along x and y, mm, for a mirror without tilt."""
    return _limits(LARGEST_TRAVEL, ("x", "y"), lambda lateral: _is_read(head, distance, (0.0, 0.0), lateral))


def _is_read(head: _core.Head, distance: float, tilt: Pair, lateral: Pair) -> bool:
    readings = _core.read_signals(head, distance=distance, tilt=tilt, lateral=lateral)
    return all(value is not None for value in readings.values())


def _limits(largest: float, names: tuple[str, str], is_read: Callable[[Pair], bool]) -> dict[str, Limits]:
    if not is_read((0.0, 0.0)):
        return {name: Limits(0.0, 0.0) for name in names}

    def ends(direction: Pair) -> float | None:
        return _first_lost(largest, lambda value: is_read((value * direction[0], value * direction[1])))

    def signed(value: float | None) -> float | None:
        return None if value is None else -value

    return {
        names[0]: Limits(signed(ends((-1.0, 0.0))), ends((1.0, 0.0))),
        names[1]: Limits(signed(ends((0.0, -1.0))), ends((0.0, 1.0))),
    }


def _first_lost(largest: float, is_read: Callable[[float], bool]) -> float | None:
    """The largest value up to which all is read: doubling, then bisection.

    None if there is no limit."""
    low, high = 0.0, SMALLEST * largest
    while is_read(high):
        low, high = high, 2.0 * high
        if high > largest:
            return None
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_read(middle) else (low, middle)
    return low
