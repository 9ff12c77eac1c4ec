"""Figure of an error map alone: its 21 errors, and what it leaves at 0."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from stepdiag._core import ErrorMap, InvalidArgument
from stepdiag.figures.calibration import NEGATIVE
from stepdiag.figures.page import Heading, Page
from stepdiag.figures.parameter_panels import HATCH, HEIGHT, WIDTH, ParameterPanels, largest
from stepdiag.io.csv_text import three_numbers
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES
from stepdiag.style import COLOUR, own_style


def draw_error_map(errors: ErrorMap, name: str = "error map") -> Figure:
    """Draw the errors of a map by axis and family; parameters that it does not have are 0, and hatched.

    `name`: the title. Raises InvalidArgument if the travel of an axis is not known."""
    travel = _travel(errors)
    with own_style():
        count = len(errors.functions) + len(errors.squareness)
        chain = errors.header.get("chain")
        facts = [f"{count} of 21 parameters", *([f"chain {chain}"] if chain else [])]
        facts.append(f"volume {' x '.join(f'{edge:g}' for edge in travel)} mm")
        page = Page(Heading(f"{name}: errors of a machine", ", ".join(facts)), WIDTH, HEIGHT)
        panels = ParameterPanels(page, travel, "")
        for parameter in FUNCTIONS:
            if parameter not in errors.functions:
                panels.mark_missing(parameter, "not in the map")
                continue
            position, value = errors.functions[parameter]
            panels.draw(parameter, position, value)
            panels.remark(parameter, largest(parameter, position, value))
            if parameter in errors.negative_functions:
                panels.draw(parameter, *errors.negative_functions[parameter], **NEGATIVE)
        for parameter in SQUARENESSES:
            if parameter in errors.squareness:
                panels.draw_squareness(parameter, errors.squareness[parameter], np.nan)
            else:
                panels.mark_missing(parameter, "not in the map")
        panels.zero_lines()
        page.legend(_handles(errors, complete=count == len(FUNCTIONS) + len(SQUARENESSES)))
        return page.finish()


def _travel(errors: ErrorMap) -> list[float]:
    """Of X, Y, Z: the volume that the file states, else as far as the functions go."""
    stated = errors.header.get("volume_mm")
    if stated is not None:
        return [float(edge) for edge in three_numbers(stated, "volume_mm")]
    ends: dict[str, float] = {}
    for name, (position, _) in errors.functions.items():
        ends[name[2]] = max(ends.get(name[2], 0.0), float(position[-1]))
    for axis in AXES:
        if not ends.get(axis, 0.0) > 0.0:
            raise InvalidArgument(
                f"the travel of {axis} is not known: expected a function of {axis}, or a line # volume_mm=X Y Z"
            )
    return [ends[axis] for axis in AXES]


def _handles(errors: ErrorMap, *, complete: bool) -> list[Any]:
    colour = COLOUR["X"]
    handles: list[Any] = [
        Line2D([], [], color=colour, marker=".", markersize=4.0, linewidth=1.1, label="value at nodes")
    ]
    if errors.negative_functions:
        label = "approached in - direction"
        handles.append(Line2D([], [], color=colour, label=label, linestyle=(0, (1, 1)), linewidth=1.0))
    if not complete:
        handles.append(Patch(label="not in the map: 0", **HATCH))
    return handles
