"""The page of a figure: heading with the verdict of a fit, panels, legend and notes below them.

Sizes are in inches. Nothing here depends on what is drawn in the panels.
"""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.patches import Rectangle

from stepdiag.findings.meaning import UNVERIFIED
from stepdiag.style import COLOUR, own_style, plain, save

LEFT, RIGHT = 0.72, 0.25
LINE: Final = 0.165  # height of a line of small text
SMALL: Final = 7.5  # size of such text, points
PER_INCH: Final = 16.5  # its characters on an inch
MOST_NOTES: Final = 8  # lines


class Drawing(Figure):
    """A figure that notebooks show without further set-up."""

    def _repr_png_(self) -> bytes:
        with own_style():
            return save(self, "png")


@dataclass(frozen=True)
class Heading:
    """Texts above the panels: title, facts in a line, the verdict of a fit (or None) and its reasons."""

    title: str
    facts: str = ""
    fit: str | None = None
    reasons: Sequence[str] = ()
    unverified: bool = False


class Page:
    """A figure with room for panels between heading and notes.

    `width`: of the page. `height`: of the panels, with their labels. Use it inside `own_style()`."""

    def __init__(self, heading: Heading, width: float, height: float, notes: Sequence[str] = ()) -> None:
        reasons = [] if heading.fit in (None, "accepted") else _wrapped(heading.reasons, width, 3)
        reasons += _wrapped([UNVERIFIED], width, 2) if heading.unverified else []
        below = _wrapped(notes, width, MOST_NOTES)
        top = 0.66 + LINE * len(reasons)
        bottom = 0.36 + LINE * len(below)
        self.size = width, top + height + bottom
        self.figure = Drawing(figsize=self.size)
        self.heading = heading
        self._top, self._bottom = top, bottom
        self._text(0.15, heading.title, size=11.0, weight="bold")
        self._text(0.40, heading.facts)
        for k, reason in enumerate(reasons):
            self._text(0.40 + LINE * (k + 1), reason)
        for k, note in enumerate(below):
            self._text(self.size[1] - bottom + 0.34 + LINE * k, note)
        if heading.fit is not None:
            self._show_verdict(heading.fit)

    def grid(self, rows: int, columns: int, *, below: float = 0.0, **shape: Any) -> GridSpec:
        """Panels in rows and columns. `below`: part of the panels' height that is left free."""
        width, height = self.size
        edges = {
            "left": LEFT / width,
            "right": 1.0 - RIGHT / width,
            "bottom": (self._bottom + 0.42 + below) / height,
            "top": 1.0 - (self._top + 0.22) / height,
        }
        return GridSpec(rows, columns, figure=self.figure, **(edges | shape))

    def legend(self, handles: Sequence[Any]) -> None:
        """One line between panels and notes."""
        self.figure.legend(
            handles=handles,
            loc="center left",
            bbox_to_anchor=((LEFT - 0.1) / self.size[0], (self._bottom - 0.12) / self.size[1]),
            ncols=max(1, len(handles)),
            fontsize=SMALL,
            handlelength=2.4,
            borderpad=0.0,
            borderaxespad=0.0,
        )

    def _text(self, down: float, text: str, size: float = SMALL, **style: Any) -> None:
        """A text whose middle is this far below the upper edge."""
        width, height = self.size
        self.figure.text(
            (LEFT - 0.5) / width, 1.0 - down / height, plain(text), size=size, verticalalignment="center", **style
        )

    def _show_verdict(self, fit: str) -> None:
        """A box in the upper right corner; of a rejected fit over the whole width, with marks in every panel."""
        width, height = self.size
        rejected = fit == "rejected"
        box = 0.0 if rejected else 1.0 - 1.6 / width
        self.figure.add_artist(
            Rectangle((box, 1.0 - 0.3 / height), 1.0 - box, 0.3 / height, facecolor=COLOUR[fit], edgecolor="none")
        )
        if rejected:
            self.figure.texts[0].set_color("white")
        self.figure.text(
            1.0 - RIGHT / width,
            1.0 - 0.15 / height,
            "FIT REJECTED: DO NOT USE" if rejected else f"fit {fit}",
            color="black" if fit == "doubtful" else "white",
            size=10.0,
            weight="bold",
            horizontalalignment="right",
            verticalalignment="center",
        )

    def finish(self) -> Figure:
        """The figure; marks the panels of a rejected fit."""
        if self.heading.fit == "rejected":
            for axes in self.figure.axes:
                axes.text(
                    0.5,
                    0.5,
                    "rejected",
                    transform=axes.transAxes,
                    color=COLOUR["rejected"],
                    alpha=0.25,
                    size=17.0,
                    rotation=24.0,
                    weight="bold",
                    horizontalalignment="center",
                    verticalalignment="center",
                    zorder=0,
                )
        return self.figure


def _wrapped(texts: Sequence[str], width: float, most: int) -> list[str]:
    """Lines that fit the page; the last one says how many texts are missing."""
    lines: list[str] = []
    for k, text in enumerate(texts):
        more = textwrap.wrap(text, int((width - LEFT) * PER_INCH), subsequent_indent="    ")
        if len(lines) + len(more) > most - (k < len(texts) - 1):
            return [*lines, f"... and {len(texts) - k} more: see the report"]
        lines += more
    return lines
