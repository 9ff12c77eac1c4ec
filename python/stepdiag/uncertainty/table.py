"""The result of an uncertainty evaluation as a labelled table (xarray), and the columns of its CSV.

Units of the table are mm and rad.
"""

import math
import string
from typing import Any, Final

import numpy as np
import xarray as xr

from stepdiag.io.labelled_tables import position_axis
from stepdiag.uncertainty.result import UNCERTAINTY_FORMAT, FloatArray, UncertaintyResult, label, volume_units
from stepdiag.wrong_arguments import checked

ABOUT: Final = {
    "format": UNCERTAINTY_FORMAT,
    "title": "uncertainty of a calibration, by virtual calibrations",
    "comment": "Geometric errors of the tool relative to the workpiece, named as in ISO 230-1, as calibrations of one "
    "machine would find them: drawn inputs, traced readings, evaluation.",
    "uncertainties": "NAME is the mean of the samples, NAME_u their standard deviation, NAME_low and NAME_high the "
    "ends of the probabilistically symmetric coverage interval, NAME_shortest_low and NAME_shortest_high those of the "
    "shortest one (JCGM 101). NAME_propagated is the value without deviations, NAME_propagated_u its standard "
    "uncertainty by the law of propagation (GUM), NAME_propagated_expanded its expanded uncertainty, NAME_freedom its "
    "effective degrees of freedom.",
    "entries": "Along output lie all outputs in one order: output_name, output_position, output_units. budget is the "
    "standard uncertainty that each group of inputs alone makes.",
}

# Ending of a variable's name, meaning, unit (None: that of the output), and values of all outputs.
Column = tuple[str, str, str | None, FloatArray]


@checked
def uncertainty_table(result: UncertaintyResult) -> xr.Dataset:
    """The result as a labelled table (xarray), in native units: mm, rad.

    Functions have the dimension x, y or z (mm), squarenesses are scalars, derived quantities have
    the dimension `derived`. Budget, covariance and kept samples have the dimension `output`, which
    contains all outputs."""
    coordinates: dict[str, Any] = {}
    variables: dict[str, Any] = {}
    columns = columns_of(result)
    for name, rows in _functions(result).items():
        first = result.outputs[rows[0]]
        dimensions: tuple[str, ...] = ()
        if not math.isnan(first.position):
            dimensions = (position_axis(coordinates, name, result.positions[rows]),)
        for ending, meaning, unit, values in columns:
            value = values[rows] if dimensions else values[rows[0]]
            attributes = {"units": unit or first.unit, "long_name": f"{meaning} of {name}"}
            variables[f"{name}{ending}"] = (dimensions, value, attributes)
    variables |= _derived(result, columns) | _outputs(result)
    for part in (_validation, _budget, _monte_carlo, _joint, _volume):
        variables |= part(result)
    return xr.Dataset(variables, coordinates, attributes_of(result))


def _functions(result: UncertaintyResult) -> dict[str, list[int]]:
    """Indices of the outputs of each parameter, in the order of the outputs."""
    rows: dict[str, list[int]] = {}
    for k, output in enumerate(result.outputs[: result.entries]):
        rows.setdefault(output.name, []).append(k)
    return rows


def columns_of(result: UncertaintyResult) -> list[Column]:
    columns: list[Column] = []
    found, other = result.monte_carlo, result.propagation
    if found is not None:
        symmetric, shortest = np.asarray(found.symmetric), np.asarray(found.shortest)
        columns += [
            ("", "mean", None, np.asarray(found.mean)),
            ("_u", "standard uncertainty", None, np.asarray(found.standard_uncertainty)),
            ("_low", "lower end of the symmetric coverage interval", None, symmetric[:, 0]),
            ("_high", "upper end of the symmetric coverage interval", None, symmetric[:, 1]),
            ("_shortest_low", "lower end of the shortest coverage interval", None, shortest[:, 0]),
            ("_shortest_high", "upper end of the shortest coverage interval", None, shortest[:, 1]),
        ]
    if other is not None:
        columns += [
            ("_propagated", "value without deviations", None, np.asarray(other.value)),
            ("_propagated_u", "propagated standard uncertainty", None, np.asarray(other.standard_uncertainty)),
            (
                "_propagated_expanded",
                "propagated expanded uncertainty",
                None,
                np.asarray(other.expanded(result.coverage)),
            ),
            ("_freedom", "effective degrees of freedom", "1", np.asarray(other.degrees_of_freedom)),
        ]
    if result.comparison is not None:
        both = result.comparison
        columns += [
            ("_tolerance", "numerical tolerance (JCGM 101, 7.9.2)", None, np.asarray(both.delta)),
            ("_d_low", "difference of the lower ends, y - U less the interval's, without sign", None, both.d_low),
            ("_d_high", "difference of the upper ends, y + U less the interval's, without sign", None, both.d_high),
        ]
    return columns


def _derived(result: UncertaintyResult, columns: list[Column]) -> dict[str, Any]:
    rows = slice(result.entries, len(result.outputs))
    derived = result.outputs[rows]
    if not derived:
        return {}
    along = "derived"
    variables: dict[str, Any] = {
        "derived_name": (along, np.array([label(o) for o in derived]), {"long_name": "derived quantity"}),
        "derived_units": (along, np.array([o.unit for o in derived]), {"long_name": "its units"}),
    }
    for ending, meaning, _, values in columns:
        comment = {"comment": "in derived_units"} if ending != "_freedom" else {"units": "1"}
        variables[f"derived{ending or '_mean'}"] = (
            along,
            values[rows],
            {"long_name": f"{meaning} of a derived quantity"} | comment,
        )
    return variables


def _outputs(result: UncertaintyResult) -> dict[str, Any]:
    names, units = (np.array([getattr(o, what) for o in result.outputs]) for what in ("name", "unit"))
    where = {"units": "mm", "long_name": "position of an output; missing where it has none"}
    return {
        "output_name": ("output", names, {"long_name": "parameter or derived quantity"}),
        "output_position": ("output", result.positions, where),
        "output_units": ("output", units, {"long_name": "units of an output"}),
    }


def _validation(result: UncertaintyResult) -> dict[str, Any]:
    found = result.comparison
    if found is None:
        return {}
    validated = "1: propagation agrees with the Monte Carlo method to the tolerance (JCGM 101, 8)"
    return {
        "output_validated": ("output", np.array(found.validated, dtype=np.int8), {"long_name": validated}),
        "output_reason": (
            "output",
            np.array(found.reason, dtype=str),
            {"long_name": "why it does not; empty where it does"},
        ),
    }


def _budget(result: UncertaintyResult) -> dict[str, Any]:
    if result.propagation is None:
        return {}
    budget = result.propagation.budget
    groups = np.array(list(budget), dtype=str)
    parts = np.array(list(budget.values())).reshape(len(budget), len(result.outputs))
    meaning = "standard uncertainty of each output that a group of inputs alone makes"
    return {
        "group": ("group", groups, {"long_name": "group of uncertain inputs"}),
        "budget": (("group", "output"), parts, {"long_name": meaning, "comment": "in output_units"}),
    }


def _monte_carlo(result: UncertaintyResult) -> dict[str, Any]:
    found = result.monte_carlo
    variables: dict[str, Any] = {}
    if found is None:
        return variables
    if found.covariance is not None:
        variables["covariance"] = (
            ("output", "output_2"),
            np.asarray(found.covariance),
            {"long_name": "covariance of all outputs", "comment": "of two values in their output_units"},
        )
    kept = found.kept
    if kept:
        values = np.array(list(kept.values()))
        names = np.array([label(result.outputs[k]) for k in kept])
        variables["kept_name"] = ("kept", names, {"long_name": "output whose samples are kept"})
        comment = "in the units of the output, in the order of the samples; missing where a sample gave no result"
        variables["kept_samples"] = (("kept", "sample"), values, {"long_name": "samples", "comment": comment})
    return variables


def _joint(result: UncertaintyResult) -> dict[str, Any]:
    """Joint coverage regions.

    Each has its own dimensions: joint_a; joint_a_x, ... for the cells."""
    variables: dict[str, Any] = {}
    regions = [] if result.monte_carlo is None else result.monte_carlo.joint
    for letter, region in zip(string.ascii_lowercase, regions, strict=False):
        name = f"joint_{letter}"
        members = [result.outputs[k] for k in region.outputs]
        text = " and ".join(map(label, members))
        units = np.array([output.unit for output in members])
        cells = np.asarray(region.smallest)
        place = {"comment": f"in {name}_units"}
        variables |= {
            f"{name}_name": (name, np.array([label(o) for o in members]), {"long_name": "outputs of a joint region"}),
            f"{name}_units": (name, units, {"long_name": "their units"}),
            f"{name}_centre": (
                name,
                np.asarray(region.centre),
                {"long_name": f"centre of the region of {text}"} | place,
            ),
            f"{name}_covariance": (
                (name, f"{name}_2"),
                np.asarray(region.covariance),
                {"long_name": f"covariance of {text}"} | place,
            ),
            f"{name}_ellipsoid_factor": (
                (),
                region.ellipsoid_factor,
                {
                    "units": "1",
                    "long_name": "coverage factor of the ellipsoid",
                    "comment": "(y - centre)' covariance^-1 (y - centre) is at most its square",
                },
            ),
            f"{name}_rectangle_factor": (
                (),
                region.rectangle_factor,
                {
                    "units": "1",
                    "long_name": "coverage factor of the rectangle",
                    "comment": "each y is within this factor times the root of its variance about the centre",
                },
            ),
            f"{name}_from": (name, np.asarray(region.grid_from), {"long_name": "lower corner of the cells"} | place),
            f"{name}_width": (name, np.asarray(region.grid_width), {"long_name": "width of a cell"} | place),
            f"{name}_smallest": (
                tuple(f"{name}_{axis}" for axis in "xyz"[: len(members)]),
                cells.astype(np.int8),
                {"long_name": f"1: cell of the smallest coverage region of {text}"},
            ),
        }
    return variables


def _volume(result: UncertaintyResult) -> dict[str, Any]:
    found = result.volume
    if found is None:
        return {}
    units = np.array([volume_units(name) for name in found.names])
    columns = {
        "value": ("range over the volume of the deviations without noise", found.value),
        "u": ("standard uncertainty of the range", found.standard_uncertainty),
        "low": ("lower end of the coverage interval of the range", found.interval[:, 0]),
        "high": ("upper end of the coverage interval of the range", found.interval[:, 1]),
        "bound": ("by how much the range may be wrong at most, with the coverage probability", found.bound),
    }
    variables: dict[str, Any] = {
        "range_name": ("range", np.array(found.names), {"long_name": "V_XYZ of ISO 230-1 and body diagonals"}),
        "range_units": ("range", units, {"long_name": "units of a range"}),
    }
    for ending, (meaning, values) in columns.items():
        variables[f"range_{ending}"] = ("range", values, {"long_name": meaning, "comment": "in range_units"})
    return variables


def attributes_of(result: UncertaintyResult) -> dict[str, Any]:
    known, found = result.known, result.monte_carlo
    attributes: dict[str, Any] = {
        "method": result.method,
        "scenario": known.path.name,
        "chain": known.chain.name,
        "volume_mm": known.plan.volume,
        "tool_mm": np.array(known.tool),
        "coverage": result.coverage,
    }
    if known.expansion is not None:
        attributes["temperature_reference_c"] = known.expansion.expansion.reference
    if found is not None:
        attributes |= {
            "samples": found.samples,
            "samples_without_result": found.lost,
            "seed": str(result.seed),  # not all readers of netCDF know unsigned 64-bit attributes
            "instruction_set": found.target,
        }
    if result.warning is not None:
        attributes["warning"] = result.warning
    return attributes
