"""A scenario's `[instrument]` in native units: what its certificate says of the scale of distances and of its sensors
of the air."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from stepdiag import _core
from stepdiag.config.instrument_keys import InstrumentSection
from stepdiag.scenario.planned_readings import with_channels
from stepdiag.units import native

# Channels of a run by the quantity of the air, as Environment.state names it; and steps for its derivatives.
CHANNELS: Final = {
    "temperature": "air_temperature",
    "pressure": "air_pressure",
    "relative_humidity": "air_humidity",
}
_STEPS: Final = {"temperature": 0.1, "pressure": 10.0, "relative_humidity": 0.01}
_KEYS: Final = {
    "temperature": "u_air_temperature_c",
    "pressure": "u_air_pressure_hpa",
    "relative_humidity": "u_air_humidity_percent",
}


@dataclass(frozen=True)
class KnownInstrument:
    """`scale`: relative error of all distances; `scale_uncertainty`: its standard uncertainty, None where
    none is stated. `air`: standard uncertainties of the air, by quantity, as far as they are stated."""

    scale: float = 0.0
    scale_uncertainty: float | None = None
    air: Mapping[str, float] = field(default_factory=dict)

    def corrected(self) -> "KnownInstrument":
        """The same for distances that are corrected by the scale."""
        return replace(self, scale=0.0)


def times(run: _core.Measurement, factor: float) -> _core.Measurement:
    """The run with its distances times a factor."""
    if factor == 1.0:
        return run
    return with_channels(run, {name: values * factor for name, values in run.channels.items() if name.startswith("d")})


def instrument_of(keys: InstrumentSection) -> KnownInstrument:
    """The section in native units."""
    stated = {quantity: getattr(keys, key) for quantity, key in _KEYS.items()}
    return KnownInstrument(
        native("scale_ppm", keys.scale_ppm),
        native("u_scale_ppm", keys.u_scale_ppm),
        {quantity: native(_KEYS[quantity], u) for quantity, u in stated.items() if u is not None},
    )


def air_state(measurement: _core.Measurement | None, assumed: _core.Environment | None) -> dict[str, float]:
    """The state of the air in the mean of a run; what it does not record is as assumed, else that of 20 °C."""
    state = (assumed.state if assumed is not None else None) or _core.Environment.from_air().state or {}
    channels = {} if measurement is None else measurement.channels
    for quantity, channel in CHANNELS.items():
        values = channels.get(channel, np.empty(0))
        if np.any(np.isfinite(values)):
            state[quantity] = float(np.nanmean(values))
    return state


def index_uncertainty(
    instrument: KnownInstrument,
    measurement: _core.Measurement | None,
    assumed: _core.Environment | None,
    wavelength: float,
) -> float:
    """Relative standard uncertainty of the index of the air, by what is stated of its sensors, which all distances of a
    run have in common. `wavelength`: in vacuum, nm."""
    uncertain = {quantity: u for quantity, u in instrument.air.items() if u > 0.0}
    if not uncertain:
        return 0.0
    state, parts = air_state(measurement, assumed), []
    for quantity, u in uncertain.items():
        # At the ends of a range on the one side alone.
        step = _STEPS[quantity] if quantity != "relative_humidity" or state[quantity] < 0.5 else -_STEPS[quantity]
        here, there = (_index(state | {quantity: state[quantity] + s}, wavelength) for s in (0.0, step))
        parts.append((there - here) / step / here * u)
    return math.hypot(*parts)


def _index(state: Mapping[str, float], wavelength: float) -> float:
    air = _core.Environment.from_air(
        temperature=state["temperature"],
        pressure=state["pressure"],
        relative_humidity=state["relative_humidity"],
        carbon_dioxide=state["carbon_dioxide"],
    )
    return air.refractive_index(wavelength)
