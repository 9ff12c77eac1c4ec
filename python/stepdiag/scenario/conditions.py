"""Under which conditions a run was evaluated: temperatures of the scales, the air, the time, as they were used."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepdiag._core import Environment, Measurement
from stepdiag.scenario.instrument import CHANNELS
from stepdiag.scenario.known import Known
from stepdiag.scenario.temperature import three

AXES = ("x", "y", "z")
AIR = ("air_temperature", "air_pressure", "air_humidity")

Range = tuple[float, float]


@dataclass(frozen=True)
class ScaleTemperature:
    """Of the scale of one axis, °C: the range over the readings that were used, and the columns or keys that say it."""

    range: Range
    origin: str


@dataclass(frozen=True)
class Conditions:
    """What an evaluation used, in native units.

    scales: of X, Y, Z; None where nothing says the temperature. air: recorded ranges by channel; of an instrument that
    compensates, evaluations do not use them. index: of that air at the wavelength of the first line's head, where
    evaluations use it; counted: that with which the instrument counted. span: from the first to the last reading used,
    s; None without times."""

    scales: tuple[ScaleTemperature | None, ScaleTemperature | None, ScaleTemperature | None]
    air: dict[str, Range]
    span: float | None
    index: Range | None = None
    counted: float | None = None


def conditions_of(known: Known, measurement: Measurement) -> Conditions:
    """Over the rows that have a distance."""
    channels = measurement.channels
    distances = [values for name, values in channels.items() if name in known.signals and name.startswith("d")]
    used = np.any(np.isfinite(distances), axis=0) if distances else np.ones(len(measurement), dtype=bool)
    lines = np.array(measurement.line)
    ranges = {name: _range(channels[name][used]) for name in (*AIR, "time") if name in channels}
    time = ranges.pop("time", None)
    assumed, wavelength = known.assumed_air, known.head.wavelength
    index = None if assumed is None else _range(_indices(assumed, channels, used, wavelength))
    return Conditions(
        (
            _scale(0, known, channels, lines, used),
            _scale(1, known, channels, lines, used),
            _scale(2, known, channels, lines, used),
        ),
        {name: found for name, found in ranges.items() if found is not None},
        None if time is None else time[1] - time[0],
        index,
        None if assumed is None else assumed.refractive_index(wavelength),
    )


def _indices(
    assumed: Environment, channels: dict[str, NDArray[np.float64]], used: NDArray[np.bool_], wavelength: float
) -> NDArray[np.float64]:
    """Of the recorded air."""
    recorded = {quantity: channels[channel][used] for quantity, channel in CHANNELS.items() if channel in channels}
    states = set(zip(*(values.tolist() for values in recorded.values()), strict=True)) if recorded else {()}
    return np.array(
        [
            Environment.from_air(
                **(assumed.state or {}) | dict(zip(recorded, state, strict=True)), equation=assumed.equation
            ).refractive_index(wavelength)
            for state in states
            if np.all(np.isfinite(state))
        ]
    )


def _scale(
    axis: int, known: Known, channels: dict[str, NDArray[np.float64]], lines: NDArray[np.str_], used: NDArray[np.bool_]
) -> ScaleTemperature | None:
    own = f"temperature_{AXES[axis]}"
    name = own if own in channels else "temperature"
    recorded = channels[name][used] if name in channels else np.full(np.count_nonzero(used), np.nan)
    origins = [f"column {name}_c"] if np.any(np.isfinite(recorded)) else []
    keys = known.keys.temperature
    # Sets: np.isin and np.unique would import numpy.ma, a twentieth of a small evaluation.
    without = set(lines[used]) - set(lines[used][np.isfinite(recorded)])
    if without and keys is not None and keys.axes_c is not None:  # such lines have the temperature of the scenario
        recorded = np.append(recorded, three(keys.axes_c)[axis])
        origins.append("axes_c")
    found = _range(recorded)
    return None if found is None else ScaleTemperature(found, " and ".join(origins))


def _range(values: NDArray[np.float64]) -> Range | None:
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else None
