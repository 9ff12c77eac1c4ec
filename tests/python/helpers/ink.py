"""What a reader sees of a figure: the ink in its panels, and its texts."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from stepdiag.style import own_style

DPI = 72


def pixels(figure: Figure) -> np.ndarray:
    """(height, width, 3) of 0 to 255, rows from above."""
    buffer = io.BytesIO()
    with own_style():
        figure.savefig(buffer, format="rgba", dpi=DPI)
    width, height = (int(DPI * inches) for inches in figure.get_size_inches())
    return np.frombuffer(buffer.getvalue(), dtype=np.uint8).reshape(height, width, 4)[:, :, :3]


def ink(figure: Figure) -> dict[str, int]:
    """Pixels inside each panel, by its title, that are darker or more coloured than grid and hatches."""
    picture = pixels(figure).astype(int)
    height, width, _ = picture.shape
    found = {}
    for number, axes in enumerate(figure.axes):
        left, bottom, right, top = axes.get_position(original=False).extents
        inner = picture[
            round((1.0 - top) * height) + 2 : round((1.0 - bottom) * height) - 2,
            round(left * width) + 2 : round(right * width) - 2,
        ]
        coloured = np.ptp(inner, axis=2) > 25
        found[axes.get_title("left") or f"panel {number}"] = int(np.sum(coloured | (inner.mean(axis=2) < 110)))
    return found


def texts(figure: Figure) -> list[str]:
    """All texts of a figure."""
    found: list[Any] = figure.findobj(lambda artist: hasattr(artist, "get_text"))
    return [artist.get_text() for artist in found if artist.get_text()]


def panel(figure: Figure, title: str) -> Any:
    """The panel of this title."""
    (axes,) = [axes for axes in figure.axes if axes.get_title("left") == title]
    return axes


def labels(figure: Figure) -> list[str]:
    """Of all axes that have one."""
    return [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text]
