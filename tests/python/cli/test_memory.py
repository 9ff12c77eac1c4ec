"""Work that needs more memory than is free is refused in one line before it begins. So is what fails for want of it."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from small_scenario import SCENARIO

from stepdiag import memory
from stepdiag.cli import main

resource = pytest.importorskip("resource")  # limits of POSIX
GB = 10**9


def test_evaluation_beyond_the_limit_of_addresses_is_refused_with_its_need(tmp_path: Path) -> None:
    """As under `ulimit -v`."""
    scenario, run = tmp_path / "scenario.toml", tmp_path / "run.csv"
    scenario.write_text(SCENARIO.replace("steps = 5", "steps = 1000"))
    assert "steps = 1000" in scenario.read_text()
    assert main(["simulate", str(scenario), "-o", str(run)]) == 0
    done = subprocess.run(
        [
            *(sys.executable, "-m", "stepdiag", "evaluate", str(scenario), str(run)),
            *("-o", str(tmp_path / "c.nc"), "--covariance"),
        ],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (6 * GB, 6 * GB)),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 2
    assert "the covariance of 18021 values needs about 16 GB of memory, but " in done.stderr
    assert done.stderr.endswith("are free: leave the covariance out (--no-covariance)\n")
    assert done.stderr.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.csv", "scenario.toml"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["uncertainty", "scenario.toml", "-n", "4000", "--covariance", "-o", "u.nc"],
            "4000 samples of 111 outputs with --covariance needs about",
        ),
        (["evaluate", "scenario.toml", "run.csv", "-o", "c.csv"], "the evaluation of 70 readings needs about"),
        (["volume", "c.nc"], "c.nc: its covariance needs about"),
    ],
)
def test_what_needs_more_than_is_free_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    assert main(["simulate", "scenario.toml", "-o", "run.csv"]) == 0
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", "c.nc"]) in (0, 3)
    capsys.readouterr()
    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr(memory, "free_memory", lambda: [1e6])
    assert main(arguments) == 2
    assert message in capsys.readouterr().err
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("error", [MemoryError(), MemoryError("std::bad_alloc")])
def test_want_of_memory_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: MemoryError
) -> None:
    def fail(*_: Any) -> None:
        raise error

    monkeypatch.setattr("stepdiag.scenario.description.read_scenario", fail)
    assert main(["simulate", "scenario.toml", "-o", str(tmp_path / "run.csv")]) == 2
    assert capsys.readouterr().err == "stepdiag: error: the memory does not suffice\n"


def test_memory_is_free_and_what_it_suffices_for_is_not_refused() -> None:
    assert min(memory.free_memory()) > 0
    memory.check_memory(0.0, "nothing", "nothing")
