"""Inputs that no workshop has: temperatures, coefficients, air and times of scenarios and runs against the limits of
`[plausible.inputs]`. What an input is refused with says what its number looks like; what is beyond the inner limits
is named, and makes a fit at best doubtful."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from stepdiag import _core
from stepdiag._core import InvalidArgument, Measurement
from stepdiag.config.input_limit_keys import InputLimits, InputLimitsSection, Range
from stepdiag.config.scenario_keys import KnownKeys
from stepdiag.scenario.heads import DescribedHead
from stepdiag.units import HECTOPASCAL, HOUR, PERCENT, PPM

AXES: Final = "xyz"
SEA_LEVEL: Final = 1013.25  # hPa
WEATHER: Final = 60.0  # hPa, around the standard atmosphere
UP_TO_500_M: Final = (890.0, 1075.0)  # hPa
SILENT_SENSOR: Final = (0.0, 85.0, -127.0)  # °C: no signal; a DS18B20 before its first conversion, and without contact

Guess = tuple[str, Callable[[float], float]]  # a unit, and from the number in it to that of the key
CELSIUS: Final[tuple[Guess, ...]] = (
    ("°F", lambda number: (number - 32.0) / 1.8),
    ("K", lambda number: number - 273.15),
    ("tenths of a degree", lambda number: number / 10.0),
    ("hundredths of a degree", lambda number: number / 100.0),
    ("thousandths of a degree", lambda number: number / 1000.0),
)


@dataclass(frozen=True)
class _Quantity:
    unit: str
    native: float
    guesses: tuple[Guess, ...] = ()


# By key of [plausible.inputs].
QUANTITIES: Final[Mapping[str, _Quantity]] = {
    "scale_temperature_c": _Quantity(" °C", 1.0, CELSIUS),
    "air_temperature_c": _Quantity(" °C", 1.0, CELSIUS),
    "reference_c": _Quantity(" °C", 1.0, CELSIUS),
    "expansion_um_per_m_k": _Quantity(
        " µm/(m K)",
        PPM,
        (
            ("the wrong sign", lambda number: -number),
            ("mm/(m K)", lambda number: number * 1e3),
            ("1/K", lambda number: number * 1e6),
            ("nm/(m K)", lambda number: number * 1e-3),
        ),
    ),
    "air_pressure_hpa": _Quantity(
        " hPa",
        HECTOPASCAL,
        (
            ("mmHg", lambda number: number * 1.333224),
            ("inHg", lambda number: number * 33.86389),
            ("kPa", lambda number: number * 10.0),
            ("bar", lambda number: number * 1000.0),
            ("Pa", lambda number: number * 0.01),
            ("psi", lambda number: number * 68.94757),
        ),
    ),
    "air_humidity_percent": _Quantity(" %", PERCENT, (("a fraction", lambda number: number * 100.0),)),
    "refractive_index": _Quantity("", 1.0),
    "wavelength_nm": _Quantity(
        " nm",
        1.0,
        (("µm", lambda number: number * 1e3), ("Å", lambda number: number * 0.1), ("m", lambda number: number * 1e9)),
    ),
    "axes_difference_k": _Quantity(" K", 1.0),
    "temperature_change_k": _Quantity(" K", 1.0),
    "setup_h": _Quantity(" h", HOUR, (("times in ms", lambda number: number * 1e-3),)),
    "reading_s": _Quantity(" s", 1.0),
}
# Channels, with the column that has them, and what limits them.
COLUMNS: Final = {
    "temperature": ("temperature_c", "scale_temperature_c"),
    **{f"temperature_{axis}": (f"temperature_{axis}_c", "scale_temperature_c") for axis in AXES},
    "air_temperature": ("air_temperature_c", "air_temperature_c"),
    "air_pressure": ("air_pressure_hpa", "air_pressure_hpa"),
    "air_humidity": ("air_humidity_percent", "air_humidity_percent"),
}


class InputLimitsInForce:
    """The limits of a scenario. Numbers are in the units of the keys."""

    def __init__(
        self, stated: InputLimitsSection, *, altitude: float | None = None, low_expansion: bool = False
    ) -> None:
        self.altitude, self.low_expansion = altitude, low_expansion
        self.is_humidity_stated = "air_humidity_percent" in stated.model_fields_set
        self._limits = {name: self._of(name, getattr(stated, name)) for name in QUANTITIES}

    def _of(self, name: str, stated: InputLimits) -> InputLimits:
        default = InputLimitsSection.model_fields[name].default
        inner = stated.inner or default.inner
        if name == "air_pressure_hpa" and stated.inner is None:
            inner = UP_TO_500_M
            if self.altitude is not None:
                usual = standard_atmosphere(self.altitude)
                inner = (usual - WEATHER, usual + WEATHER)
        outer = stated.outer or default.outer
        if stated.outer is None and outer and inner:  # an inner range that is stated alone may be wider
            outer = (min(outer[0], inner[0]), max(outer[1], inner[1]))
        return InputLimits(inner, outer)

    def is_inner(self, name: str, number: float) -> bool:
        return _within(number, self._limits[name].inner)

    def is_fraction(self, name: str, number: float) -> bool:
        """Whether a humidity, the largest of its column, looks like a fraction of 1."""
        return name == "air_humidity_percent" and 0.0 < number <= 1.0 and not self.is_humidity_stated

    def judge(self, name: str, place: str, number: float, more: str = "") -> Iterator[str]:
        """A sentence where `number` is beyond the inner limits; `place` names it, `more` completes the sentence. Raises
        InvalidArgument beyond the outer ones."""
        if name == "refractive_index" and number == 1.0:
            return
        inner, outer, unit = self._limits[name].inner, self._limits[name].outer, QUANTITIES[name].unit
        shown = f"{number:.10g}{unit}"
        if not _within(number, outer):
            raise InvalidArgument(
                f"{place}: expected {_text(outer)}{unit}, got {shown}{more}{self._looks(name, number)} "
                f"(plausible.inputs.{name})"
            )
        if _within(number, inner):
            return
        if name == "expansion_um_per_m_k" and inner and number < inner[0]:
            if self.low_expansion:
                return
            raise InvalidArgument(
                f"{place}: expected {_text(inner)}{unit}, got {shown}{self._looks(name, number)}; scales that hardly "
                "expand need temperature.low_expansion = true"
            )
        yield f"{place} is {shown}{more}, where {_text(inner)}{unit} is plausible{self._looks(name, number)}"

    def _looks(self, name: str, number: float) -> str:
        """What the number looks like, and who would have such a number."""
        ranges = [self._limits[name].inner, self._limits[name].outer]
        guesses = QUANTITIES[name].guesses
        if name == "reference_c":
            ranges.append(self._limits["scale_temperature_c"].inner)
        if name == "air_humidity_percent" and number > 1.0:
            guesses = ()
        if name.endswith("temperature_c") and number in SILENT_SENSOR:
            return "; a sensor that does not work gives it"
        found = next(
            (
                (unit, convert(number))
                for within in ranges
                for unit, convert in guesses
                if within and _within(convert(number), within)
            ),
            None,
        )
        looks = []
        if found is not None:
            unit, value = found
            looks.append(f"looks like {unit} ({value:.4g}{QUANTITIES[name].unit})")
        if name == "air_pressure_hpa":
            if self.altitude is None and 400.0 <= number < UP_TO_500_M[0]:
                height = round(height_of(number), -2)
                looks.append(f"is that of a place at {height:g} m, which environment.altitude_m would state")
            elif self.altitude is not None and abs(number - SEA_LEVEL) <= WEATHER:
                looks.append(f"looks as if reduced to sea level, where the place is at {self.altitude:g} m")
        return f"; it {', or '.join(looks)}" if looks else ""


def limits_of(keys: KnownKeys) -> InputLimitsInForce:
    temperature = keys.temperature
    return InputLimitsInForce(
        keys.plausible.inputs,
        altitude=keys.environment.altitude_m,
        low_expansion=temperature is not None and temperature.low_expansion,
    )


def standard_atmosphere(altitude: float) -> float:
    """Pressure in hPa by the height in m: ISO 2533, below 11 km."""
    return SEA_LEVEL * float((1.0 - 2.25577e-5 * altitude) ** 5.25588)


def height_of(pressure: float) -> float:
    return float((1.0 - (pressure / SEA_LEVEL) ** (1.0 / 5.25588)) / 2.25577e-5)


def implausible_keys(
    keys: KnownKeys,
    described: Mapping[str, DescribedHead],
    heads: Mapping[str, _core.Head],
    assumed_air: _core.Environment | None,
) -> Iterator[str]:
    """What the known half of a scenario says."""
    limits, temperature = limits_of(keys), keys.temperature
    if temperature is not None:
        yield from limits.judge("reference_c", "temperature.reference_c", temperature.reference_c)
        for name, value, of in (
            ("expansion_um_per_m_k", temperature.expansion_um_per_m_k, "expansion_um_per_m_k"),
            ("scale_temperature_c", temperature.axes_c, "axes_c"),
        ):
            numbers = value if isinstance(value, tuple) else () if value is None else (value,)
            for number in dict.fromkeys(numbers):
                yield from limits.judge(name, f"temperature.{of}", number)
    wavelengths = {
        head.wavelength: "head.wavelength_nm" if described[line].design is None else f"the wavelength on line {line}"
        for line, head in heads.items()
    }
    for wavelength, place in wavelengths.items():
        yield from limits.judge("wavelength_nm", place, wavelength)
    if assumed_air is not None:  # of the instrument, wherever it stands
        anywhere = InputLimitsInForce(keys.plausible.inputs)
        yield from implausible_air(anywhere, "the assumed air of environment", assumed_air)


def implausible_air(limits: InputLimitsInForce, place: str, air: _core.Environment) -> Iterator[str]:
    """An index, or a state of the air."""
    if air.state is None:
        yield from limits.judge("refractive_index", f"{place}: refractive_index", air.refractive_index(1000.0))
        return
    for name, key in (
        ("temperature", "air_temperature_c"),
        ("pressure", "air_pressure_hpa"),
        ("relative_humidity", "air_humidity_percent"),
    ):
        number = air.state[name] / QUANTITIES[key].native
        where = f"{place}: {key.removeprefix('air_')}"
        if limits.is_fraction(key, number):
            yield f"{where} is {number:g} %, which looks like a fraction ({number * 100.0:g} %)"
        yield from limits.judge(key, where, number)


def implausible_columns(limits: InputLimitsInForce, run: Measurement) -> Iterator[str]:
    """What a run records of temperatures, air and times."""
    channels, rows = run.channels, _Rows(run)
    scales = []
    for channel, (column, key) in COLUMNS.items():
        if channel not in channels:
            continue
        numbers = channels[channel] / QUANTITIES[key].native
        yield from _of_column(limits, key, column, numbers, rows)
        if key.endswith("temperature_c"):
            yield from _of_changes(limits, column, numbers, rows)
        if channel in ("temperature_x", "temperature_y", "temperature_z"):
            scales.append(numbers)
    if len(scales) > 1:
        some = np.isfinite(scales).any(axis=0)
        spread = np.full(len(run), np.nan)
        spread[some] = np.nanmax(np.array(scales)[:, some], axis=0) - np.nanmin(np.array(scales)[:, some], axis=0)
        yield from _largest(limits, "axes_difference_k", "the difference of the axes' sensors", spread, rows)
    if "time" in channels:
        yield from _of_times(limits, channels["time"], rows)


def odd_columns(run: Measurement, keys: KnownKeys | None = None) -> list[str]:
    """All findings as sentences, also those that evaluations refuse: for commands that do not use the run. Without the
    keys of a scenario by the default limits."""
    limits = InputLimitsInForce(InputLimitsSection.model_construct()) if keys is None else limits_of(keys)
    try:
        return list(implausible_columns(limits, run))
    except InvalidArgument as error:
        return [str(error)]


class _Rows:
    """Names of rows, and rows by pass, in the order of their points: a file's rows may be sorted otherwise."""

    def __init__(self, run: Measurement) -> None:
        self.line, self.point, self.run = run.line, run.point, run.run
        places: dict[tuple[int, str], list[int]] = {}
        for row, (number, line) in enumerate(zip(self.run, self.line, strict=True)):
            places.setdefault((number, line), []).append(row)
        self.passes = [np.array(sorted(rows, key=self.point.__getitem__)) for rows in places.values()]

    def name(self, row: int) -> str:
        run = f" (run {self.run[row]})" if self.run[row] else ""
        return f"{self.line[row]} point {self.point[row]}{run}"


def _of_column(
    limits: InputLimitsInForce, key: str, column: str, numbers: NDArray[np.float64], rows: _Rows
) -> Iterator[str]:
    finite = numbers[np.isfinite(numbers)]
    if not finite.size:
        return
    low, high, unit = float(finite.min()), float(finite.max()), QUANTITIES[key].unit
    if limits.is_fraction(key, high):
        raise InvalidArgument(
            f"column {column}: expected percent, got numbers that nowhere exceed {high:.4g}: they look like a fraction "
            f"({high * 100.0:.4g} %); air that is so dry needs plausible.inputs.{key}"
        )
    if key.endswith("temperature_c") and low == high and low in SILENT_SENSOR and not limits.is_inner(key, low):
        raise InvalidArgument(
            f"column {column}: expected a temperature, got {low:g}{unit} in every row: the sensor says nothing; "
            "leave the column out, or its fields empty"
        )
    for number in (high, low) if high > low else (high,):
        row = int(np.flatnonzero(numbers == number)[0])
        beyond = sum(not limits.is_inner(key, other) for other in finite) if not limits.is_inner(key, number) else 0
        more = f" ({beyond} of {finite.size} rows are beyond)" if beyond > 1 else ""
        yield from limits.judge(key, f"column {column}, {rows.name(row)}", number, more)


def _of_changes(limits: InputLimitsInForce, column: str, numbers: NDArray[np.float64], rows: _Rows) -> Iterator[str]:
    changes = np.full(len(numbers), np.nan)
    for of_pass in rows.passes:
        read = of_pass[np.isfinite(numbers[of_pass])]
        changes[read[1:]] = np.abs(np.diff(numbers[read]))
    yield from _largest(
        limits, "temperature_change_k", f"column {column}: the change from the reading before", changes, rows
    )


def _largest(
    limits: InputLimitsInForce, key: str, what: str, numbers: NDArray[np.float64], rows: _Rows
) -> Iterator[str]:
    if np.isfinite(numbers).any():
        row = int(np.nanargmax(numbers))
        yield from limits.judge(key, f"{what} at {rows.name(row)}", float(numbers[row]))


def _of_times(limits: InputLimitsInForce, times: NDArray[np.float64], rows: _Rows) -> Iterator[str]:
    longest, shortest = (0.0, 0), (np.inf, 0)
    for of_pass in rows.passes:
        read = of_pass[np.isfinite(times[of_pass])]
        steps = np.diff(times[read])
        if not steps.size:
            continue
        if (steps <= 0.0).all() and (steps < 0.0).any():
            steps = -steps  # of a backward run
        span = float(np.ptp(times[read])) / HOUR
        longest = max(longest, (span, int(read[0])))
        shortest = min(shortest, (float(steps.min()), int(read[1:][steps.argmin()])))
    if np.isfinite(shortest[0]):
        yield from limits.judge("setup_h", f"column time_s: the time on line {rows.line[longest[1]]}", longest[0])
        step, row = shortest
        yield from limits.judge(
            "reading_s", f"column time_s: the time from the reading before to {rows.name(row)}", step
        )


def _within(number: float, limits: Range | None) -> bool:
    if limits is None:
        return True
    rounding = 1e-9 * abs(number)
    return limits[0] - rounding <= number <= limits[1] + rounding


def _text(limits: Range | None) -> str:
    assert limits is not None
    low, high = limits
    if low == high:
        return f"{low:g}"
    return f"{low:.6g} to {high:.6g}" if high < 1e9 else f"at least {low:g}"
