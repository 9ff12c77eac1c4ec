"""Parts of objects that say under which conditions a run was evaluated, and what makes its uncertainty."""

from typing import Any

from typing_extensions import TypedDict

from stepdiag._core import Calibration, Measurement
from stepdiag.presentation.objects.writer import in_unit, number
from stepdiag.scenario.budget import positioning_budget
from stepdiag.scenario.conditions import AXES, Range, conditions_of
from stepdiag.scenario.known import Known
from stepdiag.scenario.temperature import three
from stepdiag.units import HOUR


class UsedScale(TypedDict):
    """Of the scale of one axis, over the readings that were used."""

    axis: str
    lowest_c: float
    highest_c: float
    origin: str
    """The columns or keys that say it."""


class StatedExpansion(TypedDict):
    """Of the scales of X, Y, Z, as the scenario states it."""

    expansion_um_per_m_k: list[float]
    u_expansion_um_per_m_k: list[float]
    u_temperature_c: float | None
    """Standard uncertainty of each sensor of the scales, K."""
    reference_c: float


class StatedInstrument(TypedDict):
    """As the scenario states it; null: not stated."""

    scale_ppm: float | None
    """By which distances were corrected."""
    u_scale_ppm: float | None
    u_air_temperature_c: float | None
    u_air_pressure_hpa: float | None
    u_air_humidity_percent: float | None


class UsedConditions(TypedDict):
    """Temperatures, coefficients, air and index that were used, each with its lowest and highest value."""

    scales: list[UsedScale]
    """Axes of which the temperature is known."""
    expansion: StatedExpansion | None
    """null: positioning errors are as found"""
    air_temperature_c: list[float] | None
    """null: not recorded, as the next two."""
    air_pressure_hpa: list[float] | None
    air_humidity_percent: list[float] | None
    air_used: bool
    """Whether distances were reduced with that air; false: the instrument has compensated for it."""
    refractive_index: list[float] | None
    """Of that air; null: not used."""
    counted_refractive_index: float | None
    """With which the instrument counted; null: it compensates."""
    instrument: StatedInstrument
    span_h: float | None
    """From the first to the last reading; null: no times."""


class PositioningParts(TypedDict):
    """Of the largest standard uncertainty of positioning; null: not stated, or not counted by the method."""

    parameter: str
    position_mm: float
    standard_uncertainty_um: float | None
    noise_um: float | None
    """Of the readings, and what the set-up's unknowns make of it."""
    scale_um: float | None
    """Of the instrument."""
    temperature_um: float | None
    """Of the scales: their sensors and expansion coefficients."""
    air_um: float | None
    between_nodes_um: float | None
    """In no standard uncertainty; null: not known."""
    between_nodes_stated: bool
    """false: estimated from the table."""


def conditions_object(known: Known, measurement: Measurement) -> UsedConditions:
    """What an evaluation of the run uses."""
    found = conditions_of(known, measurement)
    keys, temperature = known.keys.instrument, known.keys.temperature

    expansion: StatedExpansion | None = None
    if temperature is not None:
        expansion = {
            "expansion_um_per_m_k": list(three(temperature.expansion_um_per_m_k)),
            "u_expansion_um_per_m_k": list(three(temperature.u_expansion_um_per_m_k)),
            "u_temperature_c": number(temperature.u_temperature_c),
            "reference_c": temperature.reference_c,
        }
    return {
        "scales": [
            {"axis": axis.upper(), "lowest_c": scale.range[0], "highest_c": scale.range[1], "origin": scale.origin}
            for axis, scale in zip(AXES, found.scales, strict=True)
            if scale is not None
        ],
        "expansion": expansion,
        "air_temperature_c": _range(found.air.get("air_temperature"), "c"),
        "air_pressure_hpa": _range(found.air.get("air_pressure"), "hpa"),
        "air_humidity_percent": _range(found.air.get("air_humidity"), "percent"),
        "air_used": known.assumed_air is not None,
        "refractive_index": None if found.index is None else list(found.index),
        "counted_refractive_index": found.counted,
        "instrument": {
            "scale_ppm": keys.scale_ppm,
            "u_scale_ppm": keys.u_scale_ppm,
            "u_air_temperature_c": keys.u_air_temperature_c,
            "u_air_pressure_hpa": keys.u_air_pressure_hpa,
            "u_air_humidity_percent": keys.u_air_humidity_percent,
        },
        "span_h": None if found.span is None else found.span / HOUR,
    }


def budget_object(calibration: Calibration, known: Known) -> PositioningParts | None:
    """None where no positioning error has an uncertainty. `calibration`: of an evaluation, not from a file."""
    found = positioning_budget(calibration, known)
    if found is None:
        return None
    return {
        "parameter": found.parameter,
        "position_mm": found.position,
        "standard_uncertainty_um": in_unit("um", found.total),
        "noise_um": in_unit("um", found.noise),
        "scale_um": in_unit("um", found.scale),
        "temperature_um": in_unit("um", found.temperature),
        "air_um": in_unit("um", found.air),
        "between_nodes_um": in_unit("um", found.between_nodes),
        "between_nodes_stated": found.between_nodes_stated,
    }


def _range(values: Range | None, unit: str) -> Any:
    """Lowest and highest value; None where there is none."""
    return None if values is None else [in_unit(unit, value) for value in values]
