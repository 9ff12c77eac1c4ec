"""The report of `stepdiag head check`: constants, light at the detectors, limits, mirror."""

from collections.abc import Iterator, Sequence

import numpy as np

from stepdiag import _core
from stepdiag.head.trace import (
    Arrival,
    Limits,
    angle_to_z,
    arrivals,
    detectors,
    meets_mirror,
    tilt_limits,
    travel_limits,
)
from stepdiag.units import MICRO

SQUARE = 1e-9  # rad; allows for rounding


def check_report(head: _core.Head, distances: Sequence[float]) -> Iterator[str]:
    """Lines of the report, for an aligned mirror at each of the distances (mm)."""
    design = head.design
    assert design is not None
    yield f"{design.name}: layout {design.layout}, reads {', '.join(head.signals)}"
    yield f"  bodies: {', '.join(body.name for body in design.bodies) or 'none'}"
    yield f"  beams: {', '.join(beam.name for beam in design.beams)}"
    yield f"  sensors: {', '.join(sensor.name for sensor in design.sensors) or 'none'}"
    yield ""
    yield from _calibration(head)
    yield ""
    yield from _light(head, distances)
    yield ""
    yield from _limits(head, distances)
    yield ""
    yield from _mirror(head, distances)


def _calibration(head: _core.Head) -> Iterator[str]:
    calibration = head.calibration
    yield "Nominal calibration (all that an evaluation knows of the head):"
    names = [name for name in head.signals if name.startswith("d")]
    for name, constant in zip(names, calibration.head_constants, strict=False):
        yield f"  {name + ' constant':<20}{constant:14.6f} mm, subtracted from readings: glass, path before the plane"
    for name, (u, v) in zip(names, calibration.beam_offsets, strict=False):
        yield f"  {name + ' beam at (u, v)':<20}{_tidy(u):14.6f}, {_tidy(v):.6f} mm"
    if calibration.psd_distance is not None:
        yield f"  {'PSD distance':<20}{calibration.psd_distance:14.6f} mm behind the plane, unfolded, glass reduced"
        u, v = calibration.spot_beam
        yield f"  {'its beam at (u, v)':<20}{_tidy(u):14.6f}, {_tidy(v):.6f} mm"


def _light(head: _core.Head, distances: Sequence[float]) -> Iterator[str]:
    yield "Light at the detectors (spot in the detector's frame, optical path from the source, share of its power):"
    yield f"  {'mirror':>9}  {'detector':<18}{'spot x':>12}{'spot y':>12}{'path':>15}{'power':>10}  ghosts"
    yield f"  {'mm':>9}  {'':<18}{'mm':>12}{'mm':>12}{'mm':>15}{'%':>10}"
    assert head.design is not None
    out_of_square = {}
    for distance in distances:
        segments = _core.trace_beams(head, distance=distance)
        for detector in detectors(head.design):
            found = arrivals(segments, detector, distance)
            yield f"  {distance:9g}  {detector.name:<18}" + (_arrival(found) if found else f"{'no light':>12}")
            if found and distance == distances[-1]:
                out_of_square[detector.beam] = angle_to_z(segments, found[0], distance)
    for beam, angle in out_of_square.items():
        if angle > SQUARE:
            yield f"  {beam} leaves {angle * MICRO:.3g} µrad out of square to z, which reads like a misaligned laser"


def _arrival(found: list[Arrival]) -> str:
    first, ghosts = found[0], found[1:]
    text = f"{_tidy(first.spot[0]):12.6f}{_tidy(first.spot[1]):12.6f}{first.length:15.6f}{100.0 * first.power:10.4f}"
    return text + (f"  {len(ghosts)}: {100.0 * sum(ghost.power for ghost in ghosts):.3g} %" if ghosts else "  none")


def _tidy(value: float) -> float:
    """The value without the sign of a zero that comes from rounding."""
    return 0.0 if abs(value) < 5e-7 else value


def _limits(head: _core.Head, distances: Sequence[float]) -> Iterator[str]:
    size = "" if head.mirror is None else f" of {head.mirror[0]:g} x {head.mirror[1]:g} mm"
    yield f"All readings exist for tilts (at travel 0) and travels (at tilt 0) of a mirror{size} between:"
    yield f"  {'mirror':>9}{'alpha':>21}{'beta':>21}{'x':>21}{'y':>21}"
    yield f"  {'mm':>9}{'mrad':>21}{'mrad':>21}{'mm':>21}{'mm':>21}"
    for distance in distances:
        tilt, travel = tilt_limits(head, distance), travel_limits(head, distance)
        cells = [_span(tilt[name], 1e3) for name in ("alpha", "beta")] + [
            _span(travel[name], 1.0) for name in ("x", "y")
        ]
        yield f"  {distance:9g}" + "".join(f"{cell:>21}" for cell in cells)


def _span(limits: Limits, scale: float) -> str:
    if limits.low == limits.high == 0.0:
        return "lost"
    low, high = ("no end" if end is None else f"{end * scale:+.4g}" for end in (limits.low, limits.high))
    return f"{low} .. {high}"


def _mirror(head: _core.Head, distances: Sequence[float]) -> Iterator[str]:
    """The smallest mirror, centred on z, that the axes of all beams meet."""
    half = np.zeros(2)
    for distance in distances:
        for segment in _core.trace_beams(head, distance=distance):
            if meets_mirror(segment, distance):
                half = np.maximum(half, np.abs(segment.end[:2]))
    width, height = 2.0 * half
    yield f"Smallest mirror, its middle on the head's z: {width:.4g} x {height:.4g} mm for the axes of the beams;"
    yield "add the beams' diameters and the lateral excursion of the plan."
