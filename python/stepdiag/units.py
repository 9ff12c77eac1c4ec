"""Units: native ones in keys and files (mm, rad, s, Pa, 1), and those of reports."""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

MICROMETRE: Final = 1e-3  # mm
NANOMETRE: Final = 1e-6  # mm
MILLIRADIAN: Final = 1e-3  # rad
MICRORADIAN: Final = 1e-6  # rad
PERCENT: Final = 0.01
PPM: Final = 1e-6
HECTOPASCAL: Final = 100.0  # Pa
MINUTE: Final = 60.0  # s
HOUR: Final = 3600.0  # s

MICRO: Final = 1e6  # µrad of a rad


class Unit(NamedTuple):
    """What reports call it, and what it is in native ones."""

    name: str
    native: float


# By the ending of the keys that have it; a key without any has the native unit 1.
UNITS: Final[Mapping[str, Unit]] = {
    "um": Unit("µm", MICROMETRE),
    "mm": Unit("mm", 1.0),
    "urad": Unit("µrad", MICRORADIAN),
    "um_per_h": Unit("µm/h", MICROMETRE / HOUR),
    "um_per_sqrt_h": Unit("µm/√h", MICROMETRE / HOUR**0.5),
    "um_per_k": Unit("µm/K", MICROMETRE),
    "um_per_m_k": Unit("µm/(m·K)", PPM),
    "ppm": Unit("ppm", PPM),
    "c": Unit("°C", 1.0),
    "c_per_h": Unit("K/h", 1.0 / HOUR),
    "hpa": Unit("hPa", HECTOPASCAL),
    "percent": Unit("%", PERCENT),
}


def unit_of(key: str) -> Unit:
    """The unit of a key, by its ending."""
    return next((unit for ending, unit in UNITS.items() if key.endswith(f"_{ending}")), Unit("", 1.0))


def native(key: str, value: Any) -> Any:
    """A key's number, or several of them, in native units; what is no number as it is."""
    if isinstance(value, tuple):
        return tuple(native(key, one) for one in value)
    return value * unit_of(key).native if isinstance(value, int | float) else value


# Native unit -> unit in reports, and the factor to it.
REPORT_UNITS: Final[Mapping[str, tuple[str, float]]] = {"mm": ("µm", 1e3), "rad": ("µrad", MICRO), "1": ("", 1.0)}


def report_value(unit: str, value: float) -> tuple[float, str]:
    """Convert from native units to those of reports (mm to µm, rad to µrad): value and unit."""
    name, factor = REPORT_UNITS.get(unit, (unit, 1.0))
    return value * factor, name
