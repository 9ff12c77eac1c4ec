"""How the mirror stands against the beam, for a cross-hair: from one sample, to first order."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from stepdiag._core import Head
from stepdiag.acquisition.placement import sides
from stepdiag.instruments.instrument import Number, ReadColumn

FloatArray = npt.NDArray[np.float64]


def cross_of(
    head: Head, frame: FloatArray, columns: Sequence[ReadColumn], row: Sequence[Number | None], sign: int = 1
) -> tuple[float, float] | None:
    """How far the mirror's face looks to the right and up, seen from the head (of an upright beam towards X+ and Y+),
    µrad; the beam comes back with twice that. None where the row does not show it. frame: (3, 3) of the line."""
    native = {
        column.channel: float(column.native(value))
        for column, value in zip(columns, row, strict=True)
        if value is not None
    }
    face = _face(head, native, sign)
    if face is None:
        return None
    (right, *_), (up, *_) = sides(frame)
    x, y = np.array([right, up]) @ frame[:, :2] @ face * 1e6
    return float(x), float(y)


def _face(head: Head, native: dict[str, float], sign: int) -> FloatArray | None:
    """Along the local x and y, rad: (-beta, alpha)."""
    if "alpha" in native and "beta" in native:
        return np.array([-native["beta"], native["alpha"]])
    if "spot_x" in native and "spot_y" in native and "distance" in native:
        path = abs(native["distance"]) + head.psd_distance
        return np.array([native["spot_x"], native["spot_y"]]) / (2.0 * path)
    offsets = np.asarray(head.beam_offsets)
    beams = [f"d{k + 1}" for k in range(len(offsets))]
    if len(beams) < 3 or any(beam not in native for beam in beams):
        return None
    distances = sign * np.array([native[beam] for beam in beams])
    slope, *_ = np.linalg.lstsq(np.column_stack([offsets, np.ones(len(beams))]), distances, rcond=None)
    return np.asarray(slope[:2])
