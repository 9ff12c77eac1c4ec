"""Where head and mirror of a line go, in words and in the angles of a swivel.

The person stands before the machine: X+ is to the right, Y+ away, Z+ up.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit, visits_of

FloatArray = npt.NDArray[np.float64]

_CORNERS: Final = (("left", "right"), ("front", "back"), ("low", "high"))
_ALONG: Final = {"X+": (1.0, 0.0), "Y+": (0.0, 1.0), "X-": (-1.0, 0.0), "Y-": (0.0, -1.0)}
_LEAST: Final = 0.05  # degrees; a smaller angle is none
_UPRIGHT: Final = 0.999  # a direction whose Z is larger has no side to be turned to


@dataclass(frozen=True)
class Look:
    """A direction as a swivel has it: first `along` an axis in the horizontal plane, then turned to the left by `turn`
    and up by `up`, degrees."""

    along: str
    turn: float
    up: float

    @property
    def words(self) -> str:
        if abs(self.up) > math.degrees(math.asin(_UPRIGHT)):
            return f"straight {'up' if self.up > 0.0 else 'down'}"
        parts = [f"along {self.along}"]
        if abs(self.turn) > _LEAST:
            parts.append(f"turned {abs(self.turn):.1f}° to the {'left' if self.turn > 0.0 else 'right'}")
        if abs(self.up) > _LEAST:
            parts.append(f"{abs(self.up):.1f}° {'up' if self.up > 0.0 else 'down'}")
        return ", ".join(parts)


def look(direction: FloatArray) -> Look:
    """Of a unit vector, machine frame."""
    x, y, z = (float(part) for part in direction)
    along = max(_ALONG, key=lambda name: round(x * _ALONG[name][0] + y * _ALONG[name][1], 9))
    ax, ay = _ALONG[along]
    turn = math.degrees(math.atan2(ax * y - ay * x, ax * x + ay * y))
    return Look(along, turn, math.degrees(math.asin(max(-1.0, min(1.0, z)))))


@dataclass(frozen=True)
class Placement:
    """Of a line, in mm and in the machine frame: where the beam starts, where the mirror begins (the functional point),
    and the line's frame, whose third column is the beam."""

    visit: Visit
    set_ups: int  # of the plan
    volume: tuple[float, float, float]
    head: FloatArray
    mirror: FloatArray
    frame: FloatArray

    @property
    def beam(self) -> Look:
        return look(self.frame[:, 2])

    @property
    def face(self) -> Look:
        """Where the mirror's face looks: at the head."""
        return look(-self.frame[:, 2])

    @property
    def corner(self) -> str:
        return corner_words(self.visit.positions[0], np.asarray(self.volume))

    @property
    def words(self) -> str:
        visit = self.visit
        kind = "scale line" if visit.is_scale_line else "line"
        return (
            f"set-up {visit.set_up} of {self.set_ups}, {kind} {visit.line}: head at the {self.corner} corner, its beam "
            f"from {_place(self.head)} mm, looking {self.beam.words}; mirror in the spindle at {_place(self.mirror)} "
            f"mm, facing the head, {self.face.words}"
        )


def placement(known: Known, visit: Visit) -> Placement:
    """Of a visit's line."""
    first = np.asarray(known.plan.points(visit.line, visit.run)[0] + np.array(known.tool))
    frame = np.asarray(known.plan.frame(visit.line))
    origin = first - known.heads[visit.line].standoff * frame[:, 2]
    x, y, z = (float(edge) for edge in known.plan.volume)
    return Placement(visit, list(visits_of(known))[-1].set_up, (x, y, z), origin, first, frame)


def corner_words(point: FloatArray, volume: FloatArray) -> str:
    """The corner of the volume that is nearest, such as "front left low"."""
    return " ".join(_CORNERS[axis][int(point[axis] > volume[axis] / 2.0)] for axis in (1, 0, 2))


def sides(frame: FloatArray) -> tuple[tuple[FloatArray, str, str], tuple[FloatArray, str, str]]:
    """Two directions across the beam as a person at the head sees them, and what turning towards and away from them is
    called: right and up; of an upright beam those of the axes."""
    beam = frame[:, 2]
    if abs(beam[2]) > _UPRIGHT:
        return (np.array([1.0, 0.0, 0.0]), "towards X+", "towards X-"), (
            np.array([0.0, 1.0, 0.0]),
            "towards Y+",
            "towards Y-",
        )
    right = np.cross(beam, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return (right, "right", "left"), (np.cross(right, beam), "up", "down")


def _place(point: FloatArray) -> str:
    return " ".join(f"{axis}{float(x) + 0.0:.1f}" for axis, x in zip("XYZ", point, strict=True))
