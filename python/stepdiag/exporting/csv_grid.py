"""A grid of error vectors over the volume: CSV with leading `# key=value` lines.

Every grid point has the error of the functional point, actual minus commanded, by the exact pose of
docs/conventions.md. Interpolation between the points adds an error. For trilinear interpolation,
which most controllers and programs use, its largest value is searched on a finer grid and stated.
"""

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration, InvalidArgument, Machine
from stepdiag.exporting.common import (
    FloatArray,
    common_nodes,
    compensated_map,
    in_ascii,
    inside,
    origin_of,
    require,
    spread,
    temperature_row,
    tool_of,
    words,
)
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, coverage_of
from stepdiag.findings.meaning import trust_rows, unverified_key
from stepdiag.findings.temperature import temperature_text
from stepdiag.io.csv_text import csv_text, lengths
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES

GRID_FORMAT: Final = "stepdiag error grid 1"
DEFAULT_NODES: Final = (11, 11, 11)
MOST_POINTS: Final = 2_000_000  # a file of 200 MB
MOST_SAMPLES: Final = 1_000_000  # for the search of the largest loss; takes seconds


def csv_grid(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """The file, and the largest error of interpolation in it."""
    axes = _axes(calibration.volume, options)
    tool, origin = tool_of(calibration, options), origin_of(options)
    missing = require(calibration, [*FUNCTIONS, *SQUARENESSES], options)
    approach = options.approach or "mean"
    machine = Machine(calibration.chain, compensated_map(calibration, approach), tool)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    error = machine.error(grid)
    values = [error * 1e3]
    if options.orientation:
        values.append(_rotation(machine, grid) * 1e6)
    loss, place = interpolation_loss(machine, axes, calibration.volume)

    leading = {
        "format": GRID_FORMAT,
        "fit": calibration.fit or "",
        **unverified_key(calibration),
        "chain": calibration.chain.name,
        "volume_mm": lengths(calibration.volume),
        "tool_mm": lengths(tool),
        "home_mm": lengths(origin),
        "nodes": " ".join(str(len(axis)) for axis in axes),
        "order": "z fastest, then y, then x",
        "sign": "error = actual - commanded position of the tool relative to the workpiece; to compensate, subtract it",
        "reference": "functional point: the tool's origin plus the tool offset; 0 0 0 is home",
        "approach": approach,
        "temperature": in_ascii(temperature_text(calibration)),
        "interpolation_loss_um": f"{loss * 1e3:.4g}",
        "not_compensated": "; ".join(missing),
        "calibrated": calibration.date,
        **calibration.provenance,
    }
    text = csv_text(_header(bool(options.orientation)), [], leading) + "".join(_rows(axes, origin, values))
    report = _report(leading, axes, error, loss, place, missing)
    said = [*trust_rows(calibration), temperature_row(calibration), *report]
    return Export({output: text}, said, coverage_of(calibration, [*FUNCTIONS, *SQUARENESSES]))


def _axes(volume: FloatArray, options: ExportOptions) -> list[FloatArray]:
    """Positions of the grid from home, mm; both ends of every edge are included."""
    if options.nodes is not None and options.step is not None:
        raise InvalidArgument("`step`: the grid is given by `nodes` already")
    counts = options.nodes or DEFAULT_NODES
    if len(counts) != 3 or min(counts) < 2:
        raise InvalidArgument(f"`nodes`: expected three numbers of at least 2, got {words(counts)}")
    if options.step is not None:
        if not options.step > 0.0 or not np.isfinite(options.step):
            raise InvalidArgument(f"`step`: expected a length in mm, got {options.step:g}")
        # Tolerates quotients that rounding has made slightly larger than an integer.
        intervals = np.ceil(volume / options.step * (1.0 - 1e-12))
        x, y, z = (int(min(n, MOST_POINTS)) + 1 for n in np.maximum(intervals, 1.0))
        counts = (x, y, z)
    points = int(np.prod([float(n) for n in counts]))
    if points > MOST_POINTS:
        raise InvalidArgument(
            f"`{'nodes' if options.step is None else 'step'}`: a grid of {words(counts)} points; "
            f"at most {MOST_POINTS:,} in all are written"
        )
    return [np.linspace(0.0, float(edge), int(n)) for edge, n in zip(volume, counts, strict=True)]


def _rotation(machine: Machine, grid: FloatArray) -> FloatArray:
    """Rotation vectors of the tool, rad."""
    turn = machine.pose(grid)[0]
    # sin(angle)·axis equals the rotation vector to 1e-9 rad for angles below 1 mrad.
    return 0.5 * np.stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], axis=1
    )


def _header(orientation: bool) -> list[str]:
    names = [*(f"{axis}_mm" for axis in "xyz"), *(f"e{axis}_um" for axis in "xyz")]
    return names + [f"e{axis}_urad" for axis in "abc"] if orientation else names


def _rows(axes: list[FloatArray], origin: FloatArray, values: list[FloatArray]) -> Iterator[str]:
    """Lines of the file: positions with all digits, values with nine decimal places."""
    words = [[repr(float(p)) for p in axis + o] for axis, o in zip(axes, origin, strict=True)]
    number = ",".join(["%.9f"] * sum(value.shape[1] for value in values)) + "\n"
    rows = np.concatenate(values, axis=1)
    rows = np.round(rows, 9) + 0.0  # no -0
    width = len(words[2])
    for line, (x, y) in enumerate(product(words[0], words[1])):
        block = rows[line * width : (line + 1) * width].tolist()
        yield "".join(f"{x},{y},{z},{number % tuple(row)}" for z, row in zip(words[2], block, strict=True))


def interpolation_loss(machine: Machine, axes: list[FloatArray], volume: FloatArray) -> tuple[float, FloatArray]:
    """Largest error of trilinear interpolation, mm, and where it is.

    The search visits all combinations of the tables' nodes and the midpoints between nodes. If
    these are too many, it visits a subset, and from the worst point found all of them along each
    axis."""
    samples = [_samples(machine, axis, grid, float(edge)) for axis, grid, edge in zip(AXES, axes, volume, strict=True)]
    most = int(MOST_SAMPLES ** (1.0 / 3.0))
    few = [spread(s, most) for s in samples]
    values = machine.error(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3))
    values = values.reshape(*(len(axis) for axis in axes), 3)

    def loss(points: list[FloatArray]) -> tuple[float, FloatArray]:
        grid = np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 3)
        interpolated = values
        for k in sorted(range(3), key=lambda k: len(points[k]) / len(axes[k])):
            interpolated = _along(interpolated, axes[k], points[k], k)
        distance = np.linalg.norm(machine.error(grid) - interpolated.reshape(-1, 3), axis=1)
        worst = int(np.argmax(distance))
        return float(distance[worst]), grid[worst]

    best, place = loss(few)
    for k in range(3):
        found, where = loss([samples[j] if j == k else place[j : j + 1] for j in range(3)])
        if found > best:
            best, place = found, where
    return best, place


def _samples(machine: Machine, axis: str, grid: FloatArray, edge: float) -> FloatArray:
    nodes = np.union1d(inside(common_nodes(machine.errors, axis), edge), grid)
    return np.union1d(nodes, 0.5 * (nodes[1:] + nodes[:-1]))


def _along(values: FloatArray, nodes: FloatArray, points: FloatArray, axis: int) -> FloatArray:
    """Linear interpolation of an array along one of its axes."""
    after = np.clip(np.searchsorted(nodes, points), 1, len(nodes) - 1)
    share = (points - nodes[after - 1]) / (nodes[after] - nodes[after - 1])
    share = share.reshape([-1 if k == axis else 1 for k in range(values.ndim)])
    return np.take(values, after - 1, axis) * (1.0 - share) + np.take(values, after, axis) * share


def _report(
    leading: dict[str, str],
    axes: list[FloatArray],
    error: FloatArray,
    loss: float,
    place: FloatArray,
    missing: list[str],
) -> list[str]:
    spacing = words([axis[1] - axis[0] for axis in axes])
    largest = np.max(np.linalg.norm(error, axis=1)) * 1e3
    return [
        f"chain {leading['chain']}, tool offset {words([float(t) for t in leading['tool_mm'].split()])} mm, home at "
        f"{words([float(t) for t in leading['home_mm'].split()])} mm in the file's coordinates",
        f"sign: {leading['sign']}",
        f"grid: {leading['nodes']} points, spacing {spacing} mm, largest error {largest:.4g} µm",
        f"trilinear interpolation between these points loses at most {loss * 1e3:.3g} µm, at {words(place)} mm from "
        "home (found on a finer sampling)",
        *missing,
    ]
