"""Measurements and calibrations as labelled tables, in native units: mm, rad."""

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from stepdiag._core import Calibration, Measurement
from stepdiag.calibration.functional_point import functional_point_straightness
from stepdiag.findings.meaning import unverified_key
from stepdiag.io.labelled import LabelledTable
from stepdiag.parameters import COMPONENT_MEANING, units_of

if TYPE_CHECKING:
    import pandas as pd

_SQUARENESS = {"C0Y": "squareness of Y to X", "B0Z": "squareness of Z to X", "A0Z": "squareness of Z to Y"}
_CHANNEL = {
    "distance": ("mm", "distance from reference plane to mirror"),
    "alpha": ("rad", "tilt of the mirror about local x"),
    "beta": ("rad", "tilt of the mirror about local y"),
    "spot_x": ("mm", "spot position along local x"),
    "spot_y": ("mm", "spot position along local y"),
    "time": ("s", "time of the reading"),
    "temperature": ("degC", "temperature of the scales"),
    "temperature_x": ("degC", "temperature of the scale of X"),
    "temperature_y": ("degC", "temperature of the scale of Y"),
    "temperature_z": ("degC", "temperature of the scale of Z"),
    "air_temperature": ("degC", "temperature of the air"),
    "air_pressure": ("Pa", "pressure of the air"),
    "air_humidity": ("1", "relative humidity of the air"),
}


def measurement_table(measurement: Measurement) -> LabelledTable:
    """A measurement along the dimension `reading`; lost readings are NaN.

    Coordinates are line, point, run, direction, and the commanded position x, y, z (mm). Variables
    are the channels, and their standard uncertainties as NAME_u if the measurement has them."""
    coordinates: dict[str, Any] = {
        "line": ("reading", np.asarray(measurement.line, dtype=str), {"long_name": "measurement line"}),
        "point": ("reading", measurement.point, {"long_name": "point number on the line"}),
        "run": ("reading", measurement.run, {"long_name": "run"}),
        "direction": (
            "reading",
            np.asarray(measurement.direction, dtype=str),
            {"long_name": "direction of travel"},
        ),
    }
    for column, axis in enumerate("xyz"):
        attributes = {"units": "mm", "long_name": f"commanded position of {axis.upper()}"}
        coordinates[axis] = ("reading", measurement.position[:, column], attributes)
    variables: dict[str, Any] = {}
    for name, value in measurement.channels.items():
        units = channel_units(name)
        meaning = _CHANNEL[name][1] if name in _CHANNEL else f"distance of beam {name[1:]}"
        variables[name] = ("reading", value, {"units": units, "long_name": meaning})
    for name, value in measurement.standard_uncertainty.items():
        variables[f"{name}_u"] = ("reading", value, _uncertainty_of(variables[name][2]))
    return LabelledTable(variables, coordinates, {"title": "step-diagonal measurement"})


def calibration_frame(calibration: Calibration) -> "pd.DataFrame":
    """A row for each value of a calibration: parameter, position, value, standard_uncertainty, unit."""
    import pandas as pd

    parts = []
    for name in calibration:
        position, value, uncertainty = calibration[name]
        parts.append(
            pd.DataFrame(
                {
                    "parameter": name,
                    "position": np.atleast_1d(np.nan if position is None else position),
                    "value": np.atleast_1d(value),
                    "standard_uncertainty": np.atleast_1d(uncertainty),
                    "unit": units_of(name.removesuffix("_reversal")),
                }
            )
        )
    return pd.concat(parts, ignore_index=True)


def position_axis(coordinates: dict[str, Any], name: str, position: Any) -> str:
    """The dimension of a function's positions, put into the coordinates: that of its machine axis, or its own."""
    axis = name[2].lower()
    if axis in coordinates and not np.array_equal(coordinates[axis][1], position):
        axis = f"{axis}_{name}"
    coordinates[axis] = (axis, position, {"units": "mm", "long_name": f"position of {name[2]}"})
    return axis


def calibration_table(calibration: Calibration) -> LabelledTable:
    """The determined parameters by name, each with its standard uncertainty as NAME_u.

    Functions have the dimension x, y or z, the position of their axis (mm). A function with other
    nodes has a dimension of its own, such as x_EXX. Squarenesses are scalars. If reversal errors
    are known, functions belong to the + direction. Those of the - direction are smaller by
    NAME_reversal and have the standard uncertainty NAME_negative_u. NAME_functional_point is the
    straightness of the functional point, if it differs from the table's. A full covariance has the
    dimensions entry and entry_2, labelled by covariance_parameter and covariance_position.
    Undetermined parameters are absent; the attributes list them."""
    coordinates: dict[str, Any] = {}
    variables: dict[str, Any] = {}

    for name, (position, value, uncertainty) in sorted(calibration.functions.items(), key=lambda item: _order(item[0])):
        axis = position_axis(coordinates, name, position)
        attributes = {
            "units": units_of(name),
            "long_name": f"{COMPONENT_MEANING[name[1]]} of axis {name[2]}",
            "slope_determined": str(name not in calibration.undetermined_slopes).lower(),
        }
        variables[name] = (axis, value, attributes)
        variables[f"{name}_u"] = (axis, uncertainty, _uncertainty_of(attributes))
    for name, (position, value, uncertainty) in sorted(calibration.reversal.items(), key=lambda item: _order(item[0])):
        axis = position_axis(coordinates, f"{name}_reversal", position)
        attributes = {
            "units": units_of(name),
            "long_name": f"reversal error of the {COMPONENT_MEANING[name[1]]} of axis {name[2]}",
            "constant_determined": str(name not in calibration.undetermined_reversal_constants).lower(),
        }
        variables[f"{name}_reversal"] = (axis, value, attributes)
        variables[f"{name}_reversal_u"] = (axis, uncertainty, _uncertainty_of(attributes))
        negative = calibration.negative_functions.get(name)  # None without NAME
        if negative is not None:
            variables[f"{name}_negative_u"] = (
                axis,
                negative[2],
                _uncertainty_of(attributes | {"long_name": f"{name} approached in - direction"}),
            )
    for name, (_, value, uncertainty) in functional_point_straightness(calibration).items():
        moved = f"{COMPONENT_MEANING[name[1]]} of the functional point, moved by {name[2]} alone"
        attributes = {"units": "mm", "long_name": moved}
        axis = variables[name][0]
        variables[f"{name}_functional_point"] = (axis, value, attributes)
        variables[f"{name}_functional_point_u"] = (axis, uncertainty, _uncertainty_of(attributes))
    for name, (angle, angle_uncertainty) in calibration.squareness.items():
        attributes = {"units": "rad", "long_name": _SQUARENESS[name]}
        variables[name] = ((), angle, attributes)
        variables[f"{name}_u"] = ((), angle_uncertainty, _uncertainty_of(attributes))
    variables |= _covariance(calibration)
    return LabelledTable(variables, coordinates, _attributes(calibration))


def _attributes(calibration: Calibration) -> dict[str, Any]:
    """Verdict and conditions, what it was made from, and for which machine. What is not stated is absent."""
    stated = {
        "fit": calibration.fit,
        "variance_factor": calibration.variance_factor,
        "uncertainty_scaled": calibration.uncertainty_scaled,
        "between_nodes_mm": calibration.between_nodes,
        "temperature_reference_c": calibration.temperature_reference,
    }
    attributes: dict[str, Any] = {name: value for name, value in stated.items() if value is not None}
    if calibration.temperature_reference is None and calibration.temperature_as_found is not None:
        attributes["temperature_as_found_c"] = calibration.temperature_as_found
    if calibration.expansion is not None:
        attributes["expansion_per_k"] = calibration.expansion
        attributes["fixed_point_mm"] = calibration.fixed_point
    return {
        **attributes,
        "fit_codes": " ".join(calibration.fit_codes),
        "fit_reasons": "\n".join(calibration.fit_reasons),
        "unseen_faults": "\n".join(calibration.unseen_faults),
        "conditions": "\n".join(calibration.conditions),
        "budget": calibration.budget,
        **unverified_key(calibration),
        **calibration.provenance,
        "title": "calibration of a three-axis machine",
        "method": calibration.method,
        "date": calibration.date,
        "chain": calibration.chain.name,
        "volume_mm": calibration.volume,
        "tool_mm": calibration.tool,
        "straightness_reference": calibration.straightness_reference,
        "undetermined": "\n".join(calibration.undetermined),
    }


def channel_units(name: str) -> str | None:
    """The native unit of a measurement's channel; None if there is no such channel."""
    return _CHANNEL[name][0] if name in _CHANNEL else "mm" if re.fullmatch(r"d[1-9][0-9]*", name) else None


def _order(function: str) -> tuple[int, int]:
    """Sort key: axis by axis, displacements before rotations."""
    return "XYZ".index(function[2]), "XYZABC".index(function[1])


def _covariance(calibration: Calibration) -> dict[str, Any]:
    covariance = calibration.covariance
    if covariance is None:
        return {}
    labels = calibration.covariance_labels
    names = [name for name, _ in labels]
    positions = [np.nan if position is None else position for _, position in labels]
    return {
        "covariance_parameter": ("entry", np.asarray(names, dtype=str), {"long_name": "parameter of a row or column"}),
        "covariance_position": (
            "entry",
            np.asarray(positions),
            {"units": "mm", "long_name": "position of a row or column; missing for a squareness"},
        ),
        "covariance": (
            ("entry", "entry_2"),
            covariance,
            {
                "long_name": "covariance of all values",
                "comment": "of two values in the units of their parameters, mm or rad; rows and columns in one order, "
                "that of covariance_parameter and covariance_position",
            },
        ),
    }


def _uncertainty_of(attributes: dict[str, str]) -> dict[str, str]:
    return {"units": attributes["units"], "long_name": f"standard uncertainty of {attributes['long_name']}"}
