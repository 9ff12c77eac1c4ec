"""Kinematics that are a polynomial of the motors' positions: squareness, matrix, calibxyzkins.

All three say where the machine is when its motors are at j, in the controller's coordinates, mm:

    p = A j + B j^2 + c    (squares of the three positions, each by itself)

- squareness: A = I + S, S of the three squarenesses; B = 0, c = 0. The other errors stay. Those of
  the tables are told, and those with the least rms error as well.
- matrix: A of all linear parts; B = 0, c = 0. LinuxCNC's matrixkins (2.10) takes C = A^-1: j = C p.
- calibxyzkins (GTEC-UDC, https://github.com/GTEC-UDC/linuxcnc_gantry_robot): A, B and c. It
  solves for j by Newton's method, until |A j + B j^2 + c - p| < `tol`, from j = p.

A and B are those with the least rms error of the functional point over the volume, in the frame of
the calibration; home keeps its place (no constant is fitted: it would displace the zero only).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration, ErrorMap, Machine
from stepdiag.exporting.common import FloatArray, compensated_map, in_ascii, origin_of, require, tool_of
from stepdiag.exporting.left_in_volume import LeftInVolume, Motors, left_in_volume, volume_grid_of, what_is_left
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export, coverage_of, csv_leading, heading
from stepdiag.findings.meaning import provenance_rows
from stepdiag.io.csv_text import csv_text
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES

SQUARENESS_FORMAT: Final = "stepdiag squareness 1"
# The module's default is 1 µm: where the error is smaller, it would not compensate it at all.
TOLERANCE: Final = 1e-9  # mm
# A fit at two nodes of an axis could not tell a slope from a parabola.
FITTED_POSITIONS: Final = 11
# matrixkins makes its parameters when motmod asks for the kind of kinematics.
AFTER_MOTMOD: Final = "INI file: [HAL] HALFILE = this file, after the file that loads motmod"
ARC_SECOND: Final = np.pi / 180.0 / 3600.0
# Squareness -> its two axes, and the sign with which it makes their angle larger than 90 degrees.
BETWEEN: Final = {"C0Y": ("XY", 1.0), "B0Z": ("XZ", -1.0), "A0Z": ("YZ", 1.0)}


@dataclass(frozen=True)
class Polynomial:
    """p = linear j + quadratic j^2 + constant, of motor positions j in the controller's coordinates, mm."""

    linear: FloatArray  # (3, 3), 1
    quadratic: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))  # 1/mm
    constant: FloatArray = field(default_factory=lambda: np.zeros(3))  # mm

    def motors(self, commanded: FloatArray) -> FloatArray:
        """The inverse, (n, 3), by Newton's method: three steps leave nothing of errors below 1 %."""
        j = commanded.copy()
        for _ in range(3 if self.quadratic.any() else 1):
            missing = j @ self.linear.T + j**2 @ self.quadratic.T + self.constant - commanded
            slopes = self.linear + 2.0 * self.quadratic * j[:, None, :]
            j -= np.linalg.solve(slopes, missing[..., None])[..., 0]
        return j

    def from_home(self, origin: FloatArray) -> Motors:
        """Motor positions by commanded ones, both from home."""
        return lambda commanded, _: self.motors(commanded + origin) - origin


def squareness(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """The three squarenesses, CSV, in two conventions of sign: those of the tables, and the fitted ones."""
    missing = require(calibration, SQUARENESSES, options)
    known = calibration.squareness
    angles: dict[str, float] = {name: known[name][0] for name in SQUARENESSES if name in known}
    left = _left_by(calibration, options, angles)
    fitted = fitted_angles(calibration, options) if left is not None else {}
    with_fitted = _left_by(calibration, options, fitted) if fitted else None
    lines = [
        *heading(calibration, options, approach=False),
        "sign: value is stepdiag's and Renishaw's RIGHT_HANDED (positive turns Y about Z, Z about Y, Z about X by the "
        "right-hand rule); larger_than_90 is positive where the angle between the positive axes is above 90 degrees "
        "(LARGER_THAN_90)",
        "model: actual X = X - C0Y y + B0Z z, actual Y = Y - A0Z z; to compensate, apply its inverse",
        *missing,
        "left out: all 18 functions: positioning (their slopes too), straightness and rotations",
        *what_is_left(calibration, left),
    ]
    if with_fitted is not None:
        lines.append(
            "fitted: "
            + ", ".join(f"{name} {angle * 1e6:.4g}" for name, angle in fitted.items())
            + " µrad, the three angles with the least rms error in the volume (with what rotations and slopes of the "
            f"tables do to the functional point): with them the largest is {with_fitted.with_it.largest * 1e3:.4g} µm, "
            f"the rms {with_fitted.with_it.rms * 1e3:.4g} µm"
        )
    rows = []
    for name, angle in angles.items():
        axes, sign = BETWEEN[name]
        numbers = [scale * number for number in (angle, sign * angle + 0.0) for scale in (1e6, 1.0 / ARC_SECOND, 1e3)]
        rows.append([name, axes, *map(repr, [*numbers, fitted.get(name, np.nan) * 1e6])])
    columns = [f"{which}_{unit}" for which in ("value", "larger_than_90") for unit in ("urad", "arcsec", "mm_per_m")]
    leading = csv_leading(SQUARENESS_FORMAT, calibration, options, lines)
    text = csv_text(["parameter", "axes", *columns, "fitted_urad"], rows, leading)
    values = {"squareness": angles, "fitted": fitted or None, "with_fitted": with_fitted}
    return Export(
        {output: text},
        lines,
        coverage_of(calibration, SQUARENESSES),
        left,
        values,
        _motors_by(calibration, options, angles),
    )


def _shear(calibration: Calibration, angles: Mapping[str, float]) -> FloatArray:
    """Error (3, 3) of the functional point by squarenesses alone, for each mm along X, Y, Z."""
    return Machine(calibration.chain, ErrorMap({}, dict(angles))).first_order_error(np.eye(3)).T


def _left_by(calibration: Calibration, options: ExportOptions, angles: Mapping[str, float]) -> LeftInVolume | None:
    return left_in_volume(calibration, tool_of(calibration, options), _motors_by(calibration, options, angles))


def _motors_by(calibration: Calibration, options: ExportOptions, angles: Mapping[str, float]) -> Motors:
    return Polynomial(np.eye(3) + _shear(calibration, angles)).from_home(origin_of(options))


def fitted_angles(calibration: Calibration, options: ExportOptions) -> dict[str, float]:
    """The squarenesses that leave the least rms error in the volume, rad; the tables must be whole."""
    grid, root, error = _errors(calibration, options)
    alone = [(root * grid) @ _shear(calibration, {name: 1.0}).T for name in SQUARENESSES]
    design = np.stack([one.ravel() for one in alone], axis=1)
    found = np.linalg.lstsq(design, (root * error).ravel(), rcond=None)[0]
    return dict(zip(SQUARENESSES, found.tolist(), strict=True))


def matrix(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """HAL lines for matrixkins, with the matrix and its inverse in comments."""
    fitted, missing = _fitted(calibration, options, powers=1)
    tool, origin = tool_of(calibration, options), origin_of(options)
    inverse = np.asarray(np.linalg.inv(fitted.linear), dtype=np.float64)
    motors = fitted.from_home(origin)
    left = left_in_volume(calibration, tool, motors)
    moved = inverse @ origin - origin
    lines = [
        *heading(calibration, options),
        "matrix: actual = (I + A) motor, of the functional point; A has the least rms error over the volume. "
        "LinuxCNC 2.10 matrixkins: joint = C axis, C = (I + A)^-1",
        "sign: errors, actual - commanded of the tool relative to the workpiece; C compensates them (C_xy = +C0Y to "
        "first order)",
        *(
            ["note: the controller's 0 keeps its place, home is displaced by " + _micrometres(moved)]
            if moved.any()
            else []
        ),
        *missing,
        "left out: of the 18 functions all that is not proportional to one position: their shapes, and products of a "
        "rotation with a changing lever arm",
        *what_is_left(calibration, left),
    ]
    comments = ["INI file: [KINS] KINEMATICS = matrixkins; joints 0 1 2 = X Y Z; the matrix has no unit", AFTER_MOTMOD]
    comments += [f"I + A, row {axis}: {_numbers(row)}" for axis, row in zip(AXES, fitted.linear, strict=True)]
    comments += [f"C, row {axis}: {_numbers(row)}" for axis, row in zip(AXES, inverse, strict=True)]
    text = _hal("matrix", calibration, [*lines, *comments], _set("matrixkins.C_{}{}", inverse))
    coverage = coverage_of(calibration, SQUARENESSES, FUNCTIONS)
    return Export({output: text}, lines, coverage, left, {"linear": fitted.linear}, motors)


def calibxyzkins(calibration: Calibration, output: Path, options: ExportOptions) -> Export:
    """HAL lines for calibxyzkins of GTEC-UDC: linear and quadratic parts."""
    fitted, missing = _fitted(calibration, options, powers=2)
    tool, origin = tool_of(calibration, options), origin_of(options)
    motors = fitted.from_home(origin)
    left = left_in_volume(calibration, tool, motors)
    lines = [
        *heading(calibration, options),
        "model: position = A joints + B joints^2 + c, of the functional point; A and B have the least rms error over "
        "the volume, c leaves home where it is",
        "sign: errors, actual - commanded of the tool relative to the workpiece; the module sends the joints to the "
        "inverse",
        *missing,
        "left out: of the 18 functions all that is not linear or quadratic in one position: their shapes, and products "
        "of a rotation with a changing lever arm",
        *what_is_left(calibration, left),
    ]
    comments = [
        "module: https://github.com/GTEC-UDC/linuxcnc_gantry_robot; its code of July 2025 (commit 44b1355) still calls "
        "the names below calibxzkins.*",
        "INI file: [KINS] KINEMATICS = calibxyzkins coordinates=XYZ, [TRAJ] LINEAR_UNITS = mm",
        AFTER_MOTMOD,
        f"tol: the default of 0.001 mm would leave errors below 1 um as they are; here {TOLERANCE:g} mm",
    ]
    text = _hal(
        "calibxyzkins",
        calibration,
        [*lines, *comments],
        [
            *_set("calibxyzkins.calib-a.{}{}", fitted.linear),
            *_set("calibxyzkins.calib-b.{}{}", fitted.quadratic),
            *(
                f"setp calibxyzkins.calib-c.{axis.lower()} {value:.17g}"
                for axis, value in zip(AXES, fitted.constant, strict=True)
            ),
            f"setp calibxyzkins.tol {TOLERANCE:g}",
        ],
    )
    values = {"linear": fitted.linear, "quadratic": fitted.quadratic, "constant": fitted.constant}
    return Export({output: text}, lines, coverage_of(calibration, SQUARENESSES, FUNCTIONS), left, values, motors)


def _fitted(calibration: Calibration, options: ExportOptions, powers: int) -> tuple[Polynomial, list[str]]:
    """The polynomial of least rms error in the controller's coordinates, and what is not compensated."""
    missing = require(calibration, [*FUNCTIONS, *SQUARENESSES], options)
    grid, root, error = _errors(calibration, options)
    # Columns of one size, so that squares of large positions cost no digits.
    design = np.concatenate([(grid / calibration.volume) ** k for k in range(1, powers + 1)], axis=1)
    found = np.linalg.lstsq(root * design, root * error, rcond=None)[0].T
    linear = found[:, :3] / calibration.volume
    quadratic = found[:, 3:] / calibration.volume**2 if powers == 2 else np.zeros((3, 3))
    if powers == 1:
        return Polynomial(np.eye(3) + linear), missing
    # Of positions from home, q = j - origin, rewritten for the controller's j.
    origin = origin_of(options)
    return (
        Polynomial(np.eye(3) + linear - 2.0 * quadratic * origin, quadratic, quadratic @ origin**2 - linear @ origin),
        missing,
    )


def _errors(calibration: Calibration, options: ExportOptions) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points of the volume (n, 3), roots of their weights in a mean (n, 1), and the errors there (n, 3), mm."""
    errors = compensated_map(calibration, options.approach or "mean")
    grid, weights = volume_grid_of(errors, calibration.volume, fewest=FITTED_POSITIONS)
    machine = Machine(calibration.chain, errors, tool_of(calibration, options))
    return grid, np.sqrt(weights)[:, None], machine.error(grid)


def _hal(to: str, calibration: Calibration, lines: Sequence[str], settings: Sequence[str]) -> str:
    head = [f"stepdiag export --to {to}", *lines[:2], *provenance_rows(calibration), *lines[2:]]
    return in_ascii("".join(f"# {line}\n" for line in head) + "\n".join(["", *settings, ""]))


def _set(name: str, values: FloatArray) -> list[str]:
    return [
        f"setp {name.format(AXES[i].lower(), AXES[k].lower())} {values[i, k]:.17g}" for i in range(3) for k in range(3)
    ]


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.15g}" for value in values)


def _micrometres(values: FloatArray) -> str:
    return f"{' '.join(f'{value * 1e3:.4g}' for value in values)} µm"
