"""What all objects share: numbers in the units of their keys, and the text of an object."""

import json
import math
from collections.abc import Mapping
from decimal import Decimal
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from stepdiag.units import UNITS

# Powers of ten of one native unit (mm, rad, 1) in these units: a shift of the decimal point, as in CSV files.
_SHIFTS: Final[Mapping[str, int]] = {"mm": 0, "um": 3, "urad": 6, "ppm": 6, "um_per_m": 6}


def in_unit(unit: str, value: float | None) -> float | None:
    """A native value in a key's unit, without rounding; None for one that is not known or not finite."""
    if value is None or not math.isfinite(value):
        return None
    if unit in _SHIFTS:
        return float(Decimal(repr(float(value))).scaleb(_SHIFTS[unit]))
    return float(value) / UNITS[unit].native


def measured(unit: str, **native: float | npt.NDArray[np.float64] | None) -> Any:
    """Native values under keys that end with their unit: `value` in um is value_um. Arrays become lists."""
    return {
        f"{key}_{unit}": [in_unit(unit, one) for one in value.tolist()]
        if isinstance(value, np.ndarray)
        else in_unit(unit, value)
        for key, value in native.items()
    }


def number(value: float | None) -> float | None:
    """A number without a unit; None for one that is not known or not finite."""
    return None if value is None or not math.isfinite(value) else float(value)


def json_text(content: Mapping[str, Any]) -> str:
    """The object as one line of ASCII; numbers are read back to the same bits. Raises ValueError for NaN and inf."""
    return json.dumps(content, allow_nan=False)
