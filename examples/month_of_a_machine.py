"""A month of a machine that drifts, is hit and is mended, and what rechecks say of it. Simulated: the truth is known.

python examples/month_of_a_machine.py [FOLDER]

On day 0 the machine is calibrated; on the other days it is rechecked by four body diagonals in five steps, about six
minutes. Each time the laser is set up anew, the scales have another temperature, and their sensor is off by 0.1 K
(standard deviation). A recheck that says "changed" becomes the baseline of the next ones. With FOLDER, scenarios,
readings and calibrations stay there.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import stepdiag as sd

SCENARIO = """
[volume]
x_mm = 600.0
y_mm = 500.0
z_mm = 400.0
[machine]
chain = "[w X' b Y Z t]"
[head]
layout = "ideal"
[noise]
distance_um = 0.2
tilt_urad = 1.0
seed = {seed}
[misalignment]
{misalignment}
[temperature]
expansion_um_per_m_k = 11.5
u_expansion_um_per_m_k = 0.5
u_temperature_c = 0.1
axes_c = {temperature}
[adjustment]
lateral_mm = "fixed"
roll_urad = "fixed"
gain = "fixed"
[plan_by_time]
line_change_min = 0.5
repeats = [1, 2, 4]
[plan]
"""
DIAGONALS = ["ppp", "npp", "pnp", "nnp"]
SCALES = ["p00", "0p0", "00p"]
CALIBRATION = f"lines = {DIAGONALS}\nscale_lines = {SCALES}\nsteps = 10\n"
SHORT = f"lines = {DIAGONALS}\nsteps = 5\n"
DAYS = (1, 3, 5, 8, 10, 12, 15, 17, 19, 22, 24, 26, 29)
HIT, MENDED = 15, 22

VOLUME = np.array([600.0, 500.0, 400.0])
MACHINE = sd.random_error_map(VOLUME, seed=7, intervals=10)


def machine_on(day: int) -> sd.ErrorMap:
    """The head sags slowly; on one day it is hit, on another one the squareness is set right and the sag goes on."""
    functions, squareness = MACHINE.functions, MACHINE.squareness
    sag = 0.4e-6 * day  # rad, of A0Z
    turned = 40e-6 if HIT <= day < MENDED else 3e-6 if day >= MENDED else 0.0  # rad, of C0Y
    position, value = functions["ECY"]
    functions |= {"ECY": (position, value + 0.3 * turned * position / VOLUME[1])}
    squareness |= {"A0Z": squareness["A0Z"] + sag, "C0Y": squareness["C0Y"] + turned}
    return sd.ErrorMap(functions, squareness)


def read_on(day: int, plan: str, folder: Path) -> tuple[sd.Scenario, sd.Measurement]:
    rng = np.random.default_rng([7, day])
    temperature = round(20.0 + 2.0 * rng.normal(), 2)
    lines = [line for line in (*DIAGONALS, *SCALES) if f'"{line}"' in plan or f"'{line}'" in plan]
    tilts = {line: (200.0 if line in DIAGONALS else 0.0) * rng.normal(size=4) for line in lines}
    misalignment = "\n".join(
        f"{line} = {{ reflector_urad = [{a:.1f}, {b:.1f}], laser_urad = [{c:.1f}, {d:.1f}] }}"
        for line, (a, b, c, d) in tilts.items()
    )
    path = folder / f"day{day}.toml"
    path.write_text(SCENARIO.format(seed=day, temperature=temperature, misalignment=misalignment) + plan)
    scenario = sd.read_scenario(path)
    run = sd.simulate(scenario, errors=machine_on(day))
    off = {name: value + 0.1 * rng.normal() for name, value in run.channels.items() if name.startswith("temperature")}
    run = sd.Measurement(run.line, run.point, run.position, {**run.channels, **off})
    run.write(folder / f"day{day}.csv")
    return scenario, run


def largest(errors: sd.ErrorMap | sd.Calibration) -> float:
    """The largest error in the volume, µm."""
    if isinstance(errors, sd.Calibration):
        return 1e3 * sd.volume(errors, ranking=False).largest
    machine = sd.Machine("[w X' b Y Z t]", errors)
    return 1e3 * sd.volume(machine, box=[np.zeros(3), VOLUME], ranking=False).largest


def main(folder: Path) -> None:
    scenario, run = read_on(0, CALIBRATION, folder)
    baseline = sd.methods.evaluate_scenario(scenario, run, full_covariance=True)
    baseline.write(folder / "day0.nc")
    print(f"day 0: calibrated; largest error {largest(baseline):.1f} µm, in truth {largest(machine_on(0)):.1f} µm\n")
    print("day      verdict  chance    C0Y (µrad)  in truth    A0Z (µrad)  in truth   largest error (µm)  in truth")
    for day in DAYS:
        scenario, run = read_on(day, SHORT, folder)
        found = sd.recheck(baseline, scenario, run)
        changed = found.probability < 0.001
        updated = found.updated
        cells = []
        for name in ("C0Y", "A0Z"):
            value, uncertainty = updated.squareness[name]
            cells.append(f"{1e6 * value:+7.1f}({1e6 * uncertainty:.1f}) {1e6 * machine_on(day).squareness[name]:+9.1f}")
        errors = f"{largest(updated):12.1f} {largest(machine_on(day)):12.1f}"
        said = "changed" if changed else "as it was"
        chance = f"{found.probability:.1g}" if found.probability > 1e-9 else "<1e-9"
        print(f"{day:3} {said:>12} {chance:>8} {cells[0]:>22} {cells[1]:>22} {errors:>30}")
        if changed:
            baseline = updated
            updated.write(folder / f"day{day}.nc")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).mkdir(exist_ok=True)
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            main(Path(temporary))
