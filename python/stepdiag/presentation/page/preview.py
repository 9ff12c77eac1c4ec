"""Flat drawings as SVG: seen at once, before Plotly has loaded, and without JavaScript."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from stepdiag.presentation.page.html import Markup, element, markup
from stepdiag.presentation.page.look import GRID, INK, LAYOUT

MOST_TICKS: Final = 5


def preview(drawing: Mapping[str, Any], width: int, height: int) -> Markup | None:
    """The drawing in the same place and colours as Plotly draws it; None for other kinds than curves and points."""
    data, layout = drawing["data"], drawing["layout"]
    if not all(trace["type"] == "scatter" for trace in data):
        return None
    margin = layout.get("margin", LAYOUT["margin"])
    left, right, top, bottom = margin["l"], width - margin["r"], margin["t"], height - margin["b"]
    x0, x1 = _range(layout["xaxis"], (x for trace in data for x in trace["x"]))
    y0, y1 = _range(layout["yaxis"], (y for trace in data for y in trace["y"]))

    def at_x(x: float) -> float:
        return float(left + (x - x0) / (x1 - x0) * (right - left))

    def at_y(y: float) -> float:
        return float(bottom - (y - y0) / (y1 - y0) * (bottom - top))

    def points(trace: Mapping[str, Any]) -> list[str]:
        pairs = [(trace["x"][k], trace["y"][k]) for k in evenly(len(trace["x"]), width)]
        return [f"{at_x(x):.1f} {at_y(y):.1f}" for x, y in pairs if y is not None]

    parts = [*_axis_x(layout["xaxis"], x0, x1, at_x, top, bottom), *_axis_y(layout["yaxis"], y0, y1, at_y, left, right)]
    before: list[str] = []
    for trace in data:
        here = points(trace)
        if "fill" in trace:
            parts.append(element("path", d=f"M{'L'.join([*before, *reversed(here)])}Z", fill=trace["fillcolor"]))
        if "marker" in trace:
            marks = "".join(f"M{point}h0" for point in here)
            size, colour = trace["marker"]["size"], trace["marker"]["color"]
            parts.append(element("path", d=marks, stroke=colour, stroke_width=size, stroke_linecap="round"))
        elif trace["line"]["width"]:
            dash = {"dash": "6 4", "dot": "2 3"}.get(trace["line"].get("dash", ""))
            pen = {"stroke": trace["line"]["color"], "stroke_width": trace["line"]["width"], "stroke_dasharray": dash}
            parts.append(element("path", d=f"M{'L'.join(here)}", fill="none", **pen))
        before = here
    middle = (top + bottom) / 2
    parts += [
        element("text", layout["xaxis"]["title"]["text"], x=(left + right) / 2, y=height - 6, text_anchor="middle"),
        element(
            "text",
            layout["yaxis"]["title"]["text"],
            x=12,
            y=middle,
            text_anchor="middle",
            transform=f"rotate(-90 12 {middle})",
        ),
    ]
    return element("svg", *parts, viewBox=f"0 0 {width} {height}", class_="preview", aria_hidden="true", fill=INK)


def evenly(count: int, most: int) -> list[int]:
    """At most `most` indices of `count`, evenly, with first and last."""
    if count <= most:
        return list(range(count))
    return sorted({k * (count - 1) // (most - 1) for k in range(most)})


def _range(axis: Mapping[str, Any], values: Iterable[float | None]) -> tuple[float, float]:
    if "range" in axis:
        low, high = axis["range"]
        return low, high
    known = [value for value in values if value is not None]
    low, high = min(known, default=0.0), max(known, default=1.0)
    margin = 0.06 * (high - low) or 1.0
    return low - margin, high + margin


def ticks(low: float, high: float) -> list[float]:
    """Round numbers in the range, at most MOST_TICKS or so."""
    rough = (high - low) / MOST_TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= rough)
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _axis_x(axis: Mapping[str, Any], low: float, high: float, at: Any, top: float, bottom: float) -> list[Markup]:
    values: Sequence[float] = axis.get("tickvals") or ticks(low, high)
    texts = axis.get("ticktext") or [_label(value) for value in values]
    lines = [element("path", d=f"M{at(low):.1f} {bottom}H{at(high):.1f}", stroke=axis["linecolor"])]
    for value, text in zip(values, texts, strict=True):
        if axis.get("showgrid", True):
            lines.append(element("path", d=f"M{at(value):.1f} {top}V{bottom}", stroke=GRID))
        lines.append(element("text", text, x=f"{at(value):.1f}", y=bottom + 16, text_anchor="middle"))
    return lines


def _axis_y(axis: Mapping[str, Any], low: float, high: float, at: Any, left: float, right: float) -> list[Markup]:
    lines = []
    for value in ticks(low, high):
        colour = axis["zerolinecolor"] if value == 0.0 else GRID
        lines.append(element("path", d=f"M{left} {at(value):.1f}H{right}", stroke=colour))
        lines.append(element("text", _label(value), x=left - 6, y=f"{at(value) + 4:.1f}", text_anchor="end"))
    return [markup(line) for line in lines]


def _label(value: float) -> str:
    return f"{value:.6g}".replace("-", "−")
