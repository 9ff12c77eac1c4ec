"""Common style of all figures, and files with the same bytes in every run."""

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
    "svg.hashsalt": "stepdiag",  # same names inside the file in every run
}

# Metadata that would differ from run to run.
UNWANTED: Final = {"png": "Software", "svg": "Date"}


@contextmanager
def own_style() -> Iterator[None]:
    """Use stepdiag's style instead of the user's for what is drawn inside the block."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def save(figure: Figure, suffix: str) -> bytes:
    """The content of a file of this figure; `suffix` is "png" or "svg"."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=suffix, dpi=160, metadata={UNWANTED[suffix]: None})
    return buffer.getvalue()
