"""The paper's plan and a better one beside each other: lines, readings, time and uncertainty, before anyone measures.

python examples/two_plans.py [plans.png]
"""

import sys
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import stepdiag as sd

HERE = Path(__file__).parent
PLANS = {"the paper's plan": "scenario.toml", "scale lines at every step": "better_plan.toml"}
UNITS = {"positioning": "µm", "straightness": "µm", "angle": "µrad", "squareness": "µrad"}
MEASURED, SCALE = "#2450C4", "#D4401C"


def uncertainties(scenario: sd.Scenario) -> dict[str, float]:
    """The largest standard uncertainty of each family, in µm or µrad, of a run that nobody has measured."""
    _, found = sd.observe(scenario)
    factor = {"µm": 1e3, "µrad": 1e6}
    return {kind: u * factor[UNITS[kind]] for kind, (u, _) in sd.largest_uncertainties(found.calibration).items()}


def draw_lines(axes: Any, plan: sd.Plan) -> None:
    """The volume, the lines through it, and a dot for each reading."""
    edges = np.array(plan.volume)
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * edges
    for a in corners:
        for b in corners[np.sum(corners != a, axis=1) == 1]:
            axes.plot(*np.transpose([a, b]), color="#B0B0B0", lw=0.6)
    for line in [*plan.lines, *plan.scale_lines]:
        points, scale = plan.points(line), line in plan.scale_lines
        axes.plot(*points.T, color=SCALE if scale else MEASURED, lw=1.4 if scale else 0.6)
        axes.plot(*points.T, ".", color=SCALE if scale else MEASURED, ms=4 if scale else 1.2)
    axes.set_box_aspect(edges, zoom=1.02)
    axes.view_init(elev=20, azim=-62)
    axes.set_axis_off()


scenarios = {name: sd.read_scenario(HERE / file) for name, file in PLANS.items()}
found = {name: uncertainties(scenario) for name, scenario in scenarios.items()}
for name, values in found.items():
    readings = sum(len(planned.points) for planned in scenarios[name].known.plan.passes())
    said = ", ".join(f"{kind} {u:.2g} {UNITS[kind]}" for kind, u in values.items())
    print(f"{name}: {readings} readings, u at most {said}")

if len(sys.argv) > 1:
    figure = plt.figure(figsize=(10.0, 3.6), layout="constrained")
    for number, (name, scenario) in enumerate(scenarios.items(), 1):
        axes = figure.add_subplot(1, 3, number, projection="3d")
        draw_lines(axes, scenario.known.plan)
        axes.set_title(name, fontsize=10)
    axes = figure.add_subplot(1, 3, 3)
    height = np.arange(len(UNITS))
    for offset, shade, (name, values) in zip((-0.2, 0.2), ("#B0B0B0", SCALE), found.items(), strict=True):
        widths = [values[kind] for kind in UNITS]
        bars = axes.barh(height + offset, widths, 0.36, color=shade, label=name)
        texts = [f"{u:.2g} {unit}" for u, unit in zip(widths, UNITS.values(), strict=True)]
        axes.bar_label(bars, texts, padding=3, fontsize=8)
    axes.set_yticks(height, list(UNITS))
    axes.invert_yaxis()
    axes.set_xlim(right=1.3 * max(max(values.values()) for values in found.values()))
    axes.set_xticks([])
    axes.spines[["top", "right", "bottom"]].set_visible(False)
    axes.set_title("largest standard uncertainty", fontsize=10)
    axes.legend(fontsize=8, loc="lower right", frameon=False)
    figure.savefig(sys.argv[1], dpi=160)
