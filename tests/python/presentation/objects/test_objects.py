"""`--json` of check, compare, observe and report."""

from pathlib import Path

import numpy as np
import pytest
from calibrations import calibrate, parts_of
from json_objects import printed
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.calibration.functional_point import functional_point_straightness
from stepdiag.cli import main
from stepdiag.parameters import kind_of
from stepdiag.planning.observation import prospects


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    sd.simulate(sd.read_scenario("scenario.toml")).write("run.csv")
    calibrate(1, method="enhanced").write("a.csv")
    parts = parts_of(calibrate(2, full_covariance=True))
    parts["functions"]["EXX"][1][3] += 5e-3
    sd.Calibration(**parts).write("b.nc")
    return tmp_path


def reject(file: str, name: str) -> None:
    sd.read_calibration(file).judged("rejected", ["it was dropped"]).write(name)


NATIVE = {"um": 1e-3, "urad": 1e-6}


def test_report_has_the_values_of_its_file(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = printed("report", capsys, "report", "b.nc")
    read = sd.read_calibration("b.nc")
    for table in said["calibration"]["functions"]:
        position, value, u = read.functions[table["parameter"]]
        np.testing.assert_array_equal(table["position"]["value"], position)
        said_value, unit = table["value"], NATIVE[table["value"]["unit"]]
        for key, own in (("value", value), ("standard_uncertainty", u)):
            np.testing.assert_allclose(np.array(said_value[key]) * unit, own, rtol=1e-15)  # both round one number
    assert len(said["calibration"]["functions"]) == len(read.functions) == 18
    assert [one["parameter"] for one in said["calibration"]["squarenesses"]] == ["C0Y", "B0Z", "A0Z"]
    assert [one["parameter"] for one in said["functional_point"]] == list(functional_point_straightness(read))


def test_largest_values_are_the_largest_of_the_tables(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = printed("report", capsys, "report", "b.nc")
    read = sd.read_calibration("b.nc")
    for key, column, which in (
        ("largest_values", 1, "value"),
        ("largest_standard_uncertainties", 2, "standard_uncertainty"),
    ):
        for one in said[key]:
            tables = [table[column] for name, table in read.functions.items() if kind_of(name) == one["kind"]]
            angles = [pair[column - 1] for name, pair in read.squareness.items() if kind_of(name) == one["kind"]]
            largest = max(np.max(np.abs(np.concatenate([np.atleast_1d(t) for t in (*tables, *angles)]))), 0.0)
            assert abs(one["value"][which]) * NATIVE[one["value"]["unit"]] == pytest.approx(largest, rel=1e-15)
        assert [one["kind"] for one in said[key]] == ["positioning", "straightness", "angle", "squareness"]


def test_report_of_a_rejected_fit_ends_with_status_3(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reject("a.csv", "r.csv")
    said = printed("report", capsys, "report", "r.csv", status=3)
    assert said["fit"]["verdict"] == "rejected"
    assert said["fit"]["reasons"] == [{"code": None, "text": "it was dropped"}]  # as of an earlier version
    sd.read_calibration("a.csv").judged("rejected", ["it was dropped"], ["dropped"]).write("s.nc")
    said = printed("report", capsys, "report", "s.nc", status=3)
    assert said["fit"]["reasons"] == [{"code": "dropped", "text": "it was dropped"}]


def test_csv_without_uncertainties_gives_null(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    parts = parts_of(calibrate(1))
    parts["functions"]["EXX"] = (*parts["functions"]["EXX"][:2], np.full(len(parts["functions"]["EXX"][0]), np.nan))
    sd.Calibration(**parts).write("n.csv")
    said = printed("report", capsys, "report", "n.csv")
    (table,) = [table for table in said["calibration"]["functions"] if table["parameter"] == "EXX"]
    assert set(table["value"]["standard_uncertainty"]) == {None}


def test_comparison_has_the_differences(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = printed("comparison", capsys, "compare", "a.csv", "b.nc")
    comparison = sd.compare(sd.read_calibration("a.csv"), sd.read_calibration("b.nc"))
    assert said["significant"] == ["EXX"]
    assert (said["values"], said["threshold"]) == (comparison.count, comparison.threshold)
    assert (said["a"]["file"], said["b"]["file"]) == ("a.csv", "b.nc")
    for own, difference in zip(said["differences"], comparison.differences, strict=True):
        assert own["parameter"] == difference.parameter
        assert own["probability"] == comparison.probability(difference)
        numbers, unit = own["difference"]["value"], NATIVE[own["difference"]["unit"]]
        np.testing.assert_allclose(np.array(numbers) * unit, difference.value, rtol=1e-15)  # both round one number
        positions = [np.nan if p is None else p for p in own["position"]["value"]]
        np.testing.assert_array_equal(positions, difference.position)


def test_comparison_warns_of_both_fits_and_ends_with_status_3(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reject("a.csv", "r.csv")
    reject("b.nc", "s.csv")
    said = printed("comparison", capsys, "compare", "r.csv", "s.csv", status=3)
    assert len(said["warnings"]) == 2


def test_observation_has_what_the_plan_determines(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = printed("observation", capsys, "observe", "scenario.toml", "--steps", "5,10")
    known = sd.read_scenario("scenario.toml").known
    _, found = sd.observe(known)
    assert len(said["determined"]) + len(said["determined_but_for_slope"]) + len(said["determined_in_part"]) == 21
    assert said["degrees_of_freedom"] == found.degrees_of_freedom
    assert [control["channel"] for control in said["reliability"]] == [c.channel for c in found.reliability]
    table = prospects(known, [5, 10])
    for own, prospect in zip(said["by_steps"], table, strict=True):
        assert own["steps"] == prospect.steps
        assert own["mirror"]["value"] == list(prospect.mirror)
        sizes = own["largest_standard_uncertainty"]
        assert sizes["positioning"]["value"] * 1e-3 == pytest.approx(prospect.largest["positioning"], rel=1e-15)
        assert sizes["angle"]["value"] * 1e-6 == pytest.approx(prospect.largest["angle"], rel=1e-15)


def test_observation_of_a_plan_that_determines_little_names_it(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scenario.toml").write_text(SCENARIO.replace('"ppp", "npp", "pnp", "nnp"', '"ppp", "npp"'))
    said = printed("observation", capsys, "observe", "scenario.toml", "--steps", "5")
    assert said["undetermined"]
    assert len(said["findings"]) == len(said["undetermined"])
    assert said["by_steps"][0]["largest_standard_uncertainty"]["squareness"]["value"] is None or said["combinations"]


def test_check_tells_files_and_runs(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = printed("check", capsys, "check", "scenario.toml", "run.csv", "a.csv")
    assert said["valid"]
    assert [file["kind"] for file in said["files"]] == ["scenario", "measurement", "calibration"]
    assert said["files"][2]["fit"]["verdict"] == sd.read_calibration("a.csv").fit
    (run,) = said["runs"]
    found = sd.methods.adjust_scenario(sd.read_scenario("scenario.toml").known, sd.read_measurement("run.csv"))
    assert (run["run"], run["scenario"], run["fit"]["verdict"]) == ("run.csv", "scenario.toml", found.verdict.fit)


def test_check_has_files_that_are_not_valid_and_ends_with_status_2(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.csv").write_text("line,point,x_mm\nppp,0,zero\n")
    main(["check", "bad.csv"])
    message = capsys.readouterr().err.removeprefix("stepdiag: error: ").strip()
    said = printed("check", capsys, "check", "bad.csv", "run.csv", status=2)
    assert not said["valid"]
    assert [(file["valid"], file["error"]) for file in said["files"]] == [(False, message), (True, None)]


def test_check_of_a_run_of_another_plan_ends_with_status_2(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scenario.toml").write_text(SCENARIO.replace("steps = 5", "steps = 4"))
    said = printed("check", capsys, "check", "scenario.toml", "run.csv", status=2)
    (run,) = said["runs"]
    assert not run["valid"]
    assert "does not belong to scenario.toml" in run["error"]


def test_check_of_a_rejected_calibration_ends_with_status_3(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reject("a.csv", "r.csv")
    said = printed("check", capsys, "check", "r.csv", status=3)
    assert said["files"][0]["fit"]["verdict"] == "rejected"
    assert len(said["warnings"]) == 1
