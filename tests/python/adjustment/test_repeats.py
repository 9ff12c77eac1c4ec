"""Repeated runs, whose set-ups the adjustment eliminates before the machine: what one run says, with less noise."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from usual import CHAIN, DIAGONALS, SCALE_LINES, VOLUME

import stepdiag as sd

HEADS = {
    "ideal": sd.Head(),
    "psd": sd.Head("psd", psd_distance=200.0),
    "multi_beam": sd.Head("multi_beam", beam_offsets=[(0.0, 0.0), (12.0, 0.0), (0.0, 12.0)]),
}
RUNS = 60


@functools.cache
def adjusted(layout: str, runs: int) -> sd.Adjustment:
    machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=3))
    plan = sd.Plan(VOLUME, DIAGONALS, 4, scale_lines=SCALE_LINES)
    head = HEADS[layout]
    run = sd.simulate(machine, plan, head, repeats=runs)
    return sd.methods.adjust(run, plan, head, CHAIN)


@pytest.mark.parametrize("layout", HEADS)
def test_many_noiseless_runs_give_the_calibration_of_one(layout: str) -> None:
    one, many = adjusted(layout, 1), adjusted(layout, RUNS)
    assert many.degrees_of_freedom > one.degrees_of_freedom
    for name, (_, values, uncertainties) in one.calibration.functions.items():
        _, of_many, smaller = many.calibration.functions[name]
        # Second order that only priors know differs by how well they are known; roundings are below.
        assert np.abs(of_many - values).max() <= 1e-3 * np.max(uncertainties), name
        determined = uncertainties > 0.0
        ratio = smaller[determined] / uncertainties[determined]
        np.testing.assert_allclose(ratio, RUNS**-0.5, rtol=1e-3, err_msg=name)


@pytest.mark.parametrize("layout", HEADS)
def test_set_ups_of_every_run_are_said(layout: str) -> None:
    many = adjusted(layout, RUNS)
    assert {s.run for s in many.setup} == set(range(RUNS))
    assert len(many.setup) == RUNS * len(adjusted(layout, 1).setup)
