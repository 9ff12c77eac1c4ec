"""Panels of the 21 parameters: a row for each axis, columns by family, squarenesses as bars."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from stepdiag.figures.page import SMALL, Page
from stepdiag.parameters import (
    AXES,
    REPORT_UNIT,
    SQUARENESSES,
    Kind,
    in_report_units,
    kind_of,
)
from stepdiag.style import BAND, COLOUR, axis_label

FloatArray = npt.NDArray[np.float64]

COVERAGE_FACTOR: Final = 1.959963984540054  # of 95 %, normal distribution
WIDTH, HEIGHT = 13.4, 5.9
COLUMNS: Final[Mapping[str, tuple[str, ...]]] = {
    "X": ("EXX", "EYX", "EZX", "EAX", "EBX", "ECX"),
    "Y": ("EYY", "EXY", "EZY", "EAY", "EBY", "ECY"),
    "Z": ("EZZ", "EXZ", "EYZ", "EAZ", "EBZ", "ECZ"),
}
_FIRST: Final = {"positioning": 0, "straightness": 1, "angle": 3}  # column of each family
_WIDTHS: Final = (1, 0.16, 1, 1, 0.16, 1, 1, 1, 0.3, 0.7)  # narrow ones: room for the labels of the next panel
_PLACES: Final = (0, 2, 3, 5, 6, 7)
_WORDS: Final = {0: "positioning", 1: "straightness", 3: "angles"}
VALUE: Final[Mapping[str, Any]] = {"linewidth": 1.1, "marker": ".", "markersize": 2.2}
TRUTH: Final[Mapping[str, Any]] = {"color": COLOUR["truth"], "linewidth": 0.9, "linestyle": (0, (3, 2)), "zorder": 3}
BARS: Final = "#4a4a4a"  # of squarenesses, which belong to two axes
HATCH: Final[Mapping[str, Any]] = {"facecolor": "#f2f2f2", "edgecolor": "#c4c4c4", "hatch": "////", "linewidth": 0.0}


class ParameterPanels:
    """Eighteen panels of functions over position, and one of squarenesses.

    `quantity`: text of the value axes, such as "error" or "standard uncertainty". `travel`: of X, Y, Z, mm."""

    def __init__(self, page: Page, travel: npt.ArrayLike, quantity: str, *, below: float = 0.0) -> None:
        self.travel = dict(zip(AXES, np.asarray(travel, dtype=float).tolist(), strict=True))
        grid = page.grid(3, len(_WIDTHS), below=below, width_ratios=_WIDTHS, wspace=0.2, hspace=0.52)
        self.axes: dict[str, Axes] = {}
        first: dict[int, Axes] = {}
        for row, axis in enumerate(AXES):
            for column, name in enumerate(COLUMNS[axis]):
                family = _FIRST[kind_of(name)]
                axes = page.figure.add_subplot(grid[row, _PLACES[column]], sharey=first.get(family))
                first.setdefault(family, axes)
                axes.set_xlim(0.0, self.travel[axis])
                axes.margins(y=0.08)
                axes.set_xlabel(axis_label(f"position {axis}", "mm"), size=SMALL, labelpad=1.0)
                axes.set_title(name, color=COLOUR[axis], weight="bold", pad=3.0)
                axes.tick_params(labelleft=column == family, length=2.0)
                if column == family:
                    unit = REPORT_UNIT[kind_of(name)]
                    axes.set_ylabel(axis_label(f"{_WORDS[family]}, {quantity}" if quantity else _WORDS[family], unit))
                self.axes[name] = axes
        self.squareness = page.figure.add_subplot(grid[:, len(_WIDTHS) - 1])
        self.squareness.set_title("squarenesses", weight="bold", pad=3.0)
        label = f"squareness, {quantity}" if quantity else "squareness"
        self.squareness.set_ylabel(axis_label(label, REPORT_UNIT["squareness"]))
        self.squareness.set_xlim(-0.6, len(SQUARENESSES) - 0.4)
        self.squareness.set_xticks(range(len(SQUARENESSES)), SQUARENESSES)
        self.squareness.grid(axis="x", visible=False)

    def draw(
        self, name: str, position: FloatArray, value: FloatArray, low: Any = None, high: Any = None, **style: Any
    ) -> None:
        """A curve with its band, native units; NaN interrupts both."""
        axes, colour = self.axes[name], style.pop("color", COLOUR[name[2]])
        y = scaled(name, value)
        axes.plot(position, y, **{"color": colour, **VALUE, **style})
        alone = _alone(y)
        axes.plot(position[alone], y[alone], "o", color=colour, markersize=4.5, clip_on=False, zorder=3)
        if low is not None and np.isfinite(low).any():
            axes.fill_between(
                position, scaled(name, low), scaled(name, high), color=colour, alpha=BAND, linewidth=0.0, zorder=1
            )

    def draw_squareness(self, name: str, value: float, half: float, **style: Any) -> None:
        """A value with its bar from -half to +half, rad."""
        place = SQUARENESSES.index(name) + style.pop("shift", 0.0)
        y, bar = scaled(name, value), scaled(name, half)
        style = {"fmt": "o", "color": BARS, "markersize": 4.0, "capsize": 4.0, "linewidth": 1.4, **style}
        self.squareness.errorbar([place], [y], yerr=None if np.isnan(bar) else [bar], **style)

    def draw_true_squareness(self, name: str, value: float) -> None:
        place = SQUARENESSES.index(name)
        self.squareness.hlines(scaled(name, value), place - 0.4, place + 0.4, **TRUTH)

    def remark(self, name: str, text: str) -> None:
        """A small text beside the name of a panel."""
        self.axes[name].set_title(text, loc="right", size=6.5, pad=3.0, color="#444444")

    def mark_missing(self, name: str, text: str = "not determined") -> None:
        """Hatch the panel of a parameter, or the place of a squareness."""
        if name in self.axes:
            axes = self.axes[name]
            axes.axvspan(0.0, self.travel[name[2]], zorder=0.5, **HATCH)
            place = (0.5, 0.5)
        else:
            axes, k = self.squareness, SQUARENESSES.index(name)
            axes.axvspan(k - 0.4, k + 0.4, zorder=0.5, **HATCH)
            place = ((k + 0.6) / len(SQUARENESSES), 0.5)
        axes.text(
            *place,
            text,
            transform=axes.transAxes,
            size=SMALL,
            rotation=0.0 if name in self.axes else 90.0,
            horizontalalignment="center",
            verticalalignment="center",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
        )

    def mark_gaps(self, name: str, position: FloatArray, value: FloatArray) -> None:
        """Hatch the ranges of a function without values."""
        for low, high in _gaps(position, value):
            self.axes[name].axvspan(low, high, zorder=0.5, **HATCH)

    def zero_lines(self) -> None:
        for axes in (*self.axes.values(), self.squareness):
            axes.axhline(0.0, color="#777777", linewidth=0.6, zorder=0.8)


def scaled(name: str, value: Any) -> Any:
    """Values of a parameter in the units of reports."""
    return np.asarray(value, dtype=float) * in_report_units(kind_of(name), 1.0)


def _gaps(position: FloatArray, value: FloatArray) -> Iterator[tuple[float, float]]:
    """Ranges without a value, each between its known neighbours."""
    known = np.flatnonzero(np.isfinite(value))
    for before, after in pairwise(known):
        if after > before + 1:
            yield float(position[before]), float(position[after])
    for start, end in ((0, known[0]), (known[-1], len(value) - 1)):
        if end > start:
            yield float(position[start]), float(position[end])


def _alone(value: FloatArray) -> npt.NDArray[np.bool_]:
    """Values without a neighbour, of which no line would show anything."""
    known = np.concatenate([[False], np.isfinite(value), [False]])
    alone: npt.NDArray[np.bool_] = known[1:-1] & ~known[:-2] & ~known[2:]
    return alone


def largest(name: str, position: FloatArray, value: FloatArray) -> str:
    """The largest value and its place, for the head of a panel; empty if all are 0 or unknown."""
    known = np.where(np.isfinite(value), np.abs(value), -1.0)
    k = int(np.argmax(known))
    if known[k] <= 0.0:
        return ""
    kind: Kind = kind_of(name)
    return f"{in_report_units(kind, float(value[k])):.3g} {REPORT_UNIT[kind]} at {position[k]:g}"
