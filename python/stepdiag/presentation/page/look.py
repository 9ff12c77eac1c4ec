"""How figures of a page look: fonts, colours and axes that all of them share."""

from collections.abc import Mapping
from typing import Any, Final

from stepdiag import style
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
