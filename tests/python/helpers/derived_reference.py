"""What follows from a calibration, made a second time: errors at points, along diagonals, ranges over the volume.

By the exact poses of `reference` at errors so small that nothing but the first order is left. mm, rad.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import reference

import stepdiag as sd

SMALL = 1e-3
LABEL = tuple[str, float | None]


def table_of(labels: list[LABEL], values: np.ndarray) -> reference.ErrorTable:
    """Tables with these values at these nodes."""
    functions: dict[str, tuple[list[float], list[float]]] = {}
    squareness: dict[str, float] = {}
    for (name, position), value in zip(labels, values, strict=True):
        if position is None or np.isnan(position):
            squareness[name] = float(value)
        else:
            nodes, found = functions.setdefault(name, ([], []))
            nodes.append(float(position))
            found.append(float(value))
    return reference.ErrorTable(functions, squareness)


def deviations(chain: str, table: reference.ErrorTable, tool: np.ndarray, point: np.ndarray) -> np.ndarray:
    """X, Y, Z of the functional point, A, B, C of the tool; to third order in the errors given."""
    half, found = 0.5 * SMALL, []
    for size in (half, -half):
        scaled = reference.ErrorTable(
            {name: (nodes, [size * v for v in values]) for name, (nodes, values) in table.functions.items()},
            {name: size * value for name, value in table.squareness.items()},
        )
        rotation, at = reference.pose(chain, scaled, tool, point)
        twist = 0.5 * np.array(
            [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
        )
        found.append(np.concatenate([at, twist]))
    return np.asarray((found[0] - found[1]) / SMALL, dtype=float)


def rows_at(chain: str, labels: list[LABEL], tool: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Coefficients of the six deviations by value, (6, values)."""
    units = np.eye(len(labels))
    size = 1e-2  # 5 um or 5 urad, where roundings are 1e-8 of a millimetre by millimetre and third order 1e-11
    return np.array([deviations(chain, table_of(labels, size * unit), tool, point) for unit in units]).T / size


def grid(volume: np.ndarray, parts: tuple[int, int, int]) -> np.ndarray:
    shares = [np.linspace(0.0, 1.0, count + 1) for count in parts]
    return np.array([np.multiply(volume, share) for share in product(*shares)])


def diagonal(volume: np.ndarray, line: str, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of a body diagonal, equally apart, and its direction."""
    sign = np.array([{"p": 1.0, "n": -1.0}[s] for s in line])
    start = np.where(sign > 0, 0.0, volume)
    travel = sign * volume
    return np.array([start + share * travel for share in np.linspace(0, 1, points)]), travel / np.linalg.norm(travel)


def values_of(calibration: sd.Calibration) -> np.ndarray:
    """In the order of its covariance."""
    found = []
    for name, position in calibration.covariance_labels:
        if position is None:
            found.append(calibration.squareness[name][0])
        else:
            nodes, values, _ = calibration.functions[name]
            found.append(values[int(np.argmin(np.abs(nodes - position)))])
    return np.array(found)
