"""Quantities, and the text of objects that have them."""

import json
import math
from decimal import Decimal
from typing import get_args

import numpy as np
import pytest

from stepdiag.presentation.objects.writer import json_text
from stepdiag.presentation.quantity import (
    BY_KEY,
    Unit,
    in_unit,
    number,
    quantities,
    quantity,
    stated,
    with_interval,
)
from stepdiag.units import UNITS


@pytest.mark.parametrize(("unit", "power"), [("mm", 0), ("um", 3), ("urad", 6), ("ppm", 6), ("um/m", 6)])
def test_number_is_the_nearest_to_its_decimal_digits_with_the_point_moved(unit: Unit, power: int) -> None:
    for value in np.random.default_rng(1).normal(size=200).tolist():
        assert in_unit(unit, value) == float(f"{value!r}e{power}")


def test_rate_is_converted() -> None:
    # 1 µm/h is 1e-3 mm in 3600 s.
    assert in_unit("um/h", 1e-3 / 3600.0) == pytest.approx(1.0, rel=1e-15)


def test_units_of_keys_are_the_same_units() -> None:
    assert set(BY_KEY.values()) <= set(get_args(Unit))
    for key, unit in BY_KEY.items():
        assert in_unit(unit, UNITS[key].native) == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize("value", [None, math.nan, math.inf, -math.inf])
def test_what_is_not_known_or_not_limited_is_null_with_a_reason(value: float | None) -> None:
    assert in_unit("um", value) is None
    assert number(value) is None
    found = json.loads(json_text({"size": quantity("um", value, value, reason="not limited")}))
    assert found == {"size": {"value": None, "unit": "um", "standard_uncertainty": None, "reason": "not limited"}}


def test_value_has_no_reason() -> None:
    assert quantity("um", 1.0, 0.5) == {"value": 1000.0, "unit": "um", "standard_uncertainty": 500.0}
    assert stated("ppm", 3.0, 1.0) == {"value": 3.0, "unit": "ppm", "standard_uncertainty": 1.0}


def test_interval_is_in_the_unit_of_its_value() -> None:
    assert with_interval("um", 1e-3, (0.0, math.inf))["interval"] == [0.0, None]
    assert with_interval("um", 1e-3, None)["interval"] is None


def test_arrays_become_lists_by_node() -> None:
    found = quantities("um", np.array([1.0, np.nan]), [2.0, None])
    assert found == {"value": [1000.0, None], "unit": "um", "standard_uncertainty": [2000.0, None]}
    assert quantities("um", None, reason="not recorded") == {
        "value": None,
        "unit": "um",
        "standard_uncertainty": None,
        "reason": "not recorded",
    }


def test_text_is_one_line_of_ascii_that_gives_the_same_bits() -> None:
    content = {"text": "0.3 µm", "value": float(Decimal("0.1")) * 3}
    text = json_text(content)
    assert text.isascii()
    assert "\n" not in text
    assert json.loads(text) == content
    with pytest.raises(ValueError, match="JSON"):
        json_text({"value": math.nan})
