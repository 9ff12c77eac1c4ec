"""Keys of `[plausible.inputs]`: what temperatures, coefficients, air and times a workshop can have."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, NoReturn

from pydantic import PlainSerializer, PlainValidator
from pydantic_core import PydanticCustomError

from stepdiag.config.key_errors import OWN_WORDS, show, suggest
from stepdiag.config.key_types import Section, key

Range = tuple[float, float]


@dataclass(frozen=True)
class InputLimits:
    """Both ends are included; None: not stated. Beyond `inner` an input is told, beyond `outer` it is refused."""

    inner: Range | None = None
    outer: Range | None = None

    def stated(self) -> dict[str, Range]:
        return {name: value for name, value in vars(self).items() if value is not None}

    def __str__(self) -> str:
        return show(self.stated(), longest=200)


def _fail(said: str, below: str = "") -> NoReturn:
    raise PydanticCustomError(OWN_WORDS, "{below}: {said}", {"below": f".{below}" if below else "", "said": said})


def _range(value: Any, name: str) -> Range:
    numbers = isinstance(value, tuple) and all(isinstance(v, int | float) and not isinstance(v, bool) for v in value)
    if not (numbers and len(value) == 2 and all(map(math.isfinite, value)) and value[0] <= value[1]):
        _fail(f"expected two numbers, the lower one first, got {show(value)}", name)
    return float(value[0]), float(value[1])


def _limits(value: Any) -> InputLimits:
    if isinstance(value, InputLimits):
        return value
    if not isinstance(value, Mapping) or not value:
        _fail(f"expected {LIMITS}, got {show(value)}")
    for name in value:
        if name not in ("inner", "outer"):
            _fail(f"unknown key; {suggest(name, ['inner', 'outer'])}", name)
    limits = InputLimits(**{name: _range(numbers, name) for name, numbers in value.items()})
    inner, outer = limits.inner, limits.outer
    if inner and outer and not outer[0] <= inner[0] <= inner[1] <= outer[1]:
        _fail(f"expected numbers within outer = {show(outer)}, got {show(inner)}", "inner")
    return limits


LIMITS: Final = "{inner = [LOW, HIGH], outer = [LOW, HIGH]}, or one of the two"
Limits = Annotated[InputLimits, PlainValidator(_limits), PlainSerializer(InputLimits.stated)]


def _limit(meaning: str, inner: Range | None, outer: Range | None) -> Any:
    return key("limits", meaning, InputLimits(inner, outer))


class InputLimitsSection(Section):
    """Limits of plausible inputs, each `{inner = [LOW, HIGH], outer = [LOW, HIGH]}`, both ends included. Beyond `outer`
    an input is an error, which says what the number looks like. Beyond `inner` it is a warning, and the fit is at best
    doubtful. A range that is not stated is the default one; without any there is no such limit. A temperature that is
    0, 85 or -127 in every row is an error unless it is within `inner`: a sensor without a value."""

    scale_temperature_c: Limits = _limit("Of the scales, °C: columns and `axes_c`.", (10.0, 40.0), (-10.0, 60.0))
    part_temperature_c: Limits = _limit("Of a workpiece, °C, where a file states it.", (10.0, 40.0), (-10.0, 60.0))
    air_temperature_c: Limits = _limit("Of the air, °C.", (10.0, 40.0), (-10.0, 60.0))
    reference_c: Limits = _limit("`temperature.reference_c`, °C.", (20.0, 20.0), (15.0, 30.0))
    expansion_um_per_m_k: Limits = _limit(
        "Expansion coefficients, µm/(m K). Below `inner` they need `temperature.low_expansion`.",
        (0.5, 25.0),
        (-1.0, 40.0),
    )
    air_pressure_hpa: Limits = _limit(
        "Of the air, hPa. By default `inner` is within 60 hPa of the standard atmosphere at "
        "`environment.altitude_m`; without that 890 to 1075, which is 0 to 500 m.",
        None,
        (500.0, 1100.0),
    )
    air_humidity_percent: Limits = _limit(
        "Relative humidity, %. A column that nowhere exceeds 1 is refused as a fraction, unless this key is stated.",
        (0.0, 100.0),
        (0.0, 100.0),
    )
    refractive_index: Limits = _limit(
        "Index of the air. Exactly 1 is always possible: the instrument counts in vacuum wavelengths.",
        (1.00015, 1.0004),
        (1.00015, 1.0004),
    )
    wavelength_nm: Limits = _limit("Vacuum wavelength of a head, nm.", (400.0, 2000.0), (400.0, 2000.0))
    axes_difference_k: Limits = _limit("Between the sensors of two axes at one reading, K.", (0.0, 10.0), None)
    temperature_change_k: Limits = _limit("Between neighbouring readings of a line, K.", (0.0, 2.0), None)
    setup_h: Limits = _limit("From the first to the last reading of a line in place, h.", (0.0, 12.0), None)
    reading_s: Limits = _limit("Between neighbouring readings of a line, s.", (0.05, 1e9), None)
