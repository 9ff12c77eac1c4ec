"""`to_xarray()` of the extension's classes, attached when stepdiag is imported.

They are written in Python because the extension does not import the package. xarray is slow to
import and is imported only when one of them is called.
"""

from typing import TYPE_CHECKING

from stepdiag._core import Calibration, Measurement

if TYPE_CHECKING:
    import xarray


def calibration_to_xarray(self: Calibration) -> "xarray.Dataset":
    """The calibration as a labelled table (xarray.Dataset)."""
    from stepdiag.io.labelled_tables import calibration_table

    return calibration_table(self)


def measurement_to_xarray(self: Measurement) -> "xarray.Dataset":
    """The measurement as a labelled table (xarray.Dataset)."""
    from stepdiag.io.labelled_tables import measurement_table

    return measurement_table(self)


def attach() -> None:
    Calibration.to_xarray = calibration_to_xarray  # type: ignore[method-assign]
    Measurement.to_xarray = measurement_to_xarray  # type: ignore[method-assign]
