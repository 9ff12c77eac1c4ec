"""An interruption on every system: a signal that the process sends itself, while the main thread waits in a library."""

import subprocess
import sys
from pathlib import Path

import pytest
from small_scenario import SCENARIO

INTERRUPTED = """
import signal, sys, threading
signal.signal(signal.SIGINT, signal.default_int_handler)  # also where a shell has started the tests in the background
from stepdiag.cli import main
import stepdiag.scenario.description as description
def stop(*_, **__):
    threading.Timer(0.2, signal.raise_signal, [signal.SIGINT]).start()
    threading.Event().wait(60.0)
{patch} = stop
sys.exit(main())
"""


@pytest.mark.parametrize("patch", ["description.read_scenario", "import os; os.fsync"])
def test_a_command_ends_with_its_status_one_line_and_no_file(tmp_path: Path, patch: str) -> None:
    (tmp_path / "scenario.toml").write_text(SCENARIO, encoding="utf-8")
    command = [sys.executable, "-c", INTERRUPTED.format(patch=patch), "simulate", "scenario.toml", "-o", "run.nc"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300.0)
    assert (done.returncode, done.stderr.strip(), done.stdout) == (130, "stepdiag: interrupted", "")
    assert [path.name for path in tmp_path.iterdir()] == ["scenario.toml"]
