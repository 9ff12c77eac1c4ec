"""Measurements and calibrations in files, as CSV or netCDF (.nc): the ending of the name decides."""

import os
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path

from stepdiag import _core
from stepdiag._core import Adjustment, Calibration, InvalidArgument, Measurement

# What is imported inside a function keeps those fast who read and write CSV only.


def is_netcdf(path: str | PathLike[str]) -> bool:
    """Whether the name ends in .nc."""
    return os.fspath(path).lower().endswith(".nc")


def read_measurement(path: str | PathLike[str]) -> Measurement:
    """Reads a measurement, CSV or netCDF. Raises InvalidArgument naming the file, and the line or variable."""
    if not is_netcdf(path):
        return _core.read_measurement(path)
    from stepdiag.io.netcdf_read import read_measurement_netcdf

    return read_measurement_netcdf(Path(path))


def read_calibration(path: str | PathLike[str]) -> Calibration:
    """Reads a calibration, CSV or netCDF. Raises InvalidArgument naming the file, and the line or variable."""
    if not is_netcdf(path):
        return _core.read_calibration(path)
    from stepdiag.io.netcdf_read import read_calibration_netcdf

    return read_calibration_netcdf(Path(path))


def write_measurement(measurement: Measurement, path: str | PathLike[str]) -> None:
    """Writes a measurement, CSV or netCDF, that is read back to the same bits.

    Raises InvalidArgument where it cannot be written."""
    if not is_netcdf(path):
        measurement.write(path)
        return
    from stepdiag.io.netcdf_write import write_measurement_netcdf

    write_measurement_netcdf(measurement, Path(path), date_of_today())


def write_calibration(
    result: Calibration | Adjustment, path: str | PathLike[str], *, measurement: Measurement | None = None
) -> None:
    """Writes a calibration, CSV or netCDF, that is read back to the same bits; one without a date gets today's.

    netCDF also keeps a covariance and, of an adjustment, set-ups, residuals and the rest; `measurement` then labels its
    readings. CSV keeps the calibration alone. Raises InvalidArgument where it cannot be written."""
    calibration = result if isinstance(result, Calibration) else result.calibration
    date = calibration.date or date_of_today()
    if not is_netcdf(path):
        calibration.dated(date).write(path)
        return
    from stepdiag.io.netcdf_write import write_calibration_netcdf

    write_calibration_netcdf(result, Path(path), date, measurement)


def date_of_today() -> str:
    """Date and time, ISO 8601 in UTC; those of SOURCE_DATE_EPOCH (seconds) where the environment has it."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if not epoch:
        return f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
    try:
        return f"{datetime.fromtimestamp(int(epoch), UTC):%Y-%m-%dT%H:%M:%SZ}"
    except (ValueError, OverflowError, OSError):
        raise InvalidArgument(f"SOURCE_DATE_EPOCH: expected seconds since 1970, got {epoch!r}") from None
