"""The object of `stepdiag volume --json`."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration
from stepdiag.calibration.volume import VolumeErrors, VolumeFigure
from stepdiag.presentation.blocks import data_of
from stepdiag.presentation.objects.calibration import Fit, Temperature, fit_of, temperature_of
from stepdiag.presentation.objects.writer import Reported, first_keys
from stepdiag.presentation.quantity import Quantities, Quantity, Unit, quantities, quantity, with_interval
from stepdiag.presentation.volume import volume_blocks


class Without(TypedDict):
    """Errors with a parameter, or all parameters of an axis, set to 0."""

    name: str
    """A parameter, or an axis X, Y, Z."""
    parameters: list[str]
    largest: Quantity
    rms: Quantity


class VolumeObject(Reported, Temperature):
    """Result of `stepdiag volume`."""

    fit: Fit
    file: str
    tool: Quantities
    box: list[Quantities]
    """Of X, Y, Z: lowest and highest position."""
    positions: list[int]
    """Of X, Y, Z: the grid has all combinations."""
    limit: Quantity
    verdict: Literal["within", "not within", "undecided"] | None
    """Of the machine against the limit, at 95 %, as far as the calibration is valid (`fit`); null: no limit, or none
    for the reason below"""
    no_verdict_because: str | None
    bounds: Quantities
    """The largest error is above the first, and below the second, with 95 % or more each: the verdict's bounds."""
    largest: Quantity
    """Largest error. Its interval: 95 % or more, with errors between the nodes; 2.5 % at most beyond each end."""
    at: Quantities
    """Commanded position of the largest error."""
    components: Quantities
    """X, Y, Z of the largest error: actual minus nominal."""
    rms: Quantity
    between_nodes: Quantity
    """Standard uncertainty by errors between the nodes."""
    between_nodes_estimated: bool
    """From second differences of the tables; false: it was stated"""
    ranges: dict[str, Quantity]
    """X, Y, Z: largest minus smallest component."""
    tilts: dict[str, Quantity]
    """A, B, C: largest absolute rotation of the tool."""
    tilt_ranges: dict[str, Quantity]
    """A, B, C: largest minus smallest rotation."""
    diagonals: dict[str, Quantity]
    """ppp, npp, pnp, nnp: range of the errors along a body diagonal of the box."""
    missing: dict[str, list[str]]
    """X ... C: parameters that act in it and are not determined."""
    other_approaches: dict[str, Quantity]
    """-++ ...: largest error of X, Y, Z approached in these directions; empty: not known."""
    ranking: list[Without]
    """Parameters, then axes; the smallest largest error first."""


def volume_object(found: VolumeErrors, file: Path, warnings: Sequence[str]) -> VolumeObject:
    """The errors of a calibration over a volume."""
    assert isinstance(found.source, Calibration)
    missing = sorted({name for axis in "XYZ" for name in found.missing.get(axis, ())})
    why = f"not determined: {', '.join(missing)}" if missing else "not known"
    return {
        **first_keys("volume", warnings),
        "report": data_of(volume_blocks(found)),
        "fit": fit_of(found.source),
        "file": str(file),
        **temperature_of(found.source),
        "tool": quantities("mm", found.tool),
        "box": [quantities("mm", edge) for edge in found.box],
        "positions": list(found.shape),
        "limit": quantity("um", found.limit, reason="not stated"),
        "verdict": found.verdict,
        "no_verdict_because": found.no_verdict_because or None,
        "bounds": quantities("um", found.bounds, reason=why),
        "largest": with_interval("um", found.largest, found.largest_interval, reason=why),
        "at": quantities("mm", None if missing else found.largest_at, reason=why),
        "components": quantities("um", found.largest_components),
        "rms": with_interval("um", found.rms, found.rms_interval, reason=why),
        "between_nodes": quantity("um", found.between_nodes),
        "between_nodes_estimated": found.between_nodes_estimated,
        "ranges": _figures("um", found.ranges, found.missing),
        "tilts": _figures("urad", found.tilts, found.missing),
        "tilt_ranges": _figures("urad", found.tilt_ranges, found.missing),
        "diagonals": {
            name: with_interval("um", figure.value, figure.interval, reason=why)
            for name, figure in found.diagonals.items()
        },
        "missing": {name: list(parameters) for name, parameters in found.missing.items()},
        "other_approaches": {name: quantity("um", value, reason=why) for name, value in found.other_approaches.items()},
        "ranking": [
            {
                "name": one.name,
                "parameters": list(one.parameters),
                "largest": quantity("um", one.largest, reason=why),
                "rms": quantity("um", one.rms, reason=why),
            }
            for one in found.ranking
        ],
    }


def _figures(
    unit: Unit, figures: Mapping[str, VolumeFigure], missing: Mapping[str, Sequence[str]]
) -> dict[str, Quantity]:
    """By axis, X ... C."""
    return {
        axis: with_interval(
            unit, figure.value, figure.interval, reason=f"not determined: {', '.join(missing.get(axis, ()))}"
        )
        for axis, figure in figures.items()
    }
