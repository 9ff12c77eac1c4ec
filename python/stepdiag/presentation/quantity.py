"""Quantities of results: value, unit, standard uncertainty, and why there is no value. All JSON objects use them."""

import math
from collections.abc import Sequence
from decimal import Decimal
from typing import Final, Literal, NamedTuple, NotRequired

import numpy as np
import numpy.typing as npt
from typing_extensions import TypedDict

from stepdiag.units import HECTOPASCAL, HOUR, MICROMETRE, MINUTE, PERCENT, PPM

Unit = Literal[
    "1", "%", "ppm", "nm", "um", "mm", "1/mm", "urad", "rad", "um/m", "um/h", "um/K", "um/(m K)", "degC", "K", "hPa",
    "min", "h",
]  # fmt: skip
Interval = tuple[float, float]
Array = npt.NDArray[np.float64]


class Quantity(TypedDict):
    value: float | None
    unit: Unit
    standard_uncertainty: float | None
    """null: not known, or not asked for"""
    interval: NotRequired[list[float | None] | None]
    """95 %, an end that is null: no limit; null: not known. Only of quantities that have one."""
    reason: NotRequired[str]
    """Why the value is null; else absent."""


class Quantities(TypedDict):
    """Several values with one unit, such as those by node, or of X, Y, Z."""

    value: list[float | None] | None
    unit: Unit
    standard_uncertainty: list[float | None] | None
    reason: NotRequired[str]
    """Why value is null as a whole; else absent."""


class _Scale(NamedTuple):
    native: float  # the unit in native ones: mm, rad, s, Pa, degrees Celsius, 1
    shift: int | None = None  # by which the decimal point moves, so that no digit changes; None: divide


_SCALES: Final[dict[Unit, _Scale]] = {
    "1": _Scale(1.0, 0),
    "%": _Scale(PERCENT),
    "ppm": _Scale(PPM, 6),
    "nm": _Scale(1.0, 0),  # native of wavelengths
    "um": _Scale(MICROMETRE, 3),
    "mm": _Scale(1.0, 0),
    "1/mm": _Scale(1.0, 0),
    "urad": _Scale(1e-6, 6),
    "rad": _Scale(1.0, 0),
    "um/m": _Scale(PPM, 6),
    "um/h": _Scale(MICROMETRE / HOUR),
    "um/K": _Scale(MICROMETRE),
    "um/(m K)": _Scale(PPM),
    "degC": _Scale(1.0, 0),
    "K": _Scale(1.0, 0),
    "hPa": _Scale(HECTOPASCAL),
    "min": _Scale(MINUTE),
    "h": _Scale(HOUR),
}
# By the endings of keys (stepdiag.units).
BY_KEY: Final[dict[str, Unit]] = {
    "um": "um",
    "mm": "mm",
    "urad": "urad",
    "ppm": "ppm",
    "um_per_h": "um/h",
    "um_per_k": "um/K",
    "um_per_m_k": "um/(m K)",
}


def number(value: float | None) -> float | None:
    """A number without a unit; None for one that is not known or not finite."""
    return None if value is None or not math.isfinite(value) else float(value)


def in_unit(unit: Unit, native: float | None) -> float | None:
    """A native value in a unit; None for one that is not known or not finite."""
    if native is None or not math.isfinite(native):
        return None
    scale = _SCALES[unit]
    if scale.shift is None:
        return float(native) / scale.native
    return float(Decimal(repr(float(native))).scaleb(scale.shift))


def quantity(unit: Unit, native: float | None, u: float | None = None, *, reason: str = "not known") -> Quantity:
    """A native value, and its standard uncertainty, in this unit. `reason`: why there is none, if there is none."""
    return stated(unit, in_unit(unit, native), in_unit(unit, u), reason=reason)


def with_interval(
    unit: Unit, native: float | None, interval: Interval | None, u: float | None = None, *, reason: str = "not known"
) -> Quantity:
    """The same, with a 95 % interval, which is None where it is not known."""
    ends = None if interval is None else [in_unit(unit, end) for end in interval]
    return {**quantity(unit, native, u, reason=reason), "interval": ends}


def stated(unit: Unit, value: float | None, u: float | None = None, *, reason: str = "not stated") -> Quantity:
    """A value that is in this unit already, as those of keys are."""
    found: Quantity = {"value": number(value), "unit": unit, "standard_uncertainty": number(u)}
    if found["value"] is None:
        found["reason"] = reason
    return found


def quantities(
    unit: Unit,
    native: Array | Sequence[float | None] | None,
    u: Array | Sequence[float | None] | None = None,
    *,
    reason: str = "not known",
) -> Quantities:
    """Several native values, and their standard uncertainties, in this unit."""
    found: Quantities = {"value": _all(unit, native), "unit": unit, "standard_uncertainty": _all(unit, u)}
    if native is None:
        found["reason"] = reason
    return found


def _all(unit: Unit, native: Array | Sequence[float | None] | None) -> list[float | None] | None:
    if native is None:
        return None
    return [in_unit(unit, one) for one in (native.tolist() if isinstance(native, np.ndarray) else native)]
