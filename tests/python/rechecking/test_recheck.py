"""Has the machine changed: `recheck_scenario` and `stepdiag recheck`."""

from pathlib import Path

import numpy as np
import pytest
import rechecked
from json_objects import printed
from refusal import refused

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.rechecking.recheck import Judged

KNOWN = """
[volume]
x_mm = 400.0
y_mm = 300.0
z_mm = 250.0

[machine]
chain = "[w X' b Y Z t]"
errors = "machine.csv"

[head]
layout = "ideal"

[noise]
distance_um = 0.2
tilt_urad = 1.0
seed = {seed}

[adjustment]
lateral_mm = "fixed"
roll_urad = "fixed"
gain = "fixed"

[plan]
"""
DIAGONALS = 'lines = ["ppp", "npp", "pnp", "nnp"]\n'
CALIBRATED = KNOWN.format(seed=1) + DIAGONALS + 'steps = 6\nscale_lines = ["p00", "0p0", "00p"]\n'
SHORT = KNOWN.format(seed=2) + DIAGONALS + "steps = 3\n"
HIT = 40e-6  # of C0Y, rad


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A calibration, a short run of the same machine, and one after a collision."""
    monkeypatch.chdir(tmp_path)
    Path("calibrated.toml").write_text(CALIBRATED)
    Path("short.toml").write_text(SHORT)
    errors = sd.random_error_map((400.0, 300.0, 250.0), seed=5, intervals=6)
    errors.write("machine.csv")
    assert main(["simulate", "calibrated.toml", "-o", "run.csv"]) == 0
    assert main(["evaluate", "calibrated.toml", "run.csv", "-o", "calibration.nc"]) == 0
    assert main(["simulate", "short.toml", "-o", "same.csv"]) == 0
    squareness = dict(errors.squareness)
    squareness["C0Y"] += HIT
    sd.ErrorMap(errors.functions, squareness).write("machine.csv")
    assert main(["simulate", "short.toml", "-o", "hit.csv"]) == 0
    return tmp_path


def test_unchanged_machine(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["recheck", "calibration.nc", "short.toml", "same.csv"]) == 0
    said, warned = capsys.readouterr()
    assert said.startswith("no change of the machine is seen: chi-square ")
    assert "warning" not in warned


def test_change_is_found_attributed_and_taken_over(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["recheck", "calibration.nc", "short.toml", "hit.csv", "--update", "updated.nc"]) == 3
    said, warned = capsys.readouterr()
    assert said.startswith("the machine has changed: chi-square ")
    assert "  C0Y (squareness)" in said
    assert "warning: calibration.nc: the machine has changed since" in warned
    before, after = sd.read_calibration("calibration.nc"), sd.read_calibration("updated.nc")
    truth = sd.read_error_map("machine.csv").squareness["C0Y"]
    value, uncertainty = after.squareness["C0Y"]
    assert abs(value - truth) < 4.0 * uncertainty
    assert abs(before.squareness["C0Y"][0] - truth) > 0.8 * HIT
    assert after.method == f"adjustment of {before.date}, rechecked"
    assert after.covariance is not None
    # It is a calibration like any other.
    assert main(["verify", "updated.nc", "short.toml", "same.csv"]) == 3
    assert main(["volume", "updated.nc"]) == 0


def test_object_has_what_the_report_has(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["calibration.nc", "short.toml", "hit.csv", "--update", "updated.nc"]
    result = printed("recheck", capsys, "recheck", *words, status=3)
    baseline, run = sd.read_calibration("calibration.nc"), sd.read_measurement("hit.csv")
    found = sd.recheck_scenario(baseline, sd.read_scenario("short.toml"), run)
    assert (result["changed"], result["explained"], result["updated"]) == (True, True, "updated.nc")
    assert result["chi_square"] == found.chi_square
    by_name = {term.parameter: term for term in found.terms}
    assert result["squarenesses"][0]["value_urad"] == pytest.approx(1e6 * by_name["C0Y"].value)
    assert {one["parameter"] for key in ("scales", "bows", "slopes", "squarenesses") for one in result[key]} == {
        *by_name
    }
    assert len(result["sums"]) == found.degrees_of_freedom


def test_what_priors_rule_out_is_no_change(folder: Path) -> None:
    Path("rigid.toml").write_text(SHORT + "[change]\nsquareness_urad = 0\n")
    baseline, run = sd.read_calibration("calibration.nc"), sd.read_measurement("hit.csv")
    found = sd.recheck_scenario(baseline, sd.read_scenario("rigid.toml"), run)
    assert "C0Y" not in {term.parameter for term in found.terms}
    judged = Judged(found, baseline, 0.001)
    assert not judged.is_explained
    assert judged.updated.fit == "rejected"


def test_one_diagonal_tells_one_number_of_scales_and_squarenesses(folder: Path) -> None:
    Path("one.toml").write_text(SHORT.replace(DIAGONALS, 'lines = ["ppp"]\n'))
    assert main(["simulate", "one.toml", "-o", "one.csv"]) == 0
    baseline = sd.read_calibration("calibration.nc")
    found = sd.recheck_scenario(baseline, sd.read_scenario("one.toml"), sd.read_measurement("one.csv"))
    lengths = [term.kind in ("scale", "squareness") for term in found.terms]
    assert all(term.told < 0.9 for term, is_length in zip(found.terms, lengths, strict=True) if is_length)
    mostly = [sum(np.array(one.weight)[lengths] ** 2) > 0.5 for one in found.combinations]
    assert sum(mostly) == 1


def test_hidden_change_is_that_of_the_priors_where_nothing_is_told(folder: Path) -> None:
    """By the closed form: at the far corner a squareness moves the tool by the travel, a scale likewise."""
    baseline = sd.read_calibration("calibration.nc")
    priors = sd.ChangePriors(scale=0.0, bow=0.0, slope=0.0, squareness=50e-6)
    known = sd.read_scenario("short.toml").known
    plan = sd.Plan((400.0, 300.0, 250.0), ["p00"], 3)
    run = sd.simulate(sd.Machine(known.chain, sd.ErrorMap({}, {})), plan, sd.Head(), noise=sd.Noise(distance=1e-4))
    found = sd.recheck(baseline, run, plan, sd.Head(), known.chain, priors=priors)
    assert all(term.told < 0.1 for term in found.terms)
    expected = 2.0 * 50e-6 * np.sqrt(300.0**2 + 2.0 * 250.0**2)
    assert Judged(found, baseline, 0.001).hidden == pytest.approx(expected, rel=1e-3)


def test_what_cannot_be_rechecked_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["recheck", "calibration.nc", "calibrated.toml", "run.csv"]) == 2
    assert "the calibration was made from this run" in capsys.readouterr().err
    Path("none.toml").write_text(
        SHORT + "[change]\nsquareness_urad = 0\nscale_um_per_m = 0\nbow_um = 0\nslope_urad = 0\n"
    )
    baseline, run = sd.read_calibration("calibration.nc"), sd.read_measurement("same.csv")
    refused(sd.recheck_scenario, baseline, sd.read_scenario("none.toml"), run, names="one kind of change")


@pytest.mark.parametrize("seed", [14, 36, 54])
def test_machine_that_has_changed_in_all_ways_is_told_as_such(seed: int) -> None:
    """Set-ups are free in much, and must not be taken for the change of the machine."""
    drawn, baseline, rng = rechecked.calibrated(1_000_000 + seed, 4)
    plan = rechecked.short_plan(drawn, seed, 4)
    machine = rechecked.changed_machine(drawn, rechecked.random_change(rng))
    run = rechecked.read_again(drawn, machine, plan, rng)
    given = (baseline, run, plan, drawn.head, sd.Chain(drawn.chain), machine.tool)
    found = sd.recheck(*given, options=rechecked.options(drawn))
    assert found.probability < 1e-12
    assert found.fit_probability > 1e-6
    assert sd.verify(*given, options=rechecked.options(drawn)).probability < 1e-12
