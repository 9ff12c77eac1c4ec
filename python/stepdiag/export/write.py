"""`export_calibration` writes a calibration in the format of a controller.

Every error here is actual minus commanded, of the tool relative to the workpiece; what compensates it has the opposite
sign. Each format says in its file, or beside it, which of the two it holds, for which chain, tool and reference point.
"""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration, InvalidArgument, read_error_map
from stepdiag.calibration.finding_text import MEANING
from stepdiag.export.common import Export, ExportOptions, tool_of
from stepdiag.export.csv_grid import csv_grid
from stepdiag.export.isg import isg
from stepdiag.export.linuxcnc_comp import linuxcnc_comp
from stepdiag.export.linuxcnc_kins import linuxcnc_kins
from stepdiag.io.data_files import is_netcdf, read_calibration
from stepdiag.io.whole_files import check_output, make_folder, write_whole
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES

# Format -> the options that it takes beside `tool`, `origin`, `incomplete` and `accept_rejected`.
FORMATS: Final[Mapping[str, tuple[str, ...]]] = {
    "linuxcnc-comp": ("at", "rows"),
    "linuxcnc-kins": ("approach",),
    "isg": ("approach", "rows", "squareness"),
    "csv-grid": ("approach", "nodes", "step", "orientation"),
}


def read_what_is_exported(path: Path) -> Calibration:
    """A calibration, CSV or netCDF; or an error map with chain, volume and tool: what it lacks is 0.

    Raises InvalidArgument naming the file, and the line or variable."""
    calibration = read_calibration(path)
    if is_netcdf(path) or not read_error_map(path).header.get("format", "").startswith("stepdiag error map"):
        return calibration
    edges = dict(zip(AXES, calibration.volume, strict=True))
    nothing = {name: (np.array([0.0, edges[name[2]]]), np.zeros(2), np.full(2, np.nan)) for name in FUNCTIONS}
    return Calibration(
        calibration.method,
        calibration.chain,
        calibration.volume,
        calibration.tool,
        nothing | calibration.functions,
        dict.fromkeys(SQUARENESSES, (0.0, np.nan)) | calibration.squareness,
        reversal=calibration.reversal,
        reversal_negative_uncertainty={name: table[2] for name, table in calibration.negative_functions.items()},
        date=calibration.date,
        fit=calibration.fit,
        variance_factor=calibration.variance_factor,
    )


def check_fit(calibration: Calibration, name: str, accept_rejected: bool) -> None:
    """Raises InvalidArgument for a calibration, called `name`, whose fit was rejected, unless that is accepted."""
    if calibration.fit == "rejected" and not accept_rejected:
        raise InvalidArgument(
            f"{name}: fit=rejected: {MEANING['rejected']}; measure again, or export it all the same with "
            "`accept_rejected`"
        )


def export_calibration(
    calibration: Calibration, to: str, output: Path, options: ExportOptions | None = None
) -> list[str]:
    """Writes a calibration for a controller and returns what is to say: settings, losses, what is not corrected.

    to: a key of FORMATS. output: a file; of linuxcnc-comp a folder, which is made. Files are written whole or not at
    all. Raises InvalidArgument for an option that the format has no use for, for what the calibration does not
    determine unless `incomplete`, for a rejected fit unless `accept_rejected`, and for what the format cannot hold.
    """
    export = _prepare(calibration, to, output, options or ExportOptions())
    if to == "linuxcnc-comp":
        make_folder(output)
    for path in export.files:
        check_output(path)
    for path, text in export.files.items():
        write_whole(path, text)
    return [*export.report, *(f"wrote {path}" for path in export.files)]


def _prepare(calibration: Calibration, to: str, output: Path, options: ExportOptions) -> Export:
    formats = {"linuxcnc-comp": linuxcnc_comp, "linuxcnc-kins": linuxcnc_kins, "isg": isg, "csv-grid": csv_grid}
    if to not in formats:
        raise InvalidArgument(f"`to`: expected one of {', '.join(formats)}, got {to!r}")
    taken = {"tool", "origin", "incomplete", "accept_rejected", *FORMATS[to]}
    for field in fields(options):
        if field.name not in taken and getattr(options, field.name) is not None:
            theirs = " or ".join(name for name, names in FORMATS.items() if field.name in names)
            raise InvalidArgument(f"`{field.name}`: belongs to {theirs}, not to {to}")
    for name in ("tool", "origin", "at"):
        numbers = getattr(options, name)
        if numbers is not None and (len(numbers) != 3 or not np.all(np.isfinite(numbers))):
            raise InvalidArgument(f"`{name}`: expected three lengths in mm, got {numbers}")
    check_fit(calibration, "calibration", options.accept_rejected)
    if calibration.method == "conventional" and not np.array_equal(tool_of(calibration, options), calibration.tool):
        raise InvalidArgument("`tool`: tables of the method conventional hold for the tool of the measurement only")
    return formats[to](calibration, output, options)
