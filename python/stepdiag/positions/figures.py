"""The figures of ISO 230-2 and ISO 230-6 for positions along a line: names, meanings, and one figure as a value."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from stepdiag.display import Facts
from stepdiag.units import report_value

# By their symbols, in the order of reports. UP: target approached in + direction, DOWN: in - direction.
FIGURES: Final[Mapping[str, str]] = {
    "A": "accuracy, bidirectional",
    "A_up": "accuracy, + direction",
    "A_down": "accuracy, - direction",
    "E": "systematic error, bidirectional",
    "E_up": "systematic error, + direction",
    "E_down": "systematic error, - direction",
    "M": "mean bidirectional systematic error",
    "R": "repeatability, bidirectional",
    "R_up": "repeatability, + direction",
    "R_down": "repeatability, - direction",
    "B": "reversal error",
    "B_mean": "mean reversal error",
}


def symbol(figure: str) -> str:
    """The symbol of a figure as the standard prints it: E↑ of E_up."""
    return figure.replace("_up", "↑").replace("_down", "↓").replace("B_mean", "mean B")


@dataclass(frozen=True)
class PositionFigure:
    """One figure (mm), and the targets where it occurs: one, or those of the highest and of the lowest value.

    `standard_uncertainty` and `interval` (95 %) are None where they are not known."""

    value: float
    at: tuple[float, ...] = ()  # mm along the line; empty for a mean
    standard_uncertainty: float | None = None
    interval: tuple[float, float] | None = None


def figure_facts(figures: Mapping[str, PositionFigure]) -> Facts:
    """Symbols and values with their intervals, µm."""
    found = []
    for name, figure in figures.items():
        interval = ""
        if figure.interval is not None:
            low, high = (report_value("mm", end)[0] for end in figure.interval)
            interval = f", 95 % interval {low:.4g} to {high:.4g} µm"
        found.append((symbol(name), f"{report_value('mm', figure.value)[0]:.4g} µm{interval}"))
    return found
