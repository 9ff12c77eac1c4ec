"""What an export leaves of the error in the volume, with its compensation applied as the controller applies it.

The controller sends the motors to m(p) when p is commanded; e is the error of the functional point by
the exact pose. The remaining error is m + e(m) - p, referred to home, as every error of docs/volume.md is.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from stepdiag._core import Calibration, ErrorMap, Machine
from stepdiag.exporting.common import FloatArray, common_nodes, inside, spread, undetermined_of
from stepdiag.parameters import AXES, FUNCTIONS, SQUARENESSES

MOST_POSITIONS: Final = 51  # of an axis: 132,651 points, which take a tenth of a second
# Motor positions (n, 3) at commanded positions (n, 3), mm, approached in direction 0 (+) or 1 (-).
Motors = Callable[[FloatArray, int], FloatArray]


@dataclass(frozen=True)
class ErrorSize:
    """Errors of the functional point over the volume, mm."""

    largest: float
    rms: float  # root of the mean of |e|^2 over the volume, by the trapezoidal rule
    components: tuple[float, float, float]  # largest absolute X, Y, Z


@dataclass(frozen=True)
class LeftInVolume:
    """Errors in the volume without an export and with it."""

    without: ErrorSize
    with_it: ErrorSize

    def sentences(self) -> list[str]:
        """The figures in words; first a warning where the largest error grows."""
        before, after = self.without, self.with_it
        largest = f"{before.largest * 1e3:.4g}", f"{after.largest * 1e3:.4g}"
        worse = (
            "warning: this compensation makes the machine worse: the largest error in the volume is "
            f"{largest[0]} µm without it and {largest[1]} µm with it"
        )
        return [
            *([worse] if float(largest[1]) > float(largest[0]) else []),
            f"largest error in the volume without compensation {_largest(before)}, with it {_largest(after)}",
            f"rms error in the volume without compensation {before.rms * 1e3:.4g} µm, with it {after.rms * 1e3:.4g} µm",
        ]


def left_in_volume(calibration: Calibration, tool: FloatArray, motors: Motors) -> LeftInVolume | None:
    """Errors in the volume without and with a compensation; None if a parameter is not determined.

    At the nodes of the tables, of more than MOST_POSITIONS of an axis at so many of them; where
    reversal errors are known, with all axes approached in + and in - direction."""
    if any(undetermined_of(calibration, [*FUNCTIONS, *SQUARENESSES])):
        return None
    machine = Machine(calibration.chain, calibration.to_error_map(), tool)
    grid, weights = volume_grid_of(machine.errors, calibration.volume)
    home = np.zeros((1, 3))
    # Relative to home: a compensation that moves home displaces the machine's zero and nothing else.
    shift = _left(machine, home, motors(home, 0), "+++")
    before, after = [], []
    for direction, sign in enumerate("+-" if machine.errors.negative_functions else "+"):
        before.append(machine.error(grid, 3 * sign))
        after.append(_left(machine, grid, motors(grid, direction), 3 * sign) - shift)
    return LeftInVolume(_size(before, weights), _size(after, weights))


def what_is_left(calibration: Calibration, left: LeftInVolume | None) -> list[str]:
    """Sentences of what an export leaves, or of why that is not known."""
    if left is not None:
        return left.sentences()
    missing = ", ".join(undetermined_of(calibration, [*FUNCTIONS, *SQUARENESSES]))
    return [f"the remaining error in the volume is not known, because not determined: {missing}"]


def volume_grid_of(errors: ErrorMap, volume: FloatArray, fewest: int = 2) -> tuple[FloatArray, FloatArray]:
    """Points of a grid in the volume, (n, 3), mm, and the weight of each in a mean over the volume.

    At the nodes of the tables, and at `fewest` equidistant positions of an axis. The weights are
    those of the trapezoidal rule."""
    axes = []
    for axis, edge in zip(AXES, volume, strict=True):
        positions = np.append(common_nodes(errors, axis), np.linspace(0.0, edge, fewest))
        axes.append(spread(inside(np.unique(positions), float(edge)), MOST_POSITIONS))
    x, y, z = (trapezoidal(positions) for positions in axes)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid, np.einsum("i,j,k->ijk", x, y, z).ravel()


def trapezoidal(positions: FloatArray) -> FloatArray:
    """The weights of positions from 0 in a mean over their range."""
    half = 0.5 * np.diff(positions) / (positions[-1] - positions[0])
    return np.asarray(np.append(half, 0.0) + np.append(0.0, half))


def _left(machine: Machine, commanded: FloatArray, motors: FloatArray, approach: str) -> FloatArray:
    return np.asarray(motors + machine.error(motors, approach) - commanded)


def _size(errors: Sequence[FloatArray], weights: FloatArray) -> ErrorSize:
    squares = [np.sum(error**2, axis=1) for error in errors]
    x, y, z = np.max(np.abs(np.concatenate(errors)), axis=0).tolist()
    return ErrorSize(
        float(np.sqrt(np.max(squares))), float(np.sqrt(np.mean([weights @ square for square in squares]))), (x, y, z)
    )


def _largest(size: ErrorSize) -> str:
    components = ", ".join(f"{axis} {value * 1e3:.4g}" for axis, value in zip(AXES, size.components, strict=True))
    return f"{size.largest * 1e3:.4g} µm ({components})"
