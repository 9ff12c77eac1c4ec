"""Errors at points, along diagonals and over the volume, with their uncertainties, against poses made a second time."""

from __future__ import annotations

import numpy as np
import pytest
import reference
from adjusted import adjust
from dense_adjustment import Knowledge
from derived_reference import diagonal, grid, rows_at, values_of
from virtual_runs import measured, random_scenario, random_table

import stepdiag as sd
from stepdiag import _core

STEPS = 3


def calibrated(seed: int, chain: str, steps: int = STEPS) -> tuple[sd.Calibration, reference.Scenario]:
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng, steps=steps, chain=chain)
    run = measured(reference.simulate(scenario, random_table(rng, scenario.volume, steps)))
    known = Knowledge({(line, "laser"): "fixed" for line in scenario.scale_lines})
    return adjust(run, scenario, known, full_covariance=True).calibration, scenario


CHAINS = ["[w X' b Y Z t]", "[w b X Y Z t]", "[w Z' Y' X' b t]", "[w Y' b Z X t]"]


@pytest.mark.parametrize("chain", CHAINS)
def test_error_at_a_point_has_the_covariance_of_the_calibration(chain: str) -> None:
    calibration, scenario = calibrated(5, chain)
    volume = np.array(scenario.volume)
    values, covariance = values_of(calibration), calibration.covariance
    assert covariance is not None
    rng = np.random.default_rng(6)
    points = [*(volume * rng.uniform(0, 1, 3) for _ in range(3)), volume, 0 * volume, 1.3 * volume, -0.2 * volume]
    tools = [None, np.array([0.0, 0.0, -250.0]), np.array([120.0, -70.0, 33.0])]
    for i, point in enumerate(points):
        tool = tools[i % 3]
        found = _core.error_at_point(calibration, point, tool=tool)
        offset = np.array(scenario.tool) if tool is None else tool
        rows = rows_at(chain, calibration.covariance_labels, offset, point)
        # Coefficients are differences good to 1e-8; they meet errors of 20 um and 60 urad.
        assert np.allclose(found.value, rows @ values, rtol=0, atol=1e-9)
        expected = rows @ covariance @ rows.T
        scale = np.sqrt(np.diag(expected)) + 1e-30
        assert np.max(np.abs(np.asarray(found.covariance) - expected) / np.outer(scale, scale)) <= 1e-6
        assert np.allclose(found.standard_uncertainty, np.sqrt(np.maximum(np.diag(expected), 0)), rtol=1e-6, atol=1e-16)
        assert found.missing == {}


def test_error_at_a_point_is_the_machine_s_to_first_order() -> None:
    """The error map of the calibration, as a machine, moves the tool there: to second order, 60 urad of 60 um."""
    calibration, scenario = calibrated(7, CHAINS[0])
    point = np.array(scenario.volume) * [0.3, 0.8, 0.55]
    machine = sd.Machine(scenario.chain, calibration.to_error_map(), scenario.tool)
    found = _core.error_at_point(calibration, point)
    assert np.allclose(found.value[:3], machine.first_order_error(point[None])[0], rtol=0, atol=1e-12)
    assert np.allclose(found.value[:3], machine.error(point[None])[0], rtol=0, atol=2e-5)


@pytest.mark.parametrize("chain", CHAINS)
def test_diagonals_are_measured_from_where_they_begin(chain: str) -> None:
    calibration, scenario = calibrated(8, chain)
    values, covariance = values_of(calibration), calibration.covariance
    assert covariance is not None
    found = _core.diagonal_errors(calibration)
    assert set(found) == {"ppp", "npp", "pnp", "nnp"}
    for line, errors in found.items():
        points, direction = diagonal(np.array(scenario.volume), line, STEPS + 1)
        assert np.allclose(errors.point, points, rtol=0, atol=1e-9)
        rows = np.array(
            [direction @ rows_at(chain, calibration.covariance_labels, np.array(scenario.tool), p)[:3] for p in points]
        )
        rows = rows - rows[0]
        expected = rows @ covariance @ rows.T
        assert np.allclose(errors.value, rows @ values, rtol=0, atol=2e-9)
        u = np.sqrt(np.maximum(np.diag(expected), 0.0))
        assert np.allclose(errors.standard_uncertainty, u, rtol=1e-6, atol=1e-12)
        assert np.max(np.abs(np.asarray(errors.covariance) - expected)) <= 1e-6 * np.max(expected)
        assert errors.range == pytest.approx(np.ptp(errors.value), abs=1e-15)


@pytest.mark.parametrize("chain", ["[w b X Y Z t]", "[w X' b Y Z t]"])
def test_volumetric_accuracy_is_the_range_over_the_volume(chain: str) -> None:
    calibration, scenario = calibrated(9, chain, 2)
    volume, tool = np.array(scenario.volume), np.array(scenario.tool)
    values, covariance = values_of(calibration), calibration.covariance
    assert covariance is not None
    # Between nodes deviations are linear in each position, but for that of an axis that carries the workpiece.
    quadratic = "'" in chain
    points = grid(volume, (4 if quadratic else 2, 2, 2))
    rows = np.array([rows_at(chain, calibration.covariance_labels, tool, p) for p in points])
    own = np.ptp(rows @ values, axis=0)
    found = _core.volumetric_accuracy(calibration, samples=20_000, seed=3)
    assert list(found.names[:6]) == ["V_X", "V_Y", "V_Z", "V_A", "V_B", "V_C"]
    value = np.asarray(found.value)
    if quadratic:  # an extreme that neither grid meets is missed by less than a hundredth of the range
        assert np.allclose(value[:6], own, rtol=0.01)
        assert np.all(value[:3] >= own[:3] - 2 * found.resolution - 2e-9)
    else:
        assert np.allclose(value[:6], own, rtol=0, atol=2e-9)
    diagonals = _core.diagonal_errors(calibration)
    assert np.allclose(value[6:], [diagonals[line].range for line in ("ppp", "npp", "pnp", "nnp")], atol=1e-12)

    rng = np.random.default_rng(10)
    draws = rng.multivariate_normal(values, covariance, size=20_000, method="svd")
    ranges = np.ptp(np.einsum("pdv,sv->spd", rows, draws), axis=1)
    # Standard deviations of 20,000 draws each are good to 0.5 %, means to 0.007 u: five of their difference, and what
    # two grids do not see alike.
    u = np.std(ranges, axis=0)
    assert np.allclose(found.standard_uncertainty[:6], u, rtol=0.04)
    assert np.all(np.abs(found.mean[:6] - ranges.mean(axis=0)) <= 0.05 * u + quadratic * 0.01 * own)
    ends = np.quantile(ranges, [0.025, 0.975], axis=0)
    # An end of a 95 % interval from 20,000 draws is good to 0.019 u.
    near = 0.15 * u + quadratic * 0.01 * own
    assert np.all(np.abs(np.asarray(found.drawn_interval)[:6].T - ends) <= near)
    mirrored = 2 * value[:6, None] - np.asarray(found.drawn_interval)[:6][:, ::-1]
    assert np.allclose(np.asarray(found.interval)[:6], np.maximum(mirrored, 0.0), rtol=0, atol=1e-15)
