"""Files by their ending, and their dates."""

from pathlib import Path

import pytest
from calibrations import calibrate, same_calibration, same_run, simulate

import stepdiag as sd


def test_ending_decides_between_csv_and_netcdf(tmp_path: Path) -> None:
    run, calibration = simulate(1), calibrate(1)
    for name, begins in (("file.csv", b"line,point"), ("file.NC", b"\x89HDF"), ("file", b"line,point")):
        run.write(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(begins)
        assert same_run(sd.read_measurement(str(tmp_path / name)), run)
    calibration.write(tmp_path / "file.csv")
    assert same_calibration(sd.read_calibration(tmp_path / "file.csv"), calibration)


@pytest.mark.parametrize("ending", ["nc", "csv"])
def test_date_is_that_of_the_environment_and_then_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    calibration = calibrate(1)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86399")
    calibration.write(tmp_path / f"one.{ending}")
    read = sd.read_calibration(tmp_path / f"one.{ending}")
    assert read.date == "1970-01-01T23:59:59Z"
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    read.write(tmp_path / f"two.{ending}")
    assert sd.read_calibration(tmp_path / f"two.{ending}").date == read.date
    assert (tmp_path / f"one.{ending}").read_bytes() == (tmp_path / f"two.{ending}").read_bytes()
    calibration.write(tmp_path / f"now.{ending}")
    assert sd.read_calibration(tmp_path / f"now.{ending}").date > "2026"


@pytest.mark.parametrize("epoch", ["yesterday", "1e9", "9" * 30])
def test_date_of_the_environment_that_is_none_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, epoch: str
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    with pytest.raises(sd.InvalidArgument, match="SOURCE_DATE_EPOCH"):
        calibrate(1).write(tmp_path / "calibration.csv")
