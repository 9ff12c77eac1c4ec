"""Uncertain temperatures and coefficients in propagation and virtual calibrations, against the formula and against
adjustments of runs that the reference simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import reference
from small_scenario import SCENARIO
from virtual_runs import head_of, measured, plan_of, random_scenario, random_table

import stepdiag as sd
from stepdiag.scenario.description import adjustment_options, parse_scenario
from stepdiag.uncertainty.virtual_calibrations import virtual_calibrations

STEEL = """
[temperature]
expansion_um_per_m_k = 11.5
u_expansion_um_per_m_k = {u}
u_temperature_c = {sensor}
axes_c = 23.0
"""
LARGE = SCENARIO.replace("x_mm = 80.0", "x_mm = 800.0").replace("y_mm = 60.0", "y_mm = 600.0")


def calibrations(u: float, sensor: float) -> sd.montecarlo.VirtualCalibrations:
    scenario = parse_scenario(LARGE + STEEL.format(u=u, sensor=sensor))
    return virtual_calibrations(scenario, seed=1)


def end_of_x(values: np.ndarray, of: sd.montecarlo.VirtualCalibrations) -> float:
    places = [(output.name, output.position) for output in of.outputs]
    return float(values[places.index(("EXX", 800.0))])


def propagated(u: float, sensor: float) -> float:
    of = calibrations(u, sensor)
    return end_of_x(sd.montecarlo.propagate(of).standard_uncertainty, of)


def test_propagation_has_the_uncertainties_of_the_formula() -> None:
    """Steel, 800 mm, 3 K: 800 x 3 x 1 ppm = 2.40 um and 800 x 11.5 ppm x 0.1 K = 0.92 um."""
    alone = propagated(0.0, 0.0)
    assert np.sqrt(propagated(1.0, 0.0) ** 2 - alone**2) == pytest.approx(2.40e-3, rel=1e-3)
    assert np.sqrt(propagated(0.0, 0.1) ** 2 - alone**2) == pytest.approx(0.92e-3, rel=1e-3)
    assert np.sqrt(propagated(1.0, 0.1) ** 2 - alone**2) == pytest.approx(2.57e-3, rel=2e-3)


def test_budget_names_both() -> None:
    budget = sd.montecarlo.propagate(calibrations(1.0, 0.1)).budget
    assert {"expansion of the scales", "temperature of the scales"} <= set(budget)


def test_virtual_calibrations_scatter_as_propagated() -> None:
    of, count = calibrations(1.0, 0.1), 20_000
    result = sd.montecarlo.run_monte_carlo(of, samples=count)
    u = end_of_x(result.standard_uncertainty, of)
    assert u == pytest.approx(propagated(1.0, 0.1), rel=4.0 / np.sqrt(2.0 * count))  # four standard deviations


def test_an_adjustment_states_what_its_virtual_calibrations_scatter_by() -> None:
    def stated(u: float, sensor: float) -> float:
        scenario = parse_scenario(LARGE + STEEL.format(u=u, sensor=sensor))
        found = sd.methods.adjust_scenario(scenario, sd.simulate(scenario)).calibration
        return float(found.functions["EXX"][2][-1] ** 2)

    # Priors of the set-ups, which are no uncertain inputs here, are in what is stated.
    expected = propagated(1.0, 0.1) ** 2 - propagated(0.0, 0.0) ** 2
    assert stated(1.0, 0.1) - stated(0.0, 0.0) == pytest.approx(expected, rel=1e-3)


def test_many_sets_are_adjusted_as_each_by_itself() -> None:
    """With coefficients among the unknowns, in temperatures that change."""
    rng = np.random.default_rng(8)
    scales = reference.Scales(
        (8e-6, 11.5e-6, 1e-5), (22.0, 23.0, 24.0), (2e-3, 1e-3, -1e-3), fixed_point=(100.0, 0.0, -50.0)
    )
    scenario = replace(random_scenario(rng, steps=6, seconds_per_reading=5.0), scales=scales)
    run = measured(reference.simulate(scenario, random_table(rng, scenario.volume, 6)))
    expansion = sd.methods.KnownExpansion(
        sd.Expansion((8e-6, 11e-6, 1.1e-5), fixed_point=scales.fixed_point),
        (1e-6, 1e-6, 0.0),
        one_coefficient=False,
        sensor_uncertainty=0.1,
    )
    told = (plan_of(scenario), head_of(scenario), sd.Chain(scenario.chain), scenario.tool)
    signals = ("distance", "alpha", "beta")
    readings = np.stack([run.channels[name] for name in signals], axis=1)
    noise = rng.normal(size=(5, *readings.shape)) * np.array([1e-4, 1e-6, 1e-6])
    evaluator = sd.montecarlo.BatchEvaluator(run, *told, method="adjustment", expansion=expansion)
    together = evaluator.evaluate(readings + noise)
    for one, values in zip(readings + noise, together, strict=True):
        own = sd.Measurement(
            run.line, run.point, run.position, {**run.channels, **dict(zip(signals, one.T, strict=True))}
        )
        alone = sd.methods.adjust(own, *told, expansion=expansion, outlier_probability=0.0).calibration
        expected = [
            alone.squareness[entry.parameter][0]
            if np.isnan(entry.position)
            else alone.to_error_map().function(entry.parameter, [entry.position])[0]
            for entry in evaluator.entries
        ]
        assert np.max(np.abs(values - expected)) <= 1e-8  # mm, rad: both stop at a billionth of an uncertainty of 1 um


@pytest.mark.parametrize("method", ["enhanced", "conventional"])
def test_published_evaluations_correct_their_lengths_first(method: str) -> None:
    scenario = parse_scenario(LARGE.replace("[machine.random]\nseed = 7\n", "") + STEEL.format(u=0.0, sensor=0.0))
    scenario = replace(scenario, truth=replace(scenario.truth, misalignment={}, noise=sd.Noise()))
    found = sd.methods.evaluate_scenario(scenario, sd.simulate(scenario), method=method)
    assert found.temperature_reference == 20.0
    assert found.expansion == pytest.approx([11.5e-6] * 3, rel=1e-15)
    largest = max(float(np.max(np.abs(value))) for _, value, _ in found.functions.values())
    assert largest <= 1e-9  # 27.6 um without; what is left is of second order in 3e-5
    assert adjustment_options(scenario.known).expansion is not None


def test_a_ramp_of_the_temperature_is_that_of_a_run_that_warms_up_unseen() -> None:
    """The sensor goes on saying 23 °C while the scales warm up by 2 K/h."""
    text = LARGE.replace("[plan]", "[plan]\nseconds_per_reading = 20.0") + STEEL.format(u=0.0, sensor=0.0)
    scenario = parse_scenario(text + "\n[uncertainty]\nscale_temperature_c_per_h = 2.0\n")
    known, rate = scenario.known, 2.0 / 3600.0
    assert known.expansion is not None
    scales = known.expansion.expansion

    def of_run(rate: float) -> float:
        warm = sd.ScaleTemperatures(scales, (23.0,) * 3, (rate,) * 3, one_sensor=True)
        misalignment = dict(scenario.truth.misalignment)
        run = sd.simulate(
            scenario.machine(),
            known.plan,
            known.head,
            scales=warm,
            seconds_per_reading=20.0,
            misalignment=misalignment,
        )
        said = {**run.channels, "temperature": np.full(len(run), 23.0)}
        unseen = sd.Measurement(run.line, run.point, run.position, said)
        return float(sd.methods.evaluate_scenario(scenario, unseen, method="enhanced").functions["EXX"][1][-1])

    of = virtual_calibrations(scenario, method="enhanced", seed=1)
    nominal, ramped = (end_of_x(values, of) for values in of.evaluate_at(np.array([[0.0, rate]])).T)
    assert nominal == pytest.approx(of_run(0.0), abs=1e-12)
    assert ramped - nominal > 5e-3
    assert ramped - nominal == pytest.approx(of_run(rate) - of_run(0.0), rel=1e-3)
