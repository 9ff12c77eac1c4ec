"""An output is whole or not there: a signal, a full disk or a read-only file leaves what was there and nothing else."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag import InvalidArgument, platform
from stepdiag.cli import main

# The command stops where its temporary file is on the disk, and says so.
STOPPED = """
import os, sys, time
from stepdiag.cli import main
def stop(handle):
    print("written", flush=True)
    time.sleep(60)
os.fsync = stop
sys.exit(main())
"""
# RLIMIT_FSIZE stands for a full disk: a write comes back short, the next one fails.
FULL = """
import resource, sys
from stepdiag.cli import main
resource.setrlimit(resource.RLIMIT_FSIZE, (700, 700))
sys.exit(main())
"""


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO)
    return path


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_sigterm_leaves_the_old_file_and_no_temporary_one(scenario: Path) -> None:
    assert main(["nc", "scenario.toml", "-o", "run.ngc"]) == 0
    before = contents(scenario.parent)
    with subprocess.Popen(
        [sys.executable, "-c", STOPPED, "nc", "scenario.toml", "-o", "run.ngc", "--overrun", "2"],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "written\n"
        assert len(contents(scenario.parent)) == len(before) + 1
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=30) == 143
    assert contents(scenario.parent) == before


def test_sigterm_is_as_before_after_a_command(scenario: Path) -> None:
    before = signal.getsignal(signal.SIGTERM)
    assert main(["nc", "scenario.toml", "-o", "run.ngc"]) == 0
    assert signal.getsignal(signal.SIGTERM) == before


@pytest.mark.parametrize(
    "command", [["nc", "-o", "run.ngc"], ["simulate", "-o", "run.csv"], ["simulate", "-o", "run.nc"]], ids=str
)
def test_a_full_disk_leaves_nothing_half_written(scenario: Path, command: list[str]) -> None:
    name, *output = command
    before = contents(scenario.parent)
    arguments = [sys.executable, "-c", FULL, name, "scenario.toml", *output]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert f"{output[1]}: cannot be written: " in done.stderr
    assert contents(scenario.parent) == before


@pytest.mark.parametrize(
    "write",
    [
        lambda path: main(["simulate", "scenario.toml", "-o", str(path), "--overwrite"]),
        lambda path: sd.simulate(sd.read_scenario("scenario.toml")).write(path),
    ],
    ids=["command", "library"],
)
@pytest.mark.parametrize("name", ["run.csv", "run.nc"])
def test_a_read_only_file_is_refused(
    scenario: Path, name: str, write: Callable[[Path], int], capsys: pytest.CaptureFixture[str]
) -> None:
    path = scenario.with_name(name)
    assert main(["simulate", "scenario.toml", "-o", name]) == 0
    path.chmod(0o444)
    before = contents(scenario.parent)
    capsys.readouterr()
    try:
        assert write(path) == 2
        said = capsys.readouterr().err
    except InvalidArgument as error:
        said = str(error)
    assert f"{name}: cannot be written: the file is read-only" in said
    assert contents(scenario.parent) == before


def test_the_folder_is_synced_after_the_renaming(scenario: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of what the core writes, the core syncs it: tests/faults has each of its calls fail."""
    synced = []

    def sync(folder: Path, to: Callable[[Path], None] = platform.sync_folder) -> None:
        to(folder)
        synced.append((folder, sorted(os.listdir(folder))))

    monkeypatch.setattr(platform, "sync_folder", sync)
    assert main(["simulate", "scenario.toml", "-o", "run.nc"]) == 0
    assert synced == [(scenario.parent, ["run.nc", "scenario.toml"])]


@pytest.mark.parametrize("folder", ["/dev/shm", "/no/such/folder"])
def test_netcdf_is_made_elsewhere_and_leaves_nothing_there(
    scenario: Path, folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The libraries do not write to the disk of the output, where they could crash, unless there is no room."""
    monkeypatch.setattr(platform, "memory_folder", lambda: Path(folder))
    assert main(["simulate", "scenario.toml", "-o", "run.nc"]) == 0
    assert sorted(contents(scenario.parent)) == ["run.nc", "scenario.toml"]
    assert len(sd.read_measurement(scenario.with_name("run.nc")).line) == 70
    assert not list(Path("/dev/shm").glob("stepdiag.*"))
