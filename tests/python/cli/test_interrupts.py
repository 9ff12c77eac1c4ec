"""Ctrl-C and SIGTERM end a command wherever it is, with one line, its status and no temporary file."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from small_scenario import SCENARIO

from stepdiag.cli import main
from stepdiag.interruption import uninterrupted

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows sends Ctrl-C to consoles: see test_interrupts_within")

STATUS = {signal.SIGINT: 130, signal.SIGTERM: 143}
LINE = {signal.SIGINT: "stepdiag: interrupted", signal.SIGTERM: "stepdiag: terminated"}
# A command that says where it is, and stays there: `stop` takes the place of a function.
STOPPED = """
import signal, subprocess, sys, threading, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # also where a shell has started the tests in the background
signal.signal(signal.SIGTERM, signal.SIG_DFL)
from stepdiag.cli import main
def said(*what):
    print(*what, flush=True)
def stop(*_, **__):
    said("there")
    {stop}
import stepdiag
{patch}
sys.exit(main())
"""
SLEEP = "time.sleep(600)"
LOCKED = "lock = threading.Lock(); lock.acquire(); lock.acquire()"
OBSTINATE = """
    while True:
        try: time.sleep(600)
        except BaseException: pass"""
CHILD = "child = subprocess.Popen(['sleep', '600']); said(child.pid); child.wait()"
READING = "import stepdiag.scenario.description as d; d.read_scenario = stop"
EVALUATING = "import stepdiag.uncertainty.run as r; r.evaluate_uncertainty = stop"
WRITING = "import os; os.fsync = stop"
NETCDF = "import stepdiag.io.netcdf as n; n._dump = stop"
SIMULATE = ["simulate", "scenario.toml", "--overwrite", "-o"]


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO)
    return path


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def started(stop: str, patch: str, *arguments: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-c", STOPPED.format(stop=stop, patch=patch), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.slow
@pytest.mark.parametrize("sign", STATUS)
@pytest.mark.parametrize(
    ("stop", "patch", "arguments"),
    [
        (SLEEP, READING, [*SIMULATE, "run.csv"]),
        (LOCKED, READING, [*SIMULATE, "run.csv"]),
        (OBSTINATE, EVALUATING, ["uncertainty", "scenario.toml"]),
        (SLEEP, WRITING, ["nc", "scenario.toml", "-o", "run.ngc"]),
        (OBSTINATE, WRITING, ["nc", "scenario.toml", "-o", "run.ngc"]),
        (SLEEP, NETCDF, [*SIMULATE, "run.nc"]),
        (LOCKED, NETCDF, [*SIMULATE, "run.nc"]),
    ],
    ids=["asleep", "deadlocked", "ignored", "syncing", "syncing in vain", "netCDF", "netCDF deadlocked"],
)
def test_a_signal_ends_the_command_with_one_line_and_leaves_what_was_there(
    scenario: Path, stop: str, patch: str, arguments: list[str], sign: signal.Signals
) -> None:
    for name in ("run.csv", "run.nc"):
        assert main([*SIMULATE, name]) == 0
    assert main(["nc", "scenario.toml", "-o", "run.ngc"]) == 0
    before = contents(scenario.parent)
    with started(stop, patch, *arguments) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "there\n"
        process.send_signal(sign)
        _, said = process.communicate(timeout=60)
    assert process.returncode == STATUS[sign]
    assert said.count("\n") == 1
    assert said.startswith(LINE[sign])
    assert contents(scenario.parent) == before


def test_a_second_ctrl_c_ends_a_command_that_is_keeping_what_it_has(scenario: Path) -> None:
    with started(OBSTINATE, EVALUATING, "uncertainty", "scenario.toml") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "there\n"
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert said == "stepdiag: interrupted: no samples were kept\n"


def test_programs_that_a_command_has_started_end_with_it(scenario: Path) -> None:
    with started(CHILD, READING, *SIMULATE, "run.csv") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "there\n"
        child = int(process.stdout.readline())
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    assert process.returncode == 130
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)


def test_an_ignored_ctrl_c_stays_ignored(scenario: Path) -> None:
    patch = f"signal.signal(signal.SIGINT, signal.SIG_IGN); {READING}"
    with started(SLEEP, patch, *SIMULATE, "run.csv") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "there\n"
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 143, said


@pytest.mark.slow
def test_an_interrupted_study_keeps_its_cells_and_its_workers_say_nothing(scenario: Path) -> None:
    scenario.with_name("study.toml").write_text(
        '[study]\nscenario = "scenario.toml"\nmethods = ["enhanced"]\nsamples = 100000\n'
        "[grid]\nplan.steps = [2, 3, 4]\n"
    )
    patch = """
import stepdiag.uncertainty.dask_workers as w
compute = w.Workers.compute
def told(self, *arguments):
    answers = compute(self, *arguments)
    said("there")
    return answers
w.Workers.compute = told
signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
"""
    with subprocess.Popen(
        [
            *(sys.executable, "-c", STOPPED.format(stop=SLEEP, patch=patch)),
            *("study", "study.toml", "-o", "s.nc", "--workers", "2"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "there\n"
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: the workers, too
        _, said = process.communicate(timeout=60)  # returns when the workers have closed their standard error
    assert process.returncode == 130
    assert said == "stepdiag: interrupted\n"
    assert sorted(contents(scenario.parent)) == ["scenario.toml", "study.toml"]


# --- in a program that uses the package ------------------------------------------------------------------------------
def test_no_exception_is_raised_within_what_is_not_to_be_interrupted() -> None:
    came = []

    def interrupted_at_the_end() -> None:
        with uninterrupted():
            signal.raise_signal(signal.SIGINT)
            came.append("still here")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            interrupted_at_the_end()
        assert came == ["still here"]
        assert signal.getsignal(signal.SIGINT) == signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_what_is_to_be_done_at_the_end_is_done_latest_first_though_some_of_it_fails() -> None:
    program = """
from stepdiag.interruption import at_end, end_of_process
def fail(): raise OSError
with at_end(lambda: "first"), at_end(fail), at_end(lambda: None), at_end(lambda: "last"):
    assert end_of_process(0.0) == ["last", "first"]
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
