"""What all figures have in common: their style, and files that have the same bytes run after run."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

import matplotlib
from matplotlib.figure import Figure

STYLE: Any = {
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "svg.hashsalt": "stepdiag",  # the same names inside the file, run after run
}

# Metadata that would differ from run to run.
UNWANTED: Final = {"png": "Software", "svg": "Date"}


@contextmanager
def own_style() -> Iterator[None]:
    """Our style, not the user's own, for what is drawn inside."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def save(figure: Figure, suffix: str) -> bytes:
    """The figure as the content of a file, "png" or "svg"."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=suffix, dpi=160, metadata={UNWANTED[suffix]: None})
    return buffer.getvalue()
