"""Figures of a page: what Plotly draws, with its caption and its values as a table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from stepdiag import style
from stepdiag.page.html import Markup, element, markup, table
from stepdiag.style import COLOUR

FONT: Final = "system-ui, 'Segoe UI', Roboto, 'Helvetica Neue', 'Noto Sans', 'Liberation Sans', Arial, sans-serif"
INK: Final = "#1f2933"
QUIET: Final = "#52606d"
GRID: Final = "#e4e7eb"
LINE: Final = COLOUR["after"]
BEFORE: Final = COLOUR["before"]
NEGATIVE: Final = COLOUR["backward"]
MARK: Final = COLOUR["outlier"]
BAND: Final = "rgba({}, {}, {}, {})".format(*bytes.fromhex(LINE[1:]), style.BAND)
MOST_ROWS: Final = 101  # of a table on the page

# What all figures share. Axes of a panel name only what is their own.
AXIS: Final[Mapping[str, Any]] = {
    "gridcolor": GRID,
    "zerolinecolor": "#9aa5b1",
    "zerolinewidth": 1,
    "linecolor": "#9aa5b1",
    "ticks": "outside",
    "ticklen": 3,
    "tickcolor": "#9aa5b1",
    "nticks": 6,
    "title": {"standoff": 6},
    "automargin": True,
    "fixedrange": True,
}
LAYOUT: Final[Mapping[str, Any]] = {
    "font": {"family": FONT, "size": 12, "color": INK},
    "margin": {"l": 46, "r": 18, "t": 8, "b": 40},
    "paper_bgcolor": "rgba(0,0,0,0)",
    "plot_bgcolor": "rgba(0,0,0,0)",
    "showlegend": False,
    "hovermode": "x unified",
    "hoverlabel": {"bgcolor": "#ffffff", "font": {"size": 12}},
    "dragmode": False,
}


@dataclass
class Figures:
    """The drawings of a page by the identifier of their place."""

    drawings: dict[str, dict[str, Any]] = field(default_factory=dict)

    def add(
        self,
        identifier: str,
        data: Sequence[Mapping[str, Any]],
        x: Mapping[str, Any],
        y: Mapping[str, Any],
        **layout: Any,
    ) -> None:
        """A drawing with one x axis and one y axis."""
        own = {"xaxis": {**AXIS, **x}, "yaxis": {**AXIS, **y}}
        self.drawings[identifier] = {"data": list(data), "layout": own | layout}


def place(
    identifier: str, label: str, caption: object, class_: str = "panel", described_by: str | None = None
) -> Markup:
    """Where a drawing comes to stand; `label` says it to those who do not see it."""
    drawing = element("div", class_="plot", id=identifier, role="img", aria_label=label, aria_describedby=described_by)
    return element("figure", drawing, element("figcaption", caption), class_=class_)


def values(identifier: str, title: str, *tables: Markup) -> Markup:
    """The values of a figure, folded."""
    return element("details", element("summary", title), *tables, id=identifier, class_="values")


def thinned(count: int) -> list[int]:
    """Indices of at most MOST_ROWS rows, evenly, with first and last."""
    if count <= MOST_ROWS:
        return list(range(count))
    return sorted({int(k) for k in np.linspace(0, count - 1, MOST_ROWS)})


def value_table(caption: str, heading: Sequence[object], rows: Sequence[Sequence[object]]) -> Markup:
    """A table of at most MOST_ROWS rows, which says so where there are more."""
    chosen = thinned(len(rows))
    if len(chosen) < len(rows):
        caption += f" ({len(chosen)} of {len(rows)} rows, evenly chosen)"
    return markup(table(caption, heading, [rows[k] for k in chosen]))
