"""What the formats have in common: options, what is refused or said of every export, nodes and error maps."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, ErrorMap, InvalidArgument
from stepdiag.parameters import AXES

FloatArray = npt.NDArray[np.float64]
Triple = tuple[float, float, float]
Approach = Literal["mean", "positive", "negative"]
APPROACHES: Final[tuple[Approach, ...]] = ("mean", "positive", "negative")


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


def require(calibration: Calibration, names: Sequence[str], options: ExportOptions) -> list[str]:
    """Sentences on what of `names` is not determined, or not up to the end of the volume.

    Raises InvalidArgument where something is not determined, unless allowed."""
    missing = list(undetermined_of(calibration, names))
    if missing and not options.incomplete:
        raise InvalidArgument(
            f"not determined by this calibration: {', '.join(missing)}; with `incomplete` it is exported as 0"
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


def words(values: Sequence[float] | FloatArray) -> str:
    return " ".join(f"{float(value):g}" for value in values)
