"""What the export formats share: options, checks and notes, nodes and error maps."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, ErrorMap, InvalidArgument
from stepdiag.calibration.parts import OTHER_AXIS, unmeasured_axes
from stepdiag.exporting.options import Approach, ExportOptions
from stepdiag.findings.temperature import temperature_text
from stepdiag.parameters import AXES

FloatArray = npt.NDArray[np.float64]
APPROACHES: Final[tuple[Approach, ...]] = ("mean", "positive", "negative")
APPROACH_WORDS: Final[Mapping[Approach, str]] = {"mean": "mean of both", "positive": "+", "negative": "-"}

SAME_NODE: Final = 1e-6  # mm: closer nodes count as one; tables have nine digits after the point


def require(calibration: Calibration, names: Sequence[str], options: ExportOptions) -> list[str]:
    """Notes on which of `names` are undetermined, or not determined over the whole volume.

    What an axis brings that was not measured at all, as the third one of a machine of two, is exported as 0. Raises
    InvalidArgument if another one is undetermined, unless `options.incomplete`."""
    missing = list(undetermined_of(calibration, names))
    unmeasured = unmeasured_axes(calibration)
    said = []
    if len(unmeasured) == 1:
        (axis,) = unmeasured
        missing = [name for name in missing if axis not in (name[2], OTHER_AXIS.get(name))]
        said.append(f"note: {axis} was not measured: it is taken to be without errors and is not compensated")
    if missing and not options.incomplete:
        raise InvalidArgument(
            f"not determined by this calibration: {', '.join(missing)}; with `incomplete` it is exported as 0"
        )
    said += [f"NOT COMPENSATED, because not determined: {', '.join(missing)}"] if missing else []
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
    """The values that tables of these parameters would contain as 0 although they are unknown."""
    for name in names:
        if name not in calibration.functions and name not in calibration.squareness:
            yield name
        elif name in calibration.undetermined_slopes:
            yield f"{name} (slope)"
        elif name in calibration.undetermined_reversal_constants:
            yield f"{name} (constant of its reversal error)"


def temperature_row(calibration: Calibration) -> str:
    """For which temperature a table is."""
    return f"temperature: {temperature_text(calibration)}"


def in_ascii(text: str) -> str:
    """For controllers, which may take no other characters, not even in comments."""
    return text.replace("µ", "u").replace("°C", "degC")


def tool_of(calibration: Calibration, options: ExportOptions) -> FloatArray:
    """Tool offset of the export, mm."""
    return np.array(calibration.tool if options.tool is None else options.tool, dtype=float)


def origin_of(options: ExportOptions) -> FloatArray:
    """Home in the controller's coordinates, mm."""
    return np.array(options.origin or (0.0, 0.0, 0.0), dtype=float)


def rows_of(options: ExportOptions, most: int, usual: int | None = None) -> int:
    """Largest number of rows of a table. Raises InvalidArgument beyond `most`."""
    rows = (usual or most) if options.rows is None else options.rows
    if not 2 <= rows <= most:
        raise InvalidArgument(f"`rows`: expected 2 to {most}, got {rows}")
    return rows


def line_point(calibration: Calibration, options: ExportOptions) -> FloatArray:
    """The point on the corrected lines, mm from home. Raises InvalidArgument outside of the volume."""
    at = calibration.volume / 2.0 if options.at is None else np.array(options.at, dtype=float)
    if np.any((at < 0.0) | (at > calibration.volume)):
        raise InvalidArgument(f"`at`: expected a point of the volume {words(calibration.volume)} mm, got {words(at)}")
    return at


def compensated_map(calibration: Calibration, approach: Approach) -> ErrorMap:
    """The error map for one direction of approach, or the mean of both; without reversal errors."""
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
    """Union of the nodes of all functions of an axis, mm, ascending."""
    tables = [*errors.functions.items(), *errors.negative_functions.items()]
    return np.unique(np.concatenate([[0.0], *(position for name, (position, _) in tables if name[2] == axis)]))


def inside(nodes: FloatArray, edge: float) -> FloatArray:
    """The nodes within the volume and both its ends; nodes that differ by rounding are merged."""
    between = nodes[(nodes > SAME_NODE) & (nodes < edge - SAME_NODE)]
    apart = np.diff(between, prepend=-np.inf) > SAME_NODE
    return np.concatenate([[0.0], between[apart], [edge]])


def spread(values: FloatArray, most: int) -> FloatArray:
    """At most `most` of the values, among them the first and the last."""
    rows = np.linspace(0, len(values) - 1, min(most, len(values))).round().astype(int)
    return np.asarray(values[np.unique(rows)])


def words(values: Sequence[float] | FloatArray) -> str:
    return " ".join(f"{float(value):g}" for value in values)
