"""An adjustment as a labelled table: its calibration's, and how set-ups and readings fit."""

from typing import Any

import numpy as np
import xarray as xr

from stepdiag._core import Adjustment, FaultClass, Measurement, Outlier, SetupEstimate
from stepdiag.calibration.finding_text import combination_text
from stepdiag.io.labelled_tables import calibration_table, channel_units
from stepdiag.setup_quantities import SETUP_QUANTITIES


def adjustment_table(adjustment: Adjustment, measurement: Measurement | None = None) -> xr.Dataset:
    """The table of the calibration, with unknowns of the set-up along `setup`, readings left out along
    `outlier` and all that may be a fault along `fault`.

    Along `reading`, the rows of the measurement, lie CHANNEL_residual, CHANNEL_redundancy, CHANNEL_normalised_residual
    and CHANNEL_used; given the measurement, reading_run, reading_line, reading_point and reading_direction label them.
    Test values are scalars; combinations and the smoothness in force are attributes."""
    table = calibration_table(adjustment.calibration)
    for name, deviation in adjustment.smoothness.items():
        if name in table:
            table[name].attrs["second_difference_deviation"] = deviation
    variables = _test_values(adjustment) | _readings(adjustment)
    if measurement is not None and adjustment.residuals:
        variables |= _labels(measurement)
    if adjustment.setup:
        variables |= _setup(adjustment.setup)
    if adjustment.outliers:
        variables |= _outliers(adjustment.outliers)
    if adjustment.faults:
        variables |= _faults(adjustment.faults)
    return table.assign(variables).assign_attrs(combinations="\n".join(map(combination_text, adjustment.combinations)))


def _test_values(adjustment: Adjustment) -> dict[str, Any]:
    square_sum = "weighted square sum of residuals and priors"
    return {
        "weighted_square_sum": ((), adjustment.weighted_square_sum, {"units": "1", "long_name": square_sum}),
        "degrees_of_freedom": ((), adjustment.degrees_of_freedom, {"long_name": "degrees of freedom"}),
        "variance_factor": (
            (),
            adjustment.variance_factor,
            {
                "units": "1",
                "long_name": f"{square_sum}, by the degrees of freedom",
                "comment": "1 is expected; the standard uncertainties of this file are multiplied by its root only "
                "where the attribute uncertainty_scaled says so",
            },
        ),
        "chi_square_probability": (
            (),
            adjustment.chi_square_probability,
            {"units": "1", "long_name": "probability of a larger square sum, if model and uncertainties are right"},
        ),
        "iterations": ((), adjustment.iterations, {"long_name": "Gauss-Newton steps from zero"}),
    }


def _readings(adjustment: Adjustment) -> dict[str, Any]:
    variables: dict[str, Any] = {}
    redundancy, normalised, used = adjustment.redundancy, adjustment.normalised_residuals, adjustment.used
    for name, residual in adjustment.residuals.items():
        units = channel_units(name)
        variables |= {
            f"{name}_residual": ("reading", residual, {"units": units, "long_name": f"{name}, read minus adjusted"}),
            f"{name}_redundancy": (
                "reading",
                redundancy[name],
                {"units": "1", "long_name": f"redundancy of {name}", "comment": "0: nothing controls the reading"},
            ),
            f"{name}_normalised_residual": (
                "reading",
                normalised[name],
                {"units": "1", "long_name": f"residual of {name} by its own standard uncertainty"},
            ),
            f"{name}_used": (
                "reading",
                used[name].astype(np.int8),
                {
                    "long_name": f"whether the reading of {name} was used",
                    "flag_values": np.array([0, 1], dtype=np.int8),
                    "flag_meanings": "lost_or_outlier used",
                },
            ),
        }
    return variables


def _labels(measurement: Measurement) -> dict[str, Any]:
    return {
        "reading_run": ("reading", measurement.run, {"long_name": "run of the reading"}),
        "reading_line": ("reading", np.asarray(measurement.line, dtype=str), {"long_name": "line of the reading"}),
        "reading_point": ("reading", measurement.point, {"long_name": "point of the reading on its line"}),
        "reading_direction": (
            "reading",
            np.asarray(measurement.direction, dtype=str),
            {"long_name": "direction of travel"},
        ),
    }


def _setup(setup: list[SetupEstimate]) -> dict[str, Any]:
    own_units = "in setup_units"
    values = [np.nan if unknown.value is None else unknown.value for unknown in setup]
    return {
        "setup_run": ("setup", [unknown.run for unknown in setup], {"long_name": "first run that has this set-up"}),
        "setup_line": ("setup", np.array([unknown.line for unknown in setup]), {"long_name": "line of the set-up"}),
        "setup_quantity": (
            "setup",
            np.array([unknown.quantity for unknown in setup]),
            {"long_name": "what is unknown"},
        ),
        "setup_component": (
            "setup",
            [unknown.component for unknown in setup],
            {
                "long_name": "component",
                "comment": "0 or 1 of pairs, along or about local x, y; of beams: 1 for d2, ...",
            },
        ),
        "setup_units": (
            "setup",
            np.array([SETUP_QUANTITIES[unknown.quantity].unit for unknown in setup]),
            {"long_name": "units of value, standard uncertainty and prior"},
        ),
        "setup_value": (
            "setup",
            np.array(values),
            {"long_name": "value found", "comment": f"{own_units}; missing where it is not determined"},
        ),
        "setup_u": (
            "setup",
            np.array([unknown.standard_uncertainty for unknown in setup]),
            {"long_name": "standard uncertainty of the value found", "comment": own_units},
        ),
        "setup_prior": (
            "setup",
            np.array([unknown.prior for unknown in setup]),
            {
                "long_name": "standard uncertainty with which it was known to be 0",
                "comment": f"{own_units}; infinite: free, 0: fixed at 0; "
                "a free lateral offset, roll or gain has 1 m, 1 rad, 1",
            },
        ),
    }


def _outliers(outliers: list[Outlier]) -> dict[str, Any]:
    return {
        "outlier_row": (
            "outlier",
            [outlier.row for outlier in outliers],
            {"long_name": "row of the measurement, from 0"},
        ),
        "outlier_number": (
            "outlier",
            [outlier.number for outlier in outliers],
            {"long_name": "number of its class of faults", "comment": "from 1"},
        ),
        "outlier_run": ("outlier", [outlier.run for outlier in outliers], {"long_name": "run"}),
        "outlier_line": ("outlier", np.array([outlier.line for outlier in outliers]), {"long_name": "line"}),
        "outlier_point": ("outlier", [outlier.point for outlier in outliers], {"long_name": "point on its line"}),
        "outlier_channel": ("outlier", np.array([outlier.channel for outlier in outliers]), {"long_name": "channel"}),
        "outlier_residual": (
            "outlier",
            np.array([outlier.residual for outlier in outliers]),
            {"long_name": "read minus adjusted", "comment": "mm or rad, as the channel"},
        ),
        "outlier_normalised_residual": (
            "outlier",
            np.array([outlier.normalised for outlier in outliers]),
            {"units": "1", "long_name": "residual by its own standard uncertainty"},
        ),
    }


def _faults(faults: list[FaultClass]) -> dict[str, Any]:
    number, treatment, members = zip(
        *((k, found.treatment, fault) for k, found in enumerate(faults, 1) for fault in found.members), strict=True
    )
    own_units = "mm or rad, as the channel"
    return {
        "fault_class": (
            "fault",
            list(number),
            {
                "long_name": "number of its class",
                "comment": "from 1; the readings do not tell which of a class happened",
            },
        ),
        "fault_treatment": ("fault", np.array(treatment), {"long_name": "what was done about its class"}),
        "fault_kind": (
            "fault",
            np.array([fault.kind for fault in members]),
            {"long_name": "kind", "comment": "slip: an offset of the channel from this reading of the line on"},
        ),
        "fault_row": ("fault", [fault.row for fault in members], {"long_name": "row of the measurement, from 0"}),
        "fault_run": ("fault", [fault.run for fault in members], {"long_name": "run"}),
        "fault_line": ("fault", np.array([fault.line for fault in members]), {"long_name": "line"}),
        "fault_point": ("fault", [fault.point for fault in members], {"long_name": "point on its line"}),
        "fault_channel": ("fault", np.array([fault.channel for fault in members]), {"long_name": "channel"}),
        "fault_size": (
            "fault",
            np.array([fault.size for fault in members]),
            {"long_name": "what was read too much, were it this one", "comment": own_units},
        ),
        "fault_u": (
            "fault",
            np.array([fault.standard_uncertainty for fault in members]),
            {"long_name": "standard uncertainty of the size", "comment": own_units},
        ),
        "fault_chi_square_gain": (
            "fault",
            np.array([fault.chi_square_gain for fault in members]),
            {"units": "1", "long_name": "what it takes off chi-square"},
        ),
    }
