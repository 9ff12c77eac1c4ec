"""Units: native ones in keys and files (mm, rad, s, Pa, 1), and those of reports."""

from collections.abc import Mapping
from typing import Final

MICROMETRE: Final = 1e-3  # mm
NANOMETRE: Final = 1e-6  # mm
MILLIRADIAN: Final = 1e-3  # rad
MICRORADIAN: Final = 1e-6  # rad
PERCENT: Final = 0.01
HECTOPASCAL: Final = 100.0  # Pa
MINUTE: Final = 60.0  # s
HOUR: Final = 3600.0  # s

MICRO: Final = 1e6  # µrad of a rad

# Native unit -> unit in reports, and the factor to it.
REPORT_UNITS: Final[Mapping[str, tuple[str, float]]] = {"mm": ("µm", 1e3), "rad": ("µrad", MICRO), "1": ("", 1.0)}


def report_value(unit: str, value: float) -> tuple[float, str]:
    """Convert from native units to those of reports (mm to µm, rad to µrad): value and unit."""
    name, factor = REPORT_UNITS.get(unit, (unit, 1.0))
    return value * factor, name
