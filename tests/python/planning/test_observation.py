"""What `stepdiag observe` says of a plan before anyone measures, against what evaluations of runs say after."""

import csv
from pathlib import Path

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.calibration.largest_by_kind import largest_uncertainties
from stepdiag.cli import main
from stepdiag.planning.observation import extents, growth, not_measured, observe, prospects
from stepdiag.presentation.observation import prospect_csv
from stepdiag.scenario.description import Scenario, parse_scenario
from stepdiag.scenario.truth import Truth

VOLUME = SCENARIO.replace("x_mm = 80.0", "x_mm = 800.0").replace("y_mm = 60.0", "y_mm = 600.0")
LARGE = VOLUME.replace("z_mm = 50.0", "z_mm = 500.0")
NO_SCALES = SCENARIO.replace('["p00", "0p0", "00p"]', "[]")


def test_scenario_without_errors_has_the_weights_and_unknowns_of_its_own() -> None:
    scenario = parse_scenario(SCENARIO.replace("distance_um = 0.1", "distance_um = 0.3") + "[adjustment]\ngain = 0.5\n")
    perfect = Scenario(not_measured(scenario.known, {"steps": 7}), Truth())
    assert perfect.known.plan.steps == 7
    assert perfect.known.uncertainty.distance == scenario.known.uncertainty.distance == pytest.approx(0.3e-3)
    assert not perfect.machine().error([[80.0, 60.0, 50.0]]).any()
    run = sd.simulate(perfect)
    for angle in (run.channels["alpha"], run.channels["beta"]):
        assert np.max(np.abs(angle)) < 1e-15  # a perfect machine's mirror stands still, to rounding
    assert {e.prior for e in sd.methods.adjust_scenario(perfect, run).setup if e.quantity == "gain"} == {0.5}


def test_uncertainties_said_before_are_those_of_an_aligned_run() -> None:
    # These act on the angles that there are, of which nobody knows beforehand.
    fixed = '[adjustment]\nroll_urad = "fixed"\ngain = "fixed"\nlateral_mm = "fixed"\n'
    scenario = parse_scenario(SCENARIO.split("[misalignment]")[0] + fixed)
    before = largest_uncertainties(observe(scenario)[1].calibration)
    after = largest_uncertainties(sd.methods.evaluate_scenario(scenario, sd.simulate(scenario)))
    for kind, (value, where) in before.items():
        # Errors of 60 µrad and 20 µm change the derivatives by some 1e-4.
        assert after[kind][0] == pytest.approx(value, rel=1e-3)
        assert after[kind][1][:3] == where[:3]


def test_largest_uncertainty_grows_with_the_square_root_of_the_steps() -> None:
    found = prospects(parse_scenario(LARGE.split("[misalignment]")[0]).known, [10, 50, 100, 200])
    # Separately found: 0.74 µm / 1.7 µrad at 10 steps, 1.67 / 3.6 at 50, 2.36 / 5.1 at 100, of all lengths.
    for prospect, length, angle in zip(found, (0.74, 1.67, 2.36), (1.7, 3.6, 5.1), strict=False):
        worst = max(prospect.largest["positioning"], prospect.largest["straightness"])
        assert worst * 1e3 == pytest.approx(length, rel=0.05)
        assert prospect.largest["angle"] * 1e6 == pytest.approx(angle, rel=0.05)
    assert growth(found, "straightness") == pytest.approx(0.5, abs=0.05)
    assert growth(found, "angle") == pytest.approx(0.5, abs=0.05)
    assert growth(found[:2], "angle") is None


def test_mirror_that_is_too_small_for_few_steps_is_said_in_the_table() -> None:
    scenario = parse_scenario(
        LARGE.replace('"ideal"', '"ideal"\nmirror_mm = [100.0, 100.0]').replace("= 5\n", "= 20\n")
    )
    few, enough = prospects(scenario.known, [5, 20])
    assert "mirror_mm: too small for this plan" in few.trouble
    assert not few.largest
    assert few.mirror[0] > 100.0
    assert not enough.trouble
    assert {*enough.largest} == {"positioning", "straightness", "angle", "squareness"}


def test_table_is_written_with_what_is_not_determined_left_empty() -> None:
    found = prospects(parse_scenario(SCENARIO.replace('["ppp", "npp", "pnp", "nnp"]', '["ppp"]')).known, [2, 5])
    rows = list(csv.DictReader(prospect_csv(found).splitlines()))
    assert [row["steps"] for row in rows] == ["2", "5"]
    assert all(row["u_squareness_urad"] == "" for row in rows)
    assert all(float(row["mirror_width_mm"]) > 0.0 for row in rows)


# --- the command -----------------------------------------------------------------------------------------------------
@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    return "scenario.toml"


def test_command_says_what_a_whole_plan_determines(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["observe", scenario, "--steps", "10,20", "-o", "table.csv"]) == 0
    said = capsys.readouterr().out
    assert "determined: all 21 parameters" in said
    assert "undetermined" not in said
    assert "positioning" in said
    assert [row["steps"] for row in csv.DictReader(Path("table.csv").read_text().splitlines())] == ["5", "10", "20"]


def test_command_names_what_is_missing_and_what_would_help(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(scenario).write_text(NO_SCALES)
    assert main(["observe", scenario, "--steps", "5"]) == 0
    said = capsys.readouterr().out
    assert "determined but for a slope: EXX, EYY, EZZ" in said
    assert "undetermined: " in said
    assert "p00" in said


def test_command_needs_no_truth(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(scenario).write_text(SCENARIO.replace("[machine.random]\nseed = 7", 'errors = "missing.csv"'))
    assert main(["observe", scenario, "--steps", "5"]) == 0
    assert "determined: all 21 parameters" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--steps", "ten"], "expected numbers from 1 to 2000 with commas between them"),
        (["--steps", "0"], "expected numbers from 1 to 2000"),
        (["--steps", "5000"], "expected numbers from 1 to 2000"),
        (["-o", "scenario.toml"], "is also an input"),
    ],
)
def test_mistakes_are_said_in_one_line(
    scenario: str, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["observe", scenario, *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith("stepdiag: error: ")
    assert message in said
    assert said.count("\n") == 1


# --- recovered where it can be ---------------------------------------------------------------------------------------
def recovered(text: str) -> dict[str, float]:
    """The largest error of each parameter that is determined as a whole, mm or rad, of a run without noise."""
    scenario = parse_scenario(text)
    truth = scenario.machine().errors
    calibration = sd.methods.evaluate_scenario(scenario, sd.simulate(scenario))
    whole, _, _ = extents(calibration, scenario.known.plan)
    functions = {name: calibration.functions[name] for name in whole if name in calibration.functions}
    errors = {name: float(np.max(np.abs(v - truth.function(name, p)))) for name, (p, v, _) in functions.items()}
    squareness = {
        name: abs(calibration.squareness[name][0] - truth.squareness[name]) for name in calibration.squareness
    }
    return errors | squareness


ALIGNED = SCENARIO.split("[misalignment]")[0].replace('layout = "ideal"', 'layout = "ideal"\ntilts = false')
SOONS = ALIGNED.replace("[plan]", '[plan]\norder = ["XYZ", "YZX", "ZXY"]') + (
    "[adjustment]\none_setup_per_line = true\n"
)
REFLECTOR = "[misalignment]\nreflector_urad = [100.0, 300.0]\n"

FLOOR = 1e-11  # mm and rad: rounding of a decimetre, 1e-14, in steps known some hundred times worse
# What stays open (scales of 250 µrad, tilts of 300) enters what is determined by its square, over a decimetre.
SECOND_ORDER = 1e-5  # mm; over a step of 10 mm also rad


def test_distances_in_three_orders_give_what_they_can() -> None:
    found = recovered(SOONS)
    assert found.keys() == {"EBY", "ECZ", "EAZ", "EBZ", "ECY", "EXY", "EXZ", "EYZ", "EZZ"}
    assert max(found.values()) < SECOND_ORDER


def test_distances_in_three_orders_with_face_diagonals_give_everything() -> None:
    faces = '["ppp", "npp", "pnp", "nnp", "pp0", "np0", "p0p", "n0p", "0pp", "0np"]'
    text = SOONS.replace('["ppp", "npp", "pnp", "nnp"]', faces)
    for misalignment, limit in (("", FLOOR), (REFLECTOR, SECOND_ORDER)):
        found = recovered(text + misalignment)
        assert len(found) == 21
        assert max(found.values()) < limit


def test_machine_without_angles_is_recovered_from_distances() -> None:
    text = ALIGNED.replace("seed = 7", "seed = 7\nrotation_urad = 0.0") + '[adjustment]\nangles = "fixed"\n'
    found = recovered(text + REFLECTOR)
    assert found.keys() == {f"E{a}{b}" for a in "XYZ" for b in "XYZ"} | {"C0Y", "B0Z", "A0Z"}
    assert max(found.values()) < FLOOR
    no_scales = recovered(text.replace('["p00", "0p0", "00p"]', "[]") + REFLECTOR)
    assert no_scales.keys() == found.keys() - {"EXX", "EYY", "EZZ"}
    assert max(no_scales.values()) < SECOND_ORDER
