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
from stepdiag.style import COLOUR, own_style, save

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
    "1d": ("laser, mirror 700, 1000 µrad", "1d", POSITIONING, ALL),
    "2a": ("as 1a", "1a", STRAIGHTNESS, ALL),
    "2b": ("as 1b", "1b", STRAIGHTNESS, ALL),
    "2c": ("as 1c", "1c", STRAIGHTNESS, ALL),
    "2d": ("as 1d", "1d", STRAIGHTNESS, ALL),
    "3a": ("PSD displaced by 1.5, 2 mm", "3", POSITIONING, ("enhanced", "adjustment")),
    "3b": ("as 3a", "3", ANGLES, ("enhanced", "adjustment")),
}
DEFINED = ("3a", "3b")  # traced, with what the definition of the readings gives beside it
YLABEL = {
    "1a": "positioning (µm)",
    "2a": "straightness (µm)",
    "3a": "positioning (µm)",
    "3b": "rotation (µrad)",
    "4": "ripple, shifted (µm)",
}


def draw_figure(results: Sequence[Result]) -> dict[str, bytes]:
    """The figure as files, figure.png and figure.svg. Same results give the same bytes."""
    by_name = {result.case.name: result for result in results}
    with own_style():
        figure = Figure(figsize=(10.0, 8.0), layout="constrained")
        panels = figure.subplot_mosaic([["1a", "1b", "1c", "1d"], ["2a", "2b", "2c", "2d"], ["3a", "3b", "4", "4"]])
        for name, (title, case, functions, methods) in PANELS.items():
            draw_functions(panels[name], by_name[case], functions, methods)
            set_title(panels[name], name, title)
        for name in DEFINED:
            draw_definition(panels[name], by_name["3d"], PANELS[name][2])
        draw_screw(panels["4"], by_name["4"])
        set_title(panels["4"], "4", "screw error of 10 mm pitch: right at the nodes, unseen between them")
        for name, label in YLABEL.items():
            panels[name].set_ylabel(label)
        for name in ("3a", "3b", "4"):
            panels[name].set_xlabel("position (mm)")
        figure.legend(handles=legend_handles(), loc="outside upper center", ncols=5, handlelength=3.0)
        return {"figure.png": save(figure, "png"), "figure.svg": save(figure, "svg")}


def set_title(axes: Axes, name: str, title: str) -> None:
    axes.set_title(f"$\\bf{{{name}}}$  {title}")


def legend_handles() -> list[Any]:
    styles = {"truth": TRUTH, **METHODS, "enhanced, by definition of the readings (3a, 3b)": DOTS}
    return [Line2D([], [], label=name, **{"color": "black", **style}) for name, style in styles.items()]


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
