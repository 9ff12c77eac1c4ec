"""The error of a machine before and after compensation with its calibration, by simulation.

python examples/before_and_after.py [before-after.png]
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import stepdiag as sd

scenario = sd.read_scenario(Path(__file__).parent / "better_plan.toml")
machine = scenario.machine()
calibration = sd.evaluate(scenario, sd.simulate(scenario))
compensator = sd.Compensator(calibration, machine.chain)

volume = scenario.known.plan.volume
axes = [np.linspace(0.0, length, 41) for length in volume]
target = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
command = compensator.command(target)
# What the axes are commanded to plus the error there is where the tool is.
errors = {
    "before": sd.errors_at(machine, target).error,
    "after": command + sd.errors_at(machine, command).error - target,
}
sizes = {name: 1e3 * np.linalg.norm(error, axis=1).reshape(41, 41, 41) for name, error in errors.items()}
for name, size in sizes.items():
    print(f"{name} compensation: largest error {size.max():.3g} µm, rms {np.sqrt(np.mean(size**2)):.2g} µm")

if len(sys.argv) > 1:
    figure, panels = plt.subplots(1, 2, figsize=(10.0, 3.7), layout="constrained", subplot_kw={"projection": "3d"})
    scale = matplotlib.colors.LogNorm(0.3, 110.0)
    for panel, (name, size) in zip(panels, sizes.items(), strict=True):
        # Three faces of the volume that one sees.
        x, y, z = axes
        for grid, face in (
            (np.meshgrid(x, y, [z[-1]], indexing="ij"), size[:, :, -1]),
            (np.meshgrid(x, [y[0]], z, indexing="ij"), size[:, 0, :]),
            (np.meshgrid([x[-1]], y, z, indexing="ij"), size[-1, :, :]),
        ):
            surface = [np.squeeze(part) for part in grid]
            colours = plt.get_cmap("cividis")(scale(np.maximum(face, 0.3)))
            panel.plot_surface(*surface, facecolors=colours, rcount=41, ccount=41, shade=False)
        panel.set_box_aspect(volume, zoom=1.1)
        panel.view_init(elev=22, azim=-52)
        panel.set(xlabel="X (mm)", ylabel="Y (mm)", zlabel="Z (mm)")
        panel.set(xticks=[0, 400, 800], yticks=[0, 300, 600], zticks=[0, 250, 500])
        panel.set_title(f"{name} compensation: up to {size.max():.3g} µm", fontsize=12, y=0.97)
    bar = figure.colorbar(matplotlib.cm.ScalarMappable(scale, "cividis"), ax=panels, shrink=0.8, pad=0.06)
    bar.set_label("error of the tool (µm)")
    bar.set_ticks([0.3, 1, 3, 10, 30, 100], labels=["0.3", "1", "3", "10", "30", "100"])
    figure.savefig(sys.argv[1], dpi=160)
