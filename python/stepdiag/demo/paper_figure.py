"""Figure of the demonstration, after Figure 5 of the paper."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stepdiag._core import ErrorMap
from stepdiag.demo.paper_cases import POSITIONING, Result
from stepdiag.style import COLOUR, axis_label, own_style, save

FloatArray = npt.NDArray[np.float64]

# One colour per axis and one line style per method; the adjustment, which lies on the truth, is black on its colour.
TRUTH: Mapping[str, Any] = {"linewidth": 4.0, "alpha": 0.32, "solid_capstyle": "butt"}
ENHANCED: Mapping[str, Any] = {"linewidth": 1.0}
CONVENTIONAL: Mapping[str, Any] = {"linewidth": 1.0, "linestyle": (0, (4, 1.6))}
ADJUSTMENT: Mapping[str, Any] = {"linewidth": 1.3, "linestyle": (0, (1, 1.8)), "color": "black"}
DOTS: Mapping[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.0}
METHODS: Mapping[str, Mapping[str, Any]] = {
    "conventional": CONVENTIONAL,
    "enhanced": ENHANCED,
    "adjustment": ADJUSTMENT,
}

STRAIGHTNESS = ("EYX", "EZY", "EXZ")
ANGLES = ("ECX", "EAY", "EBZ")

ALL = ("conventional", "enhanced", "adjustment")

# Panel: title, case, functions, methods.
PANELS: Mapping[str, tuple[str, str, Sequence[str], Sequence[str]]] = {
    "1a": ("kinematic errors only", "1a", POSITIONING, ALL),
    "1b": ("reflector 100, 300 µrad", "1b", POSITIONING, ALL),
    "1c": ("laser 700, 1000 µrad", "1c", POSITIONING, ALL),
    "1d": ("as 1c, the mirror follows", "1d", POSITIONING, ALL),
    "2": ("straightness of 1a; hardly different in 1b to 1d", "1a", STRAIGHTNESS, ALL),
    "3a": ("PSD displaced by 1.5, 2 mm", "3", POSITIONING, ("enhanced", "adjustment")),
    "3b": ("as 3a", "3", ANGLES, ("enhanced", "adjustment")),
}
DEFINED = ("3a", "3b")  # traced, with what the definition of the readings gives beside it
# Panels of what the methods leave, which lines on the truth cannot show: title, case.
LEFT: Mapping[str, tuple[str, str]] = {
    "1a left": ("what 1a leaves", "1a"),
    "1b left": ("what 1b leaves", "1b"),
    "1c left": ("what 1c leaves", "1c"),
    "1d left": ("what 1d leaves", "1d"),
}
SMALLEST = 1e-12  # µm: a deviation of 0 is drawn there
MARKS: Mapping[str, str] = {"conventional": "s", "enhanced": "o", "adjustment": "D"}
YLABEL = {
    "1a": "positioning (µm)",
    "1a left": "largest deviation (µm)",
    "2": "straightness (µm)",
    "3a": "positioning (µm)",
    "3b": "angles (µrad)",
    "4": "ripple, shifted (µm)",
}


def draw_figure(results: Sequence[Result]) -> dict[str, bytes]:
    """The figure as files, figure.png and figure.svg. Same results give the same bytes."""
    by_name = {result.case.name: result for result in results}
    with own_style():
        figure = Figure(figsize=(10.0, 10.4), layout="constrained")
        rows: list[Any] = [["1a", "1b", "1c", "1d"], list(LEFT), ["2", "2", "3a", "3b"], ["4"] * 4]
        panels = figure.subplot_mosaic(rows, height_ratios=[1.0, 0.72, 1.0, 0.8])
        for name, (title, case, functions, methods) in PANELS.items():
            draw_functions(panels[name], by_name[case], functions, methods)
            set_title(panels[name], name, title)
        for name, (title, case) in LEFT.items():
            draw_left(panels[name], by_name[case])
            panels[name].set_title(title)
        for name in DEFINED:
            draw_definition(panels[name], by_name["3d"], PANELS[name][2])
        draw_screw(panels["4"], by_name["4"])
        set_title(panels["4"], "4", "screw error of 10 mm pitch: right at the nodes, unseen between them")
        for name, label in YLABEL.items():
            panels[name].set_ylabel(label)
        for name in ("1a", "1b", "1c", "1d", "2", "3a", "3b", "4"):
            panels[name].set_xlabel(axis_label("position", "mm"))
        figure.legend(handles=legend_handles(), loc="outside upper center", ncols=4, handlelength=3.0)
        return {"figure.png": save(figure, "png"), "figure.svg": save(figure, "svg")}


def set_title(axes: Axes, name: str, title: str) -> None:
    axes.set_title(f"$\\bf{{{name}}}$  {title}")


def legend_handles() -> list[Any]:
    styles = {"truth": TRUTH, **METHODS, "enhanced, by definition of the readings (3a, 3b)": DOTS}
    lines = [Line2D([], [], label=name, **{"color": "black", **style}) for name, style in styles.items()]
    marks = [
        Line2D([], [], linestyle="none", marker=marker, color=COLOUR[method], markersize=4.5, label=f"{method} leaves")
        for method, marker in MARKS.items()
    ]
    return [*lines, *marks]


def draw_functions(axes: Axes, result: Result, names: Sequence[str], methods: Sequence[str]) -> None:
    """Draw error functions over position: truth as a broad pale line, the methods above it."""
    for name in names:
        scale = 1e6 if name[1] in "ABC" else 1e3
        position, value = result.truth.functions[name]
        axes.plot(position, value * scale, color=COLOUR[name[2]], **TRUTH)
        for method in methods:
            function = result.calibrations[method].functions.get(name)
            if function is not None:
                axes.plot(function[0], function[1] * scale, **{"color": COLOUR[name[2]], **METHODS[method]})
    name_functions(axes, names)


def draw_left(axes: Axes, result: Result) -> None:
    """Draw the largest deviation from the truth of each function, by method, on a logarithmic axis."""
    names = [*POSITIONING, *STRAIGHTNESS]
    for method, marker in MARKS.items():
        functions = result.calibrations[method].functions
        for k, name in enumerate(names):
            if name in functions:
                position, value, _ = functions[name]
                left = 1e3 * float(np.max(np.abs(value - result.truth.function(name, position))))
                axes.plot(k, max(left, SMALLEST), marker, color=COLOUR[method], markersize=4.5)
    axes.set_yscale("log")
    axes.set_ylim(1e-10, 1e4)
    axes.set_xticks(range(len(names)), names, size=6.5)
    axes.grid(axis="x", visible=False)


def draw_definition(axes: Axes, result: Result, names: Sequence[str]) -> None:
    """Draw dots on every tenth node of the enhanced evaluation."""
    for name in names:
        position, value, _ = result.calibrations["enhanced"].functions[name]
        scale = 1e6 if name[1] in "ABC" else 1e3
        axes.plot(position[::10], value[::10] * scale, color=COLOUR[name[2]], **DOTS)


def name_functions(axes: Axes, names: Sequence[str]) -> None:
    """Write the functions' names in their colours into an empty band above the curves."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.14 * (high - low))
    for k, name in enumerate(names):
        axes.annotate(
            name,
            (0.02 + 0.2 * k, 0.98),
            xycoords="axes fraction",
            color=COLOUR[name[2]],
            verticalalignment="top",
            weight="bold",
            size=8,
        )


def draw_screw(axes: Axes, result: Result, end: float = 160.0) -> None:
    """Draw the beginning of travel, enlarged: truth, calibrated nodes, lines between them."""
    calibration = result.calibrations["enhanced"].to_error_map()
    floor = 0.0  # each function stands below the one before; only the ripple matters here
    for name in POSITIONING:
        colour = COLOUR[name[2]]
        trend = calibration.function(name, np.array([0.0, end]))

        def ripple(source: ErrorMap, name: str = name, trend: FloatArray = trend) -> tuple[FloatArray, FloatArray]:
            position = source.functions[name][0]
            position = position[position <= end]
            value = source.function(name, position) - np.interp(position, (0.0, end), trend)
            return position, value * 1e3

        fine, nodes = ripple(result.truth), ripple(calibration)
        level = floor - 2.0 - max(fine[1])
        axes.plot(fine[0], fine[1] + level, color=colour, **TRUTH)
        axes.plot(nodes[0], nodes[1] + level, color=colour, marker="o", markersize=3.0, **ENHANCED)
        axes.text(end * 1.015, level, name, color=colour, verticalalignment="center", weight="bold", size=8)
        floor = level + min(fine[1])
    axes.set_xlim(-3.0, end * 1.09)
