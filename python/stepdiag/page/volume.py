"""The error of the tool in the volume: its figures, and what the page draws in three dimensions."""

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, Machine
from stepdiag.page.contents import Contents
from stepdiag.page.figure import value_table, values
from stepdiag.page.html import Markup, element, section
from stepdiag.page.numbers import position, shown
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

FloatArray = npt.NDArray[np.float64]
NODES: Final = 13  # of the grid along each axis
MICRO: Final = 1e3  # µm of a mm


class GridErrors(NamedTuple):
    """Error of the functional point on a grid: nodes along X, Y, Z (mm), and the error (nx, ny, nz, 3), mm."""

    nodes: tuple[FloatArray, FloatArray, FloatArray]
    error: FloatArray

    @property
    def size(self) -> FloatArray:
        """(nx, ny, nz): the length of the error, mm."""
        size: FloatArray = np.linalg.norm(self.error, axis=-1)
        return size

    @property
    def largest(self) -> float:
        """The largest length of the error, mm."""
        return float(np.max(self.size))

    @property
    def worst(self) -> tuple[FloatArray, FloatArray]:
        """Where the error is largest, and the error there, mm."""
        i, j, k = np.unravel_index(int(np.argmax(self.size)), self.size.shape)
        x, y, z = self.nodes
        return np.array([x[i], y[j], z[k]]), self.error[i, j, k]

    @property
    def rms(self) -> float:
        """Root mean square of the length of the error over the grid, mm."""
        return float(np.sqrt(np.mean(self.size**2)))


def errors_in(calibration: Calibration, count: int = NODES) -> GridErrors:
    """The error on a grid of `count` nodes along each edge; what is not determined counts as 0."""
    x, y, z = (np.linspace(0.0, float(edge), count) for edge in calibration.volume)
    points = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    machine = Machine(calibration.chain, calibration.to_error_map(), calibration.tool)
    return GridErrors((x, y, z), machine.error(points).reshape(count, count, count, 3))


def drawing_of(contents: Contents, found: GridErrors, before: GridErrors | None) -> dict[str, Any]:
    """What report.js draws: nodes (mm), errors (µm) in the order x, y, z, measured lines, the worst point."""
    edges = contents.calibration.volume
    lines = [{"name": line, "from": start, "to": end} for line, start, end in _ends(contents.lines, edges)]
    at, error = found.worst
    return {
        "nodes_mm": [nodes.tolist() for nodes in found.nodes],
        "error_um": (MICRO * found.error).reshape(-1, 3).tolist(),
        "before_um": None if before is None else (MICRO * before.error).reshape(-1, 3).tolist(),
        "lines": lines,
        "worst": {"at_mm": at.tolist(), "error_um": (MICRO * error).tolist()},
        "exaggeration": exaggeration(edges, found, before),
    }


def exaggeration(edges: FloatArray, found: GridErrors, before: GridErrors | None) -> float:
    """1, 2 or 5 times a power of ten: the largest error is drawn as about a tenth of the shortest edge."""
    largest = max(one.largest for one in (found, before) if one is not None)
    if largest <= 0.0:
        return 1.0
    wanted = 0.12 * float(np.min(edges)) / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted) * power)


def _ends(lines: Sequence[str], edges: FloatArray) -> list[tuple[str, list[float], list[float]]]:
    """From where to where each line goes, by its name (docs/conventions.md)."""
    ends = []
    for line in lines:
        start = [float(edge) if sign == "n" else 0.0 for sign, edge in zip(line, edges, strict=True)]
        end = [float(edge) if sign == "p" else 0.0 for sign, edge in zip(line, edges, strict=True)]
        ends.append((line, start, end))
    return ends


def volume_section(contents: Contents, found: GridErrors, before: GridErrors | None) -> Markup:
    """The drawing with its controls, and the errors at the corners and the centre as a table."""
    scale = exaggeration(contents.calibration.volume, found, before)
    at, error = found.worst
    label = (
        f"Error of the tool in the volume, in three dimensions: largest {shown(MICRO * found.largest)} µm at "
        f"X {position(at[0])}, Y {position(at[1])}, Z {position(at[2])} mm"
    )
    missing = [] if _all_known(contents.calibration) else ["What is not determined counts as 0 here."]
    return section(
        "volume",
        "Error of the tool in the volume",
        element(
            "p",
            f"Largest at X {position(at[0])}, Y {position(at[1])}, Z {position(at[2])} mm: "
            f"{shown(MICRO * found.largest)} µm, with components "
            + ", ".join(
                f"{axis} {shown(MICRO * float(e), signed=True)} µm" for axis, e in zip("XYZ", error, strict=True)
            )
            + f". Root mean square: {shown(MICRO * found.rms)} µm, on a grid of {NODES} positions along each axis.",
            *(f" {sentence}" for sentence in missing),
        ),
        _controls(scale, before is not None, bool(contents.lines)),
        element(
            "figure",
            element(
                "div",
                class_="plot volume",
                id="figure-volume",
                role="img",
                aria_label=label,
                aria_describedby="values-volume",
            ),
            element("figcaption", element("span", "The picture is being drawn.", id="volume-caption")),
            class_="wide",
        ),
        values("values-volume", "Values in the volume", _table(found, before)),
    )


def _all_known(calibration: Calibration) -> bool:
    count = len(calibration.functions) + len(calibration.squareness)
    return count == len(FUNCTIONS) + len(SQUARENESSES) and not calibration.undetermined_slopes


def _controls(scale: float, has_before: bool, has_lines: bool) -> Markup:
    views = [("arrows", "Arrows"), ("grid", "Deformed grid"), ("slice", "Slice")]
    choices = [
        element(
            "label",
            element("input", type="radio", name="volume-view", value=value, checked=value == "grid"),
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
                max=f"{2 * scale:g}",
                step=f"{scale / 50:g}",
                value=f"{scale:g}",
            ),
            element("output", f"× {scale:,.0f}", for_="exaggeration", id="exaggeration-value"),
            class_="control",
        ),
        element(
            "div",
            element("label", "Slice across ", for_="slice-axis"),
            element("select", *(element("option", axis, value=k) for k, axis in enumerate("XYZ")), id="slice-axis"),
            element("label", " at ", for_="slice-place"),
            element("input", type="range", id="slice-place", min=0, max=NODES - 1, step=1, value=NODES // 2),
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
        parts.append(
            element("label", element("input", type="checkbox", id="show-lines", checked=True), " measured lines")
        )
    return element(
        "form",
        *parts,
        class_="controls screen-only",
        id="volume-controls",
        aria_label="Controls of the picture of the volume",
    )


def _table(found: GridErrors, before: GridErrors | None) -> Markup:
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
                row.append(shown(MICRO * float(found.size[i, j, k])))
                if before is not None:
                    row.append(shown(MICRO * float(before.size[i, j, k])))
                rows.append(row)
    return value_table("Error of the tool at corners and middles of the volume", heading, rows)
