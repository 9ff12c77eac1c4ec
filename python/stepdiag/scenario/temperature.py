"""A scenario's `[temperature]` as the core takes it: what is known of the scales, and how warm they truly are."""

from pathlib import Path

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.key_errors import show
from stepdiag.config.temperature_keys import KnownTemperatureKeys, TrueTemperatureKeys
from stepdiag.config.toml_text import located
from stepdiag.units import native

Triple = tuple[float, float, float]


def three(value: float | Triple) -> Triple:
    """One number for X, Y, Z, or three."""
    return value if isinstance(value, tuple) else (value, value, value)


def known_expansion(keys: KnownTemperatureKeys | None, path: Path) -> _core.KnownExpansion | None:
    """None without the section: positioning errors are as found. Raises InvalidArgument naming the key."""
    if keys is None:
        return None
    place = f"{path}: temperature"
    coefficient, uncertainty = keys.expansion_um_per_m_k, keys.u_expansion_um_per_m_k
    if isinstance(coefficient, tuple) != isinstance(uncertainty, tuple):
        expected = "three numbers" if isinstance(coefficient, tuple) else "one number"
        raise InvalidArgument(
            f"{place}.u_expansion_um_per_m_k: expected {expected}, as expansion_um_per_m_k has, got {show(uncertainty)}"
        )
    with located(place):
        expansion = _core.Expansion(
            three(native("expansion_um_per_m_k", coefficient)),
            fixed_point=keys.fixed_point_mm,
            reference=keys.reference_c,
        )
        return _core.KnownExpansion(
            expansion,
            three(native("u_expansion_um_per_m_k", uncertainty)),
            one_coefficient=not isinstance(coefficient, tuple),
            sensor_uncertainty=keys.u_temperature_c,
            temperature=None if keys.axes_c is None else three(keys.axes_c),
            one_temperature=not isinstance(keys.axes_c, tuple),
        )


def true_scales(
    known: _core.KnownExpansion | None, keys: TrueTemperatureKeys | None, seconds_per_reading: float | None, path: Path
) -> _core.ScaleTemperatures | None:
    """Of a simulated run. Raises InvalidArgument naming the key."""
    if known is None or keys is None:
        return None
    rate = three(native("axes_c_per_h", keys.axes_c_per_h))
    if any(rate) and seconds_per_reading is None:
        raise InvalidArgument(f"{path}: temperature.axes_c_per_h: expected plan.seconds_per_reading as well, got none")
    return scales_of(known, rate, one_sensor=not isinstance(keys.axes_c_per_h, tuple))


def scales_of(
    known: _core.KnownExpansion, rate: Triple = (0.0, 0.0, 0.0), *, one_sensor: bool = True
) -> _core.ScaleTemperatures:
    """Scales that start at what is known of them, or at the reference temperature."""
    start = three(known.expansion.reference) if known.temperature is None else known.temperature
    return _core.ScaleTemperatures(known.expansion, start, rate, one_sensor=one_sensor and known.one_temperature)
