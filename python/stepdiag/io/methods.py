"""Methods of the extension's classes that read no other room: tables and files; attached when stepdiag is imported.

They are written in Python because the extension does not import the package. What takes time to import is imported
when one of them is called.
"""

from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

from stepdiag._core import Adjustment, Calibration, Measurement
from stepdiag.io.displays import ParameterValues
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

if TYPE_CHECKING:
    import pandas
    import xarray


def calibration_to_xarray(self: Calibration) -> "xarray.Dataset":
    """The calibration as a labelled table (xarray.Dataset)."""
    from stepdiag.io.labelled_tables import calibration_table

    return calibration_table(self).to_xarray()


def measurement_to_xarray(self: Measurement) -> "xarray.Dataset":
    """The measurement as a labelled table (xarray.Dataset)."""
    from stepdiag.io.labelled_tables import measurement_table

    return measurement_table(self).to_xarray()


def calibration_to_dataframe(self: Calibration) -> "pandas.DataFrame":
    """The calibration as a pandas.DataFrame: a row for each value, with the columns parameter, position (mm; NaN of a
    squareness), value, standard_uncertainty (mm or rad) and unit."""
    from stepdiag.io.labelled_tables import calibration_frame

    return calibration_frame(self)


def measurement_to_dataframe(self: Measurement) -> "pandas.DataFrame":
    """The measurement as a pandas.DataFrame: a row for each point, with its line, number, run, direction, commanded
    position x, y, z (mm), channels (mm, rad) and their standard uncertainties as NAME_u."""
    return measurement_to_xarray(self).to_dataframe().reset_index(drop=True)


def calibration_write(
    self: Calibration,
    path: str | PathLike[str],
    *,
    provenance: Mapping[str, str] | None = None,
    between_nodes: float | None = None,
) -> Calibration:
    """Write the calibration, CSV or netCDF (a name that ends in .nc), and return it as written, with a date.

    Reading it returns the same bits; CSV has no covariance. `provenance` and `between_nodes` (mm) replace those of the
    calibration. Raises InvalidArgument where it cannot be written, or the provenance has other keys."""
    from stepdiag.io.data_files import write_calibration

    return write_calibration(self, path, provenance=provenance, between_nodes=between_nodes)


def adjustment_write(
    self: Adjustment,
    path: str | PathLike[str],
    *,
    measurement: Measurement | None = None,
    provenance: Mapping[str, str] | None = None,
    between_nodes: float | None = None,
) -> Calibration:
    """Write the calibration as Calibration.write does; in netCDF with set-ups, residuals and test values.

    `measurement` labels the residuals with run, line, point and direction."""
    from stepdiag.io.data_files import write_calibration

    return write_calibration(self, path, measurement=measurement, provenance=provenance, between_nodes=between_nodes)


def measurement_write(self: Measurement, path: str | PathLike[str]) -> None:
    """Write the measurement, CSV or netCDF (a name that ends in .nc). Reading it returns the same bits.

    Raises InvalidArgument where it cannot be written."""
    from stepdiag.io.data_files import write_measurement

    write_measurement(self, path)


def _parameter(name: str) -> property:
    def values(self: Calibration) -> ParameterValues:
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(*error.args) from None

    return property(values, doc=f"{name}: position (mm), value and standard uncertainty (mm or rad), as of `[...]`.")


def attach() -> None:
    calibration: Any = Calibration
    calibration.to_xarray = calibration_to_xarray
    calibration.to_dataframe = calibration_to_dataframe
    calibration.write = calibration_write
    for name in (*FUNCTIONS, *SQUARENESSES):
        setattr(calibration, name, _parameter(name))
    measurement: Any = Measurement
    measurement.to_xarray = measurement_to_xarray
    measurement.to_dataframe = measurement_to_dataframe
    measurement.write = measurement_write
    adjustment: Any = Adjustment
    adjustment.write = adjustment_write
