"""Firmware of small machines: one command with the three squarenesses.

From their sources (RepRapFirmware Move::AxisTransform, Marlin Planner::skew, Klipper skew_correction.py), with the
motor position m of a commanded p:

- M556 (RepRapFirmware): m_x = x + tan_XY y + tan_XZ z, m_y = y + tan_YZ z; tangents are X, Z, Y divided by S.
- M852 (Marlin) and SET_SKEW (Klipper): m_x = x - f_XY y - (f_XZ - f_XY f_YZ) z, m_y = y - f_YZ z. Klipper computes f
  from the diagonals AC, BD and the side AD of a parallelogram that was printed.

The angles are those that leave the least rms error in the volume if they are all that is compensated.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration
from stepdiag.exporting.common import FloatArray, in_ascii, require, tool_of
from stepdiag.exporting.left_in_volume import left_in_volume, what_is_left
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.polynomial import fitted_angles
from stepdiag.exporting.result import Export, coverage_of, heading
from stepdiag.findings.meaning import provenance_rows
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

SIDE: Final = 100.0  # mm, of the parallelogram; S of M556
# Tangents of XY, XZ, YZ -> lines of the file.
Command = Callable[[float, float, float], Sequence[str]]


def rrf(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """M556 of RepRapFirmware."""

    def command(xy: float, xz: float, yz: float) -> Sequence[str]:
        return [f"M556 S{SIDE:g} X{xy * SIDE:.6f} Y{yz * SIDE:.6f} Z{xz * SIDE:.6f}"]

    return _export(calibration, output, options, "rrf", command, ";", "put the line into config.g")


def marlin(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """M852 of Marlin."""

    def command(xy: float, xz: float, yz: float) -> Sequence[str]:
        return [f"M852 I{-xy + 0.0:.9f} J{-xz + 0.0:.9f} K{-yz + 0.0:.9f}", "M500"]

    steps = "the firmware needs SKEW_CORRECTION, SKEW_CORRECTION_GCODE and SKEW_CORRECTION_FOR_Z; send the lines (G21)"
    return _export(calibration, output, options, "marlin", command, ";", steps)


def klipper(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """SET_SKEW and SKEW_PROFILE of Klipper."""

    def command(xy: float, xz: float, yz: float) -> Sequence[str]:
        planes = {"XY": xy, "XZ": xz, "YZ": yz}
        measured = " ".join(f"{plane}={','.join(f'{x:.9f}' for x in diagonals(-f))}" for plane, f in planes.items())
        return [f"SET_SKEW {measured}", "SKEW_PROFILE SAVE=stepdiag", "SAVE_CONFIG"]

    steps = (
        "printer.cfg needs [skew_correction]; send the lines, then put SKEW_PROFILE LOAD=stepdiag into the start macro"
    )
    return _export(calibration, output, options, "klipper", command, "#", steps)


def diagonals(factor: float) -> tuple[float, float, float]:
    """AC, BD and AD, mm, from which Klipper computes this factor."""
    cosine = np.sin(np.arctan(factor))
    return float(SIDE * np.sqrt(2.0 + 2.0 * cosine)), float(SIDE * np.sqrt(2.0 - 2.0 * cosine)), SIDE


def _export(
    calibration: Calibration,
    output: Path,
    options: ExportOptions,
    to: str,
    command: Command,
    comment: str,
    steps: str,
) -> Export:
    missing = require(calibration, [*FUNCTIONS, *SQUARENESSES], options)
    angles = fitted_angles(calibration, options)
    xy, xz, yz = angles["C0Y"], -angles["B0Z"], angles["A0Z"]

    def motors(commanded: FloatArray, _: int) -> FloatArray:
        sent = commanded.copy()
        # Marlin and Klipper move X along the Y that is sent to the motors.
        y = commanded[:, 1] if to == "rrf" else commanded[:, 1] + yz * commanded[:, 2]
        sent[:, 0] += xy * y + xz * commanded[:, 2]
        sent[:, 1] += yz * commanded[:, 2]
        return sent

    left = left_in_volume(calibration, tool_of(calibration, options), motors)
    said = ", ".join(f"{name} {angle * 1e6:.4g} µrad" for name, angle in angles.items())
    lines = [
        "written from the firmware's source, not tried on a machine",
        *heading(calibration, options),
        f"fitted: {said}: the three angles with the least rms error in the volume",
        "sign: a positive angle turns Y about Z, Z about Y, Z about X by the right-hand rule; the command compensates "
        "it",
        f"steps: {steps}",
        "the command acts from the controller's 0; elsewhere home is displaced, and nothing else",
        *missing,
        "left out: all 18 functions, but for what they have in common with the three angles",
        *what_is_left(calibration, left),
    ]
    comments = [f"stepdiag export --to {to}", *provenance_rows(calibration), *lines]
    text = in_ascii("\n".join([*(f"{comment} {line}" for line in comments), *command(xy, xz, yz), ""]))
    return Export({output: text}, lines, coverage_of(calibration, SQUARENESSES), left, {"fitted": angles}, motors)
