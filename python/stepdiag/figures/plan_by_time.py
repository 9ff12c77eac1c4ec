"""Figure of `stepdiag plan`: what the best plans reach in which time, and which one is advised."""

import math
from collections.abc import Sequence
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from stepdiag.parameters import REPORT_UNIT, Kind, in_report_units
from stepdiag.planning.plan_by_time import KINDS_OF, Family, Outcome, complete
from stepdiag.style import own_style, save, series

GREY: Final = "#555555"
TITLES: Final[dict[Family, str]] = {
    "volume": "of the functional point in the volume",
    "length": "of positioning and straightness",
    "angle": "of angles",
    "squareness": "of squarenesses",
}
NAME: Final = 0.04  # of the picture's height that a name takes
FAR: Final = 3.0  # times the available time: how far the picture goes on


def draw_plans(
    found: Sequence[Outcome],
    taken: Outcome | None,
    minutes: float,
    suffix: str,
    *,
    family: Family = "volume",
    own: Outcome | None = None,
) -> bytes:
    """Draw the uncertainty of a family (faults: of the volume) over measuring time, a staircase for each number of
    steps: content of a "png", "svg" or "pdf" file, same bytes for same plans.

    `taken` is the plan to take, `own` that of the scenario; `minutes`: the available time, infinite: any."""
    shown: Family = "volume" if family == "faults" else family
    plans = [one for one in complete(found) if math.isfinite(one.worst(shown))]
    with own_style():
        figure = Figure(figsize=(8.0, 5.0), layout="constrained")
        axes = figure.subplots()
        axes.set_title(f"Largest standard uncertainty {TITLES[shown]}", loc="left")
        axes.set_xlabel("minutes at the machine")
        axes.set_ylabel(REPORT_UNIT[_kind(shown)])
        if plans:
            _limits(axes, plans, shown, taken, minutes)
            _staircases(axes, plans, shown)
        if math.isfinite(minutes):
            axes.axvspan(minutes, axes.get_xlim()[1], color=GREY, alpha=0.08, linewidth=0.0)
            axes.text(
                minutes,
                0.99,
                " more than the available time",
                color=GREY,
                va="top",
                transform=axes.get_xaxis_transform(),
            )
        if own is not None and own in plans:
            _mark(axes, own, shown, "D", "the scenario's own plan" + (", the one to take" if own is taken else ""))
        if taken is not None and taken is not own:
            _mark(axes, taken, shown, "o", f"take: {_said(taken)}")
        return save(figure, suffix)


def _limits(axes: Axes, plans: Sequence[Outcome], family: Family, taken: Outcome | None, minutes: float) -> None:
    """Not so far that the plan to take cannot be seen."""
    start = min(one.minutes for one in plans)
    middle = minutes if math.isfinite(minutes) else taken.minutes if taken else start
    end = min(max(one.minutes for one in plans), max(FAR * middle, 1.5 * start)) * 1.15
    within = [_value(one, family) for one in plans if one.minutes <= end]
    axes.set_xlim(0.0, end)
    axes.set_yscale("log")
    axes.set_ylim(0.8 * min(within), 1.6 * sorted(within)[-1 - len(within) // 20])
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_major_formatter(plain)
    axes.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else ""))


def _staircases(axes: Axes, plans: Sequence[Outcome], family: Family) -> None:
    """For each number of steps: the best plan until a better one is affordable; named at its end."""
    _, end = axes.get_xlim()
    low, high = (math.log(edge) for edge in axes.get_ylim())
    names: list[tuple[float, str, str]] = []
    for index, steps in enumerate(sorted({one.candidate.steps for one in plans})):
        colour, style = series(index)
        own = sorted((one for one in plans if one.candidate.steps == steps), key=lambda one: one.seconds)
        x, y, best = [], [], math.inf
        for one in own:
            if (value := _value(one, family)) < best and one.minutes <= end:
                x.append(one.minutes)
                y.append(best := value)
        if not x:
            continue
        axes.step([*x, end], [*y, best], where="post", color=colour, linestyle=style, linewidth=2.0)
        axes.plot(x, y, ".", color=colour, markersize=6.0)
        height = (math.log(best) - low) / (high - low)
        names.append((height, f"{steps} steps ({own[0].spacing:.3g} mm)", colour))
    free = 0.0
    for height, name, colour in sorted(names):
        free = max(height, free)
        axes.text(1.005, free, name, va="center", color=colour, transform=axes.transAxes)
        free += NAME


def _mark(axes: Axes, one: Outcome, family: Family, marker: str, words: str) -> None:
    place = one.minutes, _value(one, family)
    axes.plot(*place, marker, markersize=11, fillstyle="none", color="black", markeredgewidth=1.6, zorder=3)
    start, end = axes.get_xlim()
    right = place[0] > 0.55 * (start + end)
    said = f"{words}\n{one.minutes:.0f} minutes, {place[1]:.3g} {REPORT_UNIT[_kind(family)]}"
    axes.annotate(
        said,
        place,
        (-10 if right else 10, 12),
        textcoords="offset points",
        ha="right" if right else "left",
        zorder=4,
        bbox={"facecolor": "white", "alpha": 0.85, "edgecolor": "none", "pad": 1.5},
    )


def _said(one: Outcome) -> str:
    plan = one.candidate
    times = "" if plan.repeats == 1 else ", twice" if plan.repeats == 2 else f", {plan.repeats} times"
    return f"{plan.description},\n{plan.steps} steps{times}{', backward too' if plan.backward else ''}"


def _value(one: Outcome, family: Family) -> float:
    return in_report_units(_kind(family), one.worst(family))


def _kind(family: Family) -> Kind:
    """One with the unit of the family."""
    return "positioning" if family == "volume" else KINDS_OF[family][0]
