"""Parts of objects that say under which conditions a run was evaluated, and what makes its uncertainty."""

from typing_extensions import TypedDict

from stepdiag._core import Calibration, Measurement
from stepdiag.presentation.quantity import Quantities, Quantity, Unit, quantities, quantity, stated
from stepdiag.scenario.budget import positioning_budget
from stepdiag.scenario.conditions import AXES, Range, conditions_of
from stepdiag.scenario.known import Known
from stepdiag.scenario.temperature import three


class UsedScale(TypedDict):
    """Of the scale of one axis, over the readings that were used."""

    axis: str
    temperature: Quantities
    """The lowest and the highest"""
    origin: str
    """The columns or keys that say it."""


class StatedExpansion(TypedDict):
    """Of the scales of X, Y, Z, as the scenario states it."""

    coefficient: Quantities
    sensors: Quantity
    """Its standard uncertainty: of the temperature by each sensor of the scales."""
    reference: Quantity


class StatedInstrument(TypedDict):
    """As the scenario states it. Values that are only corrected, not stated, have a standard uncertainty alone."""

    scale: Quantity
    """By which distances were corrected."""
    u_air_temperature: Quantity
    """Standard uncertainties of its sensors."""
    u_air_pressure: Quantity
    u_air_humidity: Quantity


class UsedConditions(TypedDict):
    """Temperatures, coefficients, air and index that were used; of several values the lowest and the highest."""

    scales: list[UsedScale]
    """Axes of which the temperature is known."""
    expansion: StatedExpansion | None
    """null: positioning errors are as found"""
    air_temperature: Quantities
    air_pressure: Quantities
    air_humidity: Quantities
    air_used: bool
    """Whether distances were reduced with that air; false: the instrument has compensated for it."""
    refractive_index: Quantities
    """Of that air."""
    counted_refractive_index: Quantity
    """With which the instrument counted; null: it compensates."""
    instrument: StatedInstrument
    span: Quantity
    """From the first to the last reading."""


class PositioningParts(TypedDict):
    """Of the largest standard uncertainty of positioning: what each source makes of it."""

    parameter: str
    position: Quantity
    standard_uncertainty: Quantity
    noise: Quantity
    """Of the readings, and what the set-up's unknowns make of it."""
    scale: Quantity
    """Of the instrument."""
    temperature: Quantity
    """Of the scales: their sensors and expansion coefficients."""
    air: Quantity
    between_nodes: Quantity
    """In no standard uncertainty."""
    between_nodes_stated: bool
    """false: estimated from the table."""


def conditions_object(known: Known, measurement: Measurement) -> UsedConditions:
    """What an evaluation of the run uses."""
    found = conditions_of(known, measurement)
    keys, temperature = known.keys.instrument, known.keys.temperature

    expansion: StatedExpansion | None = None
    if temperature is not None:
        expansion = {
            "coefficient": {
                "value": list(three(temperature.expansion_um_per_m_k)),
                "unit": "um/(m K)",
                "standard_uncertainty": list(three(temperature.u_expansion_um_per_m_k)),
            },
            "sensors": stated("K", temperature.u_temperature_c),
            "reference": stated("degC", temperature.reference_c),
        }
    return {
        "scales": [
            {"axis": axis.upper(), "temperature": quantities("degC", scale.range), "origin": scale.origin}
            for axis, scale in zip(AXES, found.scales, strict=True)
            if scale is not None
        ],
        "expansion": expansion,
        "air_temperature": _recorded("degC", found.air.get("air_temperature")),
        "air_pressure": _recorded("hPa", found.air.get("air_pressure")),
        "air_humidity": _recorded("%", found.air.get("air_humidity")),
        "air_used": known.assumed_air is not None,
        "refractive_index": quantities("1", found.index, reason="no air was used"),
        "counted_refractive_index": quantity("1", found.counted, reason="the instrument compensates"),
        "instrument": {
            "scale": stated("ppm", keys.scale_ppm, keys.u_scale_ppm),
            "u_air_temperature": stated("K", keys.u_air_temperature_c),
            "u_air_pressure": stated("hPa", keys.u_air_pressure_hpa),
            "u_air_humidity": stated("%", keys.u_air_humidity_percent),
        },
        "span": quantity("h", found.span, reason="no times"),
    }


def budget_object(calibration: Calibration, known: Known) -> PositioningParts | None:
    """None where no positioning error has an uncertainty. `calibration`: of an evaluation, not from a file."""
    found = positioning_budget(calibration, known)
    if found is None:
        return None
    why = "not stated, or not counted by the method"
    return {
        "parameter": found.parameter,
        "position": quantity("mm", found.position),
        "standard_uncertainty": quantity("um", found.total),
        "noise": quantity("um", found.noise, reason=why),
        "scale": quantity("um", found.scale, reason=why),
        "temperature": quantity("um", found.temperature, reason=why),
        "air": quantity("um", found.air, reason=why),
        "between_nodes": quantity("um", found.between_nodes),
        "between_nodes_stated": found.between_nodes_stated,
    }


def _recorded(unit: Unit, values: Range | None) -> Quantities:
    return quantities(unit, values, reason="not recorded")
