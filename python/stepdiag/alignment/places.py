"""Where the machine goes to show how head and mirror stand: near the head, far from it, and a little aside of both.

Along the line the readings show the mirror against the laser. Aside, the distance shows the mirror against the machine:
by a shift s across the beam it changes by s times the mirror's tilt. So both are known.
"""

from itertools import combinations
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit

FloatArray = npt.NDArray[np.float64]

SHARE: Final = 0.35  # of the mirror's edge, across the beam
LEAST: Final = 0.2  # share of a move across the beam, for one that is of use


def alignment_places(known: Known, visit: Visit) -> FloatArray:
    """Positions of the axes (6, 3), mm: near, aside twice, far, aside twice. Raises InvalidArgument for a line across
    which no axis moves."""
    plan, frame = known.plan, np.asarray(known.plan.frame(visit.line))
    near, far = np.asarray(visit.positions[0]), np.asarray(visit.positions[-1])
    if visit.direction == "backward":
        near, far = far, near
    volume = np.asarray(plan.volume)
    across = frame[:, :2].T  # (2, 3) by a move of 1 mm along each axis
    edge = np.asarray(mirror_of(known, visit)).min()
    pairs = [
        (abs(float(np.linalg.det(across[:, pair]))), pair)
        for pair in (list(both) for both in combinations(range(3), 2))
        if all(np.linalg.norm(across[:, axis]) > LEAST for axis in pair)
    ]
    if not pairs:
        raise InvalidArgument(f"line {visit.line}: expected axes that move across the beam")
    _, best = max(pairs, key=lambda found: round(found[0], 9))
    found = []
    for place in (near, far):
        found.append(place)
        for axis in best:
            step = min(SHARE * edge / float(np.linalg.norm(across[:, axis])), float(volume[axis]) / 2.0)
            inward = -1.0 if place[axis] > volume[axis] / 2.0 else 1.0
            found.append(place + inward * step * np.eye(3)[axis])
    return np.array(found)


def mirror_of(known: Known, visit: Visit) -> tuple[float, float]:
    """Width and height of the mirror, mm: as stated, else as the plan needs it."""
    stated = known.heads[visit.line].mirror
    width, height = known.plan.smallest_mirror() if stated is None else stated
    return float(width), float(height)
