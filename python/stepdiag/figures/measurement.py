"""Figure of a measurement: readings, or residuals of its adjustment with outliers and slips."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from stepdiag._core import Adjustment, InvalidArgument, Measurement
from stepdiag.figures.page import SMALL, Heading, Page
from stepdiag.findings.faults import fault_rows
from stepdiag.findings.reasons import reason_texts
from stepdiag.style import BAND, COLOUR, axis_label, own_style, plain
from stepdiag.units import MICRO

FloatArray = npt.NDArray[np.float64]

COVERAGE_FACTOR: Final = 1.959963984540054  # of 95 %, normal distribution
WIDTH: Final = 13.4
MOST_COLUMNS: Final = 7  # lines beside each other
PANEL_HEIGHT: Final = 1.75
_READING: Final = re.compile(r"distance|alpha|beta|spot_[xy]|d\d+")
_POINTS: Final[Mapping[str, Mapping[str, Any]]] = {
    "forward": {"linewidth": 0.7, "marker": ".", "markersize": 2.5, "color": COLOUR["forward"]},
    # Dashes, because it often lies on the other one.
    "backward": {"linewidth": 1.1, "linestyle": (0, (2, 2)), "color": COLOUR["backward"]},
}


@dataclass(frozen=True)
class _Line:
    """Rows of a line, in the order of runs and points, and their positions along it (mm)."""

    name: str
    rows: npt.NDArray[np.intp]
    along: FloatArray


def draw_measurement(measurement: Measurement, adjustment: Adjustment | None = None, name: str = "run") -> Figure:
    """Draw a measurement by line and channel, over the position along the line.

    Without an adjustment: readings; distances as deviations from the commanded path, 0 at the first
    point of each line and run. With the adjustment of this measurement: residuals (read minus
    adjusted) with the 95 % band of their own standard uncertainty, left-out readings and slips with
    the numbers of their classes of faults. `name`: the title. Raises InvalidArgument if the
    measurement has no readings, or the adjustment is of another one."""
    values = _readings(measurement) if adjustment is None else _used_residuals(adjustment)
    if not any(np.isfinite(value).any() for value in values.values()):
        raise InvalidArgument("expected a measurement with readings, got empty fields only")
    if any(len(value) != len(measurement) for value in values.values()):
        raise InvalidArgument(f"`adjustment`: expected that of this measurement of {len(measurement)} rows")
    lines = [_line(measurement, line) for line in dict.fromkeys(measurement.line)]
    bands = {} if adjustment is None else _bands(adjustment)
    columns = min(len(lines), MOST_COLUMNS)
    blocks = -(-len(lines) // columns)
    with own_style():
        height = 0.35 + PANEL_HEIGHT * len(values) * blocks
        page = Page(_heading(measurement, adjustment, name), WIDTH, height, _notes(adjustment))
        grid = page.grid(len(values) * blocks, columns, wspace=0.14, hspace=0.6)
        first: dict[str, Axes] = {}
        panels: dict[tuple[str, str], Axes] = {}
        for k, line in enumerate(lines):
            for number, channel in enumerate(values):
                place = grid[k // columns * len(values) + number, k % columns]
                axes = page.figure.add_subplot(place, sharey=first.get(channel))
                first.setdefault(channel, axes)
                lost = np.isnan((measurement.channels if adjustment is None else adjustment.residuals)[channel])
                _draw_line(axes, measurement, line, values[channel] * _factor(channel), bands.get(channel), lost)
                axes.set_title(f"{line.name}  {plain(channel)}", weight="bold", pad=3.0)
                axes.set_xlabel(axis_label("position along line", "mm"), size=SMALL, labelpad=1.0)
                axes.tick_params(labelleft=k % columns == 0, length=2.0)
                if k % columns == 0:
                    axes.set_ylabel(axis_label(_quantity(channel, adjustment), _unit(channel)))
                panels[line.name, channel] = axes
        if adjustment is not None:
            for channel, axes in first.items():
                _limit(axes, values[channel] * _factor(channel), bands[channel])
            _mark_faults(panels, adjustment, {line.name: line for line in lines})
        page.legend(list(_handles(measurement, adjustment, values)))
        return page.finish()


def _readings(measurement: Measurement) -> dict[str, FloatArray]:
    """Readings as deviations (mm or rad): of lengths from the commanded path."""
    found = {name: value for name, value in measurement.channels.items() if _READING.fullmatch(name)}
    for name, value in found.items():
        if name.startswith("d"):
            found[name] = _deviation(measurement, np.asarray(value, dtype=float))
    return found


def _deviation(measurement: Measurement, reading: FloatArray) -> FloatArray:
    result = np.full(len(reading), np.nan)
    for line in dict.fromkeys(measurement.line):
        whole = _line(measurement, line)
        for run in np.unique(measurement.run[whole.rows]):
            own = measurement.run[whole.rows] == run
            rows, along = whole.rows[own], whole.along[own]
            known = np.flatnonzero(np.isfinite(reading[rows]))
            if len(known):
                k = known[0]
                result[rows] = reading[rows] - reading[rows[k]] - (along - along[k])
    return result


def _line(measurement: Measurement, name: str) -> _Line:
    """Its rows, and how far each point is from the first one along the line."""
    rows = np.flatnonzero(np.asarray(measurement.line) == name)
    rows = rows[np.lexsort((measurement.point[rows], measurement.run[rows]))]
    point, position = measurement.point[rows], measurement.position[rows]
    start, end = position[np.argmin(point)], position[np.argmax(point)]
    length = float(np.linalg.norm(end - start))
    along = (position - start) @ ((end - start) / length) if length > 0.0 else np.zeros(len(rows))
    return _Line(name, rows, along)


def _used_residuals(adjustment: Adjustment) -> dict[str, FloatArray]:
    """NaN where a reading was lost or left out: the latter are marked on their own."""
    used = adjustment.used
    return {channel: np.where(used[channel], value, np.nan) for channel, value in adjustment.residuals.items()}


def _bands(adjustment: Adjustment) -> dict[str, FloatArray]:
    """Half widths of 95 % of used residuals (µm or µrad); NaN where nothing controls a reading."""
    bands = {}
    for channel, residual in adjustment.residuals.items():
        normalised = adjustment.normalised_residuals[channel]
        with np.errstate(divide="ignore", invalid="ignore"):
            own = np.abs(residual / normalised)
        known = np.isfinite(own) & adjustment.used[channel]
        bands[channel] = np.where(known, COVERAGE_FACTOR * own, np.nan) * _factor(channel)
    return bands


def _draw_line(
    axes: Axes,
    measurement: Measurement,
    line: _Line,
    value: FloatArray,
    band: FloatArray | None,
    is_lost: npt.NDArray[np.bool_],
) -> None:
    direction = np.asarray(measurement.direction)
    for run in np.unique(measurement.run[line.rows]):
        own = measurement.run[line.rows] == run
        rows, along = line.rows[own], line.along[own]
        style = _POINTS["backward" if (direction[rows] == "backward").all() else "forward"]
        axes.plot(along, value[rows], **style)
        if band is not None and np.isfinite(band[rows]).any():
            axes.fill_between(along, -band[rows], band[rows], color=style["color"], alpha=BAND, linewidth=0.0, zorder=1)
        lost = along[is_lost[rows]]
        axes.plot(lost, np.full(len(lost), 0.03), "|", color="#777777", transform=axes.get_xaxis_transform())
    axes.axhline(0.0, color="#777777", linewidth=0.6, zorder=0.8)


def _limit(axes: Axes, used: FloatArray, band: FloatArray) -> None:
    """Show used residuals and their bands in full; a gross outlier would flatten them."""
    largest = max((float(np.nanmax(np.abs(x))) for x in (used, band) if np.isfinite(x).any()), default=0.0)
    if largest > 0.0:
        axes.set_ylim(-1.3 * largest, 1.3 * largest)


def _mark_faults(panels: Mapping[tuple[str, str], Axes], adjustment: Adjustment, lines: Mapping[str, _Line]) -> None:
    """Mark every reading that was left out, and every slip, with the number of its class."""
    for outlier in adjustment.outliers:
        axes, line = panels[outlier.line, outlier.channel], lines[outlier.line]
        along = float(line.along[line.rows == outlier.row][0])
        y = outlier.residual * _factor(outlier.channel)
        limit = 0.86 * axes.get_ylim()[1]
        (mark,) = axes.plot(
            along, np.clip(y, -limit, limit), "X", color=COLOUR["outlier"], markersize=6.0, markeredgewidth=0.0
        )
        mark.set_gid(f"outlier-{outlier.row}-{outlier.channel}")
        beyond = f" ({y:+.3g})" if abs(y) > limit else ""
        _number(axes, along, float(np.clip(y, -limit, limit)), f"{outlier.number}{beyond}", COLOUR["outlier"])
    for number, found in enumerate(adjustment.faults, 1):
        for fault in found.members:
            if fault.kind != "slip" or (fault.line, fault.channel) not in panels:
                continue
            axes, line = panels[fault.line, fault.channel], lines[fault.line]
            along = float(line.along[line.rows == fault.row][0])
            mark = axes.axvline(along, color=COLOUR["slip"], linewidth=0.9, linestyle=(0, (4, 2)))
            mark.set_gid(f"slip-{fault.row}-{fault.channel}")
            _number(axes, along, 0.86 * axes.get_ylim()[1], str(number), COLOUR["slip"])


def _number(axes: Axes, along: float, y: float, text: str, colour: str) -> None:
    low, high = axes.get_xlim()
    right = along > 0.5 * (low + high)
    axes.annotate(
        text,
        (along, y),
        xytext=(-5.0 if right else 5.0, 0.0),
        textcoords="offset points",
        horizontalalignment="right" if right else "left",
        verticalalignment="center",
        size=SMALL,
        weight="bold",
        color=colour,
    )


def _heading(measurement: Measurement, adjustment: Adjustment | None, name: str) -> Heading:
    runs = len(np.unique(measurement.run))
    facts = f"{len(measurement)} points on {len(set(measurement.line))} lines, {runs} run{'' if runs == 1 else 's'}"
    if adjustment is None:
        return Heading(f"{name}: readings", facts)
    facts += (
        f"; readings left out: {len(adjustment.outliers)}, classes of faults: {len(adjustment.faults)}; "
        f"variance factor {adjustment.variance_factor:.3g} with {adjustment.degrees_of_freedom} degrees of freedom"
    )
    verdict = adjustment.verdict
    return Heading(f"{name}: residuals of the adjustment", facts, verdict.fit, reason_texts(verdict.reasons))


def _notes(adjustment: Adjustment | None) -> list[str]:
    return [] if adjustment is None else [": ".join(row) for row in fault_rows(adjustment.faults)]


def _handles(
    measurement: Measurement, adjustment: Adjustment | None, values: Mapping[str, FloatArray]
) -> Iterator[Any]:
    directions = set(measurement.direction)
    for direction in ("forward", "backward"):
        if direction in directions:
            yield Line2D([], [], label=direction, **_POINTS[direction])
    if adjustment is not None:
        yield Patch(facecolor=COLOUR["forward"], alpha=BAND, label="95 % of residuals (1.96 u)")
    if any(np.isnan(value).any() for value in values.values()):
        yield Line2D([], [], linestyle="none", marker="|", color="#777777", label="lost reading")
    if adjustment is not None and adjustment.outliers:
        label = "left out, with the number of its fault"
        yield Line2D([], [], linestyle="none", marker="X", color=COLOUR["outlier"], markeredgewidth=0.0, label=label)
    if adjustment is not None and any(_slips(adjustment)):
        label = "slip from here on, with the number of its fault"
        yield Line2D([], [], color=COLOUR["slip"], linewidth=0.9, linestyle=(0, (4, 2)), label=label)


def _slips(adjustment: Adjustment) -> Sequence[bool]:
    return [fault.kind == "slip" for found in adjustment.faults for fault in found.members]


def _factor(channel: str) -> float:
    """From native units to those of the figure."""
    return MICRO if channel in ("alpha", "beta") else 1e3


def _unit(channel: str) -> str:
    return "µrad" if channel in ("alpha", "beta") else "µm"


def _quantity(channel: str, adjustment: Adjustment | None) -> str:
    if adjustment is not None:
        return f"residual of {channel}"
    return f"deviation of {channel}" if channel.startswith("d") else channel
