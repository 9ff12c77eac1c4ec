"""Tables for controllers that nobody has here: interpreters written from their manuals move the virtual machine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from controllers import INTERPRETERS
from exported import VOLUME, machine_of, points_in, random_calibration
from usual import ALL_CHAINS

from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.write import write_export

ORIGIN = (-100.0, 25.0, 7.5)
ENDING = {
    "siemens-cec": ".ini",
    "siemens-enc-comp": ".ini",
    "etalon": ".txt",
    "heidenhain-com": "",
    "heidenhain-kinematics": "",
}
BOTH = ("siemens-cec", "heidenhain-com")  # directions of approach
SQUARENESS = ("rrf", "marlin", "klipper")
INTERVALS = 7
RESOLUTION = 3e-6  # mm: values of six digits, summed; Klipper's diagonals and degrees are finer
SECOND_ORDER = 2e-5  # mm: an error of 0.1 mm times a rotation of 60 µrad, and products of rotations; thrice
FIRST_ORDER = 5e-4  # mm: an error of 0.06 mm times a slope of 5 mm/m in such a small volume


def test_directions_are_said(tmp_path: Path) -> None:
    calibration = random_calibration(3, reversal=True)
    said = [write_export(calibration, to, tmp_path / to, ExportOptions()).report for to in BOTH]
    assert any("direction of approach each by itself: X by X, X by Y, X by Z, Y by X" in line for line in said[0])
    own = "direction of approach each by itself: X by X, Y by Y, Z by Z (mean of both for the others)"
    assert any(own in line for line in said[1])
    one = write_export(calibration, "siemens-cec", tmp_path / "one", ExportOptions(approach="positive")).report
    assert any("direction of approach +" in line for line in one)


@pytest.mark.slow
@pytest.mark.parametrize("chain", ALL_CHAINS)
@pytest.mark.parametrize("to", INTERPRETERS)
def test_what_is_left_is_what_the_export_says(tmp_path: Path, to: str, chain: str) -> None:
    """At the nodes of the tables, where it is largest but for parabolas between them; at 10,000 points elsewhere it is
    no larger, and with the turned sign it is."""
    # What carries one direction only has the mean: reversal would be most of what is left.
    calibration = random_calibration(ALL_CHAINS.index(chain), chain, intervals=INTERVALS, reversal=to in BOTH)
    machine, output = machine_of(calibration), tmp_path / f"table{ENDING.get(to, '.gcode')}"
    # A firmware's command acts from the controller's 0.
    origin = (0.0, 0.0, 0.0) if to in SQUARENESS else ORIGIN
    done = write_export(calibration, to, output, ExportOptions(origin=origin))
    axes = [np.linspace(0.0, edge, INTERVALS + 1) for edge in VOLUME]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    p = np.concatenate([np.zeros((1, 3)), points_in(VOLUME, 10_000)])

    def left(p: np.ndarray, sign: float = 1.0) -> np.ndarray:
        found = []
        for direction in (1, -1):
            motors = INTERPRETERS[to](output, p + origin, direction, sign) - origin
            error = motors + machine.error(motors, ("+" if direction > 0 else "-") * 3) - p
            found.append(error)
        return np.linalg.norm(np.array(found) - found[0][0], axis=2)  # relative to home in + direction

    after, turned = left(p), left(p, -1.0)
    if done.left is None:  # all 21, subtracted at the commanded position
        model = p + origin - INTERPRETERS[to](output, p + origin, 1, 1.0)
        assert np.abs(model - model[0] - machine.error(p)).max() < RESOLUTION + SECOND_ORDER
        assert after.max() < FIRST_ORDER
    else:
        said = done.left.with_it.largest
        assert left(nodes).max() == pytest.approx(said, abs=RESOLUTION)
        assert 0.6 * said < after.max() < 1.03 * said
    assert np.mean(turned**2) > np.mean(after**2)
    if to not in SQUARENESS:
        assert turned.max() > max(after.max(), np.linalg.norm(machine.error(p), axis=1).max())
