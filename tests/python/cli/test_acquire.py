"""The commands acquire and twin, at the command line."""

import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import acquiring
import numpy as np
import pytest
from acquiring import Listener, acquire_through, instrument, scenario, sound

from stepdiag.cli import main
from stepdiag.io.data_files import read_measurement
from stepdiag.scenario.description import read_scenario, simulate_scenario
from stepdiag.twin.server import Twin

FAST = ["--settle-count", "2", "--average", "2", "--interval-ms", "0"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a scenario, which is also the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenario.toml").write_text(
        acquiring.SCENARIO.format(plan=acquiring.SMALL, head=acquiring.BEAMS, noise="")
    )
    return tmp_path


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(list(arguments)) == 2
    error = capsys.readouterr().err
    assert error.startswith("stepdiag: error: ")
    assert error.count("\n") == 1
    return error


def test_operator_presses_enter_for_every_reading(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n" * 28))
    with instrument(sound) as (host, port):
        assert main(["acquire", "scenario.toml", "--source", f"ids3010://{host}:{port}", *FAST, "-o", "run.csv"]) == 0
    out = capsys.readouterr().out
    assert out.count(": Enter") == 28
    assert "visit 4 of 4 (line npp, run 1, backward): 7 readings, 0 lost" in out
    assert out.endswith("wrote run.csv: 28 of 28 readings, 0 lost\n")
    assert np.all(read_measurement(folder / "run.csv").channels["d2"] == 100.000000002)
    assert main(["check", "run.raw.jsonl", "run.csv"]) == 0
    assert "run.raw.jsonl: raw readings: 28 of 28 readings of d1, d2, d3, 0 lost" in capsys.readouterr().out


def test_operator_who_leaves_can_come_back(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with instrument(sound) as (host, port):
        command = ["acquire", "scenario.toml", "--source", f"ids3010://{host}:{port}", *FAST, "-o", "run.csv"]
        monkeypatch.setattr(sys, "stdin", io.StringIO("\n" * 5))
        assert "standard input ended" in refused(capsys, *command)
        assert len(read_measurement(folder / "run.csv")) == 5
        assert "exists already: --resume continues it" in refused(capsys, *command)
        monkeypatch.setattr(sys, "stdin", io.StringIO("\n" * 30))
        assert main([*command, "--resume"]) == 0
        assert "continuing with visit 1 (line ppp, run 0, forward), point 5 at X80 Y60 Z25" in capsys.readouterr().out
    assert len(read_measurement(folder / "run.csv")) == 28


def test_run_is_made_from_the_raw_file_alone(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    described = scenario()
    with Twin(described) as twin:
        acquire_through(described, twin, folder / "run.csv", operator=Listener())
    (folder / "scenario.toml").unlink()
    with (folder / "run.raw.jsonl").open("ab") as file:
        file.write(b'{"record":"va')
    assert main(["acquire", "--from-raw", "run.raw.jsonl", "-o", "again.csv"]) == 0
    captured = capsys.readouterr()
    assert captured.out == "wrote again.csv: 28 of 28 readings\n"
    assert "warning: run.raw.jsonl: the last line was torn (13 bytes without an end)" in captured.err
    assert (folder / "again.csv").read_bytes() == (folder / "run.csv").read_bytes()
    assert main(["acquire", "--from-raw", "run.raw.jsonl", "--zero", "first", "-o", "zero.nc"]) == 0
    assert read_measurement(folder / "zero.nc").channels["d1"][0] == 100.0


def test_temperatures_are_read_with_the_run_and_from_the_raw_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "t.csv").write_text(f"time,temperature_c\n{time.time() - 100.0},21.5\n")
    with instrument(sound) as (host, port):
        command = ["acquire", "scenario.toml", "--source", f"ids3010://{host}:{port}", *FAST]
        assert "t.csv: is also an input" in refused(capsys, *command, "--temperatures", "t.csv", "-o", "t.csv")
        monkeypatch.setattr(sys, "stdin", io.StringIO("\n" * 5))
        error = refused(capsys, *command, "--temperatures", "t.csv", "-o", "run.csv")
        assert "standard input ended" in error
        assert set(read_measurement(folder / "run.csv").channels["temperature"]) == {21.5}
        monkeypatch.setattr(sys, "stdin", io.StringIO("\n" * 30))
        assert main([*command, "--resume", "-o", "run.csv"]) == 0
        assert "without --temperatures others have none" in capsys.readouterr().out
    again = ["acquire", "--from-raw", "run.raw.jsonl", "-o", "again.csv"]
    assert main(again) == 0
    assert (folder / "again.csv").read_bytes() == (folder / "run.csv").read_bytes()
    assert main([*again[:-1], "strict.csv", "--temperature-age", "50"]) == 0
    assert np.isnan(read_measurement(folder / "strict.csv").channels["temperature"]).all()
    assert "reads no --temperatures" in refused(capsys, *again, "--temperatures", "t.csv")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["scenario.toml"], "expected SCENARIO and --source, or --from-raw"),
        (["--source", "ids3010://127.0.0.1"], "expected SCENARIO and --source, or --from-raw"),
        (["scenario.toml", "--from-raw", "x"], "--from-raw: reads no scenario and no --source"),
        (["--from-raw", "nothing.jsonl"], "nothing.jsonl: cannot be read"),
        (["--from-raw", "scenario.toml"], "scenario.toml, line 1: Invalid JSON"),
        (["scenario.toml", "--source", "tcp://127.0.0.1"], "source: expected ids3010://HOST"),
        (["scenario.toml", "--source", "ids3010://127.0.0.1:1"], "cannot be reached"),
        (["nothing.toml", "--source", "ids3010://127.0.0.1:1"], "nothing.toml: cannot be read"),
        (["scenario.toml", "--source", "ids3010://h", "--axes", "1,2"], "axes: expected 3 different numbers"),
        (["scenario.toml", "--source", "ids3010://h", "--axes", "1,x,3"], "--axes: expected numbers"),
        (["scenario.toml", "--source", "ids3010://h", "--trigger", "bell"], "--trigger: expected key, settle or tcp"),
        (
            ["scenario.toml", "--source", "ids3010://h", "--trigger", "tcp://h"],
            "--trigger: expected key, settle or tcp",
        ),
        (["scenario.toml", "--source", "ids3010://h", "--trigger", "tcp://h:x"], "--trigger: expected key"),
        (["scenario.toml", "--source", "ids3010://h", "--settle-count", "1"], "settle-count"),
        (["scenario.toml", "--source", "ids3010://h", "--settle-limit-um", "0"], "settle-limit-um"),
        (["scenario.toml", "--source", "ids3010://h", "--settle-limit-um", "nan"], "limit_um: expected"),
        (["scenario.toml", "--source", "ids3010://h", "--timeout", "inf"], "timeout: expected"),
        (["scenario.toml", "--source", "ids3010://h", "--temperatures", "t.csv"], "t.csv: cannot be read"),
        (["scenario.toml", "--source", "ids3010://h", "--temperature-age", "inf"], "temperature_age: expected"),
        (["scenario.toml", "--source", "ids3010://h", "--resume"], "run.raw.jsonl: cannot be continued"),
        (
            ["scenario.toml", "--source", "ids3010://h", "--resume", "--restart-line"],
            "expected one of --resume, --restart-line and --restart-set-up",
        ),
        (["scenario.toml", "--source", "ids3010://h", "--raw", "run.csv"], "run.csv: is also an input"),
        (["scenario.toml", "--source", "ids3010://h", "--raw", "raw.csv"], "expected a name that ends in .jsonl"),
        (["scenario.toml", "--source", "ids3010://h", "--raw", "scenario.toml"], "is also an input"),
    ],
)
def test_bad_options_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert message in refused(capsys, "acquire", *arguments, "-o", "run.csv")
    assert [path.name for path in folder.iterdir()] == ["scenario.toml"]


def test_head_without_three_axes_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    head = 'layout = "psd"\npsd_distance_mm = 80.0'
    (folder / "psd.toml").write_text(acquiring.SCENARIO.format(plan=acquiring.SMALL, head=head, noise=""))
    message = 'psd.toml: head: the layout "psd" cannot be read'
    assert message in refused(capsys, "acquire", "psd.toml", "--source", "ids3010://h", "-o", "run.csv")
    assert message in refused(capsys, "twin", "psd.toml", "--port", "0")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--port", "70000"], "port"),
        (["--play", "0"], "play"),
        (["--play", "nan"], "play: expected seconds above 0"),
        (["--lose", "3"], "expected VISIT:POINT such as 2:5"),
        (["--settling-ms", "-1"], "settling-ms"),
        (["--temperatures", "t.csv"], "scenario.toml: expected [temperature] or the air of a constant index, got none"),
        (["--stdout"], "--stdout: goes with --protocol lines"),
        (["--protocol", "lines", "--interrupt"], "--interrupt: goes with --protocol ids3010"),
        (["--host", "no such host"], "twin: cannot listen on no such host:9090"),
    ],
)
def test_bad_options_of_the_twin_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert message in refused(capsys, "twin", "scenario.toml", *arguments)


@pytest.mark.slow
def test_twin_on_standard_output_is_acquired_and_ends_with_the_acquisition(folder: Path) -> None:
    head = 'layout = "psd"\npsd_distance_mm = 80.0'
    (folder / "psd.toml").write_text(acquiring.SCENARIO.format(plan='lines = ["ppp"]\nsteps = 1', head=head, noise=""))
    command = f"{sys.executable} -m stepdiag twin psd.toml --protocol lines --stdout --play 2"
    done = subprocess.run(
        [
            *(sys.executable, "-m", "stepdiag", "acquire", "psd.toml", "--source", f"program:{command}"),
            *("--trigger", "settle", *FAST, "-o", "run.csv"),
        ],
        input="\n",
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.stdout.endswith("wrote run.csv: 4 of 4 readings, 0 lost\n"), done
    run, expected = read_measurement(folder / "run.csv"), simulate_scenario(read_scenario(folder / "psd.toml"))
    for name in ("distance", "spot_x", "spot_y"):
        assert np.max(np.abs(run.channels[name] - expected.channels[name])) < 0.501e-9


@pytest.mark.skipif(os.name == "nt", reason="Windows sends Ctrl-C to consoles: see test_interrupts_within")
def test_interrupted_commands_end_and_keep_what_they_have(folder: Path) -> None:
    command = [sys.executable, "-m", "stepdiag"]

    def hear() -> None:  # also where the tests run in the background of a shell, which ignores Ctrl-C
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    twin = subprocess.Popen(
        [*command, "twin", "scenario.toml", "--port", "0", "--play", "0.02"],
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=hear,
    )
    assert twin.stdout is not None
    address = twin.stdout.readline().split()[2]
    acquire = subprocess.Popen(
        [*command, "acquire", "scenario.toml", "--source", f"ids3010://{address}", *FAST, "-o", "run.csv"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=hear,
    )
    try:
        assert acquire.stdin is not None
        assert acquire.stdout is not None
        for _ in range(2):
            acquire.stdin.write("\n")
            acquire.stdin.flush()
        read = ""
        while read.count(": Enter") < 3:
            read += acquire.stdout.read(1)
        acquire.send_signal(signal.SIGINT)
        assert acquire.wait(60) == 130
        assert len(read_measurement(folder / "run.csv")) == 2
        twin.send_signal(signal.SIGINT)
        assert twin.wait(60) == 130
    finally:
        for process in (acquire, twin):
            process.kill()
            process.communicate()
