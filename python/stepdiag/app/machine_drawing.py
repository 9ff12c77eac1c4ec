"""The drawing of a machine's volume with lines, head and mirror: used wherever a place or a direction is said.

Seen from the front, a little from above and from the left: X to the right, Y away from the viewer, Z up.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag.presentation.page.html import Markup, element
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit, visits_of

FloatArray = npt.NDArray[np.float64]

_WIDTH: Final = 720.0
_EDGE: Final = 60.0  # for heads that stand farther out, and names of axes
_RADIUS: Final = 11.0  # of the circle of a head
_AWAY: Final = np.array([0.42, -0.30])  # where a length along Y goes, right and down
_MOST_POINTS: Final = 20_000  # that a dry run carries to the page
_SMALLEST: Final = 0.05  # mirror and head as drawn, by the longest edge of the volume


@dataclass(frozen=True)
class PlannedLine:
    """A line of a plan: head and mirror stay as they are while it is measured. In mm, machine frame, without the tool:
    places as the axes are commanded."""

    set_up: int
    name: str
    is_scale_line: bool
    first: Visit
    passes: int
    head: FloatArray  # (3,) where the beam starts
    frame: FloatArray  # (3, 3) columns: width and height of the mirror, the beam's direction


def planned_lines(known: Known) -> list[PlannedLine]:
    """The lines of a scenario's plan in the order in which they are measured."""
    visits = list(visits_of(known))
    found: list[PlannedLine] = []
    for visit in visits:
        if visit.set_up > len(found):
            frame = known.plan.frame(visit.line)
            passes = sum(one.set_up == visit.set_up for one in visits)
            head = visit.positions[0] - known.heads[visit.line].standoff * frame[:, 2]
            found.append(PlannedLine(visit.set_up, visit.line, visit.is_scale_line, visit, passes, head, frame))
    return found


class MachineDrawing:
    """Draws what lies in a volume and around it."""

    def __init__(self, volume: FloatArray, *around: FloatArray) -> None:
        self.volume = volume
        self._matrix = np.array([[1.0, _AWAY[0], 0.0], [0.0, _AWAY[1], -1.0]])
        corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]) * volume
        flat = np.vstack([corners, *(np.atleast_2d(one) for one in around)]) @ self._matrix.T
        low, high = flat.min(axis=0), flat.max(axis=0)
        scale = (_WIDTH - 2.0 * _EDGE) / max(high[0] - low[0], 1.4 * (high[1] - low[1]))
        self._matrix = self._matrix * scale
        self._offset = _EDGE - low * scale
        self.height = 2.0 * _EDGE + (high[1] - low[1]) * scale
        self._offset[0] += (_WIDTH - 2.0 * _EDGE - (high[0] - low[0]) * scale) / 2.0
        self._corners = corners

    def at(self, point: FloatArray) -> FloatArray:
        """Where a point, or each of many, stands in the picture."""
        return np.asarray(point @ self._matrix.T + self._offset)

    def path(self, points: FloatArray, class_: str) -> Markup:
        return element("polyline", points=_points(self.at(points)), class_=class_)

    def cage(self) -> list[Markup]:
        """The edges of the volume, the hidden ones dashed, with the axes' names and travels."""
        parts = []
        for k, a in enumerate(self._corners):
            for b in self._corners[k + 1 :]:
                if np.count_nonzero(a != b) == 1:
                    hidden = any(np.array_equal(end, self.volume * [0.0, 1.0, 0.0]) for end in (a, b))
                    parts.append(self.path(np.array([a, b]), "cage hidden" if hidden else "cage"))
        along = [(self.volume * [0.5, 0.0, 0.0], "middle", 0.0, 20.0)]
        along.append((self.volume * [1.0, 0.5, 0.0], "start", 8.0, 14.0))
        along.append((self.volume * [0.0, 0.0, 0.5], "end", -8.0, 0.0))
        for axis, (place, anchor, right, down) in enumerate(along):
            x, y = self.at(place) + np.array([right, down])
            said = f"{'XYZ'[axis]} {self.volume[axis]:g} mm"
            parts.append(element("text", said, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor))
        return parts

    def heads(self, lines: Sequence[PlannedLine]) -> list[Markup]:
        """Where the heads of lines stand: circles with the numbers of the set-ups, those that would lie over each other
        farther out along their beams."""
        parts: list[Markup] = []
        taken: list[FloatArray] = []
        for one in lines:
            place, mirror = self.at(one.head), self.at(one.first.positions[0])
            length = float(np.linalg.norm(place - mirror))  # 0 of a line towards the viewer, and without a standoff
            out = (place - mirror) / length if length > 1e-6 else np.array([0.0, 1.0])
            while any(np.linalg.norm(place - other) < 2.0 * _RADIUS + 1.0 for other in taken):
                place = place + 2.0 * out
            taken.append(place)
            x, y = place
            parts.append(
                element(
                    "line", x1=f"{mirror[0]:.1f}", y1=f"{mirror[1]:.1f}", x2=f"{x:.1f}", y2=f"{y:.1f}", class_="beam"
                )
            )
            parts.append(element("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=_RADIUS, class_="head"))
            parts.append(
                element("text", f"{one.set_up}", x=f"{x:.1f}", y=f"{y + 4.5:.1f}", text_anchor="middle", class_="head")
            )
        return parts

    def figure(self, *parts: Markup, said: str, **attributes: object) -> Markup:
        box = f"0 0 {_WIDTH:g} {self.height:.0f}"
        return element("svg", *parts, viewBox=box, class_="machine", role="img", aria_label=said, **attributes)

    @property
    def projection(self) -> list[float]:
        """Six numbers, row by row, and the offset: right = m0 x + m1 y + m2 z + m6, down = m3 x + m4 y + m5 z + m7."""
        return [round(float(one), 6) for one in (*self._matrix.ravel(), *self._offset)]


def plan_figure(known: Known, lines: Sequence[PlannedLine]) -> Markup:
    """The lines of a plan in the volume with the places of the head; with a script its dry run.

    The mirror has the width and height that the plan needs, the beam not counted; at least a twentieth of the volume's
    longest edge, to be seen."""
    volume = np.asarray(known.plan.volume)
    drawing = MachineDrawing(volume, *(one.head for one in lines))
    parts = drawing.cage()
    for one in lines:
        points = one.first.positions
        parts.append(drawing.path(points[[0, -1]], "scale" if one.is_scale_line else "line"))
    parts += drawing.heads(lines)
    said = f"{len(lines)} lines in the volume; the table under the picture says where each of them begins and ends"
    return drawing.figure(*parts, said=said, data_dry_run=_dry_run(known, lines, drawing))


def _dry_run(known: Known, lines: Sequence[PlannedLine], drawing: MachineDrawing) -> str:
    """What app.js moves: JSON of the first pass of each line."""
    width, height = known.plan.smallest_mirror()
    least = _SMALLEST * float(max(known.plan.volume))
    count = sum(len(one.first.positions) for one in lines)
    every = math.ceil(count / _MOST_POINTS)
    said = [
        {
            "name": one.name,
            "setUp": one.set_up,
            "head": np.round(one.head, 3).tolist(),
            "frame": np.round(one.frame.T, 6).tolist(),
            "points": np.round(one.first.positions[::every], 3).tolist(),
        }
        for one in lines
    ]
    mirror = [max(float(width), least), max(float(height), least)]
    return json.dumps({"projection": drawing.projection, "mirror": mirror, "lines": said}, separators=(",", ":"))


def _points(flat: FloatArray) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in flat)
