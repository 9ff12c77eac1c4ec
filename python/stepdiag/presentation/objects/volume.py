"""The object of `stepdiag volume --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration, __version__
from stepdiag.calibration.volume import Interval, VolumeErrors, VolumeFigure
from stepdiag.presentation.objects.calibration import Fit, fit_of, temperature_of
from stepdiag.presentation.objects.writer import in_unit, measured


class LengthFigure(TypedDict):
    value_um: float | None
    """null: a parameter that it needs is not determined"""
    interval_um: list[float | None] | None
    """95 %; null: the calibration has no covariance"""


class AngleFigure(TypedDict):
    value_urad: float | None
    interval_urad: list[float | None] | None


class Without(TypedDict):
    """Errors with a parameter, or all parameters of an axis, set to 0."""

    name: str
    """A parameter, or an axis X, Y, Z."""
    parameters: list[str]
    largest_um: float | None
    rms_um: float | None


class VolumeObject(TypedDict):
    """Result of `stepdiag volume`."""

    stepdiag: str
    format: Literal["stepdiag volume 1"]
    fit: Fit
    warnings: list[str]
    file: str
    temperature_reference_c: float | None
    """Positioning errors are referred to it; null: they are as found."""
    temperature_as_found_c: list[float] | None
    """Of the scales of X, Y, Z; null: not recorded, or referred to a temperature."""
    tool_mm: list[float]
    box_mm: list[list[float]]
    """Lowest and highest positions of X, Y, Z."""
    positions: list[int]
    """Of X, Y, Z: the grid has all combinations."""
    limit_um: float | None
    verdict: Literal["within", "not within", "undecided"] | None
    """Of the machine against the limit, at 95 %, as far as the calibration is valid (`fit`); null: no limit, or none
    for the reason below"""
    no_verdict_because: str | None
    bounds_um: list[float | None] | None
    """The largest error is above the first, and below the second, with 95 % or more each: the verdict's bounds."""
    largest_um: float | None
    """null: parameters are not determined"""
    interval_um: list[float | None] | None
    """95 % or more, of the largest error, with what lies between the nodes: 2.5 % at most beyond each end."""
    at_mm: list[float] | None
    """Commanded position of the largest error."""
    components_um: list[float | None]
    """X, Y, Z of the largest error: actual minus nominal."""
    rms_um: float | None
    rms_interval_um: list[float | None] | None
    between_nodes_um: float | None
    """Standard uncertainty by what lies between the nodes."""
    between_nodes_estimated: bool
    """From second differences of the tables; false: it was stated"""
    ranges: dict[str, LengthFigure]
    """X, Y, Z: largest minus smallest component."""
    tilts: dict[str, AngleFigure]
    """A, B, C: largest absolute rotation of the tool."""
    tilt_ranges: dict[str, AngleFigure]
    """A, B, C: largest minus smallest rotation."""
    diagonals: dict[str, LengthFigure]
    """ppp, npp, pnp, nnp: range of the errors along a body diagonal of the box."""
    missing: dict[str, list[str]]
    """X ... C: parameters that act in it and are not determined."""
    other_approaches_um: dict[str, float | None]
    """-++ ...: largest error of X, Y, Z approached in these directions; empty: not known. No interval."""
    ranking: list[Without]
    """Parameters, then axes; the smallest largest error first."""


def volume_object(found: VolumeErrors, file: Path, warnings: Sequence[str]) -> VolumeObject:
    """The errors of a calibration over a volume."""
    assert isinstance(found.source, Calibration)
    at = None if found.missing.keys() & set("XYZ") else found.largest_at.tolist()
    return {
        "stepdiag": __version__,
        "format": "stepdiag volume 1",
        "fit": fit_of(found.source),
        "warnings": list(warnings),
        "file": str(file),
        **temperature_of(found.source),
        "tool_mm": found.tool.tolist(),
        "box_mm": found.box.tolist(),
        "positions": list(found.shape),
        "limit_um": in_unit("um", found.limit),
        "verdict": found.verdict,
        "no_verdict_because": found.no_verdict_because or None,
        "bounds_um": _ends(found.bounds, "um"),
        "largest_um": in_unit("um", found.largest),
        "interval_um": _ends(found.largest_interval, "um"),
        "at_mm": at,
        "components_um": [in_unit("um", component) for component in found.largest_components],
        "rms_um": in_unit("um", found.rms),
        "rms_interval_um": _ends(found.rms_interval, "um"),
        "between_nodes_um": in_unit("um", found.between_nodes),
        "between_nodes_estimated": found.between_nodes_estimated,
        "ranges": {name: _figure(figure, "um") for name, figure in found.ranges.items()},
        "tilts": {name: _figure(figure, "urad") for name, figure in found.tilts.items()},
        "tilt_ranges": {name: _figure(figure, "urad") for name, figure in found.tilt_ranges.items()},
        "diagonals": {name: _figure(figure, "um") for name, figure in found.diagonals.items()},
        "missing": {name: list(parameters) for name, parameters in found.missing.items()},
        "other_approaches_um": {name: in_unit("um", value) for name, value in found.other_approaches.items()},
        "ranking": [
            {
                "name": one.name,
                "parameters": list(one.parameters),
                "largest_um": in_unit("um", one.largest),
                "rms_um": in_unit("um", one.rms),
            }
            for one in found.ranking
        ],
    }


def _ends(interval: Interval | None, unit: str) -> list[float | None] | None:
    return None if interval is None else [in_unit(unit, end) for end in interval]


def _figure(figure: VolumeFigure, unit: str) -> Any:
    return {**measured(unit, value=figure.value), f"interval_{unit}": _ends(figure.interval, unit)}
