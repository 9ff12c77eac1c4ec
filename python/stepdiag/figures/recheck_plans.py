"""Figure of `stepdiag plan --recheck`: the smallest change of each kind that is seen, over measuring time."""

import math
from collections.abc import Sequence
from typing import Any, Final

from matplotlib.figure import Figure

from stepdiag.planning.recheck_plans import Power
from stepdiag.rechecking.recheck import CHANGE_UNITS
from stepdiag.style import own_style, save, series

TITLES: Final = {"scale": "scales", "bow": "bows of straightness", "slope": "slopes of angles"}


def draw_powers(found: Sequence[Power], taken: Power | None, minutes: float, suffix: str) -> bytes:
    """Draw the plans: content of a "png", "svg" or "pdf" file, same bytes for same plans. `taken`: the one to mark."""
    with own_style():
        figure = Figure(figsize=(11.0, 3.8), layout="constrained")
        panels: Any = figure.subplots(1, len(CHANGE_UNITS), sharex=True)
        steps = sorted({one.candidate.steps for one in found})
        for axes, (kind, (unit, scale)) in zip(panels, CHANGE_UNITS.items(), strict=True):
            for index, count in enumerate(steps):
                colour, style = series(index)
                own = [one for one in found if one.candidate.steps == count and math.isfinite(one.worst(kind))]
                if not own:
                    continue
                x, y = [one.minutes for one in own], [one.worst(kind) / scale for one in own]
                axes.plot(x, y, "o", color=colour, markersize=2.6, zorder=2.5)
                lowest = [min(y[: k + 1]) for k in range(len(y))]
                axes.step(x, lowest, where="post", color=colour, linestyle=style, linewidth=1.3, label=f"{count} steps")
            if taken is not None and math.isfinite(taken.worst(kind)):
                value = taken.worst(kind) / scale
                axes.plot(taken.minutes, value, "o", markersize=12, fillstyle="none", color="black", zorder=3)
            axes.axvline(minutes, color="#666666", linewidth=0.8, linestyle=(0, (2, 2)))
            axes.set_ylim(bottom=0.0)
            axes.set_title(TITLES.get(kind, "squarenesses"))
            axes.set_xlabel("measuring time (min)")
            axes.set_ylabel(f"smallest change seen ({unit})")
        handles: dict[str, Any] = {}
        for axes in panels:
            handles |= {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
        if handles:
            title = "best plan by then (line), all plans (points), the plan to take (ring)"
            names = sorted(handles, key=lambda label: int(label.split()[0]))
            figure.legend([handles[n] for n in names], names, loc="outside upper center", ncols=len(names), title=title)
        return save(figure, suffix)
