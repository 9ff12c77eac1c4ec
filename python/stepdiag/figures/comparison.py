"""Figure of a comparison: differences B - A with 95 % bands and the limits of significance."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from stepdiag.calibration.comparison import Comparison, Difference, made_of
from stepdiag.figures.page import Heading, Page
from stepdiag.figures.parameter_panels import (
    COVERAGE_FACTOR,
    HATCH,
    HEIGHT,
    WIDTH,
    ParameterPanels,
    largest,
    scaled,
)
from stepdiag.io.comparison_read import StoredComparison
from stepdiag.parameters import FUNCTIONS, SQUARENESSES
from stepdiag.style import BAND, COLOUR, own_style

LIMIT: Any = {"color": COLOUR["limit"], "linewidth": 0.8, "linestyle": (0, (4, 2))}
MARK: Any = {
    "linestyle": "none",
    "marker": "X",
    "markersize": 5.0,
    "color": COLOUR["significant"],
    "markeredgewidth": 0.0,
}
REVERSAL: Any = {"linestyle": (0, (1, 1)), "linewidth": 1.0, "marker": ""}


def draw_comparison(comparison: Comparison | StoredComparison, name: str = "comparison") -> Figure:
    """Draw the differences B - A of all parameters with their 95 % bands (1.96 u).

    Dashed lines: what a difference must exceed to be significant among all values compared;
    significant values are marked. `name`: the title. Parameters that are not compared are hatched."""
    volume = comparison.volume if isinstance(comparison, StoredComparison) else comparison.a.volume
    fit = None if isinstance(comparison, StoredComparison) else _worse_fit(comparison)
    by_name = {difference.parameter: difference for difference in comparison.differences}
    with own_style():
        facts = "; ".join(_facts(comparison))
        page = Page(Heading(f"{name}: differences B - A", facts, fit), WIDTH, HEIGHT, _notes(comparison))
        panels = ParameterPanels(page, volume, "")
        for parameter in (*FUNCTIONS, *SQUARENESSES):
            difference = by_name.get(parameter)
            if difference is None:
                panels.mark_missing(parameter, _why_missing(comparison, parameter))
            else:
                _draw(panels, difference, comparison.threshold)
            reversal = by_name.get(f"{parameter}_reversal")
            if reversal is not None:
                _draw_function(panels, parameter, reversal, comparison.threshold, REVERSAL)
        panels.zero_lines()
        page.legend(list(_handles(comparison.differences, partial=len(by_name) < 21)))
        return page.finish()


def _draw(panels: ParameterPanels, difference: Difference, threshold: float) -> None:
    name = difference.parameter
    if name in SQUARENESSES:
        value, u = float(difference.value[0]), float(difference.standard_uncertainty[0])
        panels.draw_squareness(name, value, COVERAGE_FACTOR * u)
        k = SQUARENESSES.index(name)
        for sign in (-1.0, 1.0):
            panels.squareness.hlines(scaled(name, sign * threshold * u), k - 0.3, k + 0.3, **LIMIT)
        if _significant(difference, threshold).any():
            panels.squareness.plot(k, scaled(name, value), **MARK)
        return
    _draw_function(panels, name, difference, threshold, {})
    shape = "shape, " if difference.shape_only else ""
    panels.remark(name, shape + largest(name, difference.position, difference.value))


def _draw_function(
    panels: ParameterPanels, name: str, difference: Difference, threshold: float, style: dict[str, Any]
) -> None:
    position, value, u = difference.position, difference.value, difference.standard_uncertainty
    band = COVERAGE_FACTOR * u
    panels.draw(name, position, value, value - band, value + band, **style)
    axes = panels.axes[name]
    if not style:
        for sign in (-1.0, 1.0):
            axes.plot(position, scaled(name, sign * threshold * u), **LIMIT)
    marked = _significant(difference, threshold)
    if marked.any():
        (mark,) = axes.plot(position[marked], scaled(name, value[marked]), zorder=4, **MARK)
        mark.set_gid(f"significant-{difference.parameter}")


def _significant(difference: Difference, threshold: float) -> Any:
    return difference.testable & (np.abs(difference.normalised) >= threshold)


def _why_missing(comparison: Comparison | StoredComparison, parameter: str) -> str:
    if isinstance(comparison, Comparison):
        for which, only in (("A", comparison.only_in_a), ("B", comparison.only_in_b)):
            if parameter in only:
                return f"only in {which}"
    return "not compared"


def _worse_fit(comparison: Comparison) -> str | None:
    """A rejected fit of either calibration; others do not make the difference useless."""
    return "rejected" if "rejected" in (comparison.a.fit, comparison.b.fit) else None


def _facts(comparison: Comparison | StoredComparison) -> Iterator[str]:
    if isinstance(comparison, StoredComparison):
        made = comparison.made
    else:
        both = (("a", comparison.a), ("b", comparison.b))
        made = {f"{key}_{which}": text for which, c in both for key, text in made_of(c).items()}
    for which in "ab":
        method, date, temperature = (made[f"{key}_{which}"] for key in ("method", "date", "temperature"))
        yield " ".join(filter(None, (f"{which.upper()}: {method or 'method not known'}", date, temperature)))
    marked = sum(_significant(d, comparison.threshold).any() for d in comparison.differences)
    yield f"significant: {marked} of {len(comparison.differences)} parameters"


def _notes(comparison: Comparison | StoredComparison) -> list[str]:
    if not comparison.count:
        return ["significance: not known, because one of the two has no standard uncertainties"]
    return [
        f"significant: beyond {comparison.threshold:.3g} u; chance makes any of the {comparison.count} values differ "
        f"so with a probability of {comparison.limit:g} at most (Bonferroni)",
        "u = sqrt(u_A^2 + u_B^2), as if A and B were independent; two evaluations of one run are not",
    ]


def _handles(differences: Sequence[Difference], *, partial: bool) -> Iterator[Any]:
    colour = COLOUR["X"]
    yield Line2D([], [], color=colour, marker=".", markersize=4.0, linewidth=1.1, label="difference B - A")
    yield Patch(facecolor=colour, alpha=BAND, label="95 % band (1.96 u)")
    yield Line2D([], [], label="limit of significance", **LIMIT)
    yield Line2D([], [], label="significant", **MARK)
    if any(difference.parameter.endswith("_reversal") for difference in differences):
        yield Line2D([], [], color=colour, label="difference of reversal errors", linestyle=(0, (1, 1)), linewidth=1.0)
    if partial:
        yield Patch(label="not compared", **HATCH)
