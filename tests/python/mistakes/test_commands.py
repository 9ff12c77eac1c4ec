"""What evaluate, check and acquire say of mistakes."""

import json
from pathlib import Path

import numpy as np
import pytest
from mistaken import changed
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main

STATED = SCENARIO.replace("seed = 3", "tilt_urad = 1.0\nseed = 3")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(STATED)
    return tmp_path


def write(factor: float, *names: str) -> None:
    """run.csv with these channels times a factor."""
    run = sd.simulate(sd.read_scenario("scenario.toml"))
    changed(run, {name: factor * run.channels[name] for name in names}).write("run.csv")


def test_evaluate_names_the_mistake_of_a_rejected_fit(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(-1.0, "alpha", "beta")
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", "calibration.csv"]) == 3
    said = capsys.readouterr().out
    assert said.startswith("fit: REJECTED")
    assert "rejected because a mistake explains the readings: the head is turned by 180° about its beam" in said
    assert "to change: turn the head, or in the run multiply alpha_urad, beta_urad by -1" in said


def test_where_the_adjustment_does_not_settle_the_calibration_is_rejected(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Tilts of 50 steps that contradict distances: no machine is found in a second."""
    large = STATED.replace("_mm = 80.0", "_mm = 800.0").replace("_mm = 60.0", "_mm = 600.0")
    Path("scenario.toml").write_text(large.replace("_mm = 50.0", "_mm = 500.0").replace("steps = 5", "steps = 50"))
    write(-1.0, "alpha")
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", "calibration.csv"]) == 3
    said = capsys.readouterr().out
    assert said.startswith("fit: REJECTED")
    assert "a mistake explains the readings: alpha has the wrong sign on all lines" in said
    assert sd.read_calibration("calibration.csv").fit == "rejected"


def test_evaluate_has_it_as_an_object(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(2.0, "alpha", "beta")
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", "calibration.csv", "--json"]) == 3
    said = json.loads(capsys.readouterr().out)
    # Without the mistake it is doubtful.
    assert said["fit"]["reasons"][0]["code"] == "mistake"
    assert said["fit"]["reasons"][0]["text"].startswith("a mistake explains the readings: alpha and beta are too large")
    (mistake,) = said["mistakes"]
    assert mistake["entry"] == "factor"
    assert mistake["fit"] == "accepted"
    assert mistake["variance_factor"] == pytest.approx(1.0, abs=0.5)


def test_evaluate_names_the_mistake_of_a_run_that_it_refuses(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(2.0, "distance")
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", "calibration.csv"]) == 2
    said = capsys.readouterr().err
    assert "a mistake explains the readings: distance is too large by a factor of 2 on all lines" in said
    assert "to change: in the run multiply distance_mm by 0.5" in said
    assert not Path("calibration.csv").exists()


def test_check_names_it_and_says_nothing_of_a_sound_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(-1.0, "beta")
    assert main(["check", "scenario.toml", "run.csv"]) == 3
    assert "a mistake explains the readings: beta has the wrong sign on all lines" in capsys.readouterr().out
    write(1.0)
    assert main(["check", "scenario.toml", "run.csv"]) == 0
    assert "mistake" not in capsys.readouterr().out


def test_report_says_what_no_reading_shows(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scenario.toml").write_text(STATED.replace("[machine.random]", "tool_mm = [1.0, 2.0, 30.0]\n[machine.random]"))
    write(1.0)
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", "calibration.csv"]) == 0
    (row,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("check by hand")]
    assert "chain [w X' b Y Z t], tool offset (1, 2, 30) mm, standoff 100 mm, wavelength 1530 nm" in row


@pytest.mark.parametrize("tool", [(0.0, 0.0, 80.0), (40.0, -30.0, 0.0)])
def test_no_reading_shows_the_tool(tool: tuple[float, float, float]) -> None:
    """Another tool fits as well: errors of the axes absorb it, to first order exactly."""
    scenario = sd.parse_scenario(STATED)
    known, run = scenario.known, sd.simulate(scenario)
    fits = [
        sd.methods.adjust(
            run, known.plan, known.head, known.chain, offset, uncertainty=known.uncertainty
        ).weighted_square_sum
        for offset in ((0.0, 0.0, 0.0), tool)
    ]
    assert abs(np.diff(fits)[0]) < 1.0
