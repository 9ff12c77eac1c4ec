"""Repeated runs in the linear evaluations: what one run says, with less noise, and with readings lost."""

from __future__ import annotations

import numpy as np
import pytest
from usual import CHAIN, DIAGONALS, SCALE_LINES, VOLUME

import stepdiag as sd

RUNS = 20  # 140 passes, of which laser angles are eliminated one by one


def measured(runs: int) -> tuple[sd.Measurement, sd.Plan]:
    machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=3))
    plan = sd.Plan(VOLUME, DIAGONALS, 4, scale_lines=SCALE_LINES)
    misalignment = {line: sd.Misalignment(laser=(1e-4, -2e-4)) for line in DIAGONALS}
    return sd.simulate(machine, plan, sd.Head(), repeats=runs, misalignment=misalignment), plan


@pytest.mark.parametrize("method", ["enhanced", "conventional"])
def test_many_noiseless_runs_give_the_calibration_of_one(method: str) -> None:
    one, many = (sd.methods.evaluate(*measured(runs), sd.Head(), CHAIN, method=method) for runs in (1, RUNS))
    for name, (_, values, uncertainties) in one.functions.items():
        _, of_many, smaller = many.functions[name]
        np.testing.assert_allclose(of_many, values, rtol=0.0, atol=1e-12, err_msg=name)
        np.testing.assert_allclose(smaller, uncertainties * RUNS**-0.5, rtol=1e-9, err_msg=name)
    for name, (value, uncertainty) in one.squareness.items():
        assert many.squareness[name] == pytest.approx((value, uncertainty * RUNS**-0.5), rel=1e-9)


@pytest.mark.parametrize("method", ["enhanced", "conventional"])
def test_covariance_of_many_runs_is_that_of_one_by_their_number(method: str) -> None:
    one, many = (
        sd.methods.evaluate(*measured(runs), sd.Head(), CHAIN, method=method, full_covariance=True).covariance
        for runs in (1, RUNS)
    )
    np.testing.assert_allclose(RUNS * many, one, rtol=0.0, atol=1e-12 * np.abs(one).max())
