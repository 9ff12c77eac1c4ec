"""A drift of the functional point, and returns to check points that tell it from the machine's errors. Truth is the
reference's closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import reference
from adjusted import LIMIT, adjust, assert_recovered, knowledge_of
from simulated_runs import expansion_of
from usual import ALL_CHAINS
from virtual_runs import head_of, measured, noisy, plan_of, random_scenario, random_table

import stepdiag as sd

RATE = (5e-3 / 3600.0, -3e-3 / 3600.0, 12e-3 / 3600.0)  # mm/s
WIDE = (1.0, 1.0, 1.0)
ANY = sd.methods.PlausibleLimits(positioning=1.0, translation=1e3, rotation=1.0)
STEEL = (11.5e-6, 11.5e-6, 11.5e-6)


def drifting(chain: str, layout: str = "ideal", *, every: int = 2, at: int = 1) -> reference.Scenario:
    rng = np.random.default_rng(ALL_CHAINS.index(chain))
    scenario = random_scenario(rng, layout=layout, chain=chain, seconds_per_reading=20.0)
    return replace(scenario, machine_drift=RATE, check_points=(every, at))


def fixed_drift(layout: str) -> dict[str, object]:
    """Lines have no drift of their own."""
    knowledge = knowledge_of(layout)
    knowledge.setup["drift"] = "fixed"
    return {"knowledge": knowledge}


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
@pytest.mark.parametrize("chain", ALL_CHAINS[::4])
@pytest.mark.parametrize("at", [0, 2])
def test_drift_is_found_and_the_machine_as_it_was_at_the_start(layout: str, chain: str, at: int) -> None:
    scenario = drifting(chain, layout, at=at)
    table = random_table(np.random.default_rng(5), scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    found = adjust(run, scenario, **fixed_drift(layout), machine_drift=sd.MachineDrift(WIDE))
    assert_recovered(found, table, LIMIT[layout])
    for axis, estimate in enumerate(found.machine_drift):
        assert estimate.axis == axis
        assert estimate.value == pytest.approx(RATE[axis], abs=1e-12)


def test_simulation_is_that_of_the_reference() -> None:
    scenario = replace(drifting(ALL_CHAINS[7], "psd"), misalignment={})
    table = random_table(np.random.default_rng(5), scenario.volume, scenario.steps)
    expected = measured(reference.simulate(scenario, table))
    functions = {name: (np.array(p), np.array(v)) for name, (p, v) in table.functions.items()}
    machine = sd.Machine(scenario.chain, sd.ErrorMap(functions, table.squareness), scenario.tool)
    run = sd.simulate(machine, plan_of(scenario), head_of(scenario), seconds_per_reading=20.0, machine_drift=RATE)
    assert run.line == expected.line
    assert run.point.tolist() == expected.point.tolist()
    for name in run.channels:
        np.testing.assert_allclose(run.channels[name], expected.channels[name], rtol=0.0, atol=1e-11)


def test_a_plan_says_which_points_are_returns() -> None:
    plan = sd.Plan((8.0, 6.0, 5.0), ["ppp"], 4, scale_lines=["p00"], check_points=sd.CheckPoints(2, 1))
    numbers = plan.check_numbers("ppp")
    assert numbers == [7, 14]
    np.testing.assert_array_equal(plan.points("ppp")[numbers], [[2.0, 1.5, 1.25]] * 2)
    assert plan.check_numbers("p00") == []


def test_it_goes_with_a_recorded_temperature() -> None:
    """The same drift, told by a sensor that warms up evenly: the rate is one by kelvin."""
    scenario = drifting(ALL_CHAINS[0])
    table = random_table(np.random.default_rng(5), scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    warm = sd.Measurement(
        run.line, run.point, run.position, {**run.channels, "air_temperature": 21.0 + run.channels["time"] / 3600.0}
    )
    drift = sd.MachineDrift([1e3, 1e3, 1e3], record="air_temperature")
    found = adjust(warm, scenario, **fixed_drift("ideal"), machine_drift=drift)
    assert_recovered(found, table, LIMIT["ideal"])
    assert [e.value for e in found.machine_drift] == pytest.approx([3600.0 * rate for rate in RATE], abs=1e-8)


def test_expansion_and_drift_are_told_apart() -> None:
    scales = reference.Scales(STEEL, (20.0,) * 3, (2.0 / 3600.0,) * 3)
    scenario = replace(drifting(ALL_CHAINS[0]), scales=scales)
    table = random_table(np.random.default_rng(5), scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    known = sd.methods.KnownExpansion(expansion_of(scales), (1e-6,) * 3, one_coefficient=True, sensor_uncertainty=0.0)
    found = adjust(run, scenario, **fixed_drift("ideal"), machine_drift=sd.MachineDrift(WIDE), expansion=known)
    assert_recovered(found, table, LIMIT["ideal"])


def test_check_points_make_a_drift_observable() -> None:
    """Without them it looks like errors of the machine that grow along each line."""

    def uncertainty(every: int) -> float:
        rng = np.random.default_rng(3)
        scenario = random_scenario(rng, volume=(800.0, 600.0, 500.0), steps=10, tool=(0.0, 0.0, 0.0))
        scenario = replace(scenario, seconds_per_reading=10.0, machine_drift=RATE, check_points=(every, 0))
        table = random_table(rng, scenario.volume, 10)
        run = noisy(measured(reference.simulate(scenario, table)), np.random.default_rng(4))
        found = adjust(run, scenario, **fixed_drift("ideal"), machine_drift=sd.MachineDrift([20e-3 / 3600.0] * 3))
        assert found.verdict.fit == "accepted"
        return max(estimate.standard_uncertainty for estimate in found.machine_drift)

    assert uncertainty(3) < 0.2 * uncertainty(0)


def test_linear_evaluations_and_batches_take_a_run_with_check_points() -> None:
    """Enhanced and conventional leave the returns out: with them or without, the same values."""
    scenario = replace(drifting(ALL_CHAINS[0]), machine_drift=(0.0, 0.0, 0.0))
    table = random_table(np.random.default_rng(5), scenario.volume, scenario.steps)
    with_returns = measured(reference.simulate(scenario, table))
    plain = replace(scenario, check_points=(0, 0))
    without = measured(reference.simulate(plain, table))
    uncertainty = sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6)
    for method in ("enhanced", "conventional"):
        a, b = (
            sd.methods.evaluate(
                run, plan_of(s), head_of(s), s.chain, s.tool, method=method, uncertainty=uncertainty, plausible=ANY
            )
            for run, s in ((with_returns, scenario), (without, plain))
        )
        for name, (_, values, deviations) in b.functions.items():
            np.testing.assert_array_equal(a.functions[name][1], values)
            np.testing.assert_array_equal(a.functions[name][2], deviations)


@pytest.mark.parametrize("method", ["enhanced", "adjustment"])
def test_batches_say_what_single_evaluations_say(method: str) -> None:
    scenario = drifting(ALL_CHAINS[0])
    rng = np.random.default_rng(5)
    table = random_table(rng, scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    options = sd.methods.AdjustmentOptions(
        uncertainty=sd.methods.ReadingUncertainty(distance=1e-4, tilt=1e-6),
        setup=sd.methods.SetupPriors(drift="fixed"),
        machine_drift=sd.MachineDrift([20e-3 / 3600.0] * 3),
    )
    batch = sd.montecarlo.BatchEvaluator(
        run,
        plan_of(scenario),
        head_of(scenario),
        scenario.chain,
        scenario.tool,
        method=method,
        **({"options": options} if method == "adjustment" else {"uncertainty": options.uncertainty}),
    )
    other = noisy(run, rng)
    readings = np.stack([other.channels[name] for name in ("distance", "alpha", "beta")], axis=1)[None]
    values = batch.evaluate(readings)[0]
    single = (
        sd.methods.adjust(
            other, plan_of(scenario), head_of(scenario), scenario.chain, scenario.tool, options
        ).calibration
        if method == "adjustment"
        else sd.methods.evaluate(
            other,
            plan_of(scenario),
            head_of(scenario),
            scenario.chain,
            scenario.tool,
            method=method,
            uncertainty=options.uncertainty,
        )
    )
    for entry, value in zip(batch.entries, values, strict=True):
        if entry.parameter in single.functions:
            position, table_values, _ = single.functions[entry.parameter]
            (k,) = np.flatnonzero(np.isclose(position, entry.position))
            assert value == pytest.approx(table_values[k], abs=1e-8)


def test_a_drift_far_from_its_prior_rejects() -> None:
    scenario = drifting(ALL_CHAINS[0])
    table = random_table(np.random.default_rng(5), scenario.volume, scenario.steps)
    run = noisy(measured(reference.simulate(scenario, table)), np.random.default_rng(1))
    little = sd.MachineDrift([1.5e-3 / 3600.0] * 3)
    found = adjust(run, scenario, **fixed_drift("ideal"), machine_drift=little)
    assert found.verdict.fit == "rejected"
    said = " ".join(found.calibration.fit_reasons)
    assert "the drift of the functional point along Z is" in said


def test_a_lost_reading_needs_no_time() -> None:
    scenario = drifting(ALL_CHAINS[0])
    table = random_table(np.random.default_rng(5), scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))

    def without(row: int, *names: str) -> sd.Measurement:
        channels = {name: values.copy() for name, values in run.channels.items()}
        for name in names:
            channels[name][row] = np.nan
        return sd.Measurement(run.line, run.point, run.position, channels)

    drift = {"machine_drift": sd.MachineDrift(WIDE), **fixed_drift("ideal")}
    for row in (0, 7):
        found = adjust(without(row, *run.channels), scenario, **drift)
        # The drift then counts from the second row, where the machine's errors have grown by it.
        assert found.machine_drift[2].value == pytest.approx(RATE[2], abs=1e-11)
    with pytest.raises(sd.InvalidArgument, match=r'line .*, point 7: a machine drift with "time" needs that column'):
        adjust(without(7, "time"), scenario, **drift)


def test_bad_options_are_refused() -> None:
    scenario = drifting(ALL_CHAINS[0])
    table = random_table(np.random.default_rng(5), scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    with pytest.raises(sd.InvalidArgument, match='expected time or a temperature, got "pressure"'):
        adjust(run, scenario, machine_drift=sd.MachineDrift(WIDE, record="pressure"))
    with pytest.raises(sd.InvalidArgument, match='machine drift with "temperature_x" needs that column'):
        adjust(run, scenario, machine_drift=sd.MachineDrift(WIDE, record="temperature_x"))
    with pytest.raises(sd.InvalidArgument, match="three finite standard uncertainties"):
        adjust(run, scenario, machine_drift=sd.MachineDrift([-1.0, 0.0, 0.0]))
    with pytest.raises(sd.InvalidArgument, match="check_points every: expected 0 to 5 "):
        sd.Plan((1.0, 1.0, 1.0), ["ppp"], 5, check_points=sd.CheckPoints(6, 0))
