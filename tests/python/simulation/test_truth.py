"""`simulate` against the runs with known truth and against an independent closed form (reference.py)."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import reference
import reference_files
from hypothesis import given, settings
from hypothesis import strategies as st
from places import RUNS
from simulated_runs import LIMIT, errors_of, plan_of, scenarios, simulated, table_of, warm
from usual import ALL_LINES

import stepdiag as sd

CASES = sorted(path.parent.name for path in RUNS.glob("*/scenario.toml"))


@pytest.mark.parametrize("case", CASES)
def test_run_with_known_truth_is_reproduced(case: str) -> None:
    scenario = reference_files.read_scenario(RUNS / case / "scenario.toml")
    rows = reference_files.read_rows(RUNS / case / "measurement.csv")
    run = simulated(scenario, sd.read_error_map(RUNS / case / "truth.csv"))
    place = {key: i for i, key in enumerate(zip(run.line, run.point, strict=True))}
    channels = set(run.channels)
    compared = 0
    for row in rows:
        i = place.pop((row["line"], row["point"]))
        assert run.position[i] == pytest.approx([row["x"], row["y"], row["z"]], abs=1e-9)
        for channel in channels:
            if row[channel] is None:
                continue
            limit = LIMIT[channel]
            if case == "noisy":  # 0.1 um and 1 urad, a standard deviation: six of them
                limit = 6e-4 if channel == "distance" else 6e-6
            assert abs(run.channels[channel][i] - row[channel]) <= limit, (case, row["line"], row["point"], channel)
            compared += 1
    assert compared >= len(channels) * (len(rows) - 5)  # reversed_order has lost five
    assert not place, "every point of the plan is in the file"


@pytest.mark.parametrize("case", [case for case in CASES if case != "noisy"])
def test_reference_reproduces_the_runs_too(case: str) -> None:
    """The reference itself is checked against the files, so that it is worth comparing with."""
    scenario = reference_files.read_scenario(RUNS / case / "scenario.toml")
    table = reference_files.read_error_table(RUNS / case / "truth.csv")
    expected = {(row["line"], row["point"]): row for row in reference_files.read_rows(RUNS / case / "measurement.csv")}
    for row in reference.simulate(scenario, table):
        for channel in LIMIT.keys() & row.keys():
            value = expected[row["line"], row["point"]][channel]
            assert value is None or abs(value - row[channel]) <= LIMIT[channel] / 2


@settings(max_examples=60)
@given(scenarios(), st.integers(0, 2**32), st.integers(2, 20), st.floats(1.0, 1.5))
def test_traced_readings_are_the_closed_form(
    scenario: reference.Scenario, seed: int, intervals: int, index: float
) -> None:
    errors = errors_of(scenario, seed, intervals)
    run = simulated(scenario, errors, environment=sd.Environment(index))
    for i, row in enumerate(reference.simulate(scenario, table_of(errors))):
        assert (run.line[i], run.point[i]) == (row["line"], row["point"])
        for channel in ("distance", "alpha", "beta"):
            assert abs(run.channels[channel][i] - row[channel]) <= LIMIT[channel]


@settings(max_examples=40)
@given(scenarios(("psd", "multi_beam")), st.integers(0, 2**32))
def test_raw_layouts_read_the_closed_form(scenario: reference.Scenario, seed: int) -> None:
    errors = errors_of(scenario, seed, 7)
    run = simulated(scenario, errors)
    for i, row in enumerate(reference.simulate(scenario, table_of(errors))):
        for channel in LIMIT.keys() & row.keys():
            assert abs(run.channels[channel][i] - row[channel]) <= LIMIT[channel]


@settings(max_examples=40)
@given(warm(("ideal", "psd", "multi_beam")), st.integers(0, 2**32))
def test_scales_that_expand_read_the_closed_form(scenario: reference.Scenario, seed: int) -> None:
    errors = errors_of(scenario, seed, 7)
    run = simulated(scenario, errors)
    for i, row in enumerate(reference.simulate(scenario, table_of(errors))):
        for channel in run.channels.keys() - {"time"}:
            limit = LIMIT.get(channel, 1e-12)  # temperatures of 40 °C and 10 K/h: a few roundings
            assert abs(run.channels[channel][i] - row[channel]) <= limit


@settings(max_examples=12)
@given(scenarios(("ideal", "psd", "multi_beam")), st.integers(0, 2**32), st.integers(0, 10**6))
def test_readings_hold_against_forty_digits(scenario: reference.Scenario, seed: int, pick: int) -> None:
    errors = errors_of(scenario, seed, 7)
    table = table_of(errors)
    run = simulated(scenario, errors)
    for i in (pick % len(run), (7 * pick + 3) % len(run)):
        # The commanded position as the run has it: k travel / N, rounded once.
        line, commanded = run.line[i], run.position[i]
        exact = reference.readings(scenario, table, line, commanded, reference.DIGITS_40)
        for channel, value in exact.items():
            assert abs(float(run.channels[channel][i] - value)) <= LIMIT[channel]


@settings(max_examples=100)
@given(scenarios(), st.integers(0, 2**32), st.tuples(*[st.floats(-0.2, 1.2)] * 3))
def test_pose_holds_against_forty_digits(
    scenario: reference.Scenario, seed: int, share: tuple[float, float, float]
) -> None:
    errors = errors_of(scenario, seed, 7)
    machine = sd.Machine(sd.Chain(scenario.chain), errors, scenario.tool)
    commanded = np.array(share) * scenario.volume
    rotation, point = machine.pose(commanded[None, :])
    exact_rotation, exact_point = reference.pose(
        scenario.chain, table_of(errors), scenario.tool, commanded, reference.DIGITS_40
    )
    assert np.max(np.abs((point[0] - exact_point).astype(float))) <= 1e-12  # a handful of roundings below 1.3 m
    assert np.max(np.abs((rotation[0] - exact_rotation).astype(float))) <= 1e-15


@pytest.mark.parametrize("line", ALL_LINES)
@pytest.mark.parametrize("volume", [(800.0, 600.0, 500.0), (1.0, 1.0, 1.0), (260.0, 420.0, 160.0)])
def test_frame_of_every_line_is_the_one_built_from_cross_products(
    line: str, volume: tuple[float, float, float]
) -> None:
    frame = sd.Plan(volume, [line], 3).frame(line)
    assert np.max(np.abs(frame - reference.frame(line, volume))) <= 5e-16  # a few roundings below 1


@settings(max_examples=60)
@given(scenarios())
def test_plan_visits_the_points_of_the_conventions(scenario: reference.Scenario) -> None:
    plan = plan_of(scenario)
    for line in scenario.lines:
        expected = np.array(reference.commanded_points(scenario, line))
        assert np.max(np.abs(plan.points(line) - expected)) <= 1e-12  # the order of a product and a quotient
        assert len(expected) == 1 + scenario.steps * sum(s != "0" for s in line)


def test_runs_made_in_threads_have_the_same_bits() -> None:
    scenario = reference_files.read_scenario(RUNS / "noisy" / "scenario.toml")
    errors = sd.read_error_map(RUNS / "noisy" / "truth.csv")
    noise = sd.Noise(distance=1e-4, tilt=1e-6, seed=11)
    alone = simulated(scenario, errors, noise=noise)
    with ThreadPoolExecutor(4) as pool:
        runs = list(pool.map(lambda _: simulated(scenario, errors, noise=noise), range(12)))
    for run in runs:
        for channel, values in run.channels.items():
            assert np.array_equal(values, alone.channels[channel])
