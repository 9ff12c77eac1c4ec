"""The command line: files in, files out, exit codes, and one clear line for a caller's mistake."""

import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
import xarray as xr
from places import RUNS
from small_scenario import SCENARIO, of_map
from systems import with_slashes

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.io.data_files import write_calibration
from stepdiag.scenario.description import evaluate_beside_adjustment

CASES = sorted(path.name for path in RUNS.iterdir() if path.is_dir())


def run(*arguments: str) -> int:
    return main(list(arguments))


@pytest.fixture(autouse=True)
def one_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Calibrations carry the date of their making."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1790000000")


# --- the round trip --------------------------------------------------------------------------------------------------
def test_simulate_writes_what_the_library_simulates(here: Path) -> None:
    scenario = sd.read_scenario("scenario.toml")
    sd.simulate(scenario).write("library.csv")
    assert Path("run.csv").read_bytes() == Path("library.csv").read_bytes()


# What the command says of where a calibration comes from, and the library does not know.
PROVENANCE = ("run_sha256", "scenario_sha256", "heads_sha256", "program", "options")


def but(keys: tuple[str, ...], path: str | Path) -> bytes:
    """A file without the leading lines of these keys."""
    lines = Path(path).read_bytes().splitlines(keepends=True)
    return b"".join(line for line in lines if not line.startswith(tuple(f"# {key}=".encode() for key in keys)))


@pytest.mark.parametrize("method", ["conventional", "enhanced", "adjustment"])
def test_evaluate_writes_what_the_library_evaluates(
    here: Path, method: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    code = run("evaluate", "scenario.toml", "run.csv", "-m", method, "-o", "calibration.csv")
    scenario, measurement = sd.read_scenario("scenario.toml"), sd.read_measurement("run.csv")
    calibration = sd.methods.evaluate_scenario(scenario, measurement, method=method)
    if method != "adjustment":
        judged = evaluate_beside_adjustment(scenario, measurement, method=method)
        np.testing.assert_equal(dict(judged.calibration.functions), dict(calibration.functions))
        calibration = judged.calibration
    # The machine has rotations, which contradict what the conventional method takes for granted.
    assert code == (3 if method == "conventional" else 0)
    write_calibration(calibration, "library.csv")
    assert but(PROVENANCE, "calibration.csv") == Path("library.csv").read_bytes()
    said = capsys.readouterr().out
    assert f"method: {method}" in said
    assert "positioning" in said


def test_adjustment_is_the_default(here: Path) -> None:
    run("evaluate", "scenario.toml", "run.csv", "-o", "default.csv")
    assert sd.read_calibration("default.csv").method == "adjustment"


def test_netcdf_keeps_the_covariance_and_the_set_up(here: Path) -> None:
    assert run("evaluate", "scenario.toml", "run.csv", "-o", "calibration.nc") == 0
    with xr.open_dataset("calibration.nc") as table:
        assert table["covariance"].shape == (18 * 6 + 3,) * 2
        assert "reflector" in table["setup_quantity"].values.tolist()
        assert table.sizes["reading"] == len(sd.read_measurement("run.csv"))


def test_covariance_of_many_values_is_written_on_demand_alone(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def written(*option: str) -> bool:
        assert run("evaluate", "scenario.toml", "run.csv", *option, "-o", "calibration.nc") == 0
        return sd.read_calibration("calibration.nc").covariance is not None

    assert not written("--no-covariance")
    assert "no covariance" not in capsys.readouterr().err
    monkeypatch.setattr("stepdiag.cli.evaluate.MOST_COVARIED", 18 * 6 + 2)
    assert not written()
    assert "stepdiag: note: no covariance of 111 values" in capsys.readouterr().err
    assert written("--covariance")


def test_report_counts_lost_readings_and_lost_points(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = Path("run.csv").read_text().splitlines()
    rows[10] = ",".join([*rows[10].split(",")[:5], "", "", ""])
    del rows[20]
    Path("run.csv").write_text("\n".join(rows) + "\n")
    assert run("evaluate", "scenario.toml", "run.csv", "-o", "calibration.csv") == 0
    assert "lost: 1 rows without a complete reading, 1 points of the plan without a row" in capsys.readouterr().out


def test_report_says_what_is_undetermined(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("no_scales.toml").write_text(SCENARIO.replace('["p00", "0p0", "00p"]', "[]"))
    assert run("simulate", "no_scales.toml", "-o", "no_scales.csv") == 0
    assert run("evaluate", "no_scales.toml", "no_scales.csv", "-o", "calibration.csv") == 0
    assert "undetermined: scale of X (EXX): add the line p00" in capsys.readouterr().out


# --- an evaluator sees no truth --------------------------------------------------------------------------------------
def without_truth(scenario: str) -> str:
    """The scenario with everything deleted that only a simulation may know."""
    content = tomllib.loads(scenario)
    content["machine"].pop("errors", None)
    content["machine"].pop("random", None)
    content.pop("misalignment", None)
    content.get("noise", {}).pop("seed", None)
    return tomlkit.dumps(content)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["conventional", "enhanced", "adjustment"])
@pytest.mark.parametrize("case", CASES)
def test_calibration_has_the_same_bytes_when_the_truth_is_deleted(case: str, method: str, tmp_path: Path) -> None:
    scenario = (RUNS / case / "scenario.toml").read_text()
    blind, seeing = tmp_path / "blind", tmp_path / "seeing"
    outcomes = []
    for folder, text in ((seeing, scenario), (blind, without_truth(scenario))):
        shutil.copytree(RUNS / case, folder)
        (folder / "scenario.toml").write_text(text)
        if folder == blind:
            (folder / "truth.csv").unlink()
        arguments = ["evaluate", str(folder / "scenario.toml"), str(folder / "measurement.csv")]
        code = run(*arguments, "-m", method, "-o", str(folder / "out.csv"))
        outcomes.append((code, but(("scenario_sha256",), folder / "out.csv") if code != 2 else b""))
    assert without_truth(scenario) != scenario
    assert outcomes[0] == outcomes[1]
    # Six face diagonals are no body diagonals: the conventional method refuses them. The others contradict it, since
    # their machines have rotations (three beams are too noisy to tell more than doubt), as a displaced position sensing
    # device contradicts the enhanced method.
    if method == "conventional":
        expected = {"faces": 2, "three_beams": 0}.get(case, 3)
    else:
        expected = 3 if (case, method) == ("displaced_psd", "enhanced") else 0
    assert outcomes[0][0] == expected


# --- mistakes --------------------------------------------------------------------------------------------------------
MISTAKES: list[tuple[list[str], str]] = [
    (["simulate"], "Missing argument 'SCENARIO'"),
    (["simulate", "scenario.toml"], "Missing option '-o'"),
    (["simulat", "scenario.toml"], "No such command 'simulat': did you mean simulate?"),
    (["simulate", "scenario.toml", "-o", "out.csv", "--fast"], "No such option"),
    (["simulate", "no.toml", "-o", "out.csv"], "no.toml: cannot be read: No such file or directory"),
    (
        ["simulate", "run.csv", "-o", "out.csv"],
        "run.csv: expected a scenario, got a measurement: are the files in the wrong order?",
    ),
    (["simulate", "scenario.toml", "-o", "no/out.csv"], "no/out.csv: cannot be written: the folder no does not exist"),
    (["simulate", "scenario.toml", "-o", "."], "cannot be written: it is a folder"),
    (["simulate", "scenario.toml", "-o", "/dev/null"], "/dev/null: cannot be written: expected the name of a file"),
    (["simulate", "scenario.toml", "-o", "/dev/stdout"], "expected the name of a file, got that of a device"),
    (["evaluate", "scenario.toml", "run.csv", "-o", "/dev/fd/1"], "expected the name of a file, got that of a device"),
    (["simulate", "scenario.toml", "-o", "run.csv/out.csv"], "the folder run.csv does not exist"),
    (["simulate", "scenario.toml", "-o", "scenario.toml"], "is also an input"),
    (["evaluate", "scenario.toml", "run.csv", "-m", "magic", "-o", "out.csv"], "'magic' is not one of"),
    (["evaluate", "scenario.toml", "scenario.toml", "-o", "out.csv"], "scenario.toml"),
    (["evaluate", "scenario.toml", "run.csv", "--covariance", "-o", "out.csv"], "expected an output named .nc"),
    (["evaluate", "scenario.toml", "no.csv", "-o", "out.csv"], "no.csv: cannot be read"),
    (["evaluate", "scenario.toml", "/dev/zero", "-o", "out.csv"], "/dev/zero: expected a file, got a device"),
    (["evaluate", "scenario.toml", "run.csv", "-o", "./run.csv"], "is also an input"),
    (["simulate", "of_map.toml", "-o", "truth.csv"], "is the scenario's machine.errors"),
    (["evaluate", "of_map.toml", "run.csv", "-o", "./truth.csv"], "is the scenario's machine.errors"),
    (["evaluate", "no_map.toml", "run.csv", "-o", "missing.csv"], "is the scenario's machine.errors"),
    (["evaluate", "other.toml", "run.csv", "-o", "out.csv"], "run.csv: "),
    (["evaluate", "scenario.toml", "run.csv", "-o", "no/out.csv"], "the folder no does not exist"),
    (["check"], "Missing argument 'FILE...'"),
    (["check", "no.csv"], "no.csv: cannot be read"),
    (["check", "."], ".: expected a file, got a folder"),
    (["check", "notes.txt"], "notes.txt: expected a scenario or a head (TOML), a measurement"),
    (["init"], "Missing option '-o'"),
    (["init", "-o", "run.csv"], "run.csv"),
    (["init", "-o", "."], "scenario.toml: exists already, and is not overwritten"),
    (["demo", "-o", "run.csv"], "run.csv: the folder cannot be made"),
    (["demo", "everything"], "unexpected extra argument"),
]


@pytest.mark.parametrize(("arguments", "message"), MISTAKES, ids=[" ".join(arguments) for arguments, _ in MISTAKES])
def test_mistake_gives_exit_code_2_and_one_line(
    here: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if os.name == "nt" and "/dev/" in " ".join(arguments):
        pytest.skip("Windows has no /dev")
    Path("other.toml").write_text(SCENARIO.replace("steps = 5", "steps = 4"))
    Path("of_map.toml").write_text(of_map("truth.csv"))
    Path("no_map.toml").write_text(of_map("missing.csv"))
    sd.ErrorMap().write("truth.csv")
    Path("notes.txt").write_text("nothing of ours\n")
    before = {path.name: path.read_bytes() for path in here.iterdir()}
    capsys.readouterr()
    assert run(*arguments) == 2
    said = with_slashes(capsys.readouterr().err)
    assert said.startswith("stepdiag: error: ")
    assert message in said
    assert said.count("\n") == 1
    assert {path.name: path.read_bytes() for path in here.iterdir()} == before, "files were left behind"


def test_no_arguments_show_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert run() == 0
    assert "stepdiag init -o machine" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["simulate", "evaluate", "observe", "demo", "check", "init"])
def test_help_of_every_command_has_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(command, "--help") == 0
    assert f"Example: stepdiag {command}" in capsys.readouterr().out


def test_version_is_that_of_the_library(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--version") == 0
    assert capsys.readouterr().out == f"stepdiag {sd.__version__}\n"


def test_interruption_gives_130(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("stepdiag.scenario.description.read_scenario", interrupted)
    assert run("simulate", "scenario.toml", "-o", "out.csv") == 130
    assert not Path("out.csv").exists()


def test_terminal_without_the_micro_sign_gets_its_report(here: Path) -> None:
    command = [sys.executable, "-m", "stepdiag", "evaluate", "scenario.toml", "run.csv", "-o", "calibration.csv"]
    environment = {**os.environ, "PYTHONIOENCODING": "iso8859-5"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=here, env=environment)
    assert done.returncode == 0
    assert "?m " in done.stdout


# --- whole or not at all ---------------------------------------------------------------------------------------------
def limit_files(size: int) -> Callable[[], None]:
    """For a child process: writing more than `size` bytes to a file fails, as on a full disk."""
    resource = pytest.importorskip("resource")
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


@pytest.mark.parametrize(
    "arguments",
    [
        ["simulate", "scenario.toml", "-o", "out.csv"],
        ["evaluate", "scenario.toml", "run.csv", "-o", "out.csv"],
        ["init", "-o", "new"],
    ],
)
def test_full_disk_leaves_no_half_written_file(here: Path, arguments: list[str]) -> None:
    before = {path.name for path in here.iterdir()}
    command = [sys.executable, "-m", "stepdiag", *arguments]
    limit = limit_files(1024)
    done = subprocess.run(command, preexec_fn=limit, capture_output=True, text=True, check=False, cwd=here)
    assert done.returncode == 2
    assert done.stderr.startswith("stepdiag: error: ")
    assert "cannot be written" in done.stderr
    assert done.stderr.count("\n") == 1
    assert {path.name for path in here.iterdir()} - {"new"} == before
    assert not list(here.glob("new/*"))


def test_failed_evaluation_leaves_an_older_result_alone(here: Path) -> None:
    Path("calibration.csv").write_text("older")
    Path("other.toml").write_text(SCENARIO.replace("steps = 5", "steps = 4"))
    assert run("evaluate", "other.toml", "run.csv", "-o", "calibration.csv") == 2
    assert Path("calibration.csv").read_text() == "older"


@pytest.mark.parametrize(("word", "meant"), [("evalute", "evaluate"), ("calibrate", "evaluate"), ("Report", "report")])
def test_command_that_is_meant_is_named(word: str, meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([word]) == 2
    assert f"No such command '{word}': did you mean {meant}?" in capsys.readouterr().err


def test_command_like_no_other_is_not_guessed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["qqqq"]) == 2
    assert "did you mean" not in capsys.readouterr().err
