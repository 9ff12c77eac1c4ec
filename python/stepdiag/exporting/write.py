"""Export of a calibration in the format of a controller: `export`.

All errors here are actual minus commanded, of the tool relative to the workpiece; the compensation
has the opposite sign. Every format states, in its file or beside it, which of the two it contains,
and for which chain, tool and reference point.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import Any, Final

import numpy as np

from stepdiag._core import Calibration, InvalidArgument, read_error_map
from stepdiag.calibration.parts import parts_of
from stepdiag.exporting.common import tool_of
from stepdiag.exporting.csv_grid import csv_grid
from stepdiag.exporting.etalon import etalon
from stepdiag.exporting.firmware import klipper, marlin, rrf
from stepdiag.exporting.formats import FORMATS
from stepdiag.exporting.heidenhain import heidenhain_com, heidenhain_kinematics
from stepdiag.exporting.isg import isg
from stepdiag.exporting.linuxcnc_comp import linuxcnc_comp
from stepdiag.exporting.linuxcnc_kins import linuxcnc_kins
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.polynomial import calibxyzkins, matrix, squareness
from stepdiag.exporting.position_error import position_error
from stepdiag.exporting.result import Export
from stepdiag.exporting.siemens import siemens_cec, siemens_enc_comp
from stepdiag.findings.error_map import check_angles
from stepdiag.findings.meaning import MEANING
from stepdiag.io.data_files import is_netcdf, read_calibration
from stepdiag.io.whole_files import check_output, make_folder, write_set
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES
from stepdiag.wrong_arguments import checked

WRITERS: Final[Mapping[str, Callable[[Calibration, Path, ExportOptions], Export]]] = {
    "linuxcnc-kins": linuxcnc_kins,
    "linuxcnc-comp": linuxcnc_comp,
    "matrix": matrix,
    "calibxyzkins": calibxyzkins,
    "siemens-cec": siemens_cec,
    "siemens-enc-comp": siemens_enc_comp,
    "heidenhain-kinematics": heidenhain_kinematics,
    "heidenhain-com": heidenhain_com,
    "isg": isg,
    "etalon": etalon,
    "rrf": rrf,
    "marlin": marlin,
    "klipper": klipper,
    "csv-grid": csv_grid,
    "squareness": squareness,
    "position-error": position_error,
}


def read_what_is_exported(path: Path) -> Calibration:
    """Read a calibration, CSV or netCDF, or an error map with chain, volume and tool.

    Parameters that an error map lacks are 0. Raises InvalidArgument naming the file, and the line
    or variable."""
    calibration = read_calibration(path)
    check_angles(calibration.to_error_map(), str(path))
    if is_netcdf(path) or not read_error_map(path).header.get("format", "").startswith("stepdiag error map"):
        return calibration
    edges = dict(zip(AXES, calibration.volume, strict=True))
    nothing = {name: (np.array([0.0, edges[name[2]]]), np.zeros(2), np.full(2, np.nan)) for name in FUNCTIONS}
    parts = parts_of(calibration)
    parts["functions"] = nothing | parts["functions"]
    parts["squareness"] = dict.fromkeys(SQUARENESSES, (0.0, np.nan)) | parts["squareness"]
    return Calibration(**parts)


def check_fit(calibration: Calibration, name: str, accept_rejected: bool) -> None:
    """Raise InvalidArgument for a rejected fit unless that is accepted.

    `name` is used in messages."""
    if calibration.fit == "rejected" and not accept_rejected:
        raise InvalidArgument(
            f"{name}: fit=rejected: {MEANING['rejected']}; measure again, or export it all the same with "
            "`accept_rejected`"
        )


@checked
def export(
    calibration: Calibration, output: str | PathLike[str], *, to: str, options: ExportOptions | None = None, **more: Any
) -> list[str]:
    """Write a calibration for a controller. Returns notes: settings, losses, what is not corrected.

    Files are written completely or not at all; notes that begin with "warning:" say what makes the machine worse.

    Args:
        calibration: the calibration to export.
        output: the file to write; for linuxcnc-comp and heidenhain-... a folder, which is created.
        to: format (docs/your-controller.md), such as "linuxcnc-kins", "siemens-cec" or "csv-grid".
        options: ExportOptions, or its fields by name.

    Raises:
        InvalidArgument: an option does not belong to the format, the calibration does not determine
            a required value (unless `incomplete`), its fit was rejected (unless `accept_rejected`),
            or the format cannot represent it.
    """
    if options is not None and more:
        raise TypeError("export(): expected `options`, or its fields by name, got both")
    return write_export(calibration, to, Path(output), options or ExportOptions(**more)).told


def write_export(calibration: Calibration, to: str, output: Path, options: ExportOptions) -> Export:
    """Write as `export` does, and return also what is compensated and the remaining error."""
    export = _prepare(calibration, to, output, options)
    if FORMATS[to].folder:
        make_folder(output)
    for path in export.files:
        check_output(path)
    write_set(export.files)
    return export


def _prepare(calibration: Calibration, to: str, output: Path, options: ExportOptions) -> Export:
    if to not in FORMATS:
        raise InvalidArgument(f"`to`: expected one of {', '.join(FORMATS)}, got {to!r}")
    taken = {"tool", "origin", "incomplete", "accept_rejected", *FORMATS[to].options}
    for field in fields(options):
        if field.name not in taken and getattr(options, field.name) is not None:
            theirs = " or ".join(name for name, one in FORMATS.items() if field.name in one.options)
            raise InvalidArgument(f"`{field.name}`: belongs to {theirs}, not to {to}")
    for name in ("tool", "origin", "at", "fixed"):
        numbers = getattr(options, name)
        if numbers is not None and (len(numbers) != 3 or not np.all(np.isfinite(numbers))):
            raise InvalidArgument(f"`{name}`: expected three lengths in mm, got {numbers}")
    check_fit(calibration, "calibration", options.accept_rejected)
    if calibration.method == "conventional" and not np.array_equal(tool_of(calibration, options), calibration.tool):
        raise InvalidArgument("`tool`: tables of the method conventional hold for the tool of the measurement only")
    return WRITERS[to](calibration, output, options)
