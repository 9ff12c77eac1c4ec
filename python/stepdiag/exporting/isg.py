"""CSV for volumetric compensation in ISG-CNC and Beckhoff TwinCAT CNC; not tried on a controller.

Sources: ISG kernel [FCT-C26] and Beckhoff TF5280, "Volumetric Compensation" (sections ISG CSV
format, Units of measure, List of parameters supported, Interpolation mode, General configuration),
and P-VOLC-00001 .. -00020. According to them a header line names the columns, arguments X Y Z and
ISO 230-1 parameters; rows follow; comments begin with //; a # begins a new header; units are mm and
rad; interpolation on the grid is linear. The parts that were available state neither the sign
(error or correction; `negate` inverts it), nor how a squareness turns the axes after it. The file
is therefore written such that it depends little on their interpretation:

- errors are actual minus commanded, ISO 230-1;
- every axis is treated as one that carries the tool (workpiece_axes 0): the tables are those of the
  functional point, e = sum over axes of delta + theta x L, L = zero position of the tool plus the
  positions of the axes after it in the chain;
- squarenesses are written as slopes of straightness, unless requested as parameters.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration, Chain, ErrorMap, InvalidArgument, Machine
from stepdiag.exporting.common import (
    APPROACH_WORDS,
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
from stepdiag.exporting.fewest_nodes import best_subset
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, coverage_of
from stepdiag.findings.meaning import provenance_rows, trust_rows
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES

UNTRIED: Final = "written from the manual (ISG FCT-C26, Beckhoff TF5280), not tried on a controller"
MOST_ROWS: Final = 5000
# Largest deviation of a parabola between two nodes, mm: ten times below what can be measured.
HIDDEN: Final = 1e-5


def isg(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """The file, and the entries of the compensation list that belong to it."""
    rows = MOST_ROWS if options.rows is None else options.rows
    if not 2 <= rows <= MOST_ROWS:
        raise InvalidArgument(f"`rows`: expected 2 to {MOST_ROWS}, got {rows}")
    missing = require(calibration, [*FUNCTIONS, *SQUARENESSES], options)
    tool, origin = tool_of(calibration, options), origin_of(options)
    approach = options.approach or "mean"
    apart = options.squareness == "parameters"
    errors = compensated_map(calibration, approach)
    exact = Machine(calibration.chain, errors, tool)
    letters = [letter for letter in calibration.chain.name if letter in AXES]
    tables = {
        axis: _axis_table(exact, axis, letters, float(calibration.volume[n]), origin, rows, apart)
        for n, axis in enumerate(AXES)
    }
    squareness = errors.squareness if apart else {}
    functions = {name: (x, column) for x, named in tables.values() for name, column in named.items()}
    tool_side = Chain(f"[w b {' '.join(letters)} t]")
    loss = _largest_loss(exact, Machine(tool_side, ErrorMap(functions, squareness), tool), tables, origin)

    records = sum(len(x) for x, _ in tables.values()) + bool(squareness) + 1
    angles = ", ".join(f"{name} = {angle * 1e6:.6g} µrad" for name, angle in errors.squareness.items())
    where = "as parameters" if apart else "in the straightnesses: EXY - C0Y y, EXZ + B0Z z, EYZ - A0Z z"
    lines = [
        *trust_rows(calibration),
        temperature_row(calibration),
        *provenance_rows(calibration),
        UNTRIED,
        f"chain {calibration.chain}, volume {words(calibration.volume)} mm, home at {words(origin)} mm in the "
        f"controller's coordinates, direction of approach {APPROACH_WORDS[approach]}",
        "sign: errors, actual - commanded of the tool relative to the workpiece (ISO 230-1); if the machine gets "
        "worse, set negate XYZ",
        f"straightness: of the functional point, tool offset {words(tool)} mm, other axes at 0 (every axis taken as "
        "one that carries the tool)",
        f"squareness {where}: {angles or 'none known'}; positive turns Y or Z by the right-hand rule",
        f"rows: {', '.join(f'{axis} {len(x)}' for axis, (x, _) in tables.items())}; this model differs from the exact "
        f"one by at most {loss * 1e3:.2g} µm in the volume",
        f"compensation list: chain {''.join(letters)}, workpiece_axes 0, interpolation GRID, file_format[0] ISG_CSV; "
        f"start-up list: vol_comp[0].max_records {records} or more",
        *missing,
    ]
    text = _text(lines, tables, squareness, tool)
    return Export({output: text}, lines, coverage_of(calibration, [*FUNCTIONS, *SQUARENESSES]))


Table = tuple[FloatArray, dict[str, FloatArray]]


def _axis_table(
    exact: Machine, axis: str, letters: list[str], edge: float, origin: FloatArray, rows: int, apart: bool
) -> Table:
    """Positions of an axis in the controller's coordinates, and its six functions there.

    The functions are those of an axis that carries the tool."""
    own = {name: table for name, table in exact.errors.functions.items() if name[2] == axis}
    squareness = {} if apart else {n: a for n, a in exact.errors.squareness.items() if n[2] == axis}
    alone = ErrorMap(own, squareness)
    # The controller's L contains positions from its own origin. Their contribution is subtracted.
    after = [AXES.index(letter) for letter in letters[letters.index(axis) + 1 :]]
    lever = np.zeros(3)
    lever[after] = -origin[after]
    nodes = inside(common_nodes(alone, axis), edge)
    if exact.chain.carries_workpiece(axis):
        nodes = _where_parabolas_hide_little(alone, axis, nodes)
    line = np.zeros((len(nodes), 3))
    line[:, AXES.index(axis)] = nodes
    delta = Machine(exact.chain, alone, lever).first_order_error(line)
    if apart:
        # The controller's squareness refers to its own 0, not to home.
        slopes = ErrorMap({}, {n: a for n, a in exact.errors.squareness.items() if n[2] == axis})
        shift = np.where(np.arange(3) == AXES.index(axis), -origin, 0.0)
        delta = delta + Machine(exact.chain, slopes).first_order_error(shift[None, :])
    theta = np.array([alone.function(f"E{turn}{axis}", nodes) for turn in "ABC"])
    # Rotations are weighted by the displacement that they cause at the farthest point.
    kept = best_subset(nodes, np.concatenate([delta.T, theta * 3.0 * edge]), rows)
    columns = dict(zip((f"E{component}{axis}" for component in "XYZABC"), [*delta.T, *theta], strict=True))
    return nodes[kept] + origin[AXES.index(axis)], {name: column[kept] for name, column in columns.items()}


def _where_parabolas_hide_little(errors: ErrorMap, axis: str, nodes: FloatArray) -> FloatArray:
    """Add nodes such that chords hide little.

    Between two nodes theta p is a parabola; it deviates from its chord by step · d(theta) / 4."""
    theta = np.array([errors.function(f"E{turn}{axis}", nodes) for turn in "ABC"])
    step = np.diff(nodes)
    bulge = 0.25 * step * np.max(np.abs(np.diff(theta, axis=1)), axis=0)
    parts = np.clip(np.ceil(np.sqrt(bulge / HIDDEN)), 1, 100).astype(int)
    finer = [a + h / n * np.arange(n) for a, h, n in zip(nodes, step, parts, strict=False)]
    return np.concatenate([*finer, nodes[-1:]])


def _largest_loss(exact: Machine, written: Machine, tables: dict[str, Table], origin: FloatArray) -> float:
    """Largest distance in the volume between the written model's errors and the exact ones, mm."""
    samples = []
    for n, axis in enumerate(AXES):
        x = tables[axis][0]
        nodes = np.union1d(x, inside(common_nodes(exact.errors, axis), float(x[-1] - x[0])) + origin[n])
        samples.append(np.union1d(nodes, 0.5 * (nodes[1:] + nodes[:-1])))

    def distance(places: FloatArray) -> FloatArray:
        there = exact.error(places - origin)
        # The manuals do not say whether a controller includes products of two errors.
        models = (written.error(places), written.first_order_error(places))
        return np.asarray(np.max([np.linalg.norm(model - there, axis=1) for model in models], axis=0))

    grid = np.stack(np.meshgrid(*(spread(s, 41) for s in samples), indexing="ij"), axis=-1)
    found = distance(grid.reshape(-1, 3)).reshape(grid.shape[0], -1)
    # From the worst point of each slice along one axis after the other, as long as it gets worse.
    starts = grid.reshape(len(grid), -1, 3)[np.arange(len(grid)), np.argmax(found, axis=1)]
    return max(_climbed(place, samples, distance) for place in starts)


def _climbed(place: FloatArray, samples: list[FloatArray], distance: Callable[[FloatArray], FloatArray]) -> float:
    best, before = float(distance(place[None, :])[0]), -1.0
    while best > before:
        before = best
        for n, along in enumerate(samples):
            line = np.tile(place, (len(along), 1))
            line[:, n] = along
            found = distance(line)
            if found.max() > best:
                best, place = float(found.max()), line[int(np.argmax(found))]
    return best


def _text(lines: list[str], tables: dict[str, Table], squareness: dict[str, float], tool: FloatArray) -> str:
    """Decimals without exponent: nine places for mm, twelve for rad."""
    blocks = []
    for axis, (x, columns) in tables.items():
        rows = [f"{axis} {' '.join(columns)}"]
        for k, position in enumerate(x):
            moved = " ".join(f"{column[k]:.9f}" for column in list(columns.values())[:3])
            turned = " ".join(f"{column[k]:.12f}" for column in list(columns.values())[3:])
            rows.append(f"{position:.9f} {moved} {turned}")
        blocks.append("\n".join(rows))
    if squareness:
        blocks.append(f"{' '.join(squareness)}\n{' '.join(f'{angle:.12f}' for angle in squareness.values())}")
    blocks.append(f"P0X P0Y P0Z\n{' '.join(f'{t:.9f}' for t in tool)}")
    # A # begins a new header anywhere. The manuals do not say what comments may contain.
    head = "".join(f"// {line}\n" for line in ["stepdiag export --to isg", *lines]).replace("#", "")
    return in_ascii(head) + "\n#\n".join(blocks) + "\n"
