"""The figure of a head: bodies, beams and detectors from two sides, alone and with the mirror."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from stepdiag import _core
from stepdiag.head.trace import arrivals, detectors
from stepdiag.style import own_style, plain, save, series

FloatArray = npt.NDArray[np.float64]
Box = tuple[FloatArray, FloatArray]  # corners with the lowest and highest coordinates

GLASS: Final = "#a9cbe3"
DARK: Final = "#333333"
WEAKEST: Final = 1e-6  # share of the power with the palest colour
MARGIN: Final = 0.12  # around the head, as a share of its size
LABEL: Final = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}


@dataclass(frozen=True)
class View:
    """A side view: the axis of the head that points upwards. z points to the right."""

    name: str
    axis: int

    def project(self, points: FloatArray) -> FloatArray:
        """(n, 3) to (n, 2)."""
        return np.column_stack([points[:, 2], points[:, self.axis]])


VIEWS: Final = (View("x", 0), View("y", 1))


def draw_head(head: _core.Head, distance: float, suffix: str) -> bytes:
    """Draw a head in front of an aligned mirror at a distance (mm).

    Returns the content of a "png", "svg" or "pdf" file."""
    design = head.design
    if design is None or head.mirror is None:
        raise ValueError("draw_head: expected a head with a design and a mirror")
    segments = _core.trace_beams(head, distance=distance)
    outlines = _outlines(design)
    low, high = _extent(outlines)
    width, height_x, height_y = (high - low)[[2, 0, 1]]
    scale = min(5.5 / width, 6.5 / (height_x + height_y))  # inches per mm
    with own_style():
        figure = Figure(figsize=(width * scale + 5.7, (height_x + height_y) * scale + 1.6), layout="constrained")
        panels = figure.subplots(
            2, 2, width_ratios=(width * scale, 4.2), height_ratios=(height_x, height_y), sharex="col"
        )
        for view, (large, whole) in zip(VIEWS, panels, strict=True):
            for axes in (large, whole):
                _draw_bodies(axes, view, design)
                _draw_beams(axes, view, design, segments, distance)
                _draw_detectors(axes, view, design, outlines)
                axes.axvline(0.0, color="#999999", linewidth=0.6, linestyle=":", zorder=0)
            large.set(xlim=(low[2], high[2]), ylim=(low[view.axis], high[view.axis]), aspect="equal")
            large.set_ylabel(f"{view.name} (mm)")
            _name_components(large, view, outlines)
            half = 0.5 * float(head.mirror[view.axis])
            whole.plot([distance, distance], [-half, half], color=DARK, linewidth=3.0, solid_capstyle="butt", zorder=6)
            whole.set(xlim=(low[2], distance + 0.05 * (distance - low[2])))
            whole.set(ylim=(min(low[view.axis], -1.1 * half), max(high[view.axis], 1.1 * half)))
            whole.set_aspect("equal", anchor="C")
        for axes, title in zip(
            panels[0], (f"{plain(design.name)}: the head", f"the mirror at {distance:g} mm"), strict=True
        ):
            axes.set_title(title)
        for axes in panels[1]:
            axes.set_xlabel("z (mm)")
        figure.legend(handles=_legend(design), loc="outside lower center", ncols=3, handlelength=2.2)
        return save(figure, suffix)


def _outlines(design: _core.HeadDesign) -> dict[str, list[FloatArray]]:
    """Faces of every component, head frame: bodies, squares at sources, areas of sensors."""
    faces = {body.name: list(body.outlines) for body in design.bodies}
    faces |= {beam.name: [_corners(beam.position, beam.rotation, beam.size, beam.size)] for beam in design.beams}
    return faces | {s.name: [_corners(s.position, s.rotation, *s.size)] for s in design.sensors}


def _corners(place: FloatArray, rotation: FloatArray, width: float, height: float) -> FloatArray:
    x, y = 0.5 * width, 0.5 * height
    return np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]]) @ rotation.T + place


def _extent(outlines: dict[str, list[FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest x, y, z, with a margin."""
    points = np.concatenate([face for faces in outlines.values() for face in faces])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = MARGIN * float(max(high - low))
    return low - margin, high + margin


def _draw_bodies(axes: Axes, view: View, design: _core.HeadDesign) -> None:
    for body in design.bodies:
        faces = [view.project(outline) for outline in body.outlines]
        is_glass = not {"reflecting", "absorbing"} & set(body.surfaces)
        style: dict[str, Any] = {"edgecolors": DARK, "linewidths": 0.7 if is_glass else 2.0}
        axes.add_collection(
            PolyCollection(faces, facecolors=GLASS if is_glass else DARK, alpha=0.3, zorder=1, linewidths=0.0)
        )
        axes.add_collection(PolyCollection(faces, facecolors="none", zorder=2, **style))


def _draw_beams(
    axes: Axes, view: View, design: _core.HeadDesign, segments: Sequence[_core.BeamSegment], distance: float
) -> None:
    """Draw paths to the detectors solid and other light dashed; weaker light is paler.

    Light that was not traced further is not drawn."""
    ways = [arrival.way for detector in detectors(design) for arrival in arrivals(segments, detector, distance)[:1]]
    main = {k for way in ways for k in way}
    for number, beam in enumerate(design.beams):
        for is_main in (True, False):
            mine = [
                segment
                for k, segment in enumerate(segments)
                if segment.beam == beam.name and segment.fate != "cut" and (k in main) is is_main
            ]
            lines = LineCollection(
                [view.project(np.array([segment.start, segment.end])) for segment in mine],
                colors=_colour(number),
                alpha=[1.0 - 0.75 * min(1.0, np.log(segment.power) / np.log(WEAKEST)) for segment in mine] or None,
                linewidths=1.4 + _excess(design, number) if is_main else 0.8,
                linestyles="solid" if is_main else (0, (4, 2)),
                zorder=4 if is_main else 3,
            )
            axes.add_collection(lines)


def _draw_detectors(axes: Axes, view: View, design: _core.HeadDesign, outlines: dict[str, list[FloatArray]]) -> None:
    for number, beam in enumerate(design.beams):
        for name in filter(None, (beam.name, beam.sensor)):
            edges = PolyCollection(
                [view.project(face) for face in outlines[name]],
                facecolors="none",
                edgecolors=_colour(number),
                linewidths=3.0 + 2.0 * _excess(design, number),
                zorder=5,
            )
            axes.add_collection(edges)


def _colour(beam: int) -> str:
    return series(beam + 1)[0]  # the first one is as dark as mirrors


def _excess(design: _core.HeadDesign, beam: int) -> float:
    """Extra line width of the first beams, so that they show below later ones."""
    return 1.2 * (len(design.beams) - 1 - beam) if len(design.beams) <= 6 else 0.0


def _name_components(axes: Axes, view: View, outlines: dict[str, list[FloatArray]]) -> None:
    """Write each name at a free upper or lower corner of its component, otherwise above it."""
    boxes = {}
    for name, faces in outlines.items():
        points = view.project(np.concatenate(faces))
        boxes[name] = points.min(axis=0), points.max(axis=0)
    height = float(np.ptp(axes.get_ylim()))
    line, gap = 0.05 * height, 0.012 * height
    taken: list[Box] = []
    for name, (low, high) in sorted(boxes.items(), key=lambda item: (item[1][0][0], -item[1][1][1])):
        size = np.array([0.6 * line * len(name), line])  # approximate size of the text
        above, below = np.array([low[0], high[1] + gap]), np.array([low[0], low[1] - gap - line])
        others = [box for other, box in boxes.items() if other != name] + taken
        stacked = [above + np.array([0.0, k * line]) for k in range(len(boxes))]
        places = [p for p in (above, below) if _is_free((p, p + size), others)]
        places += [p for p in stacked if _is_free((p, p + size), taken)]
        taken.append((places[0], places[0] + size))
        axes.text(float(places[0][0]), float(places[0][1]), plain(name), size=7.5, va="bottom", zorder=7, bbox=LABEL)


def _is_free(box: Box, others: Sequence[Box]) -> bool:
    return not any(bool(np.all(box[0] < high) and np.all(low < box[1])) for low, high in others)


def _legend(design: _core.HeadDesign) -> list[Any]:
    beams = [
        Line2D([], [], color=_colour(k), linewidth=1.6, label=f"{plain(beam.name)} ({beam.wavelength:g} nm)")
        for k, beam in enumerate(design.beams)
    ]
    return [
        *beams,
        Line2D([], [], color=DARK, linewidth=0.8, linestyle=(0, (4, 2)), label="light that comes elsewhere"),
        Patch(facecolor=GLASS, edgecolor=DARK, linewidth=0.7, alpha=0.6, label="glass"),
        Line2D([], [], color=DARK, linewidth=3.0, label="mirror, screen"),
    ]
