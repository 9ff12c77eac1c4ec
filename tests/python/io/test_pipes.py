"""Pipes as inputs: one that a program writes into is read as a file, one without a writer is refused and not waited
for."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from refusal import refused
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.acquisition.temperature_file import TemperatureFile
from stepdiag.cli import main

NO_WRITER = "expected a file, got a pipe into which no program writes"
STEPDIAG = f"{shlex.quote(sys.executable)} -m stepdiag"
CSV_READERS = (sd.read_measurement, sd.read_error_map, sd.read_calibration)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    assert main(["simulate", "scenario.toml", "-o", "run.csv"]) == 0
    os.mkfifo("pipe")
    for ending in ("csv", "nc", "toml", "png", "checkpoint", "xlsx", "jsonl"):
        os.mkfifo(f"pipe.{ending}")
    return tmp_path


def ended(command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.slow
@pytest.mark.parametrize("reader", [*CSV_READERS, sd.read_scenario, sd.optics.read_head_design])
def test_reader_refuses_a_pipe_without_a_writer(here: Path, reader: Callable[[str], Any]) -> None:
    refused(reader, "pipe", names=f"pipe: {NO_WRITER}")


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        "evaluate scenario.toml pipe.csv -o c.csv",
        "evaluate pipe.toml run.csv -o c.csv",
        "evaluate scenario.toml pipe.nc -o c.csv",
        "check pipe.csv",
        "check pipe",
        "check pipe.toml",
        "check pipe.nc",
        "check pipe.jsonl",
        "report pipe.csv",
        "report pipe.nc",
        "compare pipe.csv run.csv",
        "plot pipe.csv -o run.png",
        "positions pipe.csv",
        "export pipe.csv --to squareness -o s.csv",
        "import pipe.csv --scenario scenario.toml -o m.csv",
        "import pipe.xlsx --scenario scenario.toml -o m.csv",
        "simulate pipe.toml -o r.csv",
        "head check pipe.toml",
        "uncertainty scenario.toml -n 100 --resume --checkpoint pipe.checkpoint -o u.nc",
    ],
)
def test_command_names_the_pipe_and_ends_with_status_2(here: Path, command: str) -> None:
    done = ended(f"{STEPDIAG} {command}")
    assert done.returncode == 2, done.stderr
    (line,) = done.stderr.splitlines()
    assert re.match(r"stepdiag: error: (?:\S*: )?pipe\S*: (?:expected|cannot be written:) ", line), line
    assert line.count("pipe.") <= 1


def test_file_of_temperatures_is_no_pipe(here: Path) -> None:
    refused(TemperatureFile, Path("pipe.csv"), age=60.0, tell=print, names="pipe.csv: expected a file")


@pytest.mark.parametrize(
    "command",
    [
        "evaluate scenario.toml <(cat run.csv) -o c.csv",
        "simulate <(cat scenario.toml) -o again.csv && cmp again.csv run.csv && "
        f"{STEPDIAG} evaluate scenario.toml again.csv -o c.csv",
        "evaluate scenario.toml /dev/stdin -o c.csv <run.csv",
        "evaluate /dev/stdin run.csv -o c.csv <scenario.toml",
    ],
)
def test_pipe_with_a_writer_is_read(here: Path, command: str) -> None:
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", "expected.csv"]) == 0
    done = ended(f"{STEPDIAG} {command}")
    assert done.returncode == 0, done.stderr
    expected = sd.read_calibration("expected.csv")
    assert sd.read_calibration("c.csv").squareness == expected.squareness


def test_standard_input_from_a_pipe_is_read(here: Path) -> None:
    done = ended(f"cat run.csv | {STEPDIAG} evaluate scenario.toml /dev/stdin -o c.csv")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_writer_may_come_late_and_take_its_time(here: Path) -> None:
    """It opens the pipe after a second, waits longer than a reader waits for a writer, and writes in pieces."""
    script = "sleep 1; exec >pipe; sleep 2.5; head -c 1000 {file}; sleep 2.5; tail -c +1001 {file}"
    for file, reader in (("run.csv", sd.read_measurement), ("scenario.toml", sd.read_scenario)):
        with subprocess.Popen(["sh", "-c", script.format(file=file)]):
            reader("pipe")


def test_pipe_whose_writer_wrote_nothing_is_an_empty_file(here: Path) -> None:
    for file, command in (("run", "evaluate scenario.toml <(true)"), ("scenario", "evaluate <(true) run.csv")):
        begun = time.monotonic()
        done = ended(f"{STEPDIAG} {command} -o c_{file}.csv")
        assert done.returncode == 2
        assert "the file is empty" in done.stderr
        assert time.monotonic() - begun < 30.0
