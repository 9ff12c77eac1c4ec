"""Figure of `stepdiag plan`: largest uncertainty of the fastest plans over measuring time."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from stepdiag.parameters import REPORT_UNIT, Kind, in_report_units
from stepdiag.planning.plan_by_time import KINDS_OF, Family, Outcome, complete
from stepdiag.style import own_style, save, series

GREY: Final = "#555555"
TITLES: Final[dict[Family, str]] = {
    "volume": "functional point in the volume",
    "length": "positioning and straightness",
    "angle": "angles",
    "squareness": "squarenesses",
}


def draw_plans(found: Sequence[Outcome], taken: Outcome | None, minutes: float, suffix: str) -> bytes:
    """Draw the plans: content of a "png", "svg" or "pdf" file, same bytes for same plans.

    `taken` is the plan to mark."""
    plans = [o for o in complete(found) if all(math.isfinite(o.worst(family)) for family in TITLES)]
    with own_style():
        figure = Figure(figsize=(14.0, 4.6), layout="constrained")
        shapes = _shapes(plans)
        panels: Any = figure.subplots(1, len(TITLES), sharex=True)
        for axes, family in zip(panels, TITLES, strict=True):
            _draw_family(axes, plans, family, minutes, shapes)
            if taken is not None:
                axes.plot(
                    taken.minutes, _value(taken, family), "o", markersize=12, fillstyle="none", color="black", zorder=3
                )
        handles, labels = panels[0].get_legend_handles_labels()
        if handles:
            title = "steps (farthest nodes); ring: the plan to take"
            figure.legend(handles, labels, loc="outside upper center", ncols=len(handles), title=title)
            figure.legend(handles=list(_marks(plans, shapes)), loc="outside lower center", ncols=6, fontsize=7.5)
        return save(figure, suffix)


def _lines(plan: Outcome) -> str:
    """Which kinds of lines a plan has beside its scale lines."""
    counts = plan.candidate.counts
    return " and ".join(f"{name}s" for name, count in counts.items() if count and name != "scale line")


def _shapes(plans: Sequence[Outcome]) -> dict[str, str]:
    """A marker for each set of lines."""
    return dict(zip(sorted({_lines(plan) for plan in plans}), cycle("osD^vPX*"), strict=False))


def _style(scale_lines: int, repeats: int, colour: str) -> dict[str, Any]:
    """Hollow without scale lines, pale with one or two, full with three; larger with more repeats."""
    face = {0: "white", 3: colour}.get(scale_lines, to_rgba(colour, 0.35))
    return {"markerfacecolor": face, "markeredgecolor": colour, "markersize": 2.6 + 1.1 * math.log2(repeats)}


def _marks(plans: Sequence[Outcome], shapes: Mapping[str, str]) -> Iterator[Line2D]:
    for name, marker in shapes.items():
        yield Line2D([], [], linestyle="none", marker=marker, label=name, **_style(3, 2, GREY))
    for count in sorted({len(plan.candidate.scale_lines) for plan in plans}):
        label = f"{count or 'no'} scale line{'' if count == 1 else 's'}"
        yield Line2D([], [], linestyle="none", marker="o", label=label, **_style(count, 4, GREY))
    for repeats in sorted({plan.candidate.repeats for plan in plans}):
        label = "measured once" if repeats == 1 else f"{repeats} times"
        yield Line2D([], [], linestyle="none", marker="o", label=label, **_style(3, repeats, GREY))


def _draw_family(
    axes: Axes, plans: Sequence[Outcome], family: Family, minutes: float, shapes: Mapping[str, str]
) -> None:
    """For each number of steps, a staircase: the best plan until the next one is affordable."""
    for index, steps in enumerate(sorted({o.candidate.steps for o in plans})):
        colour, style = series(index)
        own = sorted((o for o in plans if o.candidate.steps == steps), key=lambda o: o.seconds)
        x, y = [o.minutes for o in own], [_value(o, family) for o in own]
        for one, at, u in zip(own, x, y, strict=True):
            style_of = _style(len(one.candidate.scale_lines), one.candidate.repeats, colour)
            axes.plot(at, u, shapes[_lines(one)], markeredgewidth=0.6, zorder=2.5, **style_of)
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
    axes.set_ylabel(f"largest standard uncertainty ({REPORT_UNIT[_kind(family)]})")


def _value(one: Outcome, family: Family) -> float:
    return in_report_units(_kind(family), one.worst(family))


def _kind(family: Family) -> Kind:
    """One with the unit of the family."""
    return "positioning" if family == "volume" else KINDS_OF[family][0]
