"""The error of the tool in the volume: its figures, and what the page draws in three dimensions."""

import math
import re
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from stepdiag._core import Calibration, Machine
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.calibration.volume import VolumeErrors, volume
from stepdiag.parameters import AXES
from stepdiag.presentation.page.contents import Contents
from stepdiag.presentation.page.figure import rounded, value_table, values
from stepdiag.presentation.page.html import Markup, element, html_of, section, table
from stepdiag.presentation.page.numbers import position, shown
from stepdiag.presentation.volume import figure_table, frame_notes, length_text, place_of_largest, why_not_known

NODES: Final = 13  # of the grid along each axis
MICRO: Final = 1e3  # µm of a mm
MOST_RANKED: Final = 5


class ErrorInVolume(NamedTuple):
    """The error of the functional point: its figures over the volume, and on a grid that is drawn: nodes along X, Y, Z
    (mm) and errors (nx, ny, nz, 3), mm, for which what is not determined counts as 0."""

    figures: VolumeErrors
    nodes: tuple[FloatArray, FloatArray, FloatArray]
    error: FloatArray


def error_in_volume(calibration: Calibration, limit: float | None) -> ErrorInVolume:
    """The figures, as `stepdiag volume` has them, and what is drawn.

    Raises InvalidArgument for a limit that is not positive."""
    return ErrorInVolume(volume(calibration, limit=limit), *error_grid(calibration))


def error_grid(calibration: Calibration) -> tuple[tuple[FloatArray, FloatArray, FloatArray], FloatArray]:
    """NODES positions of each axis (mm) and the errors there, (nx, ny, nz, 3), mm."""
    x, y, z = (np.linspace(0.0, float(edge), NODES) for edge in calibration.volume)
    points = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    machine = Machine(calibration.chain, calibration.to_error_map(), calibration.tool)
    return (x, y, z), machine.error(points).reshape(NODES, NODES, NODES, 3)


def drawing_of(contents: Contents, found: ErrorInVolume, before: ErrorInVolume | None) -> dict[str, Any]:
    """What report.js draws: nodes (mm), errors (µm) in the order x, y, z, measured lines, the worst point."""
    edges, figures = contents.calibration.volume, found.figures
    worst = {"at_mm": figures.largest_at.tolist(), "error_um": (MICRO * figures.largest_components).tolist()}
    content = {
        "nodes_mm": [nodes.tolist() for nodes in found.nodes],
        "error_um": (MICRO * found.error).reshape(-1, 3).tolist(),
        "before_um": None if before is None else (MICRO * before.error).reshape(-1, 3).tolist(),
        "lines": [{"name": line, "from": start, "to": end} for line, start, end in _ends(contents.lines, edges)],
        "worst": None if math.isnan(figures.largest) else worst,
    }
    return {key: value if key == "nodes_mm" else rounded(value) for key, value in content.items()}


def exaggeration(edges: FloatArray, found: ErrorInVolume, before: ErrorInVolume | None) -> float:
    """1, 2 or 5 times a power of ten: the largest error is drawn as about a tenth of the shortest edge."""
    largest = max(float(np.max(np.linalg.norm(one.error, axis=-1))) for one in (found, before) if one is not None)
    if largest <= 0.0:
        return 1.0
    wanted = 0.12 * float(np.min(edges)) / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted) * power)


def _ends(lines: Sequence[str], edges: FloatArray) -> list[tuple[str, list[float], list[float]]]:
    """From where to where each line goes, by its name (docs/conventions.md)."""
    ends = []
    for line in filter(re.compile("[pn0]{3}").fullmatch, lines):
        start = [float(edge) if sign == "n" else 0.0 for sign, edge in zip(line, edges, strict=True)]
        end = [float(edge) if sign == "p" else 0.0 for sign, edge in zip(line, edges, strict=True)]
        ends.append((line, start, end))
    return ends


def volume_section(contents: Contents, found: ErrorInVolume, before: ErrorInVolume | None) -> Markup:
    """The figures, the drawing with its controls, and the errors at corners and middles as a table."""
    scale = exaggeration(contents.calibration.volume, found, before)
    figures = found.figures
    if math.isnan(figures.largest):
        said = f"The largest error is {why_not_known(figures)}. In the picture that counts as 0."
    else:
        parts = zip(AXES, figures.largest_components, strict=True)
        components = ", ".join(f"{axis} {shown(MICRO * float(e), signed=True)} µm" for axis, e in parts)
        said = (
            f"Largest at {place_of_largest(figures)}: {length_text(figures.largest, figures.largest_interval)}, with "
            f"components {components}. Root mean square over the volume: "
            f"{length_text(figures.rms, figures.rms_interval)}."
        )
    drawing = element(
        "div",
        class_="plot volume",
        id="figure-volume",
        role="img",
        aria_label=f"Error of the tool in the volume, in three dimensions. {said}",
        aria_describedby="values-volume",
    )
    return section(
        "volume",
        "Error of the tool in the volume",
        element("p", said),
        _controls(scale, found, has_before=before is not None, has_lines=bool(contents.lines)),
        element(
            "figure",
            drawing,
            element("figcaption", element("span", "The picture is being drawn.", id="volume-caption")),
            class_="wide",
        ),
        html_of(frame_notes(figures)),
        _ranking(figures),
        values("values-volume", "Values in the volume", html_of([figure_table(figures)]), _table(found, before)),
    )


def _ranking(figures: VolumeErrors) -> Markup | None:
    """The parameters that matter most."""
    chosen = [one for one in figures.ranking if len(one.parameters) == 1][:MOST_RANKED]
    if not chosen:
        return None
    rows = [[one.name, f"{shown(MICRO * one.largest)} µm", f"{shown(MICRO * one.rms)} µm"] for one in chosen]
    heading = ["Without", "largest error", "root mean square"]
    return table("What makes it: the error of the tool if one parameter were 0", heading, rows)


def _controls(scale: float, found: ErrorInVolume, *, has_before: bool, has_lines: bool) -> Markup:
    """First a level slice through the worst point: nothing in it hides anything else."""
    views = [("slice", "Slice"), ("grid", "Deformed grid"), ("arrows", "Arrows")]
    worst = (
        NODES // 2
        if math.isnan(found.figures.largest)
        else int(np.argmin(np.abs(found.nodes[2] - found.figures.largest_at[2])))
    )
    choices = [
        element(
            "label",
            element("input", type="radio", name="volume-view", value=value, checked=value == "slice"),
            f" {words}",
        )
        for value, words in views
    ]
    parts = [
        element("fieldset", element("legend", "View"), *choices),
        element(
            "div",
            element("label", "Exaggeration ", for_="exaggeration"),
            element(
                "input",
                type="range",
                id="exaggeration",
                min=0,
                max=f"{4 * scale:g}",
                step=f"{scale / 50:g}",
                value=f"{scale:g}",
            ),
            element("output", f"× {scale:,.0f}", for_="exaggeration", id="exaggeration-value"),
            class_="control",
        ),
        element(
            "div",
            element("label", "Slice across ", for_="slice-axis"),
            element(
                "select",
                *(element("option", axis, value=k, selected=axis == "Z") for k, axis in enumerate("XYZ")),
                id="slice-axis",
            ),
            element("label", " at ", for_="slice-place"),
            element("input", type="range", id="slice-place", min=0, max=NODES - 1, step=1, value=worst),
            element("output", "", for_="slice-place", id="slice-value"),
            class_="control",
        ),
    ]
    if has_before:
        parts.append(
            element(
                "fieldset",
                element("legend", "Calibration"),
                element(
                    "label", element("input", type="radio", name="volume-of", value="error_um", checked=True), " after"
                ),
                element("label", element("input", type="radio", name="volume-of", value="before_um"), " before"),
            )
        )
    if has_lines:
        parts.append(element("label", element("input", type="checkbox", id="show-lines"), " measured lines"))
    return element(
        "form",
        *parts,
        class_="controls screen-only",
        id="volume-controls",
        aria_label="Controls of the picture of the volume",
    )


def _table(found: ErrorInVolume, before: ErrorInVolume | None) -> Markup:
    """Corners and middles of the volume."""
    last = NODES - 1
    heading = ["X, Y, Z (mm)", "e_X (µm)", "e_Y (µm)", "e_Z (µm)", "|e| (µm)"]
    if before is not None:
        heading.append("|e| before (µm)")
    rows = []
    for i in (0, last // 2, last):
        for j in (0, last // 2, last):
            for k in (0, last // 2, last):
                x, y, z = (float(nodes[n]) for nodes, n in zip(found.nodes, (i, j, k), strict=True))
                row = [f"{position(x)}, {position(y)}, {position(z)}"]
                row += [shown(MICRO * float(e), signed=True) for e in found.error[i, j, k]]
                row.append(shown(MICRO * float(np.linalg.norm(found.error[i, j, k]))))
                if before is not None:
                    row.append(shown(MICRO * float(np.linalg.norm(before.error[i, j, k]))))
                rows.append(row)
    return value_table("Error of the tool at corners and middles of the volume", heading, rows)
