"""Figure of `stepdiag plan`: largest uncertainty of the fastest plans over measuring time."""

import math
from collections.abc import Sequence
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from stepdiag.parameters import REPORT_UNIT, in_report_units
from stepdiag.planning.plan_by_time import FAMILIES, Family, Outcome, complete
from stepdiag.style import own_style, save, series

TITLES: Final[dict[Family, str]] = {
    "length": "positioning and straightness",
    "angle": "angles",
    "squareness": "squarenesses",
}


def draw_plans(found: Sequence[Outcome], taken: Outcome | None, minutes: float, suffix: str) -> bytes:
    """Draw the plans: content of a "png", "svg" or "pdf" file, same bytes for same plans.

    `taken` is the plan to mark."""
    plans = [o for o in complete(found) if all(math.isfinite(o.worst(family)) for family in FAMILIES)]
    with own_style():
        figure = Figure(figsize=(10.0, 3.8), layout="constrained")
        panels: Any = figure.subplots(1, len(FAMILIES), sharex=True)
        for axes, family in zip(panels, FAMILIES, strict=True):
            _draw_family(axes, plans, family, minutes)
            if taken is not None:
                axes.plot(
                    taken.minutes, _value(taken, family), "o", markersize=10, fillstyle="none", color="black", zorder=3
                )
        handles, labels = panels[0].get_legend_handles_labels()
        if handles:
            title = "steps (farthest nodes); dots: other sets of lines, repeats; ring: the plan to take"
            figure.legend(handles, labels, loc="outside upper center", ncols=len(handles), title=title)
        return save(figure, suffix)


def _draw_family(axes: Axes, plans: Sequence[Outcome], family: Family, minutes: float) -> None:
    """For each number of steps, a staircase: the best plan until the next one is affordable."""
    for index, steps in enumerate(sorted({o.candidate.steps for o in plans})):
        colour, style = series(index)
        own = sorted((o for o in plans if o.candidate.steps == steps), key=lambda o: o.seconds)
        x, y = [o.minutes for o in own], [_value(o, family) for o in own]
        axes.plot(x, y, ".", color=colour, markersize=4.0, alpha=0.4)
        lowest = [min(y[: k + 1]) for k in range(len(y))]
        label = f"{steps} ({own[0].spacing:.3g} mm)"
        axes.step(x, lowest, where="post", color=colour, linestyle=style, linewidth=1.3, label=label)
    if plans:
        axes.set_xscale("log")
        axes.set_yscale("log")
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(plain)
        axis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else ""))
    axes.axvline(minutes, color="#666666", linewidth=0.8, linestyle=(0, (2, 2)))
    axes.set_title(TITLES[family])
    axes.set_xlabel("measuring time (min)")
    axes.set_ylabel(f"largest standard uncertainty ({REPORT_UNIT[FAMILIES[family][0]]})")


def _value(one: Outcome, family: Family) -> float:
    return in_report_units(FAMILIES[family][0], one.worst(family))
