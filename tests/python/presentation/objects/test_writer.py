"""Numbers in objects."""

import json
import math
from decimal import Decimal

import numpy as np
import pytest

from stepdiag.presentation.objects.writer import in_unit, json_text, measured, number


@pytest.mark.parametrize(("unit", "power"), [("mm", 0), ("um", 3), ("urad", 6), ("ppm", 6), ("um_per_m", 6)])
def test_number_is_the_nearest_to_its_decimal_digits_with_the_point_moved(unit: str, power: int) -> None:
    for value in np.random.default_rng(1).normal(size=200).tolist():
        assert in_unit(unit, value) == float(f"{value!r}e{power}")


def test_rate_is_converted() -> None:
    # 1 µm/h is 1e-3 mm in 3600 s.
    assert in_unit("um_per_h", 1e-3 / 3600.0) == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize("value", [None, math.nan, math.inf, -math.inf])
def test_what_is_not_known_or_not_limited_is_null(value: float | None) -> None:
    assert in_unit("um", value) is None
    assert number(value) is None
    assert json.loads(json_text(measured("um", size=value))) == {"size_um": None}


def test_arrays_become_lists_by_node() -> None:
    assert measured("um", value=np.array([1.0, np.nan]), u=2.0) == {"value_um": [1000.0, None], "u_um": 2000.0}


def test_text_is_one_line_of_ascii_that_gives_the_same_bits() -> None:
    content = {"text": "0.3 µm", "value": float(Decimal("0.1")) * 3}
    text = json_text(content)
    assert text.isascii()
    assert "\n" not in text
    assert json.loads(text) == content
    with pytest.raises(ValueError, match="JSON"):
        json_text({"value": math.nan})
