"""An adjustment as a labelled table: its calibration's, and how set-ups and readings fit."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from stepdiag._core import Adjustment, FaultClass, Measurement, Outlier, SetupEstimate
from stepdiag.findings.undetermined import combination_text
from stepdiag.io.labelled import LabelledTable
from stepdiag.io.labelled_tables import calibration_table, channel_units
from stepdiag.setup_quantities import SETUP_QUANTITIES


def adjustment_table(adjustment: Adjustment, measurement: Measurement | None = None) -> LabelledTable:
    """The table of the calibration, with unknowns of the set-up along `setup`, readings left out along
    `outlier` and all that may be a fault along `fault`.

    Along `reading`, the rows of the measurement, lie CHANNEL_residual, CHANNEL_redundancy, CHANNEL_normalised_residual
    and CHANNEL_used; given the measurement, reading_run, reading_line, reading_point and reading_direction label them.
    Test values are scalars; combinations and the smoothness in force are attributes."""
    table = calibration_table(adjustment.calibration)
    for name, deviation in adjustment.smoothness.items():
        if name in table.variables:
            table.variables[name].attrs["second_difference_deviation"] = deviation
    variables = _test_values(adjustment) | _readings(adjustment)
    if measurement is not None and adjustment.residuals:
        variables |= _labels(measurement)
    if adjustment.setup:
        variables |= _setup(adjustment.setup)
    if adjustment.outliers:
        variables |= _outliers(adjustment.outliers)
    if adjustment.faults:
        variables |= _faults(adjustment.faults)
    table.add(variables)
    table.attrs["combinations"] = "\n".join(map(combination_text, adjustment.combinations))
    return table


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
    return _columns(
        "reading",
        {
            "run": (measurement.run, "run of the reading"),
            "line": (measurement.line, "line of the reading"),
            "point": (measurement.point, "point of the reading on its line"),
            "direction": (measurement.direction, "direction of travel"),
        },
    )


def _setup(setup: list[SetupEstimate]) -> dict[str, Any]:
    own_units = "in setup_units"
    return _columns(
        "setup",
        {
            "run": ([one.run for one in setup], "first run that has this set-up"),
            "line": ([one.line for one in setup], "line of the set-up"),
            "quantity": ([one.quantity for one in setup], "what is unknown"),
            "component": (
                [one.component for one in setup],
                "component",
                {"comment": "0 or 1 of pairs, along or about local x, y; of beams: 1 for d2, ..."},
            ),
            "units": (
                [SETUP_QUANTITIES[one.quantity].unit for one in setup],
                "units of value, standard uncertainty and prior",
            ),
            "value": (
                [np.nan if one.value is None else one.value for one in setup],
                "value found",
                {"comment": f"{own_units}; missing where it is not determined"},
            ),
            "u": (
                [one.standard_uncertainty for one in setup],
                "standard uncertainty of the value found",
                {"comment": own_units},
            ),
            "prior": (
                [one.prior for one in setup],
                "standard uncertainty with which it was known to be 0",
                {
                    "comment": f"{own_units}; infinite: free, 0: fixed at 0; "
                    "a free lateral offset, roll or gain has 1 m, 1 rad, 1"
                },
            ),
        },
    )


def _outliers(outliers: list[Outlier]) -> dict[str, Any]:
    return _columns(
        "outlier",
        {
            "row": ([one.row for one in outliers], "row of the measurement, from 0"),
            "number": ([one.number for one in outliers], "number of its class of faults", {"comment": "from 1"}),
            "run": ([one.run for one in outliers], "run"),
            "line": ([one.line for one in outliers], "line"),
            "point": ([one.point for one in outliers], "point on its line"),
            "channel": ([one.channel for one in outliers], "channel"),
            "residual": (
                [one.residual for one in outliers],
                "read minus adjusted",
                {"comment": "mm or rad, as the channel"},
            ),
            "normalised_residual": (
                [one.normalised for one in outliers],
                "residual by its own standard uncertainty",
                {"units": "1"},
            ),
        },
    )


def _faults(faults: list[FaultClass]) -> dict[str, Any]:
    number, treatment, members = zip(
        *((k, found.treatment, fault) for k, found in enumerate(faults, 1) for fault in found.members), strict=True
    )
    own_units = {"comment": "mm or rad, as the channel"}
    return _columns(
        "fault",
        {
            "class": (
                number,
                "number of its class",
                {"comment": "from 1; the readings do not determine which of a class happened"},
            ),
            "treatment": (treatment, "what was done about its class"),
            "kind": (
                [fault.kind for fault in members],
                "kind",
                {"comment": "slip: an offset of the channel from this reading of the line on; factor: all of the line"},
            ),
            "row": ([fault.row for fault in members], "row of the measurement, from 0"),
            "run": ([fault.run for fault in members], "run"),
            "line": ([fault.line for fault in members], "line"),
            "point": ([fault.point for fault in members], "point on its line"),
            "channel": ([fault.channel for fault in members], "channel"),
            "size": ([fault.size for fault in members], "what was read too much, were it this one", own_units),
            "u": ([fault.standard_uncertainty for fault in members], "standard uncertainty of the size", own_units),
            "chi_square_gain": (
                [fault.chi_square_gain for fault in members],
                "what it takes off chi-square",
                {"units": "1"},
            ),
        },
    )


def _columns(dimension: str, columns: Mapping[str, tuple[Any, ...]]) -> dict[str, Any]:
    """Variables DIMENSION_NAME of columns NAME: values, long name and, if there are any, more attributes."""
    variables = {}
    for name, (values, long_name, *attributes) in columns.items():
        variables[f"{dimension}_{name}"] = (
            dimension,
            np.asarray(values),
            {**dict(*attributes), "long_name": long_name},
        )
    return variables
