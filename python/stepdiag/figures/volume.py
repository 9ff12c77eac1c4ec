"""Figure of the error in the volume: three planes through the point with the largest one."""

from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from stepdiag._core import Calibration, InvalidArgument, Machine, errors_at
from stepdiag.calibration.volume import VolumeErrors
from stepdiag.figures.page import Heading, Page
from stepdiag.findings.temperature import temperature_mark
from stepdiag.parameters import AXES
from stepdiag.style import COLOUR, axis_label, own_style

FloatArray = npt.NDArray[np.float64]

WIDTH: Final = 13.4
FREE: Final = 3.1  # width of margins, labels and colour bar
TALLEST: Final = 7.0
POINTS: Final = 61  # of a plane along each axis
ARROWS: Final = 9  # along each axis
PLANES: Final = ((0, 1), (0, 2), (1, 2))
COLOURS: Final = "cividis"  # the same lightness for every colour vision


def draw_volume(found: VolumeErrors, name: str = "calibration") -> Figure:
    """Draw the length of the error of the functional point in three planes through the worst point.

    Arrows show the error in the plane, enlarged. `name`: the title. Raises InvalidArgument if
    parameters that act in the error are not determined."""
    if not np.isfinite(found.largest):
        lacking = sorted({parameter for names in found.missing.values() for parameter in names})
        raise InvalidArgument(f"the error in the volume is not known: {', '.join(lacking)} are not determined")
    machine = _machine(found)
    edges = found.box[1] - found.box[0]
    widths = [float(edges[u]) for u, _ in PLANES]
    scale = min((WIDTH - FREE) / sum(widths), TALLEST / float(max(edges[1], edges[2])))  # inches on a mm
    with own_style():
        unverified = isinstance(found.source, Calibration) and found.source.unverified
        heading = Heading(f"{name}: error in the volume", _facts(found), found.fit, unverified=unverified)
        note = "planes through the point with the largest error (cross); arrows: error in the plane, enlarged"
        if isinstance(found.source, Calibration):
            note += f"; positioning errors {temperature_mark(found.source)}"
        page = Page(heading, WIDTH, scale * float(max(edges[1], edges[2])) + 0.75, [note])
        bar_width = 0.18 / scale
        spaces = 3.2 * bar_width
        grid = page.grid(
            1,
            7,
            width_ratios=[widths[0], spaces, widths[1], spaces, widths[2], bar_width, bar_width],
            wspace=0.0,
            right=1.0 - 0.75 / WIDTH,
        )
        top = found.largest * 1e3
        for column, plane in enumerate(PLANES):
            axes = page.figure.add_subplot(grid[0, 2 * column])
            u, v = (_along(found, axis, POINTS) for axis in plane)
            length = 1e3 * np.linalg.norm(_errors(machine, found, plane, u, v), axis=-1)
            drawn = axes.pcolormesh(u, v, length, vmin=0.0, vmax=top, cmap=COLOURS, shading="gouraud", rasterized=True)
            u, v = (_along(found, axis, ARROWS + 2)[1:-1] for axis in plane)
            error = 1e3 * _errors(machine, found, plane, u, v)
            arrows: dict[str, Any] = {"color": "black", "edgecolor": "white", "linewidth": 0.5, "width": 0.005}
            axes.quiver(u, v, error[..., plane[0]], error[..., plane[1]], scale=12.0 * top, **arrows)
            worst = found.largest_at[list(plane)]
            axes.plot(*worst, "X", color=COLOUR["outlier"], markersize=9.0, markeredgecolor="white", clip_on=False)
            across = ({0, 1, 2} - set(plane)).pop()
            axes.set_title(f"{AXES[across]} = {found.largest_at[across]:g} mm", weight="bold", pad=4.0)
            axes.set_xlabel(axis_label(f"position {AXES[plane[0]]}", "mm"))
            axes.set_ylabel(axis_label(f"position {AXES[plane[1]]}", "mm"))
            axes.set_aspect("equal", anchor="SW")
            axes.grid(visible=False)
        bar = page.figure.colorbar(drawn, cax=page.figure.add_subplot(grid[0, 6]))
        bar.set_label(axis_label("length of the error", "µm"))
        return page.finish()


def _machine(found: VolumeErrors) -> Machine:
    source = found.source
    return Machine(source.chain, source.errors if isinstance(source, Machine) else source.to_error_map(), found.tool)


def _along(found: VolumeErrors, axis: int, count: int) -> FloatArray:
    low, high = found.box[:, axis].tolist()
    return np.linspace(low, high, count)


def _errors(machine: Machine, found: VolumeErrors, plane: tuple[int, int], u: FloatArray, v: FloatArray) -> FloatArray:
    """(len(v), len(u), 3): errors at the points of a plane through the worst point, mm."""
    points = np.tile(found.largest_at, (len(v), len(u), 1))
    points[..., plane[0]], points[..., plane[1]] = np.meshgrid(u, v)
    errors: FloatArray = errors_at(machine, points.reshape(-1, 3))[:, :3].reshape(points.shape)
    return errors


def _facts(found: VolumeErrors) -> str:
    x, y, z = found.largest_at
    dx, dy, dz = 1e3 * found.largest_components
    text = f"largest {1e3 * found.largest:.3g} µm"
    if found.largest_interval is not None:
        low, high = (1e3 * end for end in found.largest_interval)
        text += f" (95 %: {low:.3g} to {high:.3g} µm)"
    text += (
        f" at X {x:g}, Y {y:g}, Z {z:g} mm, components {dx:.3g}, {dy:.3g}, {dz:.3g} µm; rms {1e3 * found.rms:.3g} µm"
    )
    if found.limit is not None and found.verdict is not None:
        text += f"; {found.verdict} the limit of {1e3 * found.limit:g} µm"
    if found.interval_note:
        text += f" ({found.interval_note})"
    return text
