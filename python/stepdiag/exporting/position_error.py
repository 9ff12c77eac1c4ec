"""Rows of position and error: the error of one axis as a function of the position of an axis, CSV.

This is what tables for cross compensation, sag or straightness want (of the same axis: pitch
compensation). The error is that of the functional point on the line along the independent axis
through `at`, where the other two axes stand:

    E(p) = e_axis(p on the line) - e_axis(home on the line),

the straightness or positioning error with theta x L of that line, and the squareness. The
controller subtracts it from the position of the dependent axis, m = P - E(p), wherever the others
stand; to first order in the errors.
"""

from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration, ErrorMap, InvalidArgument, Machine
from stepdiag.exporting.common import (
    FloatArray,
    common_nodes,
    compensated_map,
    inside,
    line_point,
    origin_of,
    require,
    tool_of,
    words,
)
from stepdiag.exporting.fewest_nodes import best_subset
from stepdiag.exporting.left_in_volume import left_in_volume, what_is_left
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, coverage_of, csv_leading, heading
from stepdiag.io.csv_text import csv_text, lengths
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES

FORMAT: Final = "stepdiag position error 1"


def position_error(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """The file, and what resampling loses."""
    axis, by = (_index_of(name, getattr(options, name)) for name in ("axis", "depends_on"))
    at, tool, origin = line_point(calibration, options), tool_of(calibration, options), origin_of(options)
    acting = _acting(calibration, tool, at, axis, by)
    missing = require(calibration, acting, options)
    errors = compensated_map(calibration, options.approach or "mean")
    machine = Machine(calibration.chain, errors, tool)
    nodes = inside(common_nodes(errors, AXES[by]), float(calibration.volume[by]))

    def exact(positions: FloatArray) -> FloatArray:
        return _on_line(machine, at, axis, by, positions)

    error = exact(nodes)
    kept = np.arange(len(nodes)) if options.rows is None else best_subset(nodes, error[None, :], options.rows)
    where = np.union1d(nodes, 0.5 * (nodes[1:] + nodes[:-1]))
    loss = float(np.max(np.abs(np.interp(where, nodes[kept], error[kept]) - exact(where))))

    def motors(commanded: FloatArray, _: int) -> FloatArray:
        sent = commanded.copy()
        sent[:, axis] -= np.interp(commanded[:, by], nodes[kept], error[kept])
        return sent

    left = left_in_volume(calibration, tool, motors)
    whole = [name for name in acting if name in (f"E{AXES[axis]}{AXES[by]}", *SQUARENESSES)]
    coverage = coverage_of(calibration, whole, [name for name in acting if name not in whole])
    lines = [
        *heading(calibration, options),
        f"table: error of {AXES[axis]} by the position of {AXES[by]}, on the line through {words(at)} mm from home; 0 "
        f"at home of {AXES[by]}",
        "sign: error, actual - commanded of the tool relative to the workpiece; to compensate, subtract it from the "
        f"position of {AXES[axis]}",
        f"rows: {len(kept)} of {len(nodes)} nodes; the table deviates from the exact error on the line by at most "
        f"{loss * 1e3:.2g} µm",
        *missing,
        f"left out: all but {', '.join(acting) or 'nothing'}, and the effect of the rotations away from the line",
        *what_is_left(calibration, left),
    ]
    more = {"axis": AXES[axis], "depends_on": AXES[by], "at_mm": lengths(at), "deviation_um": f"{loss * 1e3:.4g}"}
    rows = [
        [repr(float(p + origin[by])), f"{e * 1e3 + 0.0:.9f}"] for p, e in zip(nodes[kept], error[kept], strict=True)
    ]
    leading = csv_leading(FORMAT, calibration, options, lines, more)
    return Export({output: csv_text(["position_mm", "error_um"], rows, leading)}, lines, coverage, left, motors=motors)


def _index_of(name: str, letter: str | None) -> int:
    if letter not in tuple(AXES):
        raise InvalidArgument(f"`{name}`: position-error needs X, Y or Z, got {letter or 'none'}")
    return AXES.index(letter)


def _on_line(machine: Machine, at: FloatArray, axis: int, by: int, positions: FloatArray) -> FloatArray:
    """The error of the axis along the line, less that at home, mm."""
    line = np.tile(at, (len(positions) + 1, 1))
    line[:, by] = np.append(positions, 0.0)
    error = machine.error(line)[:, axis]
    return np.asarray(error[:-1] - error[-1])


def _acting(calibration: Calibration, tool: FloatArray, at: FloatArray, axis: int, by: int) -> list[str]:
    """The parameters that change the error of the axis along the line, to first order."""
    line = np.tile(at, (5, 1))
    line[:, by] = np.linspace(0.0, calibration.volume[by], 5)

    def acts(name: str) -> bool:
        if name in SQUARENESSES:
            alone = ErrorMap({}, {name: 1e-3})
        else:
            alone = ErrorMap({name: ([0.0, calibration.volume[AXES.index(name[2])]], [0.0, 1e-3])})
        error = Machine(calibration.chain, alone, tool).first_order_error(line)[:, axis]
        return bool(np.ptp(error) > 1e-12)

    return [name for name in (*FUNCTIONS, *SQUARENESSES) if acts(name)]
