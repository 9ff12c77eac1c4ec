"""Figures of a page: what Plotly draws, with its caption and its values as a table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from stepdiag.presentation.page.html import Markup, element, markup, table
from stepdiag.presentation.page.look import AXIS
from stepdiag.presentation.page.preview import evenly, preview

MOST_ROWS: Final = 101  # of a table on the page
# Of drawings on a wide screen, as in report.css: width and height in pixels.
SIZES: Final[Mapping[str, tuple[int, int]]] = {"panel": (352, 210), "wide": (1104, 300), "wide low": (1104, 200)}


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
        self.drawings[identifier] = {"data": [rounded(trace) for trace in data], "layout": own | layout}

    def place(
        self, identifier: str, label: str, caption: object, class_: str = "panel", described_by: str | None = None
    ) -> Markup:
        """Where a drawing comes to stand, and what is there until it is drawn; `label` says it to those who do not
        see it."""
        drawing = element(
            "div",
            preview(self.drawings[identifier], *SIZES[class_]),
            class_="plot",
            id=identifier,
            role="img",
            aria_label=label,
            aria_describedby=described_by,
        )
        return element("figure", drawing, element("figcaption", caption), class_=class_)


def rounded(content: Any) -> Any:
    """Numbers of drawings to 4 decimals, 0.1 nm or 0.1 nrad: the page stays small. Its values are not rounded."""
    if isinstance(content, Mapping):
        return {key: rounded(value) for key, value in content.items()}
    if isinstance(content, list):
        return [rounded(value) for value in content]
    return round(content, 4) if isinstance(content, float) else content


def values(identifier: str, title: str, *tables: Markup) -> Markup:
    """The values of a figure, folded."""
    return element("details", element("summary", title), *tables, id=identifier, class_="values")


def value_table(caption: str, heading: Sequence[object], rows: Sequence[Sequence[object]]) -> Markup:
    """A table of at most MOST_ROWS rows, which says so where there are more."""
    chosen = evenly(len(rows), MOST_ROWS)
    if len(chosen) < len(rows):
        caption += f" ({len(chosen)} of {len(rows)} rows, evenly chosen)"
    return markup(table(caption, heading, [rows[k] for k in chosen]))
