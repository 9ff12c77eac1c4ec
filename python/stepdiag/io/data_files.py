"""Measurements and calibrations as CSV or netCDF files; the ending of the name decides."""

import os
from collections.abc import Mapping
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path

from stepdiag import _core
from stepdiag._core import Adjustment, Calibration, InvalidArgument, Measurement
from stepdiag.io.whole_files import write_by_core
from stepdiag.wrong_arguments import checked

# Imports inside functions keep programs fast that use CSV only.


def is_netcdf(path: str | PathLike[str]) -> bool:
    """Whether the name ends in .nc."""
    return os.fspath(path).lower().endswith(".nc")


@checked
def read_measurement(path: str | PathLike[str]) -> Measurement:
    """Read a measurement, CSV or netCDF (.nc).

    Raises InvalidArgument naming the file, and the line or variable."""
    from stepdiag.io.refused_files import explained

    with explained(Path(path), "measurement"):
        if not is_netcdf(path):
            return _core.read_measurement(path)
        from stepdiag.io.netcdf_read import read_measurement_netcdf

        return read_measurement_netcdf(Path(path))


@checked
def read_calibration(path: str | PathLike[str]) -> Calibration:
    """Read a calibration, CSV or netCDF (.nc).

    Raises InvalidArgument naming the file, and the line or variable."""
    if not is_netcdf(path):
        return _core.read_calibration(path)
    from stepdiag.io.netcdf_read import read_calibration_netcdf

    return read_calibration_netcdf(Path(path))


def write_measurement(measurement: Measurement, path: str | PathLike[str]) -> None:
    """Write a measurement, CSV or netCDF (.nc). Reading it returns the same bits.

    Raises InvalidArgument naming the file if it cannot be written."""
    if not is_netcdf(path):
        write_by_core(path, measurement.write_csv)
        return
    from stepdiag.io.netcdf_write import write_measurement_netcdf

    write_measurement_netcdf(measurement, Path(path), date_of_today())


def write_calibration(
    result: Calibration | Adjustment,
    path: str | PathLike[str],
    *,
    measurement: Measurement | None = None,
    provenance: Mapping[str, str] | None = None,
    between_nodes: float | None = None,
) -> Calibration:
    """Write a calibration, CSV or netCDF (.nc), and return it as written. Reading it returns the same bits.

    A calibration without a date gets the current one. CSV contains the calibration only. netCDF
    also contains the covariance and, for an Adjustment, set-ups, residuals and test values.

    Args:
        result: a Calibration, or an Adjustment.
        path: the file to write.
        measurement: labels the residuals of an adjustment with run, line, point and direction
            (netCDF).
        provenance: replaces that of the calibration; `provenance_of` makes it.
        between_nodes: replaces that of the calibration, mm; `Known.between_nodes` has it.

    Raises:
        InvalidArgument: the file cannot be written, or the provenance has other keys; names either.
    """
    calibration = result if isinstance(result, Calibration) else result.calibration
    if provenance is not None:
        calibration = calibration.with_provenance(provenance)
    if between_nodes is not None:
        calibration = calibration.with_between_nodes(between_nodes)
    dated = calibration.dated(calibration.date or date_of_today())
    if not is_netcdf(path):
        write_by_core(path, dated.write_csv)
        return dated
    from stepdiag.io.netcdf_write import write_calibration_netcdf

    made: dict[str, str | float] = {"date": dated.date, **dated.provenance}
    if dated.between_nodes is not None:
        made["between_nodes_mm"] = dated.between_nodes
    write_calibration_netcdf(result, Path(path), made, measurement)
    return dated


def date_of_today() -> str:
    """The current time, ISO 8601 in UTC, or that of SOURCE_DATE_EPOCH (seconds) if it is set."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if not epoch:
        return f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
    try:
        return f"{datetime.fromtimestamp(int(epoch), UTC):%Y-%m-%dT%H:%M:%SZ}"
    except (ValueError, OverflowError, OSError):
        raise InvalidArgument(f"SOURCE_DATE_EPOCH: expected seconds since 1970, got {epoch!r}") from None
