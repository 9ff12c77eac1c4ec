"""Figure of the closed loop: errors before and after, a screw error, and noise."""

import math
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stepdiag.demo.loop_outcome import LoopOutcome
from stepdiag.demo.loop_points import Agreement, FloatArray
from stepdiag.demo.loop_report import UM, WORDS, left_along
from stepdiag.style import COLOUR, SERIES, axis_label, own_style, save

SHOWN: Final = 100.0  # mm of X in the screw's panel
SMALLEST: Final = 1e-4  # µm; smaller errors, such as at home, are left of the figure
CASES: Final = (COLOUR["X"], COLOUR["Y"], COLOUR["Z"], SERIES[-1])  # clean, screw, noise, warm
DASHES: Final = {"nodes": "-", "random": "--"}


def draw_loop(outcomes: list[LoopOutcome], repeated: dict[str, Agreement] | None) -> dict[str, bytes]:
    """The figure as contents of files, by name."""
    with own_style():
        figure = Figure(figsize=(12.0, 4.8), layout="constrained")
        left, middle, right = figure.subplots(1, 3)
        draw_errors(left, outcomes)
        for outcome in outcomes:
            if outcome.case.screw:
                draw_screw(middle, outcome)
            if outcome.case.noise:
                draw_noise(right, outcome, repeated)
        return {f"loop.{suffix}": save(figure, suffix) for suffix in ("png", "svg")}


def draw_errors(axes: Axes, outcomes: list[LoopOutcome]) -> None:
    """Draw the share of points with a smaller error."""
    for outcome, colour in zip(outcomes, CASES, strict=False):
        for kind, points in outcome.points.items():
            label = f"{outcome.case.name}, {WORDS[kind]}"
            draw_shares(axes, lengths(points.after), color=colour, linestyle=DASHES[kind], label=label)
    before = outcomes[0].points["random"].before
    draw_shares(axes, lengths(before), color=COLOUR["truth"], linestyle=":", label="before")
    axes.set_xscale("log")
    axes.set_xlim(left=SMALLEST)
    axes.set_xlabel(axis_label("error of the functional point", "µm"))
    axes.set_ylabel("share of points with a smaller error")
    axes.set_title("Volumetric error before and after compensation")
    legend_below(axes)


def legend_below(axes: Axes) -> None:
    """A legend that hides no curve."""
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(0.0, -0.16), ncols=2, borderaxespad=0.0)


def lengths(errors: FloatArray) -> FloatArray:
    """Lengths of error vectors, µm."""
    return np.asarray(np.linalg.norm(errors, axis=1) * UM)


def draw_shares(axes: Axes, values: FloatArray, *, color: str, linestyle: str, label: str) -> None:
    shares = np.arange(1, len(values) + 1) / len(values)
    axes.plot(np.sort(values), shares, color=color, linestyle=linestyle, label=label, linewidth=1.2)


def draw_screw(axes: Axes, outcome: LoopOutcome) -> None:
    """Draw the remaining error in X along the first part of X."""
    colour = CASES[1]
    fine, nodes = np.linspace(0.0, SHOWN, 1001), outcome.scenario.known.plan.nodes("X")
    nodes = nodes[nodes <= SHOWN]
    targets = np.zeros((len(fine), 3))
    targets[:, 0] = fine
    axes.plot(fine, outcome.machine.error(targets)[:, 0] * UM, color=COLOUR["before"], label="before", linewidth=1.2)
    axes.plot(fine, left_along(outcome, 0, fine)[:, 0] * UM, color=colour, label="after", linewidth=1.2)
    axes.plot(nodes, left_along(outcome, 0, nodes)[:, 0] * UM, "o", color=colour, markersize=4, label="after, at nodes")
    axes.set_xlabel(axis_label("position X", "mm"))
    axes.set_ylabel(axis_label("error in X", "µm"))
    axes.set_title("A screw error of 10 mm pitch stays between nodes")
    legend_below(axes)


def draw_noise(axes: Axes, outcome: LoopOutcome, repeated: dict[str, Agreement] | None) -> None:
    """Draw errors relative to the stated uncertainty, and the expected chi-square distribution."""
    for kind, found in outcome.agreement.items():
        draw_shares(axes, found.chi_square, color=CASES[2], linestyle=DASHES[kind], label=f"this run, {WORDS[kind]}")
    for kind, found in (repeated or {}).items():
        label = f"repetitions, {WORDS[kind]}"
        draw_shares(axes, found.chi_square, color=COLOUR["outlier"], linestyle=DASHES[kind], label=label)
    x = np.linspace(0.0, 20.0, 400)
    expected = [math.erf(math.sqrt(v / 2.0)) - math.sqrt(2.0 * v / math.pi) * math.exp(-v / 2.0) for v in x]
    axes.plot(x, expected, color=COLOUR["truth"], linewidth=0.8, label="expected, three degrees of freedom")
    axes.set_xlim(0.0, 20.0)
    axes.set_xlabel("chi-square of the error vector")
    axes.set_ylabel("share of points with a smaller value")
    axes.set_title("Noise: what is left, by the calibration's own uncertainty")
    legend_below(axes)
