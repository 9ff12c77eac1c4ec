"""Calibrations in the formats of controllers: `export_calibration`, and what the formats have in common.

Every error here is actual minus commanded, of the tool relative to the workpiece; what compensates it has the opposite
sign. Each format says in its file, or beside it, which of the two it holds, for which chain, tool and reference point.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, ErrorMap, InvalidArgument, read_error_map
from stepdiag.calibration.verdict_text import MEANING

FloatArray = npt.NDArray[np.float64]
Triple = tuple[float, float, float]
Approach = Literal["mean", "positive", "negative"]
APPROACHES: Final[tuple[Approach, ...]] = ("mean", "positive", "negative")

AXES: Final = "XYZ"
FUNCTIONS: Final = tuple(f"E{component}{axis}" for axis in AXES for component in "XYZABC")
SQUARENESSES: Final = ("C0Y", "B0Z", "A0Z")

SAME_NODE: Final = 1e-6  # mm: nearer ones are the same position, and one row of a table with nine digits


@dataclass(frozen=True)
class ExportOptions:
    """What a user chooses; None: the format's default, documented with the command."""

    tool: Triple | None = None  # mm; None: the calibration's
    origin: Triple | None = None  # mm, controller's coordinates of home; None: 0 0 0
    incomplete: bool = False  # what is not determined is exported as 0
    approach: Approach | None = None  # of tables with two directions; None: mean
    at: Triple | None = None  # mm from home, linuxcnc-comp: the lines that are corrected; None: centre of the volume
    rows: int | None = None  # linuxcnc-comp, isg: at most so many rows a table
    nodes: tuple[int, int, int] | None = None  # csv-grid
    step: float | None = None  # mm, csv-grid: largest spacing
    orientation: bool | None = None  # csv-grid: rotations too
    squareness: Literal["straightness", "parameters"] | None = None  # isg: where squareness is written
    accept_rejected: bool = False  # takes a calibration whose fit was rejected


@dataclass(frozen=True)
class Export:
    """Texts of files by their paths, and what is to say about them."""

    files: Mapping[Path, str]
    report: Sequence[str]


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
    from stepdiag.io.data_files import is_netcdf, read_calibration

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
            "--accept-rejected"
        )


def export_calibration(
    calibration: Calibration, to: str, output: Path, options: ExportOptions = ExportOptions()
) -> list[str]:
    """Writes a calibration for a controller and returns what is to say: settings, losses, what is not corrected.

    to: a key of FORMATS. output: a file; of linuxcnc-comp a folder, which is made. Files are written whole or not at
    all. Raises InvalidArgument for an option that the format has no use for, for what the calibration does not
    determine unless `incomplete`, for a rejected fit unless `accept_rejected`, and for what the format cannot hold.
    """
    from stepdiag.io.whole_files import check_output, make_folder, write_whole

    export = _prepare(calibration, to, output, options)
    if to == "linuxcnc-comp":
        make_folder(output)
    for path in export.files:
        check_output(path)
    for path, text in export.files.items():
        write_whole(path, text)
    return [*export.report, *(f"wrote {path}" for path in export.files)]


def _prepare(calibration: Calibration, to: str, output: Path, options: ExportOptions) -> Export:
    from stepdiag.export.csv_grid import csv_grid
    from stepdiag.export.isg import isg
    from stepdiag.export.linuxcnc_comp import linuxcnc_comp
    from stepdiag.export.linuxcnc_kins import linuxcnc_kins

    formats = {"linuxcnc-comp": linuxcnc_comp, "linuxcnc-kins": linuxcnc_kins, "isg": isg, "csv-grid": csv_grid}
    if to not in formats:
        raise InvalidArgument(f"--to: expected one of {', '.join(formats)}, got {to!r}")
    taken = {"tool", "origin", "incomplete", "accept_rejected", *FORMATS[to]}
    for field in fields(options):
        if field.name not in taken and getattr(options, field.name) is not None:
            theirs = " or ".join(name for name, names in FORMATS.items() if field.name in names)
            raise InvalidArgument(f"--{field.name}: belongs to {theirs}, not to {to}")
    for name in ("tool", "origin", "at"):
        numbers = getattr(options, name)
        if numbers is not None and (len(numbers) != 3 or not np.all(np.isfinite(numbers))):
            raise InvalidArgument(f"--{name}: expected three lengths in mm, got {numbers}")
    check_fit(calibration, "calibration", options.accept_rejected)
    if calibration.method == "conventional" and not np.array_equal(tool_of(calibration, options), calibration.tool):
        raise InvalidArgument("--tool: tables of the method conventional hold for the tool of the measurement only")
    return formats[to](calibration, output, options)


def require(calibration: Calibration, names: Sequence[str], options: ExportOptions) -> list[str]:
    """Sentences on what of `names` is not determined, or not up to the end of the volume.

    Raises InvalidArgument where something is not determined, unless allowed."""
    missing = list(undetermined_of(calibration, names))
    if missing and not options.incomplete:
        raise InvalidArgument(
            f"not determined by this calibration: {', '.join(missing)}; with --incomplete it is exported as 0"
        )
    said = [f"NOT COMPENSATED, because not determined: {', '.join(missing)}"] if missing else []
    if held := list(_held(calibration, names)):
        said.append(f"note: outside their nodes tables hold their end values: {', '.join(held)}")
    return said


def _held(calibration: Calibration, names: Sequence[str]) -> Iterator[str]:
    for name in names:
        if name in calibration.functions:
            position, value, _ = calibration.functions[name]
            if position[0] > SAME_NODE and value[0] != 0.0:
                yield f"{name} below {position[0]:g} mm"
            if position[-1] < calibration.volume[AXES.index(name[2])] - SAME_NODE and value[-1] != 0.0:
                yield f"{name} above {position[-1]:g} mm"


def undetermined_of(calibration: Calibration, names: Sequence[str]) -> Iterator[str]:
    """What a table of these parameters would hold as 0 although nobody knows it."""
    for name in names:
        if name not in calibration.functions and name not in calibration.squareness:
            yield name
        elif name in calibration.undetermined_slopes:
            yield f"{name} (slope)"
        elif name in calibration.undetermined_reversal_constants:
            yield f"{name} (constant of its reversal error)"


def tool_of(calibration: Calibration, options: ExportOptions) -> FloatArray:
    """The tool offset that the export is for, mm."""
    return np.array(calibration.tool if options.tool is None else options.tool, dtype=float)


def origin_of(options: ExportOptions) -> FloatArray:
    """Controller's coordinates of home, mm."""
    return np.array(options.origin or (0.0, 0.0, 0.0), dtype=float)


def compensated_map(calibration: Calibration, approach: Approach) -> ErrorMap:
    """The error map of one direction of approach, or of the mean of both: it has no reversal error."""
    positive = {name: table[:2] for name, table in calibration.functions.items()}
    squareness = {name: angle for name, (angle, _) in calibration.squareness.items()}
    if approach == "positive":
        return ErrorMap(positive, squareness)
    functions = dict(positive)
    for name, (there, back, _) in calibration.negative_functions.items():
        if approach == "negative":
            functions[name] = (there, back)
            continue
        position = np.union1d(positive[name][0], there)
        functions[name] = (
            position,
            0.5 * (np.interp(position, *positive[name]) + np.interp(position, there, back)),
        )
    return ErrorMap(functions, squareness)


def common_nodes(errors: ErrorMap, axis: str) -> FloatArray:
    """Every position at which a function of this axis has a node, mm, ascending."""
    tables = [*errors.functions.items(), *errors.negative_functions.items()]
    return np.unique(np.concatenate([[0.0], *(position for name, (position, _) in tables if name[2] == axis)]))


def inside(nodes: FloatArray, edge: float) -> FloatArray:
    """The nodes within the volume, and both its ends; of nodes that are one but for rounding, one."""
    between = nodes[(nodes > SAME_NODE) & (nodes < edge - SAME_NODE)]
    apart = np.diff(between, prepend=-np.inf) > SAME_NODE
    return np.concatenate([[0.0], between[apart], [edge]])


def spread(values: FloatArray, most: int) -> FloatArray:
    """At most so many of the values, the first and the last among them."""
    rows = np.linspace(0, len(values) - 1, min(most, len(values))).round().astype(int)
    return np.asarray(values[np.unique(rows)])


def lengths(values: Sequence[float] | FloatArray) -> str:
    """Three numbers, each read back to the same bits."""
    return " ".join(repr(float(value)) for value in values)


def words(values: Sequence[float] | FloatArray) -> str:
    return " ".join(f"{float(value):g}" for value in values)
