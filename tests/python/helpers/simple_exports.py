"""Readers of the simple exports, and what their controllers make of them by their published formulas.

They share no code with the writers. All positions in mm, in the controller's coordinates, (n, 3).
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np

Vectors = np.ndarray


def settings(path: Path) -> dict[str, float]:
    """What the lines `setp NAME VALUE` of a HAL file set; nothing else stands there but comments."""
    found = {}
    for line in path.read_text(encoding="ascii").splitlines():
        if line and not line.startswith("#"):
            word, name, value = line.split()
            assert word == "setp"
            found[name] = float(value)
    return found


def matrix_of(values: dict[str, float], name: str) -> Vectors:
    return np.array([[values[name.format(a, b)] for b in "xyz"] for a in "xyz"])


def rows_of(path: Path) -> tuple[dict[str, str], list[dict[str, str]]]:
    lines = path.read_text(encoding="ascii").splitlines()
    leading = dict(line[2:].split("=", 1) for line in lines if line.startswith("#"))
    return leading, list(csv.DictReader(line for line in lines if not line.startswith("#")))


def squareness_motors(path: Path, p: Vectors) -> Vectors:
    """m of actual = m + shear, by elimination: z is right, then y, then x."""
    c0y, b0z, a0z = (float(row["value_urad"]) * 1e-6 for row in rows_of(path)[1])
    m = p.copy()
    m[:, 1] += a0z * p[:, 2]
    m[:, 0] += c0y * m[:, 1] - b0z * p[:, 2]
    return m


def matrixkins_motors(path: Path, p: Vectors) -> Vectors:
    """kinematicsInverse of LinuxCNC 2.10's matrixkins."""
    return p @ matrix_of(settings(path), "matrixkins.C_{}{}").T


def calibxyzkins_motors(path: Path, p: Vectors) -> Vectors:
    """Newton's method from j = p, at most 10 steps, to |A j + B j^2 + c - p| < tol, as its documentation says."""
    values = settings(path)
    a, b = (matrix_of(values, f"calibxyzkins.calib-{name}.{{}}{{}}") for name in "ab")
    c = np.array([values[f"calibxyzkins.calib-c.{axis}"] for axis in "xyz"])
    j = p.copy()
    for _ in range(10):
        residual = np.einsum("ik,nk->ni", a, j) + np.einsum("ik,nk->ni", b, j**2) + c - p
        going = np.linalg.norm(residual, axis=1) >= values["calibxyzkins.tol"]
        jacobian = a + 2.0 * b * j[going][:, None, :]  # B diag(j): column k by j_k
        j[going] -= np.einsum("nik,nk->ni", np.linalg.inv(jacobian), residual[going])
    return j


def position_error_motors(path: Path, p: Vectors) -> Vectors:
    leading, rows = rows_of(path)
    position, error = np.array([[float(row["position_mm"]), float(row["error_um"])] for row in rows]).T
    m = p.copy()
    m[:, "XYZ".index(leading["axis"])] -= np.interp(p[:, "XYZ".index(leading["depends_on"])], position, error) * 1e-3
    return m


MOTORS: dict[str, Callable[[Path, Vectors], Vectors]] = {
    "squareness": squareness_motors,
    "matrix": matrixkins_motors,
    "calibxyzkins": calibxyzkins_motors,
    "position-error": position_error_motors,
}
