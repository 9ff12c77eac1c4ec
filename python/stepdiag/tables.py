"""Runs and calibrations as labelled tables (xarray). Units are native and said: mm, rad."""

from typing import Any

import numpy as np
import xarray as xr

from stepdiag._core import Calibration, Measurement

_COMPONENT = {
    "X": "displacement along X",
    "Y": "displacement along Y",
    "Z": "displacement along Z",
    "A": "rotation about X",
    "B": "rotation about Y",
    "C": "rotation about Z",
}
_SQUARENESS = {"C0Y": "squareness of Y to X", "B0Z": "squareness of Z to X", "A0Z": "squareness of Z to Y"}
_CHANNEL = {
    "distance": ("mm", "distance from reference plane to mirror"),
    "alpha": ("rad", "tilt of the mirror about local x"),
    "beta": ("rad", "tilt of the mirror about local y"),
    "spot_x": ("mm", "spot position along local x"),
    "spot_y": ("mm", "spot position along local y"),
    "time": ("s", "time of the reading"),
    "temperature": ("degC", "temperature"),
}


def measurement_table(measurement: Measurement) -> xr.Dataset:
    """One row per reading along the dimension `reading`; lost readings are NaN.

    Coordinates: line, point, run, direction, and the commanded position x, y, z (mm). Variables: the channels,
    and their standard uncertainties as NAME_u where the run gives them."""
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
        units, meaning = _CHANNEL.get(name, ("mm", f"distance of beam {name[1:]}"))
        variables[name] = ("reading", value, {"units": units, "long_name": meaning})
    for name, value in measurement.standard_uncertainty.items():
        variables[f"{name}_u"] = ("reading", value, _uncertainty_of(variables[name][2]))
    return xr.Dataset(variables, coordinates, {"title": "step-diagonal measurement"})


def calibration_table(calibration: Calibration) -> xr.Dataset:
    """The determined parameters by name, each with its standard uncertainty as NAME_u.

    Functions lie over the position x, y or z (mm) of their axis; one whose nodes differ from those of its
    axis has a dimension of its own (x_EXX). Squarenesses are scalars. Where backward runs tell reversal errors,
    functions are those of the + direction; those of the - direction are less by NAME_reversal, and NAME_negative_u is
    their uncertainty. What is not determined is absent, and the attributes say so."""
    coordinates: dict[str, Any] = {}
    variables: dict[str, Any] = {}

    def dimension(name: str, position: Any) -> str:
        axis = name[2].lower()
        if axis in coordinates and not np.array_equal(coordinates[axis][1], position):
            axis = f"{axis}_{name}"
        coordinates[axis] = (axis, position, {"units": "mm", "long_name": f"position of {name[2]}"})
        return axis

    for name, (position, value, uncertainty) in calibration.functions.items():
        axis = dimension(name, position)
        attributes = {
            "units": "rad" if name[1] in "ABC" else "mm",
            "long_name": f"{_COMPONENT[name[1]]} of axis {name[2]}",
            "slope_determined": str(name not in calibration.undetermined_slopes).lower(),
        }
        variables[name] = (axis, value, attributes)
        variables[f"{name}_u"] = (axis, uncertainty, _uncertainty_of(attributes))
    for name, (position, value, uncertainty) in calibration.reversal.items():
        axis = dimension(f"{name}_reversal", position)
        attributes = {
            "units": "rad" if name[1] in "ABC" else "mm",
            "long_name": f"reversal error of the {_COMPONENT[name[1]]} of axis {name[2]}",
            "constant_determined": str(name not in calibration.undetermined_reversal_constants).lower(),
        }
        variables[f"{name}_reversal"] = (axis, value, attributes)
        variables[f"{name}_reversal_u"] = (axis, uncertainty, _uncertainty_of(attributes))
        negative = calibration.negative_functions.get(name)  # none without the function itself
        if negative is not None:
            variables[f"{name}_negative_u"] = (
                axis,
                negative[2],
                _uncertainty_of(attributes | {"long_name": f"{name} approached in - direction"}),
            )
    for name, (angle, angle_uncertainty) in calibration.squareness.items():
        attributes = {"units": "rad", "long_name": _SQUARENESS[name]}
        variables[name] = ((), angle, attributes)
        variables[f"{name}_u"] = ((), angle_uncertainty, _uncertainty_of(attributes))
    return xr.Dataset(
        variables,
        coordinates,
        {
            "title": "calibration of a three-axis machine",
            "method": calibration.method,
            "chain": calibration.chain.name,
            "volume_mm": calibration.volume,
            "tool_mm": calibration.tool,
            "undetermined": "\n".join(calibration.undetermined),
        },
    )


def _uncertainty_of(attributes: dict[str, str]) -> dict[str, str]:
    return {"units": attributes["units"], "long_name": f"standard uncertainty of {attributes['long_name']}"}
