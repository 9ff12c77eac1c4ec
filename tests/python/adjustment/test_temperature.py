"""Scales that expand: the adjustment refers positioning errors to the reference temperature, whatever the temperatures
of the run were. Truth is the reference's closed form (reference.Scales)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import reference
from adjusted import LIMIT, adjust, assert_recovered, distance_from, knowledge_of
from simulated_runs import expansion_of
from usual import ALL_CHAINS
from virtual_runs import measured, noisy, random_scenario, random_table

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS

STEEL = (11.5e-6, 11.5e-6, 11.5e-6)
GLASS_AND_STEEL = (8.0e-6, 11.5e-6, 10.2e-6)


def random_scales(rng: np.random.Generator, *, warms_up: bool) -> reference.Scales:
    three = [tuple(float(v) for v in rng.uniform(low, high, 3)) for low, high in ((15, 30), (-3, 3), (-500, 500))]
    rate = tuple(v / 3600.0 for v in three[1]) if warms_up else (0.0, 0.0, 0.0)
    return reference.Scales(GLASS_AND_STEEL, three[0], rate, three[2])


def known(scales: reference.Scales, *, u: float = 1e-6, sensor: float = 0.1, **more: Any) -> sd.methods.KnownExpansion:
    return sd.methods.KnownExpansion(
        expansion_of(scales), (u, u, u), sensor_uncertainty=sensor, **({"one_coefficient": False} | more)
    )


@pytest.mark.parametrize("warms_up", [False, True])
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
@pytest.mark.parametrize("chain", ALL_CHAINS[::5])
def test_positioning_errors_come_out_as_at_the_reference_temperature(
    layout: str, chain: str, *, warms_up: bool
) -> None:
    rng = np.random.default_rng(len(chain) * 100 + ALL_CHAINS.index(chain))
    scenario = random_scenario(rng, layout=layout, chain=chain, seconds_per_reading=5.0)
    scenario = replace(scenario, scales=random_scales(rng, warms_up=warms_up))
    table = random_table(rng, scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    adjustment = adjust(run, scenario, knowledge_of(layout), expansion=known(scenario.scales))
    assert_recovered(adjustment, table, LIMIT[layout])
    for estimate in adjustment.expansion:  # 1e-11 mm over 250 mm and a kelvin
        assert estimate.value == pytest.approx(estimate.stated, abs=1e-13)
    assert adjustment.calibration.temperature_reference == scenario.scales.reference
    assert adjustment.calibration.temperature_as_found is None
    assert adjustment.calibration.expansion == pytest.approx(scenario.scales.coefficient, abs=1e-13)
    assert tuple(adjustment.calibration.fixed_point) == scenario.scales.fixed_point


def steel_run(start: float, rate: float = 0.0, *, noise: int | None = None) -> tuple[Any, ...]:
    rng = np.random.default_rng(3)
    scales = reference.Scales(STEEL, (start,) * 3, (rate / 3600.0,) * 3)
    scenario = random_scenario(rng, volume=(800.0, 600.0, 500.0), steps=10, tool=(0.0, 0.0, 0.0), scales=scales)
    scenario = replace(scenario, seconds_per_reading=10.0)
    table = random_table(rng, scenario.volume, 10)
    run = measured(reference.simulate(scenario, table))
    return scenario, table, run if noise is None else noisy(run, np.random.default_rng(noise))


def test_without_temperatures_errors_are_as_found() -> None:
    scenario, table, run = steel_run(23.0)
    adjustment = adjust(run, scenario)
    found = adjustment.calibration.functions["EXX"][1][-1] - table.functions["EXX"][1][-1]
    assert found == pytest.approx(11.5e-6 * 3.0 * 800.0, rel=1e-3)  # beside what lines at an angle make of it
    assert adjustment.calibration.temperature_reference is None
    assert adjustment.calibration.temperature_as_found == pytest.approx([23.0, 23.0, 23.0], abs=1e-12)
    assert adjustment.calibration.expansion is None


def test_a_coefficient_is_found_where_the_temperature_changes() -> None:
    """Half a part per million too little is stated; at 12 K/h each line is measured at another temperature."""
    scenario, table, run = steel_run(20.0, 12.0, noise=4)
    less = replace(scenario.scales, coefficient=(11.0e-6,) * 3)
    adjustment = adjust(run, scenario, expansion=known(less, one_coefficient=True))
    (estimate,) = adjustment.expansion
    assert estimate.axes == [0, 1, 2]
    assert estimate.standard_uncertainty < 0.3e-6 < estimate.prior
    assert abs(estimate.value - 11.5e-6) < 4.0 * estimate.standard_uncertainty
    assert distance_from(adjustment, table).position < 3e-3  # noise of 0.1 um and 1 urad


def test_a_compensator_takes_the_coefficient_that_the_errors_were_referred_with() -> None:
    """Stated 1.5 µm/(m K) too low; with it the machine at 28 °C, as it was measured, would be 9.6 µm off at 800 mm."""
    scenario, table, run = steel_run(28.0, 12.0, noise=4)
    less = replace(scenario.scales, coefficient=(10.0e-6,) * 3)
    calibration = adjust(run, scenario, expansion=known(less, one_coefficient=True)).calibration
    assert np.abs(calibration.expansion - STEEL).max() < 0.3e-6 < np.abs(calibration.expansion - 10.0e-6).min()
    compensator = sd.Compensator(calibration, scenario.chain, temperatures=(15.0, 40.0))
    end, warm = np.array(scenario.volume), (28.0, 28.0, 28.0)
    _, actual = reference.pose(scenario.chain, table, scenario.tool, end, scales=reference.Scales(STEEL, warm))
    left = compensator.error([end], temperature=warm)[0] - (actual - end - scenario.tool)
    assert np.abs(left).max() < 1e-3
    assert np.abs((calibration.expansion - 10.0e-6) * 8.0 * end).max() > 8e-3


def test_a_coefficient_that_is_far_from_its_prior_is_a_contradiction() -> None:
    scenario, _, run = steel_run(20.0, 60.0, noise=5)
    glass = replace(scenario.scales, coefficient=(1.0e-6,) * 3)
    adjustment = adjust(run, scenario, expansion=known(glass, u=0.5e-6, one_coefficient=True))
    assert adjustment.verdict.fit == "rejected"
    assert any(reason.finding == "prior" and reason.channel == "expansion" for reason in adjustment.verdict.reasons)


def end_of_travel(adjustment: sd.Adjustment) -> float:
    return float(adjustment.calibration.functions["EXX"][2][-1])


def test_uncertainties_of_coefficient_and_sensor_are_those_of_the_formula() -> None:
    """Steel, 800 mm, 3 K above the reference: 800 x 3 x 1 ppm = 2.40 um, and 800 x 11.5 ppm x 0.1 K = 0.92 um."""
    scenario, _, run = steel_run(23.0)

    def uncertainty(u: float, sensor: float) -> float:
        expansion = known(scenario.scales, u=u, sensor=sensor, one_coefficient=True)
        return end_of_travel(adjust(run, scenario, expansion=expansion))

    alone = uncertainty(0.0, 0.0)
    assert np.sqrt(uncertainty(1e-6, 0.0) ** 2 - alone**2) == pytest.approx(2.40e-3, rel=1e-3)
    assert np.sqrt(uncertainty(0.0, 0.1) ** 2 - alone**2) == pytest.approx(0.92e-3, rel=1e-3)
    assert np.sqrt(uncertainty(1e-6, 0.1) ** 2 - alone**2) == pytest.approx(2.57e-3, rel=2e-3)


@pytest.mark.parametrize(("channels", "expected"), [(("temperature",), 1.29e-3), (("x", "y", "z"), 0.80e-3)])
def test_a_common_sensor_counts_along_the_diagonal_as_one(channels: tuple[str, ...], expected: float) -> None:
    """u of the body diagonal's length by 0.1 K: one sensor 11.5 ppm x 0.1 K x 1118 mm, three independent ones less."""
    scenario, _, run = steel_run(23.0)
    if channels == ("temperature",):
        values = {name: v for name, v in run.channels.items() if not name.startswith("temperature")}
        run = sd.Measurement(run.line, run.point, run.position, values | {"temperature": run.channels["temperature_x"]})
    edges = np.array(scenario.volume)

    def variance(sensor: float) -> float:
        expansion = known(scenario.scales, u=0.0, sensor=sensor, one_coefficient=True)
        adjustment = adjust(run, scenario, expansion=expansion, full_covariance=True)
        calibration = adjustment.calibration
        entries = [(name, p) for name in FUNCTIONS for p in calibration.functions[name][0]]
        row = np.zeros(len(calibration.covariance))
        for axis, name in enumerate(("EXX", "EYY", "EZZ")):
            row[entries.index((name, edges[axis]))] = edges[axis] / np.linalg.norm(edges)
        return float(row @ calibration.covariance @ row)

    assert np.sqrt(variance(0.1) - variance(0.0)) == pytest.approx(expected, abs=0.005e-3)


def test_lost_temperatures_are_interpolated_and_missing_ones_are_an_error() -> None:
    scenario, table, run = steel_run(20.0, 12.0)
    channels = {name: np.array(values) for name, values in run.channels.items()}
    of_line = np.flatnonzero([line == scenario.lines[1] for line in run.line])
    for name in ("temperature_x", "temperature_y", "temperature_z"):
        channels[name][of_line[1:-1]] = np.nan

    def changed() -> sd.Measurement:
        return sd.Measurement(run.line, run.point, run.position, channels)

    adjustment = adjust(changed(), scenario, expansion=known(scenario.scales))
    assert distance_from(adjustment, table).position <= 1e-10  # linear in time, as the interpolation
    channels["temperature_z"][of_line] = np.nan
    with pytest.raises(sd.InvalidArgument, match=rf"run 0, line {scenario.lines[1]}: expected temperatures"):
        adjust(changed(), scenario, expansion=known(scenario.scales))
    usual = known(scenario.scales, temperature=(20.5, 20.5, 20.5))
    adjust(changed(), scenario, expansion=usual)
