"""A calibration put together from its parts: the same bits, or refused by name."""

from typing import Any

import numpy as np
import pytest
from calibrations import PLAN, calibrate, parts_of, same_calibration, simulate
from refusal import refused

import stepdiag as sd


def test_calibration_is_made_again_from_its_parts() -> None:
    run = simulate(1, backward=True)
    adjusted = sd.methods.adjust(run, PLAN, sd.Head(), "[w X' b Y Z t]", full_covariance=True).calibration
    assert adjusted.reversal
    for calibration in (adjusted, calibrate(1), calibrate(1, method="enhanced", full_covariance=True)):
        assert same_calibration(sd.Calibration(**parts_of(calibration)), calibration)


BAD_PARTS: list[tuple[dict[str, Any], str]] = [
    ({"chain": "[w X Y Z t]"}, "chain"),
    ({"volume": (0.0, 1.0, 1.0)}, "volume"),
    ({"volume": (1.0, 1.0)}, "volume"),
    ({"tool": (np.nan, 0.0, 0.0)}, "tool"),
    ({"method": "two\nlines"}, "method"),
    ({"date": "two\nlines"}, "date"),
    ({"undetermined": ["two\nlines"]}, "undetermined"),
    ({"provenance": {"program": "two\nlines"}}, "provenance, program"),
    ({"provenance": {"program": ""}}, "provenance, program: expected a text"),
    ({"provenance": {"author": "me"}}, "provenance: expected the keys program, run_sha256, "),
    ({"functions": {"EXQ": ([0.0], [0.0], [0.0])}}, "EXQ"),
    ({"functions": {"EXX": ([0.0, 1.0], [0.0], [0.0])}}, "EXX"),
    ({"functions": {"EXX": ([], [], [])}}, "EXX"),
    ({"functions": {"EXX": ([0.0, 0.0], [0.0, 0.0], [0.0, 0.0])}}, "EXX: positions must ascend"),
    ({"functions": {"EXX": ([0.0, np.nan], [0.0, 0.0], [0.0, 0.0])}}, "EXX"),
    ({"functions": {"EXX": ([0.0], [np.inf], [0.0])}}, "EXX"),
    ({"functions": {"EXX": ([0.0], [0.0], [-1.0])}}, "EXX"),
    ({"functions": {"EXX": ([0.0], [0.0], [np.inf])}}, "EXX"),
    ({"squareness": {"C0X": (0.0, 0.0)}}, "C0X"),
    ({"squareness": {"C0Y": (np.nan, 0.0)}}, "C0Y"),
    ({"squareness": {"C0Y": (0.0, -1.0)}}, "C0Y"),
    ({"undetermined_slopes": ["EQQ"]}, "EQQ"),
    ({"functions": {}, "undetermined_slopes": ["EXX"]}, "EXX"),
    ({"reversal": {"EXX": ([0.0, 1.0], [0.0], [0.0])}}, "reversal of EXX"),
    ({"reversal": {"EXX": ([1.0, 0.0], [0.0, 0.0], [0.0, 0.0])}}, "reversal of EXX, node 1: positions must ascend"),
    ({"reversal": {"EXX": ([0.0], [np.nan], [0.0])}}, "reversal of EXX"),
    ({"reversal": {"EXX": ([0.0], [0.0], [-1.0])}}, "reversal of EXX"),
    ({"reversal_negative_uncertainty": {"EXX": [0.0]}}, "EXX"),
    ({"reversal": {"EXX": ([0.0], [0.0], [0.0])}, "reversal_negative_uncertainty": {"EXX": [-1.0]}}, "EXX"),
    ({"undetermined_reversal_constants": ["EXX"]}, "EXX"),
    ({"covariance": np.zeros((2, 2))}, "covariance: expected 111 rows and columns"),
    ({"covariance": np.zeros(3)}, "covariance"),
    ({"covariance": "unit"}, "covariance"),
    ({"covariance": np.zeros((0, 0))}, "covariance"),
]


@pytest.mark.parametrize(("parts", "names"), BAD_PARTS)
def test_parts_that_make_no_calibration_are_refused(parts: dict[str, Any], names: str) -> None:
    whole = parts_of(calibrate(1)) | ({"covariance": None} if "covariance" not in parts else {})
    refused(sd.Calibration, **(whole | parts), names=names)


def test_uncertainties_of_a_covariance_may_be_unknown() -> None:
    parts = parts_of(calibrate(1, full_covariance=True))
    parts["functions"] = {n: (p, v, np.full_like(u, np.nan)) for n, (p, v, u) in parts["functions"].items()}
    covariance = sd.Calibration(**parts).covariance
    assert covariance is not None
    np.testing.assert_array_equal(covariance, parts["covariance"])


def test_line_break_in_a_date_is_refused() -> None:
    refused(calibrate(1).dated, "2026\n", names="date")
