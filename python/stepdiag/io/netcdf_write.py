"""Self-describing netCDF files of measurements, calibrations and adjustments."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from stepdiag._core import Adjustment, Calibration, Measurement
from stepdiag.io.adjustment_table import adjustment_table
from stepdiag.io.labelled_tables import calibration_table, measurement_table
from stepdiag.io.netcdf import write_netcdf
from stepdiag.io.netcdf_read import CALIBRATION_FORMAT, MEASUREMENT_FORMAT

_OF_MEASUREMENT: Final = {
    "format": MEASUREMENT_FORMAT,
    "title": "step-diagonal measurement",
    "comment": "A mirror in the spindle of a three-axis machine tool moves along lines, in steps of one axis after the "
    "other; a laser head that is fixed in the frame of the workpiece reads its distance and tilts at every point.",
    "lines": "A line is named by the signs of travel of X, Y, Z: p, n, or 0 where the axis is not moved. Points count "
    "from 0. Local z is the direction of travel. A backward run visits the points in reverse order.",
    "positions": "x, y, z are commanded; 0 is home, the corner of the measured volume.",
    "readings": "A missing value is a lost reading. NAME_u is the standard uncertainty of a reading of NAME.",
}

_OF_CALIBRATION: Final = {
    "format": CALIBRATION_FORMAT,
    "title": "calibration of a three-axis machine tool",
    "comment": "Geometric errors of the tool relative to the workpiece, named as in ISO 230-1. What is absent is not "
    "determined; the attribute undetermined says why.",
    "functions": "Ecm is the component c (X, Y, Z: displacement along, A, B, C: rotation about X, Y, Z) of the error "
    "of axis m over its commanded position, linear between nodes. Position 0 is home, the corner of the measured "
    "volume of edges volume_mm. Functions are 0 at home, straightnesses at both ends of travel. Where "
    "slope_determined is false, only the shape is known, given with 0 at both ends.",
    "squarenesses": "C0Y, B0Z, A0Z. With them the displacement of Y along X is EXY - C0Y y, of Z along X EXZ + B0Z z, "
    "of Z along Y EYZ - A0Z z.",
    "uncertainties": "NAME_u is the standard uncertainty of NAME; missing where it is not known.",
    "chain_syntax": "from workpiece (w) to tool (t); b is the bed, a prime marks an axis that carries the workpiece",
}

_OF_REVERSAL: Final = {
    "reversals": "NAME belongs to positions approached in + direction; NAME - NAME_reversal, with the standard "
    "uncertainty NAME_negative_u, to those approached in - direction. Where constant_determined is false, only the "
    "change from home is known, given with 0 at home.",
}

_OF_ADJUSTMENT: Final = {
    "adjustment": "Least squares over all readings. Along setup lie the unknowns of each line's set-up; along reading, "
    "the rows of the measurement, residuals, redundancy numbers (0: nothing controls the reading), residuals by their "
    "own standard uncertainties and whether a reading was used; along outlier the readings that were left out, along "
    "fault all that may have been wrong with them.",
}


def write_measurement_netcdf(measurement: Measurement, path: Path, date: str) -> None:
    """Write a measurement. Raises InvalidArgument if the file cannot be written."""
    write_netcdf(measurement_table(measurement), path, _OF_MEASUREMENT | {"date": date})


def write_calibration_netcdf(
    result: Calibration | Adjustment,
    path: Path,
    made: Mapping[str, str | float],
    measurement: Measurement | None = None,
) -> None:
    """Write a calibration, or an adjustment with all its results. `made`: attributes that say when and from what, and
    what was stated.

    Raises InvalidArgument if the file cannot be written."""
    attributes: dict[str, Any] = {**_OF_CALIBRATION, **made}
    if isinstance(result, Calibration):
        table = calibration_table(result)
    else:
        table, attributes = adjustment_table(result, measurement), attributes | _OF_ADJUSTMENT
    if any(name.endswith("_reversal") for name in table.variables):
        attributes |= _OF_REVERSAL
    write_netcdf(table, path, attributes)
