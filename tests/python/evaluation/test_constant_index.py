"""Readings of an instrument that counted with a constant index: distances in the air that the run recorded."""

from __future__ import annotations

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag import _core
from stepdiag.scenario.description import parse_scenario, reduced_run

PERFECT = SCENARIO.split("[misalignment]")[0]
COUNTED = (
    PERFECT
    + """
[environment]
readings = "constant_index"
temperature_c = 26.0
pressure_hpa = 990.0
[environment.assumed]
temperature_c = 20.0
pressure_hpa = 1013.25
"""
)
IN_VACUUM = COUNTED.split("[environment.assumed]")[0] + "[environment.assumed]\nrefractive_index = 1.0\n"


def with_channels(run: sd.Measurement, channels: dict[str, np.ndarray]) -> sd.Measurement:
    return sd.Measurement(run.line, run.point, run.position, {**run.channels, **channels})


def without_constants(run: sd.Measurement, distance: np.ndarray) -> np.ndarray:
    """Distances less the first one of each line that is there."""
    result = distance.copy()
    for line in dict.fromkeys(run.line):
        rows = np.flatnonzero([name == line for name in run.line])
        result[rows] -= distance[rows][np.isfinite(distance[rows])][0]
    return result


# Errors of 20 um of the machine at a line's start, which nominal distances do not have, times the index's 12 ppm.
OF_NOMINAL = 3e-7


@pytest.mark.parametrize("text", [COUNTED, IN_VACUUM])
def test_distances_are_those_of_the_formula_with_a_drifting_air(text: str) -> None:
    """L_i = (n_used (D_i - D_0) + n_0 L_0)/n_i by the conventions, the index by the library's Ciddor alone."""
    scenario = parse_scenario(text)
    sound = sd.simulate(parse_scenario(PERFECT))
    wavelength, standoff = scenario.known.head.wavelength, scenario.known.head.standoff
    count = np.arange(len(sound))
    air = {
        "air_temperature": 21.0 + 0.01 * count,
        "air_pressure": 100_000.0 + 5.0 * count,
        "air_humidity": 0.4 + 0.0005 * count,
    }
    names = ("temperature", "pressure", "relative_humidity")
    index = np.array(
        [
            sd.Environment.from_air(**dict(zip(names, state, strict=True))).refractive_index(wavelength)
            for state in zip(*air.values(), strict=True)
        ]
    )
    standard = sd.Environment.from_air(temperature=20.0, pressure=101_325.0).refractive_index(wavelength)
    used = 1.0 if text == IN_VACUUM else standard
    truth, read, expected = (sound.channels["distance"].copy() for _ in range(3))
    for line in dict.fromkeys(sound.line):
        rows = np.flatnonzero([name == line for name in sound.line])
        optical = index[rows] * truth[rows]
        read[rows] = 12.5 + (optical - optical[0]) / used  # a counter starts anywhere
        # The machine stands at the line's start by its errors, which the nominal first distance does not have.
        expected[rows] -= index[rows[0]] / index[rows] * (truth[rows[0]] - standoff)
    found = reduced_run(scenario.known, with_channels(sound, {"distance": read, **air}))
    assert np.max(np.abs(found.channels["distance"] - expected)) <= 1e-12  # a few roundings of 200 mm


@pytest.mark.parametrize("text", [COUNTED, IN_VACUUM])
def test_a_simulated_run_is_found_as_it_was(text: str) -> None:
    scenario = parse_scenario(text)
    run, sound = sd.simulate(scenario), sd.simulate(parse_scenario(PERFECT))
    assert run.channels["air_temperature"] == pytest.approx(26.0)
    raw, reduced, truth = (
        without_constants(run, one.channels["distance"]) for one in (run, reduced_run(scenario.known, run), sound)
    )
    assert np.max(np.abs(raw - truth)) > 1e-3  # 11.6 ppm of 112 mm
    assert np.max(np.abs(reduced - truth)) <= OF_NOMINAL


def test_a_lost_first_reading_and_empty_fields_do_no_harm() -> None:
    scenario = parse_scenario(COUNTED)
    run = sd.simulate(scenario)
    first = [i for i in range(len(run)) if run.point[i] == 0]
    distance, warm = run.channels["distance"].copy(), run.channels["air_temperature"].copy()
    distance[first], warm[3:9] = np.nan, np.nan
    found = reduced_run(scenario.known, with_channels(run, {"distance": distance, "air_temperature": warm}))
    sound = sd.simulate(parse_scenario(PERFECT)).channels["distance"].copy()
    sound[first] = np.nan
    difference = without_constants(run, found.channels["distance"]) - without_constants(run, sound)
    assert np.count_nonzero(np.isnan(difference)) == len(first)
    assert np.nanmax(np.abs(difference)) <= OF_NOMINAL


def test_a_run_without_air_is_refused() -> None:
    scenario = parse_scenario(COUNTED)
    run = sd.simulate(parse_scenario(PERFECT))
    with pytest.raises(sd.InvalidArgument, match=r"environment.readings: .*expected a column air_temperature_c"):
        sd.methods.adjust_scenario(scenario, run)
    with pytest.raises(sd.InvalidArgument, match=r"expected air_pressure recorded on line .*, got none; an assumed"):
        _core.in_recorded_air(
            with_channels(run, {"air_temperature": np.full(len(run), 20.0)}),
            scenario.known.plan,
            scenario.known.head,
            sd.Environment(1.0003),
        )


def test_a_result_lists_the_index_of_the_air_where_the_instrument_counted_in_vacuum() -> None:
    scenario = parse_scenario(IN_VACUUM)
    rows = sd.methods.evaluate_scenario(scenario, sd.simulate(scenario)).conditions
    air = sd.Environment.from_air(temperature=26.0, pressure=99_000.0).refractive_index(scenario.known.head.wavelength)
    assert f"index of that air: {air:.8f}, counted with 1.00000000" in rows
