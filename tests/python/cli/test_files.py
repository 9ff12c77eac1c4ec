"""The commands check and init: distinguishing files, and beginning with new ones."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from small_scenario import SCENARIO, of_map
from systems import with_slashes
from terminals import needs_terminal

import stepdiag as sd
from stepdiag.cli import main


def run(*arguments: str) -> int:
    return main(list(arguments))


def test_check_tells_every_kind(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("evaluate", "scenario.toml", "run.csv", "-o", "calibration.csv")
    sd.read_scenario("scenario.toml").machine().errors.write("truth.csv")
    capsys.readouterr()
    assert run("check", "scenario.toml", "run.csv", "calibration.csv", "truth.csv") == 0
    said = capsys.readouterr().out.splitlines()
    kinds = [line.split(": ")[1] for line in said]
    assert kinds[:4] == ["scenario", "measurement", "calibration", "error map"]
    assert all(line.startswith("run.csv with scenario.toml: ") for line in said[4:])


def test_check_warns_of_a_map_that_breaks_the_zeros(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("truth.csv").write_text("parameter,position_mm,value,unit,standard_uncertainty\nEYX,0,1.5,um,\nEYX,80,0,um,\n")
    assert run("check", "truth.csv") == 0
    assert "truth.csv: warning: EYX is 1.5 µm at home" in capsys.readouterr().out


COLUMNS = "parameter,position_mm,value,unit,standard_uncertainty\n"

# What an error map says, and what is told of it by simulate and check.
ODD_MAPS = {
    "zeros": (f"{COLUMNS}EYX,0,1.5,um,\nEYX,80,0,um,\n", "EYX is 1.5 µm at home"),
    "chain": (f"# chain=[w b X Y Z t]\n{COLUMNS}", "is for the chain [w b X Y Z t], the scenario has [w X' b Y Z t]"),
    "no chain": (f"# chain=serial\n{COLUMNS}", "is for the chain serial"),
    "volume": (f"# volume_mm=80 60 40\n{COLUMNS}", "is for the volume 80 60 40 mm, the scenario has 80 60 50 mm"),
    "no volume": (f"# volume_mm=large\n{COLUMNS}", "is for the volume large mm"),
    "tool": (f"# tool_mm=0 0 -100\n{COLUMNS}", "is for the tool offset 0 0 -100 mm, the scenario has 0 0 0 mm"),
}


@pytest.mark.parametrize("name", ODD_MAPS)
def test_odd_map_of_a_scenario_is_used_as_given_with_a_warning(
    here: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    content, warning = ODD_MAPS[name]
    Path("truth.csv").write_text(content)
    Path("scenario.toml").write_text(of_map("truth.csv"))
    assert run("simulate", "scenario.toml", "-o", "out.csv") == 0
    said = capsys.readouterr().err
    assert said.startswith(f"warning: truth.csv: {warning}")
    assert said.count("\n") == 1
    assert run("check", "scenario.toml") == 0
    assert f"scenario.toml: warning: truth.csv: {warning}" in capsys.readouterr().out


def test_map_of_the_same_machine_gives_no_warning(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = sd.read_scenario("scenario.toml")
    errors = scenario.machine().errors
    errors.write("truth.csv", chain=scenario.known.chain, volume=scenario.known.plan.volume, tool=scenario.known.tool)
    Path("scenario.toml").write_text(of_map("truth.csv"))
    assert run("simulate", "scenario.toml", "-o", "out.csv") == 0
    assert run("check", "scenario.toml") == 0
    said = capsys.readouterr()
    assert "warning" not in said.err + said.out


def test_calibration_with_open_slopes_says_so(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("no_scales.toml").write_text(SCENARIO.replace('["p00", "0p0", "00p"]', '["p00"]'))
    run("simulate", "no_scales.toml", "-o", "no_scales.csv")
    run("evaluate", "no_scales.toml", "no_scales.csv", "-o", "open.csv")
    slopes = sd.read_calibration("open.csv").undetermined_slopes
    capsys.readouterr()
    assert run("check", "open.csv") == 0
    said = capsys.readouterr().out.splitlines()[0]
    assert slopes
    assert said.endswith(f" of 21 parameters, slopes of {', '.join(slopes)} open, fit doubtful")
    Path("next.toml").write_text(of_map("open.csv"))
    assert run("simulate", "next.toml", "-o", "next.csv") == 0
    assert (
        f"warning: open.csv: is a calibration that leaves the slopes of {', '.join(slopes)}" in capsys.readouterr().err
    )


def test_format_says_what_a_table_is_whatever_else_it_holds(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("map.csv").write_text(f"# method=enhanced\n# format=stepdiag error map 1\n{COLUMNS}C0Y,,1,urad,\n")
    assert run("check", "map.csv") == 0
    assert "map.csv: error map: 1 of 21" in capsys.readouterr().out
    Path("torn.csv").write_text("# format=stepdiag calibration 1\nline,point\n")
    assert run("check", "torn.csv") == 2
    assert "parameter" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"# chain=[w b X Y Z t]\n", "has only comments"),
        (b"\x7fELF\x00\x01\x02", "expected a scenario"),
        (b"parameter,position_mm,value,unit,standard_uncertainty\nEXX,0,0,mm,\n", "line 2: unit"),
        (b"parameter,position_mm,value,unit,standard_uncertainty\nEXQ,0,0,um,\n", "line 2"),
        (b"# format=stepdiag calibration 1\nparameter,position_mm,value,unit,standard_uncertainty\n", "file"),
        (b"line,point,x_mm,y_mm,z_mm,distance_mm\nppp,0,0,0,0,1\nppp,0,0,0,0,1\n", "line 3"),
        (b"line,point,x_mm,y_mm,z_mm,distance_mm\nppp,0,0,0,0,nan\n", "line 2"),
        (b"line,point,x_mm,y_mm,z_mm,distance_mm\nppp,0,0,0\n", "line 2"),
        (b"[volume]\nx_mm = 3\n", "volume.y_mm: missing"),
    ],
)
def test_check_refuses_a_file_that_is_not_sound(
    tmp_path: Path, content: bytes, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.write_bytes(content)
    assert run("check", str(file)) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"stepdiag: error: {file}")
    assert message in said
    assert said.count("\n") == 1


def test_check_goes_on_after_a_bad_file(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("bad.csv").write_text("line,point,x_mm\nppp,0,zero\n")
    assert run("check", "bad.csv", "run.csv") == 2
    said = capsys.readouterr()
    assert "run.csv: measurement" in said.out
    assert said.err.count("stepdiag: error: bad.csv") == 1


def test_check_looks_into_the_map_that_a_scenario_names(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scenario.toml").write_text(of_map("truth.csv"))
    assert run("check", "scenario.toml") == 2
    assert "machine.errors" in capsys.readouterr().err


def test_init_makes_a_sheet_with_every_commanded_point(here: Path) -> None:
    assert run("init", "-o", "machine") == 0
    scenario = sd.read_scenario("machine/scenario.toml")
    sheet = sd.read_measurement("machine/measurement.csv")
    assert len(sheet) == 2 * (4 * 31 + 21 + 3 * 11)
    assert sheet.channels.keys() == {"distance", "alpha", "beta"}
    simulated = sd.simulate(scenario)
    assert (sheet.line, sheet.point.tolist()) == (simulated.line, simulated.point.tolist())
    assert sheet.position.tolist() == simulated.position.tolist()


def test_sheet_for_a_scenario_has_the_columns_of_its_head(here: Path) -> None:
    head = 'layout = "psd"\npsd_distance_mm = 50.0'
    Path("psd.toml").write_text(SCENARIO.replace('layout = "ideal"', head))
    assert run("init", "-o", "sheets", "--sheet-for", "psd.toml") == 0
    assert [path.name for path in Path("sheets").iterdir()] == ["measurement.csv"]
    assert sd.read_measurement("sheets/measurement.csv").channels.keys() == {"distance", "spot_x", "spot_y"}


def test_init_takes_what_everybody_states(here: Path) -> None:
    words = ["--volume", "400", "300", "250", "--chain", "[w Y' X' b Z t]", "--layout", "psd", "--steps", "4"]
    assert run("init", "-o", "machine", *words) == 0
    known = sd.read_scenario("machine/scenario.toml").known
    assert known.plan.volume.tolist() == [400.0, 300.0, 250.0]
    assert (str(known.chain), known.plan.steps, known.head.layout) == ("[w Y' X' b Z t]", 4, "psd")
    assert len(Path("machine/scenario.toml").read_text().splitlines()) <= 27
    assert run("init", "-o", "all", *words, "--all-keys") == 0
    every = sd.read_scenario("all/scenario.toml").known
    assert (every.plan.steps, every.head.layout) == (4, "psd")
    assert len(Path("all/scenario.toml").read_text().splitlines()) > 300
    assert "best plan for 45 minutes" not in Path("all/scenario.toml").read_text()  # that is of another machine


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_new_scenario_of_every_layout_is_simulated_and_evaluated(here: Path, layout: str) -> None:
    assert run("init", "-o", "machine", "--layout", layout, "--steps", "3") == 0
    assert run("check", "machine/scenario.toml", "machine/measurement.csv") in (0, 2)  # the sheet has no readings
    assert run("simulate", "machine/scenario.toml", "-o", "r.csv") == 0
    assert run("evaluate", "machine/scenario.toml", "r.csv", "-o", "c.csv") == 0


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["--volume", "0", "300", "250"], "the new scenario: volume.x_mm: expected a length"),
        (["--chain", "XYZ"], 'the new scenario: machine.chain: chain "XYZ": has 3 links'),
        (["--steps", "0"], "the new scenario: plan.steps: expected an integer"),
        (["--layout", "psd", "--head", "three_beams"], "--layout: goes with a head that has no description"),
        (["--steps", "3", "--sheet-for", "scenario.toml"], "--steps: goes with a new scenario"),
    ],
)
def test_init_refuses(here: Path, capsys: pytest.CaptureFixture[str], words: list[str], error: str) -> None:
    assert run("init", "-o", "machine", *words) == 2
    assert error in capsys.readouterr().err
    assert not Path("machine").exists()


@needs_terminal
def test_init_asks_on_a_terminal(here: Path) -> None:
    """A pseudo-terminal, at which a person answers; Enter takes what is offered."""
    ours, theirs = os.openpty()
    command = [sys.executable, "-m", "stepdiag", "init", "-o", "machine", "--steps", "3"]
    with subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs) as process:
        os.write(ours, b"400\n\n250\n\npsd\n")
        assert process.wait(60.0) == 0
    known = sd.read_scenario("machine/scenario.toml").known
    assert known.plan.volume.tolist() == [400.0, 1000.0, 250.0]
    assert (known.plan.steps, known.head.layout) == (3, "psd")


def test_empty_sheet_is_written_again_after_an_edit(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("init", "-o", "machine", "--steps", "3") == 0
    edited = Path("machine/scenario.toml").read_text().replace("steps = 3", "steps = 4")
    Path("machine/scenario.toml").write_text(edited)
    capsys.readouterr()
    assert run("init", "-o", "machine") == 2
    assert "init --sheet-for machine/scenario.toml -o machine" in with_slashes(capsys.readouterr().err)
    assert run("init", "-o", "machine", "--sheet-for", "machine/scenario.toml") == 0
    assert sd.read_measurement("machine/measurement.csv").point.max() == 12
    sheet = Path("machine/measurement.csv").read_text().splitlines()
    filled = [sheet[0], sheet[1].replace(",,,,", ",100.0,,,"), *sheet[2:]]
    Path("machine/measurement.csv").write_text("\n".join(filled) + "\n")
    assert run("init", "-o", "machine", "--sheet-for", "machine/scenario.toml") == 2
    assert "it has readings" in capsys.readouterr().err
    assert Path("machine/measurement.csv").read_text() == "\n".join(filled) + "\n"


def test_init_never_overwrites(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("machine").mkdir()
    Path("machine/measurement.csv").write_text("mine")
    assert run("init", "-o", "machine") == 2
    assert Path("machine/measurement.csv").read_text() == "mine"
    assert not Path("machine/scenario.toml").exists()


def test_sheet_has_the_runs_of_all_orders_and_directions(here: Path) -> None:
    keys = 'steps = 5\norder = ["XYZ", "YZX"]\nbackward = true'
    Path("orders.toml").write_text(SCENARIO.replace("steps = 5", keys))
    assert run("init", "-o", "sheets", "--sheet-for", "orders.toml") == 0
    sheet = sd.read_measurement("sheets/measurement.csv")
    simulated = sd.simulate(sd.read_scenario("orders.toml"))
    for name in ("line", "direction"):
        assert getattr(sheet, name) == getattr(simulated, name)
    for name in ("run", "point", "position"):
        assert getattr(sheet, name).tolist() == getattr(simulated, name).tolist()


MAP = "parameter,position_mm,value,unit,standard_uncertainty\n"


def test_check_says_what_is_implausible_of_an_error_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "map.csv"
    # 1 mm/m, 2000 µm and 5000 µrad are the limits; X has 400 mm.
    rows = "EXX,0,0,um,\nEXX,400,399,um,\nEYY,0,0,um,\nEYY,400,401,um,\nEZX,0,0,um,\nEZX,200,-2001,um,\nEZX,400,0,um,\n"
    path.write_text(MAP + rows + "EAZ,0,0,urad,\nEAZ,400,4999,urad,\nC0Y,,5001,urad,\n")
    assert main(["check", str(path)]) == 0
    warnings = [line.split(": warning: ")[1] for line in capsys.readouterr().out.splitlines() if "warning" in line]
    assert warnings == [
        "C0Y is 5001 µrad, beyond what a machine can be (5000 µrad); used as given",
        "EYY is 401 µm at 400 mm, beyond what a machine can be (400 µm); used as given",
        "EZX is -2001 µm at 200 mm, beyond what a machine can be (2000 µm); used as given",
    ]


@pytest.mark.parametrize("row", ["EAX,400,1e12,urad,", "B0Z,,-100000,urad,"])
def test_angles_that_no_machine_has_are_refused_wherever_they_would_be_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], row: str
) -> None:
    monkeypatch.chdir(tmp_path)
    head = "# format=stepdiag error map 1\n# chain=[w X' b Y Z t]\n# volume_mm=80 60 50\n# tool_mm=0 0 0\n"
    Path("map.csv").write_text(head + MAP + row + "\n")
    Path("scenario.toml").write_text(of_map("map.csv"))
    for command in (
        ["check", "map.csv"],
        ["check", "scenario.toml"],
        ["simulate", "scenario.toml", "-o", "run.csv"],
        ["export", "map.csv", "--to", "csv-grid", "-o", "grid.csv"],
    ):
        assert main(command) == 2, command
        assert re.search(rf"map.csv: {row[:3]} is \S+ µrad.*, expected less than 0.1 rad", capsys.readouterr().err)
    Path("map.csv").write_text(head + MAP + "B0Z,,-99999,urad,\n")
    assert main(["check", "scenario.toml"]) == 0
