"""The result of a study as a netCDF file: a dimension for each varied key, and one for the method.

The latter is named `evaluation`, because `method` is an argument of xarray's `sel`.
"""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import xarray as xr

from stepdiag.config.key_errors import show
from stepdiag.io.data_files import date_of_today
from stepdiag.io.labelled import LabelledTable
from stepdiag.io.netcdf import write_netcdf
from stepdiag.parameters import KINDS
from stepdiag.uncertainty.study_cell import FIGURES, SUMMARIES, CellResult
from stepdiag.uncertainty.study_keys import Study
from stepdiag.wrong_arguments import checked

STUDY_FORMAT: Final = "stepdiag study 1"
LENGTHS: Final = ("positioning", "straightness")

_ABOUT: Final = {
    "format": STUDY_FORMAT,
    "title": "study of uncertainties over a grid of scenarios",
    "comment": "Each cell is a scenario, its keys set to the values along the dimensions, with virtual calibrations of "
    "its machine: inputs drawn from their distributions, traced readings, evaluation.",
    "variables": "NAME_FIGURE_largest and NAME_FIGURE_median are over the nodes of the parameter NAME (EXX ... ECZ, "
    "C0Y, B0Z, A0Z as in ISO 230-1), or over all nodes and parameters of a family: positioning, straightness, angle, "
    "squareness. Of means and values they are those of absolute values; intervals are given by their lengths.",
    "missing": "A value is missing where the cell has none: where failure says why, where the evaluation does not "
    "determine the parameter, or where the study was interrupted.",
}

# Units by the endings of keys.
_UNITS: Final = {
    "mm": "mm",
    "um": "um",
    "nm": "nm",
    "urad": "urad",
    "c": "degC",
    "hpa": "hPa",
    "percent": "percent",
    "ppm": "1e-6",
    "s": "s",
    "min": "min",
}


def write_study(study: Study, results: Mapping[tuple[int, ...], CellResult], path: Path) -> None:
    """Write a result as netCDF. Cells without a result are missing values."""
    date = {"date": date_of_today()}
    write_netcdf(LabelledTable.of(study_table(study, results)), path, _ABOUT | date)


@checked
def study_table(study: Study, results: Mapping[tuple[int, ...], CellResult]) -> xr.Dataset:
    """The results of a study as a labelled table (xarray), in native units: mm, rad.

    Dimensions are the axes of the grid and `evaluation`, the method. Cells without a result are
    NaN."""
    dimensions, coordinates = _coordinates(study)
    shape = study.shape
    variables: dict[str, Any] = {}

    def gather(of: Any, missing: Any, kind: Any) -> npt.NDArray[Any]:
        values = np.full(shape, missing, dtype=kind)
        for index, result in results.items():
            values[index] = of(result)
        return values

    for name, figure in _columns(list(results.values())):
        unit = "mm" if name in LENGTHS or (name[0] == "E" and name[1] in "XYZ") else "rad"
        for which, summary in enumerate(SUMMARIES):

            def value(result: CellResult, name: str = name, figure: str = figure, which: int = which) -> float:
                return result.figures.get(name, {}).get(figure, (math.nan, math.nan))[which]

            what = "family " if name in KINDS else ""
            attributes = {"units": unit, "long_name": f"{summary} {FIGURES[figure]} of {what}{name}"}
            variables[f"{name}_{figure}_{summary}"] = (dimensions, gather(value, math.nan, float), attributes)
    about_cells = {
        "samples": (gather(lambda r: r.samples, 0, np.int64), "virtual calibrations that gave a result"),
        "lost": (gather(lambda r: r.lost, 0, np.int64), "virtual calibrations that gave none"),
    }
    for name, (counts, meaning) in about_cells.items():
        variables[name] = (dimensions, counts, {"units": "1", "long_name": meaning})
    texts = {
        "failure": ([r.failure for r in results.values()], "why the cell has no result"),
        "instruction_set": ([r.instruction_set for r in results.values()], "same bits for the same one"),
    }
    for name, (given, meaning) in texts.items():
        width = max([1, *map(len, given)])
        values = np.full(shape, "" if name != "failure" else "not computed"[:width], dtype=f"U{max(width, 12)}")
        if name == "failure":
            values[...] = "not computed"
        for index, text in zip(results, given, strict=True):
            values[index] = text
        variables[name] = (dimensions, values, {"long_name": meaning})
    return xr.Dataset(variables, coordinates, _attributes(study))


def _columns(results: Sequence[CellResult]) -> list[tuple[str, str]]:
    """Names and figures that any cell has: families, then parameters in the calibration's order."""
    names = dict.fromkeys(name for result in results for name in result.figures)
    ordered = [*(kind for kind in KINDS if kind in names), *(name for name in names if name not in KINDS)]
    figures = [f for f in FIGURES if any(f in of for result in results for of in result.figures.values())]
    return [(name, figure) for name in ordered for figure in figures]


def _coordinates(study: Study) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Dimensions and coordinates.

    A dimension is named after its key (plan_steps). Keys that change together share a dimension
    with the name of their group, and each key is a coordinate along it."""
    dimensions, coordinates = [], {}
    for axis in study.axes:
        dimension = _named(axis.name)
        dimensions.append(dimension)
        for k, name in enumerate(axis.keys):
            # The dimension of a group has a coordinate of its own, unless a key has its name.
            values = [row[k] for row in axis.values]
            coordinates[_named(name)] = (dimension, *_coordinate(name, values))
        if dimension not in coordinates:
            steps = np.arange(len(axis.values))
            coordinates[dimension] = (dimension, steps, {"long_name": f"step along {', '.join(axis.keys)}"})
    coordinates["evaluation"] = ("evaluation", np.array(study.settings.methods), {"long_name": "evaluation"})
    return (*dimensions, "evaluation"), coordinates


def _named(key: str) -> str:
    return re.sub(r"\W", "_", key)


def _coordinate(name: str, values: Sequence[Any]) -> tuple[npt.NDArray[Any], dict[str, str]]:
    """Values as numbers if all are numbers, otherwise as TOML texts."""
    attributes = {"long_name": name}
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        unit = _UNITS.get(name.rpartition("_")[2]) if "_" in name else None
        if unit is not None and "per" not in name.split("_"):
            attributes["units"] = unit
        return np.array(values), attributes
    return np.array([value if isinstance(value, str) else show(value, longest=1000) for value in values]), attributes


def _attributes(study: Study) -> dict[str, Any]:
    settings = study.settings
    return {
        "scenario": str(study.scenario.name),
        "samples_per_cell": settings.samples,
        "seed": str(settings.seed),  # netCDF integers are below 2^63
        "coverage": settings.coverage,
        "digits": settings.digits,
    }
