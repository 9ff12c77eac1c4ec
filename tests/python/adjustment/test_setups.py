"""Set-up unknowns, reversal and drift: recovered where they are free and seen; scale lines' cosine error."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference
from adjusted import (
    adjust,
    assert_nothing_is_determined,
    assert_rank,
    distance_from,
    is_complete,
    nodes_of,
    reversal_claims,
    setup_value,
)
from dense_adjustment import DenseAdjustment, Knowledge
from dense_model import Setup
from usual import DIAGONALS
from virtual_runs import measured, noisy, random_scenario, random_table, truth_of, within

import stepdiag as sd

PER_HOUR = 1e-3 / 3600.0  # um/h in mm/s


def assert_set_ups(
    adjustment: sd.Adjustment, truth: dict[Any, float], limits: dict[str, float], lines: list[str] = DIAGONALS
) -> None:
    """Values of the set-ups against the truth; quantities that are not in `limits` are not looked at."""
    seen = set()
    for s in adjustment.setup:
        if s.quantity in limits and s.line in lines:
            assert s.value is not None, s
            expected = truth.get(Setup(s.run, s.line, s.quantity, s.component), 0.0)
            assert abs(s.value - expected) <= limits[s.quantity], (s, expected)
            seen.add((s.line, s.quantity))
    assert seen == {(line, quantity) for line in lines for quantity in limits}


def test_set_ups_of_the_ideal_head_are_recovered() -> None:
    rng = np.random.default_rng(41)
    # There and back again: else a drift looks like a scale.
    scenario = random_scenario(rng, steps=8, seconds_per_reading=15.0, backward=True)
    for line in DIAGONALS:
        scenario.misalignment[line] |= {
            "roll": float(rng.uniform(-0.02, 0.02)),
            "gain": float(rng.uniform(-0.02, 0.02)),
            "drift": float(rng.uniform(-5, 5)) * PER_HOUR,
            "distance_constant": float(rng.uniform(-100, 100)),
        }
    table = random_table(rng, scenario.volume, 8)
    run = measured(reference.simulate(scenario, table))
    setup: dict[Any, Any] = {(line, q): "free" for line in DIAGONALS for q in ("roll", "gain", "drift")}
    truth = truth_of(scenario, table)
    knowledge = Knowledge(setup | {"lateral": "fixed"}, reversal=False)
    dense = DenseAdjustment(run, scenario, knowledge, truth)
    assert len(dense.null) == 0
    adjustment = adjust(run, scenario, knowledge)
    assert is_complete(adjustment.calibration)
    # Free means known to 1 rad and to 1 of gain: with uncertainties u of some 0.01 that pulls them by u^2 of themselves
    # to 0, and with them all that they multiply: 60 urad of the machine, 2 mrad of the set-up, over 1 m.
    error = distance_from(adjustment, table)
    assert error.position <= 1e-6
    assert error.angle <= 2e-9
    limits = {
        "reflector": 5e-8,
        "laser": 5e-8,
        "distance_constant": 1e-4,
        "drift": 1e-10,
        "roll": 1e-5,
        "gain": 1e-5,
    }
    assert_set_ups(adjustment, truth, limits)


def test_displaced_position_sensing_device_is_found() -> None:
    """3a and 3b of the paper's Figure 5, with zeros of 3 mm."""
    rng = np.random.default_rng(42)
    scenario = random_scenario(rng, steps=8, layout="psd")
    table = random_table(rng, scenario.volume, 8)
    adjustment = adjust(measured(reference.simulate(scenario, table)), scenario)
    assert_set_ups(adjustment, truth_of(scenario, table), {"reflector": 1e-12, "laser": 1e-12, "psd_zero": 1e-10})


def test_constants_of_beams_are_found_where_the_laser_is_known() -> None:
    rng = np.random.default_rng(43)
    misalignment = {
        line: {
            "reflector": within(rng, 2e-3),
            "distance_constant": 2.0,
            "beam_constants": [float(b) for b in rng.uniform(-1, 1, 3)],
        }
        for line in DIAGONALS
    }
    scenario = random_scenario(rng, steps=8, layout="multi_beam", misalignment=misalignment)
    table = random_table(rng, scenario.volume, 8)
    adjustment = adjust(measured(reference.simulate(scenario, table)), scenario, Knowledge({"laser": "fixed"}))
    error = distance_from(adjustment, table)
    assert error.position <= 1e-10
    assert error.angle <= 1e-12
    assert_set_ups(adjustment, truth_of(scenario, table), {"beam_constants": 1e-9, "distance_constant": 1e-9})


@pytest.mark.slow
def test_a_set_up_for_every_run_or_one_for_the_line() -> None:
    """Two runs, the second one set up anew: with one set-up for both the residuals say that this is wrong."""
    rng = np.random.default_rng(44)
    first = random_scenario(rng, steps=6)
    table = random_table(rng, first.volume, 6)
    other = {line: {"reflector": within(rng, 1e-3), "laser": within(rng, 1e-3)} for line in DIAGONALS}
    second = reference.Scenario(**{**vars(first), "misalignment": other})
    rows = [*reference.simulate(first, table), *({**row, "run": 1} for row in reference.simulate(second, table))]
    run = measured(rows)
    adjustment = adjust(run, first)
    assert is_complete(adjustment.calibration)
    assert distance_from(adjustment, table).position <= 2e-11
    assert_set_ups(adjustment, truth_of(first, table) | truth_of(second, table, runs=[1]), {"laser": 1e-12})
    wrong = adjust(noisy(run, rng), first, Knowledge(one_setup_per_line=True))
    assert wrong.chi_square_probability < 1e-6


def reversed_run(
    seed: int, *, constants: bool = False, **given: Any
) -> tuple[sd.Measurement, reference.Scenario, reference.ErrorTable]:
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng, **({"steps": 4, "backward": True, "seconds_per_reading": 10.0} | given))
    table = random_table(rng, scenario.volume, scenario.steps, reversal=0.3, straightness_constants=constants)
    return measured(reference.simulate(scenario, table)), scenario, table


# Constants of straightnesses are not determined (of EXY and EYX only X EXY + Y EYX): what they are taken to be instead,
# some 10 um, is seen in second order, by 2 mrad and less. Of lengths (mm), of angles (rad), and as a share of standard
# uncertainties.
OPEN_CONSTANTS = (3e-5, 5e-8, 5e-3)
# Spots tell the mirrors' angles of scale lines, which are unknowns, by their change along the line alone. With these
# angles fixed the error is 1.4e-6 mm, so it is they that see the constants.
OPEN_CONSTANTS_OF_SPOTS = (2e-4, 5e-8, 1e-2)


def assert_reversal(
    adjustment: sd.Adjustment, dense: DenseAdjustment, table: reference.ErrorTable, limit: tuple[float, float, float]
) -> int:
    """Every reversal error that is claimed is right; returns how many functions have one."""
    calibration = adjustment.calibration
    for (name, k), weights in reversal_claims(calibration, dense).items():
        position, value, u = calibration.reversal[name][:3]
        at = nodes_of(dense, name, position).index(k)
        truth = np.array(table.functions[name][1]) - np.array(table.negative[name][1])
        expected = truth[k] - (truth[0] if name in calibration.undetermined_reversal_constants else 0.0)
        assert abs(value[at] - expected) <= limit[name[1] in "ABC"], (name, k, value[at], expected)
        # What is not determined is held in another way there, and is seen in second order.
        expected_deviation = dense.standard_uncertainty(weights)
        assert u[at] == pytest.approx(expected_deviation, rel=limit[2], abs=1e-15), (name, k)
    return len(calibration.reversal)


@pytest.mark.parametrize("layout", ["ideal", "psd"])
def test_reversal_of_every_function_is_recovered(layout: str) -> None:
    run, scenario, table = reversed_run(45, layout=layout)
    dense = DenseAdjustment(run, scenario)
    assert dense.gap[1] < 1e-12 < 1e-6 < dense.gap[0]
    dense.solve()
    adjustment = adjust(run, scenario)
    assert_rank(adjustment, dense)
    assert is_complete(adjustment.calibration)
    limit = OPEN_CONSTANTS_OF_SPOTS if layout == "psd" else OPEN_CONSTANTS
    assert assert_reversal(adjustment, dense, table, limit) == 18
    error = distance_from(adjustment, table)
    assert error.position <= limit[0]
    assert error.angle <= limit[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "scale_lines"),
    [
        (DIAGONALS, ["p00", "0p0", "00p"]),
        (DIAGONALS, []),
        (DIAGONALS[:3], ["p00", "0p0"]),
        (["ppp"], ["p00"]),
        (["ppp"], []),
        (["p00", "0p0", "00p"], []),
    ],
)
def test_reversal_is_claimed_where_the_rank_allows(lines: list[str], scale_lines: list[str]) -> None:
    run, scenario, table = reversed_run(46, constants=True, lines=lines, scale_lines=scale_lines, misalignment={})
    dense = DenseAdjustment(run, scenario)
    assert dense.gap[1] < 1e-12 < 1e-6 < dense.gap[0]
    dense.solve()
    if [*lines, *scale_lines] == ["ppp"]:
        with pytest.raises(sd.InvalidArgument, match="nothing can be determined"):
            adjust(run, scenario)
        return assert_nothing_is_determined(dense)
    adjustment = adjust(run, scenario)
    assert_rank(adjustment, dense)
    assert_reversal(adjustment, dense, table, OPEN_CONSTANTS)


def test_reversal_stays_apart_from_drift() -> None:
    run, scenario, table = reversed_run(47)
    for line in DIAGONALS:
        scenario.misalignment[line]["drift"] = 20 * PER_HOUR
    run = measured(reference.simulate(scenario, table))
    knowledge = Knowledge({(line, "drift"): "free" for line in DIAGONALS})
    dense = DenseAdjustment(run, scenario, knowledge).solve()
    adjustment = adjust(run, scenario, knowledge)
    assert_rank(adjustment, dense)
    assert_reversal(adjustment, dense, table, OPEN_CONSTANTS)
    drift, u = setup_value(adjustment, Setup(0, "pnp", "drift"))
    assert drift == pytest.approx(20 * PER_HOUR, abs=0.1 * u)


def test_without_reversal_both_directions_count_as_one() -> None:
    run, scenario, _ = reversed_run(48)
    knowledge = Knowledge(reversal=False)
    adjustment = adjust(run, scenario, knowledge, outlier_probability=0.0)
    assert adjustment.calibration.reversal == {}
    assert adjustment.chi_square_probability < 1e-6  # the machine does not do that


def test_free_drift_without_times_is_refused() -> None:
    rng = np.random.default_rng(49)
    scenario = random_scenario(rng, steps=3)
    run = measured(reference.simulate(scenario, random_table(rng, scenario.volume, 3)))
    with pytest.raises(sd.InvalidArgument, match="time"):
        adjust(run, scenario, Knowledge({"drift": "free"}))


@pytest.mark.parametrize("deviation", [None, 200e-6, "fixed"])
def test_cosine_error_of_a_scale_line_is_in_the_uncertainty(deviation: Any) -> None:
    """A beam that is out of true by (a, b) reads travel (a^2 + b^2)/2 short: 95 % of it is below -ln(0.05) s^2."""
    rng = np.random.default_rng(50)
    scenario = random_scenario(rng, steps=4, scale_lines=["p00"], tool=(0.0, 0.0, 0.0))
    # Without angles of the machine: they turn the mirror, and what they do depends on the laser to first order.
    table = random_table(rng, scenario.volume, 4, rotation=0.0)
    run = measured(reference.simulate(scenario, table))
    u = 1e-5
    knowledge = Knowledge(
        {("p00", "lateral"): "fixed"} | ({} if deviation is None else {("p00", "laser"): deviation}),
        {"distance": u, "tilt": 1e-6, "spot": 1e-3},
    )
    s = {None: 500e-6, "fixed": 0.0}.get(deviation, deviation)
    travel = scenario.volume[0]
    _, _, found = adjust(run, scenario, knowledge).calibration.functions["EXX"]
    # Start and end are read once each, and nothing else sees the scale of X: no lever, no beam beside its place.
    expected = np.hypot(-np.log(0.05) / 1.959963984540054 * s * s * travel, np.sqrt(2) * u)
    assert found[-1] == pytest.approx(expected, rel=1e-3)


def test_cosine_error_reads_short() -> None:
    """The mirror is set square to the beam, which is out of true: what is measured is a part of the travel."""
    rng = np.random.default_rng(51)
    angles = (400e-6, -300e-6)
    square = {"p00": {"reflector": angles, "laser": angles}}
    scenario = random_scenario(rng, steps=4, scale_lines=["p00"], misalignment=square)
    table = random_table(rng, scenario.volume, 4)
    adjustment = adjust(measured(reference.simulate(scenario, table)), scenario)
    _, value, u = adjustment.calibration.functions["EXX"]
    short = scenario.volume[0] * (angles[0] ** 2 + angles[1] ** 2) / 2
    # The machine's own angles of 100 urad turn the mirror against the beam as well: 500 urad x 100 urad x 1 m = 50 nm.
    assert value[-1] - table.functions["EXX"][1][-1] == pytest.approx(-short, abs=1e-4)
    assert u[-1] >= short
