"""Writes the result of an uncertainty evaluation: netCDF, or CSV in the units of reports."""

from pathlib import Path
from typing import Any

import numpy as np

from stepdiag._core import InvalidArgument
from stepdiag.io.csv_text import csv_text
from stepdiag.io.data_files import date_of_today, is_netcdf
from stepdiag.io.labelled import LabelledTable
from stepdiag.io.netcdf import write_netcdf
from stepdiag.io.whole_files import write_whole
from stepdiag.uncertainty.result import UNCERTAINTY_FORMAT, UncertaintyResult
from stepdiag.uncertainty.table import ABOUT, attributes_of, columns_of, uncertainty_table
from stepdiag.units import report_value


def write_uncertainty(result: UncertaintyResult, path: Path) -> None:
    """Write a result, netCDF (.nc) or CSV (.csv).

    Raises InvalidArgument if it cannot be written."""
    if is_netcdf(path):
        write_netcdf(LabelledTable.of(uncertainty_table(result)), path, ABOUT | {"date": date_of_today()})
    elif path.suffix.lower() == ".csv":
        write_whole(path, uncertainty_csv(result))
    else:
        raise InvalidArgument(f"{path}: expected a name that ends in .nc or .csv")


def uncertainty_csv(result: UncertaintyResult) -> str:
    """The result as CSV: a row per output in µm and µrad, attributes as `# key=value` lines."""
    columns = columns_of(result)
    facts = {"format": UNCERTAINTY_FORMAT, "date": date_of_today()} | attributes_of(result)
    named = [(ending or "_mean").removeprefix("_").replace("_u", "_standard_uncertainty") for ending, *_ in columns]
    named = ["standard_uncertainty" if name == "u" else name for name in named]
    rows = []
    for k, output in enumerate(result.outputs):
        unit = {"µm": "um", "µrad": "urad"}.get(report_value(output.unit, 0.0)[1], output.unit)
        cells = [output.name, float(output.position), unit]
        for ending, _, _, values in columns:
            value = float(values[k])
            cells.append(value if ending == "_freedom" else report_value(output.unit, value)[0])
        rows.append(cells)
    leading = {name: _fact(value) for name, value in facts.items()}
    return csv_text(["output", "position_mm", "unit", *named], rows, leading)


def _fact(value: Any) -> str:
    return " ".join(f"{x:.17g}" for x in value) if isinstance(value, np.ndarray) else str(value)
