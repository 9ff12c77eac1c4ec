"""Whether readings of a linear evaluation contradict each other: a test of its own, and the adjustment beside it."""

from pathlib import Path

import numpy as np
import pytest
from small_scenario import SCENARIO
from usual import CHAIN, DIAGONALS, SCALE_LINES, VOLUME

import stepdiag as sd
from stepdiag.cli import main

PLAN = sd.Plan(VOLUME, DIAGONALS, 10, scale_lines=SCALE_LINES)
STATED = {"distance": 0.1e-3, "alpha": 1e-6, "beta": 1e-6}


def machine(*, rotations: bool) -> sd.Machine:
    errors = sd.random_error_map(VOLUME, seed=7)
    functions = {name: table for name, table in errors.functions.items() if rotations or name[1] not in "ABC"}
    return sd.Machine(CHAIN, sd.ErrorMap(functions, errors.squareness))


def fits(method: str, run: sd.Measurement, plan: sd.Plan = PLAN, runs: int = 150) -> list[sd.Calibration]:
    found = []
    for seed in range(runs):
        random, channels = np.random.default_rng(seed), dict(run.channels)
        for name, u in STATED.items():
            channels[name] = channels[name] + u * random.standard_normal(len(run))
        noisy = sd.Measurement(run.line, run.point.tolist(), run.position, channels)
        found.append(sd.methods.evaluate(noisy, plan, sd.Head(), CHAIN, (0, 0, 0), method=method))
    return found


@pytest.mark.parametrize(
    ("method", "rotations", "freedom"),
    [
        # Four diagonals for three translations of each of 30 steps.
        ("conventional", False, 30),
        # Eight tilts for three rotations, 15 trends for 14 unknowns, and four lengths for three translations, of which
        # three sums are in the trends already.
        ("enhanced", True, 5 * 30 + 1 + 30 - 3),
    ],
)
def test_of_sound_runs_the_test_is_chi_square(method: str, rotations: bool, freedom: int) -> None:
    found = fits(method, sd.simulate(machine(rotations=rotations), PLAN, sd.Head()))
    factors = np.array([calibration.variance_factor for calibration in found])
    runs = len(factors)
    # Mean 1 and variance 2/freedom, each to four of its own standard deviations.
    assert abs(np.mean(factors) - 1.0) < 4 * np.sqrt(2 / freedom / runs)
    assert np.var(factors) == pytest.approx(2 / freedom, rel=4 * np.sqrt(2 / runs + 12 / freedom / runs))
    assert "rejected" not in [calibration.fit for calibration in found]


def test_rotations_contradict_the_conventional_evaluation() -> None:
    (calibration,) = fits("conventional", sd.simulate(machine(rotations=True), PLAN, sd.Head()), runs=1)
    assert calibration.fit == "rejected"
    assert calibration.variance_factor is not None
    assert calibration.variance_factor > 9.0


def test_three_diagonals_check_nothing() -> None:
    plan = sd.Plan(VOLUME, DIAGONALS[:3], 10)
    (calibration,) = fits("conventional", sd.simulate(machine(rotations=False), plan, sd.Head()), plan, runs=1)
    assert (calibration.fit, calibration.variance_factor) == ("unchecked", None)


def test_many_steps_are_tested_by_some_of_their_contradictions() -> None:
    plan = sd.Plan(VOLUME, DIAGONALS, 150)
    (calibration,) = fits("conventional", sd.simulate(machine(rotations=False), plan, sd.Head()), plan, runs=1)
    assert calibration.fit == "accepted"


# --- the command -----------------------------------------------------------------------------------------------------
OF_VOLUME = {"x_mm = 80.0": "x_mm = 800.0", "y_mm = 60.0": "y_mm = 600.0", "z_mm = 50.0": "z_mm = 500.0"}


def scenario() -> str:
    """Of a usual volume, with the set-ups true: neither linear method knows them."""
    text = SCENARIO.replace("[misalignment]\nreflector_urad = [100.0, 300.0]\n", "").replace("steps = 5", "steps = 10")
    for small, usual in OF_VOLUME.items():
        text = text.replace(small, usual)
    return text.replace("distance_um = 0.1", "distance_um = 0.1\ntilt_urad = 1.0")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(scenario())
    sd.simulate(sd.read_scenario("scenario.toml")).write("run.csv")
    return tmp_path


def evaluate(method: str, output: str = "calibration.csv") -> int:
    return main(["evaluate", "scenario.toml", "run.csv", "-m", method, "-o", output])


def test_enhanced_states_both_verdicts_and_that_its_uncertainties_are_of_noise_alone(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert evaluate("enhanced") == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("fit: accepted: ")
    assert "own test (accepted)" in said[1]
    assert "adjustment of the same readings (accepted)" in said[1]
    assert "largest standard uncertainties, of noise alone:" in said
    assert "# uncertainties=of the noise of the readings alone\n" in Path("calibration.csv").read_text()
    assert main(["report", "calibration.csv"]) == 0
    assert "uncertainties are of noise alone" in capsys.readouterr().out


def test_conventional_is_rejected_by_its_own_test_where_the_machine_has_rotations(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for output in ("calibration.csv", "calibration.nc"):
        assert evaluate("conventional", output) == 3
        said = capsys.readouterr()
        assert said.out.startswith("fit: REJECTED: ")
        assert "own test (rejected) and of the adjustment of the same readings (accepted)" in said.out
        assert said.err.startswith("warning: ")
        calibration = sd.read_calibration(output)
        assert calibration.fit == "rejected"
        assert any("by itself" in reason for reason in calibration.fit_reasons)


def test_a_linear_method_takes_over_what_the_adjustment_rejects(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = sd.read_measurement("run.csv")
    channels = {name: values.copy() for name, values in run.channels.items()}
    channels["alpha"], channels["beta"] = channels["beta"], channels["alpha"]
    sd.Measurement(run.line, run.point.tolist(), run.position, channels).write("run.csv")
    assert evaluate("enhanced") == 3
    assert "of the adjustment of the same readings (rejected)" in capsys.readouterr().out
    assert any("adjustment of the same readings: " in r for r in sd.read_calibration("calibration.csv").fit_reasons)
