"""Keys of a scenario that say how often, which way and when a line is measured, and the rest of its set-up."""

# ruff: noqa: E501  a table of messages reads best with a case a line

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scenario_refusals import changed, refusal

import stepdiag as sd
from stepdiag.scenario.description import parse_scenario, simulate_scenario

MALFORMED = [
    ("steps = 50", "steps = 50\nrepeats = 0", "plan.repeats: expected an integer from 1 to 1000, got 0"),
    ("steps = 50", "steps = 50\nbackward = 1", "plan.backward: expected true or false, got 1"),
    ("steps = 50", "steps = 50\nseconds_per_reading = 0", "plan.seconds_per_reading: expected a positive number, got 0"),
    ("laser_urad = [700, 1000]", "roll_urad = 1e5", "misalignment.npp.roll_urad: expected an angle below 0.1 rad, in µrad, got 100000.0"),
    ("laser_urad = [700, 1000]", "gain = 0.6", "misalignment.npp.gain: expected a number from -0.5 to 0.5, got 0.6"),
    ("laser_urad = [700, 1000]", "lateral_mm = 1", "misalignment.npp.lateral_mm: expected two lengths in mm, got 1"),
    ("laser_urad = [700, 1000]", "drift_um_per_h = 1", "misalignment.npp.drift_um_per_h: expected plan.seconds_per_reading as well, got none"),
    ("psd_zero_mm", "drift_um_per_h = 1\npsd_zero_mm", "misalignment.drift_um_per_h: expected plan.seconds_per_reading"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), MALFORMED, ids=[new[:40] or old for old, new, _ in MALFORMED])
def test_malformed_scenario_is_refused_in_one_line_that_names_the_key(old: str, new: str, message: str) -> None:
    said = refusal(changed(old, new))
    assert said.startswith(f"s.toml: {message}")
    assert "\n" not in said


RUNS = "repeats = 2\nbackward = true\nseconds_per_reading = 2.5\n"
SETUP = "lateral_mm = [0.5, -1.0]\nroll_urad = 2000\ngain = 0.01\ndrift_um_per_h = 36\n"


def test_set_up_is_read_in_native_units_and_inherited_key_by_key() -> None:
    text = changed("steps = 50\n", "steps = 5\n" + RUNS).replace("laser_urad = [700", "gain = 0.0\nlaser_urad = [700")
    scenario = parse_scenario(text.replace("psd_zero_mm", SETUP + "psd_zero_mm"))
    for line, gain in (("ppp", 0.01), ("npp", 0.0)):
        setup = scenario.truth.misalignment[line]
        assert setup.lateral.tolist() == [0.5, -1.0]
        assert setup.roll == 2000 * 1e-6
        assert setup.gain == gain
        assert setup.drift == pytest.approx(1e-5, rel=1e-15)  # mm/s; a product and a quotient
    scale_line = scenario.truth.misalignment["p00"]  # named for its laser alone: the rest is aligned
    assert (scale_line.roll, scale_line.gain, scale_line.drift, *scale_line.lateral) == (0.0, 0.0, 0.0, 0.0, 0.0)


def test_runs_are_those_of_the_core_and_read_back_from_their_file(tmp_path: Path) -> None:
    scenario = parse_scenario(
        changed("steps = 50\n", "steps = 5\n" + RUNS).replace("psd_zero_mm", SETUP + "psd_zero_mm")
    )
    run = simulate_scenario(scenario)
    expected = sd.simulate(
        scenario.machine(),
        scenario.known.plan,
        scenario.known.head,
        misalignment=dict(scenario.truth.misalignment),
        noise=scenario.truth.noise,
        repeats=2,
        backward=True,
        seconds_per_reading=2.5,
    )
    assert len(run) == 4 * (4 * 16 + 2 * 2)
    run.write(tmp_path / "run.csv")
    header = (tmp_path / "run.csv").read_text().split("\n")[0]
    assert header == "line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad,time_s,run,direction"
    for other in (expected, sd.read_measurement(tmp_path / "run.csv")):
        assert (run.line, run.direction) == (other.line, other.direction)
        assert np.array_equal(run.run, other.run)
        for name, values in run.channels.items():
            assert np.array_equal(values, other.channels[name])


def test_plan_of_one_forward_run_without_times_is_what_it_was() -> None:
    run = simulate_scenario(parse_scenario(changed("steps = 50", "steps = 5")))
    said = simulate_scenario(parse_scenario(changed("steps = 50", "steps = 5\nrepeats = 1\nbackward = false")))
    assert run.channels.keys() == {"distance", "alpha", "beta"} == said.channels.keys()
    for name, values in run.channels.items():
        assert np.array_equal(values, said.channels[name])


def test_set_up_that_makes_no_sense_is_refused_by_the_core() -> None:
    plan = sd.Plan((800, 600, 500), ["ppp"], 3)
    machine = sd.Machine("[w b X Y Z t]")
    for setup, word in (
        (sd.Misalignment(roll=0.1), "angles below 0.1 rad"),
        (sd.Misalignment(gain=-0.6), "gain"),
        (sd.Misalignment(drift=1e-6), "seconds_per_reading"),
    ):
        with pytest.raises(sd.InvalidArgument, match=word):
            sd.simulate(machine, plan, sd.Head(), misalignment={"ppp": setup})
    for options, word in (
        ({"repeats": 0}, "repeats"),
        ({"repeats": 1001}, "repeats"),
        ({"seconds_per_reading": 0.0}, "seconds_per_reading"),
        ({"seconds_per_reading": float("nan")}, "seconds_per_reading"),
    ):
        with pytest.raises(sd.InvalidArgument, match=word):
            sd.simulate(machine, plan, sd.Head(), **options)
    with pytest.raises(sd.InvalidArgument, match="lateral"):
        sd.Misalignment(lateral=(0.0, float("inf")))


def test_gain_of_a_traced_multi_beam_head_is_refused_in_words() -> None:
    text = changed('layout = "ideal"', 'description = "three_beams"').replace("psd_zero_mm", "gain = 0.01\npsd_zero_mm")
    with pytest.raises(
        sd.InvalidArgument, match=r"s\.toml: misalignment of nnp: gain: expected 0, because the beams of a traced head"
    ):
        simulate_scenario(parse_scenario(text, "s.toml"))
