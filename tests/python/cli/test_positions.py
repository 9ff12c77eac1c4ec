"""The command positions: what it reports of readings and of calibrations, and mistakes in a line."""

from pathlib import Path

import pytest
from calibrations import TOOL, calibrate, simulate
from json_objects import printed
from places import DATA
from usual import CHAIN, small_plan

import stepdiag as sd
from stepdiag.cli import main

READINGS = DATA / "positions" / "stepper_stage.csv"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def said(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> list[str]:
    assert main(["positions", *arguments]) == code
    captured = capsys.readouterr()
    lines = (captured.out + captured.err).splitlines()
    assert code == 2 or max(len(line) for line in lines if not line.startswith("fit:")) <= 100
    return lines


def test_figures_of_readings_are_reported_in_micrometres(capsys: pytest.CaptureFixture[str]) -> None:
    lines = said(capsys, str(READINGS))
    assert lines[0] == "line: axis of a stepper stage"
    assert lines[1] == "5 targets from -10 to 10.48 mm, 5 cycles, ↑ and ↓, 50 readings, 0 lost"
    rows = {line.split()[0]: line.split()[1] for line in lines if line.startswith("  ")}
    assert [rows[name] for name in ("A", "E", "M", "R", "B")] == ["0.08881", "0.0368", "0.0277", "0.06882", "0.0122"]
    assert not any(line.startswith("incomplete") for line in lines)


def test_few_cycles_and_left_out_targets_stand_in_the_first_lines(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [f"{target},{d},{cycle},{target}.001" for cycle in (1, 2) for target in (0, 100, 200) for d in "+-"]
    rows.remove("100,-,2,100.001")
    Path("few.csv").write_text("target_mm,direction,cycle,position_mm\n" + "\n".join(rows) + "\n")
    lines = said(capsys, "few.csv")
    assert lines[0] == "incomplete: target 100 mm ↓ is left out: it has 1 reading, two are needed"
    assert lines[1] == "incomplete: 2 readings of a target, where the standard takes 5 cycles"
    assert [line for line in lines if line.startswith("warning: few.csv: ")] == [
        line.replace("incomplete: ", "warning: few.csv: ") for line in lines[:2]
    ]


def test_calibration_is_reported_along_axes_and_diagonals(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    calibration = calibrate(1, full_covariance=True)
    calibration.write("c.nc")
    lines = said(capsys, "c.nc")
    rows = {line.split()[0]: line.split() for line in lines if line.startswith("  ")}
    assert [*rows][:8] == ["µm", "X", "Y", "Z", "ppp", "npp", "pnp", "nnp"]
    for name, row in rows.items():
        if name in ("ppp", "npp"):
            figure = sd.positions.predict_positions(
                calibration, *sd.positions.diagonal_line(calibration, name)
            ).figures["E_up"]
            assert figure.interval is not None
            low, high = figure.interval
            assert row[7:] == [f"{figure.value * 1e3:.4g}", f"{low * 1e3:.4g}", "to", f"{high * 1e3:.4g}"]


def test_one_line_is_reported_in_full(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = simulate(1, repeats=2, backward=True)
    calibration = sd.methods.evaluate(run, small_plan(), sd.Head(), CHAIN, TOOL, full_covariance=True)
    calibration.write("c.nc")
    lines = said(capsys, "c.nc", "--axis", "X", "--at", "0,30,20", "--points", "5")
    assert "X: from 0 30 20 to 80 30 20 mm, 5 targets" in lines
    symbols = [line.split()[0] for line in lines if line.startswith("  ")][1:]
    assert symbols == ["E", "E↑", "E↓", "M", "B", "mean"]
    same = said(capsys, "c.nc", "--from", "0,30,20", "--to", "80,30,20", "--points", "5")
    assert same == [line.replace("X: from", "line: from") for line in lines]
    assert any(line.startswith("npp: from 80 0 0") for line in said(capsys, "c.nc", "--diagonal", "npp"))


def test_rejected_calibration_ends_with_its_code(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    calibrate(1).judged("rejected", ["a test"]).write("c.csv")
    lines = said(capsys, "c.csv", code=3)
    assert lines[0].startswith("fit: REJECTED")
    assert "warning: c.csv: the fit is rejected: do not use this calibration" in lines


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--axis", "X"], "--axis: goes with a calibration, and "),
        (["--points", "5"], "--points: goes with a calibration, and "),
        (["none.csv"], "none.csv"),
    ],
)
def test_mistakes_with_readings_are_named(
    arguments: list[str], message: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [] if arguments[0].endswith(".csv") else [str(READINGS)]
    assert message in said(capsys, *files, *arguments, code=2)[0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--from", "0,0,0"], "--from and --to: go together"),
        (["--at", "0,0,0"], "--at: goes with --axis"),
        (["--axis", "X", "--diagonal", "ppp"], "--axis, --diagonal, --from: expected one of them"),
        (["--axis", "X", "--at", "0,70,0"], "expected points in the volume of 80 x 60 x 50 mm, got 0, 70, 0"),
        (["--axis", "X", "--at", "1,2"], "expected X,Y,Z in mm, such as 400,300,250, got '1,2'"),
        (["--from", "0,0,nan", "--to", "1,1,1"], "expected X,Y,Z in mm"),
        (["--diagonal", "xyz"], "--diagonal: expected a body or face diagonal"),
        (["--points", "1"], "--points: expected two or more, got 1"),
    ],
)
def test_mistakes_with_a_calibration_are_named(
    arguments: list[str], message: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    calibrate(1).write("c.csv")
    assert message in said(capsys, "c.csv", *arguments, code=2)[0]


def test_readings_are_known_to_check(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(READINGS)]) == 0
    assert "table of target readings: 50 readings of 5 targets, 0 lost" in capsys.readouterr().out


def test_object_of_readings_has_the_figures_of_the_result(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = printed("positions", capsys, "positions", str(READINGS))
    result = sd.positions.evaluate_positions(sd.positions.read_positions(READINGS))
    assert found["predicted"] is None
    own = found["measured"]
    assert (own["line"], own["readings"], own["lost"], own["cycles"]) == (
        "axis of a stepper stage",
        50,
        0,
        [1, 2, 3, 4, 5],
    )
    assert own["figures"].keys() == result.figures.keys()
    for name, figure in result.figures.items():
        # The decimal point is moved exactly; multiplying rounds.
        assert own["figures"][name]["value"]["value"] == pytest.approx(figure.value * 1e3, rel=1e-15)
        assert own["figures"][name]["at"]["value"] == list(figure.at)
    assert [one["mean"]["value"] for one in own["up"]] == pytest.approx([s.mean * 1e3 for s in result.up], rel=1e-15)
    few = "target_mm,direction,cycle,deviation_um\n0,+,1,0\n0,+,2,1\n9,+,1,2\n9,+,2,0\n0,-,1,3\n"
    Path("few.csv").write_text(few)
    own = printed("positions", capsys, "positions", "few.csv")["measured"]
    left_out = [(one["target"]["value"], one["direction"], one["readings"]) for one in own["left_out"]]
    assert left_out == [(0.0, "-", 1), (9.0, "-", 0)]


def test_object_of_a_calibration_has_its_lines(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = simulate(1, repeats=2, backward=True)
    calibration = sd.methods.evaluate(run, small_plan(), sd.Head(), CHAIN, TOOL, full_covariance=True)
    calibration.write("c.nc")
    found = printed("positions", capsys, "positions", "c.nc")
    assert found["measured"] is None
    assert [line["name"] for line in found["predicted"]["lines"]] == ["X", "Y", "Z", "ppp", "npp", "pnp", "nnp"]
    expected = sd.positions.predict_positions(calibration, *sd.positions.axis_line(calibration, "X"))
    line = found["predicted"]["lines"][0]
    assert line["up"]["value"] == pytest.approx((expected.up * 1e3).tolist(), rel=1e-15)
    assert line["figures"]["B"]["value"]["value"] == pytest.approx(expected.figures["B"].value * 1e3, rel=1e-15)
    interval = expected.figures["E_up"].interval
    assert interval is not None
    assert line["figures"]["E_up"]["value"]["interval"] == pytest.approx([end * 1e3 for end in interval], rel=1e-15)
    diagonal = found["predicted"]["lines"][3]
    assert diagonal["reversal"]["value"] == [None] * 6
    assert diagonal["reasons"]
    calibration.judged("rejected").write("bad.nc")
    assert len(printed("positions", capsys, "positions", "bad.nc", status=3)["warnings"]) == 1
