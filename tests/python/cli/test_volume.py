"""The command volume: its verdict in the first line, its object, its exit codes, and mistakes in a line."""

from pathlib import Path

import pytest
from calibrations import calibrate, parts_of
from json_objects import printed
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    calibrate(1, full_covariance=True).write("c.nc")
    calibrate(1).write("c.csv")
    return tmp_path


def said(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> list[str]:
    assert main(["volume", *arguments]) == code
    captured = capsys.readouterr()
    lines = (captured.out + captured.err).splitlines()
    assert code == 2 or max(map(len, lines)) <= 100, max(lines, key=len)
    return lines


def test_first_line_is_the_verdict(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert said(capsys, "c.nc", "--limit", "1000")[0].startswith("machine: within 1000 µm: the largest error is below ")
    assert said(capsys, "c.nc", "--limit", "1")[0].startswith("machine: not within 1 µm: the largest error is above ")
    largest = sd.volume(sd.read_calibration("c.nc")).largest * 1e3
    assert said(capsys, "c.nc", "--limit", f"{largest}")[0].startswith("machine: undecided at ")


def test_report_has_at_most_fifteen_lines(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert 5 <= len(said(capsys, "c.nc", "--limit", "1000")) <= 15


def test_file_without_covariance_has_values_and_says_why_there_is_no_verdict(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = said(capsys, "c.csv", "--limit", "1000")
    assert lines[0].startswith("machine: no verdict on the limit of 1000 µm: the calibration has no covariance")
    assert any(line.startswith("largest error: ") for line in lines)
    assert any(line.startswith("intervals: none: ") for line in lines)


def test_object_has_the_values_of_the_library(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("c.nc", "--limit", "20", "--tool", "0,0,50", "--box", "0:80,10:50,0:50", "--between-nodes", "0.5")
    content = printed("volume", capsys, "volume", *arguments)
    found = sd.volume(
        sd.read_calibration("c.nc"),
        limit=0.02,
        tool=(0, 0, 50),
        box=[[0, 10, 0], [80, 50, 50]],
        between_nodes=5e-4,
    )
    assert content["largest"]["value"] == pytest.approx(found.largest * 1e3, rel=1e-15)
    assert content["at"]["value"] == found.largest_at.tolist()
    assert content["verdict"] == found.verdict
    assert content["between_nodes"]["value"] == 0.5
    assert not content["between_nodes_estimated"]
    assert found.largest_interval is not None
    assert content["largest"]["interval"] == pytest.approx([end * 1e3 for end in found.largest_interval], rel=1e-12)
    assert len(content["ranking"]) == 24


@pytest.mark.parametrize("name", ["e.csv", "e.nc"])
@pytest.mark.parametrize("method", ["adjustment", "enhanced"])
def test_scenario_states_what_lies_between_the_nodes(
    name: str, method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text(SCENARIO + "[uncertainty]\nbetween_nodes_um = 0.7\n")
    assert main(["simulate", "s.toml", "-o", "r.csv"]) == 0
    assert main(["evaluate", "s.toml", "r.csv", "-o", name, "-m", method]) in (0, 3)
    capsys.readouterr()
    assert sd.read_calibration(name).between_nodes == pytest.approx(0.7e-3, rel=1e-15)
    scenario = sd.read_scenario("s.toml")
    found = sd.methods.evaluate_scenario(scenario, sd.read_measurement("r.csv"), method=method)  # type: ignore[arg-type]
    assert found.between_nodes == scenario.known.between_nodes
    found = sd.volume(sd.read_calibration(name), ranking=False)
    assert (found.between_nodes, found.between_nodes_estimated) == (scenario.known.between_nodes, False)
    told = sd.volume(sd.read_calibration(name), between_nodes=1e-4, ranking=False)
    assert told.between_nodes == 1e-4
    if name == "e.nc" and method == "adjustment":
        assert any("between nodes: standard uncertainty 0.7 µm (stated)" in line for line in said(capsys, name))


def test_object_without_covariance_or_parameters_has_null(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content = printed("volume", capsys, "volume", "c.csv", "--limit", "20")
    assert content["largest"]["interval"] is None
    assert content["verdict"] is None
    parts = parts_of(calibrate(1))
    del parts["functions"]["EXX"]
    sd.Calibration(**parts).write("m.csv")
    content = printed("volume", capsys, "volume", "m.csv")
    for open_quantity in (content["largest"], content["at"], content["ranges"]["X"]):
        assert (open_quantity["value"], open_quantity["reason"]) == (None, "not determined: EXX")
    assert content["missing"] == {"X": ["EXX"]}
    assert said(capsys, "m.csv")[1].startswith("not determined: EXX")


def test_rejected_fit_is_told_first_and_ends_with_code_3(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sd.read_calibration("c.nc").judged("rejected", ["it was dropped"]).write("r.nc")
    lines = said(capsys, "r.nc", "--limit", "1000", code=3)
    assert lines[0] == "calibration: REJECTED: do not use it (fit: rejected)"
    assert any(line.startswith("warning: r.nc: the fit is rejected") for line in lines)
    assert printed("volume", capsys, "volume", "r.nc", "--limit", "1000", status=3)["verdict"] is None


def test_doubt_about_the_calibration_is_told_before_the_machine(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sd.read_calibration("c.nc").judged("doubtful", ["more noise than stated"]).write("d.nc")
    first, second = said(capsys, "d.nc", "--limit", "1")[:2]
    assert first == "calibration: DOUBTFUL: do not rely on the stated uncertainties (fit: doubtful)"
    assert second.startswith("machine: not within 1 µm: ")
    assert said(capsys, "c.nc", "--limit", "1")[1] == "calibration: valid: the readings agree (fit: accepted)"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--limit", "-1"], "--limit: expected a length of at least 0 mm"),
        (["--limit", "0"], "--limit: expected a length above 0 mm"),
        (["--box", "0:80,0:60"], "expected ranges of X,Y,Z in mm"),
        (["--box", "0:800,0:60,0:50"], "box: expected positions of X in the calibrated volume"),
        (["--grid", "1"], "grid: expected 2 to 1001 positions"),
        (["--tool", "1,2"], "expected X,Y,Z in mm"),
        (["--between-nodes", "nan"], "--between-nodes: expected a length of at least 0 mm"),
    ],
)
def test_mistakes_are_refused(
    here: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert message in said(capsys, "c.nc", *arguments, code=2)[-1]
