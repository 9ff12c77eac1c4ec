"""What the tests of this folder share."""

from pathlib import Path

import pytest
from verified import CALIBRATED, TESTED

from stepdiag.cli import main


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A calibration, and a run of two of its lines in larger steps."""
    monkeypatch.chdir(tmp_path)
    Path("calibrated.toml").write_text(CALIBRATED)
    Path("tested.toml").write_text(TESTED)
    assert main(["simulate", "calibrated.toml", "-o", "run.csv"]) == 0
    assert main(["evaluate", "calibrated.toml", "run.csv", "-o", "calibration.nc"]) == 0
    assert main(["simulate", "tested.toml", "-o", "new.csv"]) == 0
    return tmp_path
