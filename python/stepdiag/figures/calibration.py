"""Figure of a calibration: the 21 parameters with 95 % bands, and the truth beside them."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from stepdiag._core import Calibration, ErrorMap
from stepdiag.figures.page import Heading, Page
from stepdiag.figures.parameter_panels import (
    COVERAGE_FACTOR,
    HATCH,
    HEIGHT,
    TRUTH,
    WIDTH,
    ParameterPanels,
    largest,
)
from stepdiag.findings.meaning import FITS, MEANING
from stepdiag.findings.temperature import temperature_mark
from stepdiag.parameters import FUNCTIONS, SQUARENESSES
from stepdiag.style import BAND, COLOUR, own_style

FloatArray = npt.NDArray[np.float64]
NEGATIVE: Any = {"linestyle": (0, (1, 1)), "linewidth": 1.0, "marker": "", "alpha": 0.9}


def draw_calibration(calibration: Calibration, truth: ErrorMap | None = None, name: str = "calibration") -> Figure:
    """Draw the 21 parameters of a calibration with 95 % bands (1.96 u), by axis and family.

    `truth`: errors to draw beside them. `name`: the title. Parameters that are not determined are
    hatched; of those that are partly determined the known part is drawn. A rejected fit is marked
    in the heading and in every panel."""
    with own_style():
        page = Page(_heading(calibration, name), WIDTH, HEIGHT, undetermined_notes(calibration))
        panels = ParameterPanels(page, calibration.volume, "")
        for parameter in FUNCTIONS:
            if parameter in calibration.functions:
                _draw_function(panels, calibration, parameter)
            else:
                panels.mark_missing(parameter)
            if truth is not None:
                _draw_truth(panels, calibration, parameter, truth)
        for parameter in SQUARENESSES:
            if parameter in calibration.squareness:
                value, u = calibration.squareness[parameter]
                panels.draw_squareness(parameter, value, COVERAGE_FACTOR * u)
            else:
                panels.mark_missing(parameter)
            if truth is not None:
                panels.draw_true_squareness(parameter, truth.squareness.get(parameter, 0.0))
        panels.zero_lines()
        page.legend(list(_handles(calibration, truth)))
        return page.finish()


def _heading(calibration: Calibration, name: str) -> Heading:
    volume = " x ".join(f"{edge:g}" for edge in calibration.volume)
    tool = " ".join(f"{offset:g}" for offset in calibration.tool)
    made = [
        calibration.method or "method not known",
        calibration.date or "date not known",
        temperature_mark(calibration),
    ]
    machine = [f"chain {calibration.chain}", f"volume {volume} mm", f"tool offset {tool} mm"]
    factor = calibration.variance_factor
    fit = [] if factor is None else [f"variance factor {factor:.3g}"]
    reasons = calibration.fit_reasons or ([MEANING[calibration.fit]] if calibration.fit in FITS else [])
    return Heading(name, ", ".join([*made, *machine, *fit]), calibration.fit, reasons, calibration.unverified)


def undetermined_notes(calibration: Calibration) -> list[str]:
    """What is not determined, and what would help: parameters first, then set-ups."""
    return [f"undetermined: {text}" for text in calibration.undetermined]


def _draw_function(panels: ParameterPanels, calibration: Calibration, parameter: str) -> None:
    position, value, u = calibration.functions[parameter]
    known = with_gaps(calibration, parameter, position, value, u)
    remark = largest(parameter, position, value)
    if parameter in calibration.undetermined_slopes:
        remark = "shape only, ends at 0"
    elif np.isnan(known[1]).any():
        remark = "some positions only"
        panels.mark_gaps(parameter, *known[:2])
    band = COVERAGE_FACTOR * known[2]
    panels.draw(parameter, known[0], known[1], known[1] - band, known[1] + band)
    panels.remark(parameter, remark)
    if parameter in calibration.negative_functions:
        position, value, u = with_gaps(calibration, parameter, *calibration.negative_functions[parameter])
        band = COVERAGE_FACTOR * u
        panels.draw(parameter, position, value, value - band, value + band, **NEGATIVE)


def with_gaps(
    calibration: Calibration, parameter: str, position: FloatArray, value: FloatArray, u: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A table with NaN at those nodes of its axis where the parameter is not determined.

    Where all is determined, an evaluation gives all functions of an axis at the same nodes. Tables
    of other origin may have nodes of their own; they have no list of what is undetermined."""
    tables = [table[0] for name, table in calibration.functions.items() if name[2] == parameter[2]]
    nodes = np.unique(np.concatenate(tables))
    if not calibration.undetermined or len(nodes) == len(position):
        return position, value, u
    place = np.searchsorted(nodes, position)
    values, uncertainties = np.full((2, len(nodes)), np.nan)
    values[place], uncertainties[place] = value, u
    return nodes, values, uncertainties


def _has_gaps(calibration: Calibration) -> bool:
    return any(np.isnan(with_gaps(calibration, name, *t)[1]).any() for name, t in calibration.functions.items())


def _draw_truth(panels: ParameterPanels, calibration: Calibration, parameter: str, truth: ErrorMap) -> None:
    """The truth in the frame of the calibration: a shape where only a shape is known."""
    end = panels.travel[parameter[2]]
    nodes = truth.functions[parameter][0] if parameter in truth.functions else np.array([0.0, end])
    position = np.unique(np.clip(np.concatenate([nodes, [0.0, end]]), 0.0, end))
    for approach in "+-" if parameter in calibration.negative_functions else "+":
        value = truth.function(parameter, position, approach)
        if parameter in calibration.undetermined_slopes:
            value = value - np.interp(position, (0.0, end), (value[0], value[-1]))
        panels.draw(parameter, position, value, **{"marker": "", **TRUTH})


def _handles(calibration: Calibration, truth: ErrorMap | None) -> Iterator[Any]:
    colour = COLOUR["X"]
    yield Line2D([], [], color=colour, marker=".", markersize=4.0, linewidth=1.1, label="value at nodes")
    if _has_uncertainty(calibration):
        yield Patch(facecolor=colour, alpha=BAND, label="95 % band (1.96 u)")
    else:
        yield Line2D([], [], linestyle="none", label="no uncertainties in the file")
    if calibration.negative_functions:
        yield Line2D([], [], color=colour, label="approached in - direction", linestyle=(0, (1, 1)), linewidth=1.0)
    if truth is not None:
        yield Line2D([], [], label="truth", **TRUTH)
    count = len(calibration.functions) + len(calibration.squareness)
    if count < len(FUNCTIONS) + len(SQUARENESSES) or _has_gaps(calibration):
        yield Patch(label="not determined", **HATCH)


def _has_uncertainty(calibration: Calibration) -> bool:
    tables: Sequence[Any] = [u for _, _, u in calibration.functions.values()]
    return any(np.isfinite(u).any() for u in tables) or any(u >= 0.0 for _, u in calibration.squareness.values())
