"""A command whose standard streams are closed, as those of daemons, does its work and keeps its exit status."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from small_scenario import SCENARIO

from stepdiag.cli import main

pytestmark = pytest.mark.skipif(os.name == "nt", reason="closes streams as a shell of Linux does")

CLOSED = (">&-", "2>&-", "<&-", ">&- 2>&-", "<&- >&- 2>&-")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    assert main(["simulate", "scenario.toml", "-o", "run.csv"]) == 0
    return tmp_path


def status(command: str, closed: str) -> tuple[int, str, str]:
    """Exit status, and what came on the streams that are open."""
    arguments = f"{shlex.quote(sys.executable)} -m stepdiag {command}"
    done = subprocess.run(
        ["bash", "-c", f"{arguments} {closed}"], capture_output=True, text=True, timeout=120, check=False
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("closed", CLOSED)
def test_evaluate_writes_the_same_calibration(here: Path, monkeypatch: pytest.MonkeyPatch, closed: str) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    for name in ("c.csv", "c.nc"):
        expected = status(f"evaluate scenario.toml run.csv -o open_{name}", "")
        found = status(f"evaluate scenario.toml run.csv -o {name}", closed)
        assert found[0] == expected[0] == 0
        assert found[1] in ("", expected[1].replace("open_", ""))
        assert found[2] in ("", expected[2].replace("open_", ""))
        assert Path(name).read_bytes() == Path(f"open_{name}").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("closed", CLOSED)
@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("check scenario.toml run.csv", 0),
        ("check scenario.toml run.csv --json", 0),
        ("check missing.csv", 2),
        ("plot run.csv -o run.png", 0),
        ("--help", 0),
        ("nonsense", 2),
    ],
)
def test_command_keeps_its_status(here: Path, closed: str, command: str, code: int) -> None:
    found = status(command, closed)
    assert found[0] == code
    assert "Traceback" not in found[2]
    assert ">&-" not in f" {closed}".replace("2>&-", "") or found[1] == ""


def test_warning_that_nobody_reads_keeps_status_3(here: Path) -> None:
    assert status("evaluate scenario.toml run.csv -o c.csv", "")[0] == 0
    lines = Path("c.csv").read_text().splitlines(keepends=True)
    Path("edited.csv").write_text("".join(line for line in lines if not line.startswith("# sha256=")))
    for closed in ("", *CLOSED):
        assert status("report edited.csv", closed)[0] == 3


def test_worker_and_its_files_do_not_get_the_streams_numbers(here: Path) -> None:
    """What is opened later would have the number of a closed stream, and get what is printed."""
    program = (
        "import os; from stepdiag.cli import open_standard_streams; open_standard_streams(); "
        "handle = os.open('opened', os.O_CREAT | os.O_WRONLY); assert handle > 2; "
        "assert all(os.get_inheritable(number) for number in (0, 1, 2)); "
        "import sys; print('lost'); print('lost', file=sys.stderr); assert sys.stdin.read() == ''; "
        "os.write(handle, b'kept')"
    )
    done = subprocess.run(
        ["bash", "-c", f"{shlex.quote(sys.executable)} -c {shlex.quote(program)} <&- >&- 2>&-"], check=False
    )
    assert done.returncode == 0
    assert Path("opened").read_bytes() == b"kept"
