"""What several files of tests share."""

import os
from pathlib import Path

import hypothesis
import one_thread  # noqa: F401 (for what its import does)
import pytest
from small_scenario import SCENARIO

from stepdiag.cli import main

hypothesis.settings.register_profile("untimed", deadline=None)  # machines may be busy
hypothesis.settings.load_profile("untimed")
os.environ["SOURCE_DATE_EPOCH"] = "1795252980"  # files carry dates, and are compared byte by byte


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a scenario and its run, which is also the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenario.toml").write_text(SCENARIO)
    assert main(["simulate", "scenario.toml", "-o", "run.csv"]) == 0
    return tmp_path


@pytest.fixture
def book(here: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same folder, with a machine book of one machine, VMC-1200, that has scenario and run."""
    monkeypatch.setenv("STEPDIAG_BOOK", str(here / "book"))
    for command in (
        ["new", "VMC-1200", "--book", "book", "--serial-number", "0815", "--limit", "20"],
        ["add", "--machine", "VMC-1200", "scenario.toml", "run.csv"],
    ):
        assert main(["book", *command]) == 0
    return here
