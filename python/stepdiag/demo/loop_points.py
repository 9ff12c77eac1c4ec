"""Criteria of the loop: errors at nodes and random points, before and after compensation."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, Expansion, Machine, Plan, error_at_point

FloatArray = npt.NDArray[np.float64]

# Of chi-square with three degrees of freedom, 95 %.
QUANTILE_95: Final = 7.8147279


def grid_nodes(plan: Plan, count: int, seed: int) -> FloatArray:
    """A random choice of `count` nodes of the plan's grid, (n, 3), mm, with all eight corners."""
    sides = plan.steps + 1
    corners = np.array([[x, y, z] for x in (0, plan.steps) for y in (0, plan.steps) for z in (0, plan.steps)])
    drawn = np.random.default_rng(seed).permutation(sides**3)[:count]
    indices = np.stack(np.unravel_index(drawn, (sides, sides, sides)), axis=1)
    indices[: len(corners)] = corners[:count]
    nodes = [plan.nodes(axis) for axis in "XYZ"]
    return np.stack([nodes[axis][indices[:, axis]] for axis in range(3)], axis=1)


def random_points(plan: Plan, count: int, seed: int) -> FloatArray:
    """Random points in the volume, (n, 3), mm."""
    return np.random.default_rng(seed).uniform(0.0, plan.volume, (count, 3))


@dataclass(frozen=True)
class Warmth:
    """Scales that expand, at these temperatures of X, Y, Z, °C."""

    expansion: Expansion
    temperature: tuple[float, float, float]


def errors_at(machine: Machine, joints: FloatArray, targets: FloatArray, warmth: Warmth | None = None) -> FloatArray:
    """Deviation of the functional point from its target for axes at `joints`, (n, 3), mm."""
    if warmth is None:
        return joints + machine.error(joints) - targets
    actual = [machine.pose([p], expansion=warmth.expansion.shift(p, warmth.temperature))[1][0] for p in joints]
    return np.array(actual) - machine.tool - targets


@dataclass(frozen=True)
class Sizes:
    """Sizes of error vectors, mm."""

    largest: float
    rms: float

    @classmethod
    def of(cls, errors: FloatArray) -> "Sizes":
        lengths = np.linalg.norm(errors, axis=1)
        return cls(float(lengths.max()), float(np.sqrt(np.mean(lengths**2))))


@dataclass(frozen=True)
class Agreement:
    """Remaining errors compared with the calibration's stated uncertainty."""

    chi_square: FloatArray  # (n,): of each error vector, by the covariance of the calibration there
    stated_rms: float  # of the vectors' standard uncertainty, mm
    found_rms: float  # of the remaining error, mm

    @property
    def covered(self) -> float:
        """Share of points whose error lies in the region of 95 %."""
        return float(np.mean(self.chi_square <= QUANTILE_95))

    @property
    def mean_chi_square(self) -> float:
        """Mean chi-square per degree of freedom; 1 is expected."""
        return float(np.mean(self.chi_square) / 3.0)


def covariances(calibration: Calibration, points: FloatArray) -> FloatArray:
    """Covariances of the calibration's error vectors at points, (n, 3, 3), mm^2."""
    return np.array([error_at_point(calibration, point).covariance[:3, :3] for point in points])


def agreement(errors: FloatArray, covariance: FloatArray) -> Agreement:
    """Compare errors with their covariance.

    Points at home, where the covariance is 0, are left out."""
    known = np.linalg.eigvalsh(covariance)[:, 0] > 0.0
    errors, covariance = errors[known], covariance[known]
    chi_square = np.einsum("ni,ni->n", errors, np.linalg.solve(covariance, errors[:, :, None])[:, :, 0])
    stated = float(np.sqrt(np.mean(np.trace(covariance, axis1=1, axis2=2))))
    return Agreement(chi_square, stated, Sizes.of(errors).rms)
