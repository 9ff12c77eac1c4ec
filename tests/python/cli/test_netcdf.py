"""The commands with netCDF in place of CSV: the same runs, the same calibrations."""

from pathlib import Path

import pytest
from calibrations import same_calibration, same_run

import stepdiag as sd
from stepdiag.cli import main


def test_simulate_writes_the_same_run(here: Path) -> None:
    assert main(["simulate", "scenario.toml", "-o", "run.nc"]) == 0
    assert same_run(sd.read_measurement("run.nc"), sd.read_measurement("run.csv"))


def test_evaluation_is_the_same_from_either_to_either(here: Path) -> None:
    assert main(["simulate", "scenario.toml", "-o", "run.nc"]) == 0
    found = []
    for run in ("run.csv", "run.nc"):
        for output in ("calibration.csv", "calibration.nc"):
            assert main(["evaluate", "scenario.toml", run, "-o", output]) == 0
            found.append(sd.read_calibration(output))
    assert all(calibration.date == found[0].date for calibration in found)
    # What CSV does not keep, a covariance, is not looked at.
    bare = [sd.Calibration(c.method, c.chain, c.volume, c.tool, c.functions, c.squareness) for c in found]
    assert all(same_calibration(calibration, bare[0]) for calibration in bare)


def test_netcdf_file_has_the_same_bytes_run_after_run(here: Path) -> None:
    for name in ("one.nc", "two.nc"):
        assert main(["simulate", "scenario.toml", "-o", name]) == 0
    assert Path("one.nc").read_bytes() == Path("two.nc").read_bytes()


def test_run_that_is_no_netcdf_file_is_told_in_a_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("run.nc").write_bytes(Path("run.csv").read_bytes())
    assert main(["evaluate", "scenario.toml", "run.nc", "-o", "calibration.nc"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("stepdiag: error: run.nc: expected a netCDF file")
    assert said.count("\n") == 1
    assert not Path("calibration.nc").exists()
