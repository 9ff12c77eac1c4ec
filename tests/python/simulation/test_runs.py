"""Repeated and backward runs, tables of both directions and the whole set-up: `simulate` against reference.py."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import reference
import reference_files
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_runs import LIMIT, errors_of, scenarios, simulated, symmetric, table_of, with_reversal

import stepdiag as sd

LAYOUTS = ("ideal", "psd", "multi_beam")


@st.composite
def whole_runs(draw: st.DrawFn) -> reference.Scenario:
    """Any of the set-up's quantities on any line, scale lines too; repeats, backward runs and times."""
    scenario = draw(scenarios(LAYOUTS))
    scale_lines = [line for line in ("p00", "0n0", "00p") if line not in scenario.lines and draw(st.booleans())]
    pair = st.tuples(symmetric(2.0), symmetric(2.0))
    seconds = draw(st.none() | st.floats(0.1, 100.0))
    misalignment = {}
    for line in [*scenario.lines, *scale_lines]:
        setup = dict(scenario.misalignment.get(line, {}))
        if draw(st.booleans()):
            setup |= {"lateral": draw(pair), "roll": draw(symmetric(0.03)), "gain": draw(symmetric(0.05))}
            setup["distance_constant"] = draw(symmetric(5.0))
            if seconds is not None:
                setup["drift"] = draw(symmetric(1e-5))
            if scenario.layout == "multi_beam":
                setup["beam_constants"] = draw(st.lists(symmetric(0.1), min_size=4, max_size=4))
        misalignment[line] = setup
    return replace(
        scenario,
        scale_lines=scale_lines,
        misalignment=misalignment,
        repeats=draw(st.integers(1, 3)),
        backward=draw(st.booleans()),
        seconds_per_reading=seconds,
    )


@settings(max_examples=80)
@given(whole_runs(), st.integers(0, 2**32), st.integers(0, 18))
def test_whole_runs_read_the_closed_form(scenario: reference.Scenario, seed: int, directed: int) -> None:
    errors = with_reversal(errors_of(scenario, seed, 7), errors_of(scenario, seed + 1, 5), directed)
    run = simulated(scenario, errors)
    rows = list(reference.simulate(scenario, table_of(errors)))
    assert len(rows) == len(run)
    for i, row in enumerate(rows):
        key = run.line[i], run.point[i], run.run[i], run.direction[i]
        assert key == (row["line"], row["point"], row["run"], row["direction"])
        assert np.max(np.abs(run.position[i] - row["position"])) <= 1e-12  # the order of a product and a quotient
        for channel in LIMIT.keys() & row.keys():
            assert abs(run.channels[channel][i] - row[channel]) <= LIMIT[channel]
    if scenario.seconds_per_reading is None:
        assert "time" not in run.channels
    else:
        assert np.array_equal(run.channels["time"], [row["time"] for row in rows])


@settings(max_examples=12)
@given(whole_runs(), st.integers(0, 2**32), st.integers(0, 10**6))
def test_whole_runs_hold_against_forty_digits(scenario: reference.Scenario, seed: int, pick: int) -> None:
    errors = with_reversal(errors_of(scenario, seed, 7), errors_of(scenario, seed + 1, 5), 9)
    table = table_of(errors)
    run = simulated(scenario, errors)
    first = {}  # row of the first reading of each set-up
    for i in range(len(run)):
        first.setdefault((run.line[i], run.run[i] - (run.direction[i] == "backward")), i)
    for i in (pick % len(run), (7 * pick + 3) % len(run)):
        backward = bool(run.direction[i] == "backward")
        elapsed = (i - first[run.line[i], run.run[i] - backward]) * (scenario.seconds_per_reading or 0.0)
        exact = reference.readings(
            scenario, table, run.line[i], run.position[i], reference.DIGITS_40, backward, elapsed
        )
        for channel, value in exact.items():
            assert abs(float(run.channels[channel][i] - value)) <= LIMIT[channel]


def test_file_of_both_directions_is_the_machine_that_wrote_it(tmp_path: Path) -> None:
    """Written by the core, read by the reference, and the other way round by the core again: the same bits."""
    volume = (800.0, 600.0, 500.0)
    errors = with_reversal(
        sd.random_error_map(volume, seed=1, intervals=9), sd.random_error_map(volume, seed=2, intervals=6), 11
    )
    path = tmp_path / "map.csv"
    errors.write(path)
    again = sd.read_error_map(path)
    table = reference_files.read_error_table(path)
    assert len(again.negative_functions) == 11 == len(table.negative)
    for mine, others, theirs in (
        (errors.functions, again.functions, table.functions),
        (errors.negative_functions, again.negative_functions, table.negative),
    ):
        for name, (position, value) in mine.items():
            assert np.array_equal(others[name][0], position)
            assert np.array_equal(others[name][1], value)
            assert np.allclose(theirs[name][1], value, rtol=1e-15, atol=0)  # a product with 1e-3 or 1e-6
    for name in ("EXX", "EBZ"):
        positions = np.linspace(-10.0, 900.0, 50)
        for sign, direction in (("+", 1), ("-", -1)):
            expected = [table.value(name, p, direction) for p in positions]
            assert np.max(np.abs(again.function(name, positions, sign) - expected)) <= 1e-17  # of 0.02 mm at most


@settings(max_examples=40)
@given(
    scenarios(), st.integers(0, 2**32), st.tuples(*[st.floats(-0.2, 1.2)] * 3), st.tuples(*[st.sampled_from("+-")] * 3)
)
def test_pose_of_any_approach_holds_against_forty_digits(
    scenario: reference.Scenario, seed: int, share: tuple[float, float, float], signs: tuple[str, str, str]
) -> None:
    errors = with_reversal(errors_of(scenario, seed, 7), errors_of(scenario, seed + 1, 5), 14)
    machine = sd.Machine(sd.Chain(scenario.chain), errors, scenario.tool)
    commanded = np.array(share) * scenario.volume
    rotation, point = machine.pose(commanded[None, :], "".join(signs))
    x, y, z = (1 if sign == "+" else -1 for sign in signs)
    exact_rotation, exact_point = reference.pose(
        scenario.chain, table_of(errors), scenario.tool, commanded, reference.DIGITS_40, (x, y, z)
    )
    assert np.max(np.abs((point[0] - exact_point).astype(float))) <= 1e-12  # a handful of roundings below 1.3 m
    assert np.max(np.abs((rotation[0] - exact_rotation).astype(float))) <= 1e-15
    nominal = commanded + np.array(scenario.tool)
    assert np.max(np.abs(machine.error(commanded[None, :], "".join(signs))[0] - (point[0] - nominal))) <= 1e-12
