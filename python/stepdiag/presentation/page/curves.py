"""The 18 error functions as small multiples, family by family, and the three squarenesses drawn."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from stepdiag._core import Calibration
from stepdiag.findings.temperature import temperature_mark
from stepdiag.parameters import COMPONENT_MEANING, REPORT_UNIT, SQUARENESSES, Kind, in_report_units, kind_of
from stepdiag.presentation.page.figure import Figures, value_table, values
from stepdiag.presentation.page.html import Markup, element, markup, section
from stepdiag.presentation.page.look import BAND, BEFORE, GRID, INK, LINE, NEGATIVE, QUIET
from stepdiag.presentation.page.numbers import COVERAGE_FACTOR, position, shown, with_interval

FAMILIES: Final[tuple[tuple[Kind, str, tuple[str, ...]], ...]] = (
    ("positioning", "Positioning", ("EXX", "EYY", "EZZ")),
    ("straightness", "Straightness", ("EYX", "EXY", "EXZ", "EZX", "EZY", "EYZ")),
    ("angle", "Angular errors", ("EAX", "EAY", "EAZ", "EBX", "EBY", "EBZ", "ECX", "ECY", "ECZ")),
)
# Which axes form the angle, in whose plane it is drawn, and the sign of the second axis' lean to the first one.
_CORNER: Final = {"C0Y": ("X", "Y", -1.0), "B0Z": ("X", "Z", 1.0), "A0Z": ("Y", "Z", -1.0)}


def what_it_is(name: str) -> str:
    """The meaning of an error function: "displacement along Y of axis X"."""
    return f"{COMPONENT_MEANING[name[1]]} of axis {name[2]}"


def curves_section(calibration: Calibration, before: Calibration | None, figures: Figures) -> Markup:
    """All curves with their 95 % bands, and the values of each family as tables."""
    parts = [_legend(calibration, before)]
    for kind, title, names in FAMILIES:
        parts.append(_family(kind, title, names, calibration, before, figures))
    return section("curves", "Error functions", *parts)


def _legend(calibration: Calibration, before: Calibration | None) -> Markup:
    entries = [("key-line", "value"), ("key-band", "95 % interval")]
    if calibration.reversal:
        entries.append(("key-negative", "approached in − direction"))
    if before is not None:
        entries.append(("key-before", "before"))
    keys = [
        element("li", element("span", class_=f"key {name}", aria_hidden="true"), f" {words}") for name, words in entries
    ]
    return markup(
        element(
            "p",
            "Actual less commanded, by the names of ISO 230-1. Rotations follow the right-hand rule. "
            f"All panels of a family have the same scale. {_temperatures(calibration, before)}",
        ),
        element("ul", *keys, class_="keys", aria_label="Legend of the curves"),
    )


def _temperatures(calibration: Calibration, before: Calibration | None) -> str:
    """To which temperature positioning errors belong, of both where there are two."""
    mark = temperature_mark(calibration)
    earlier = "" if before is None or temperature_mark(before) == mark else f"; before: {temperature_mark(before)}"
    return f"Positioning errors: {mark}{earlier}."


def _family(
    kind: Kind, title: str, names: Sequence[str], calibration: Calibration, before: Calibration | None, figures: Figures
) -> Markup:
    unit = REPORT_UNIT[kind]
    known = [name for name in names if name in calibration.functions]
    reach = [*_reach(kind, known, calibration), *_reach(kind, known, before)]
    low, high = (min(reach, default=-1.0), max(reach, default=1.0))
    margin = 0.06 * (high - low or 1.0)
    panels, tables = [], []
    table_id = f"values-{kind}"
    for name in names:
        if name not in known:
            panels.append(element("div", element("p", element("strong", name), " is not determined.")))
            continue
        figures.add(
            f"figure-{name}",
            list(_traces(name, calibration, before)),
            {"title": {"text": f"{name[2]} (mm)", "standoff": 6}, **_travel(name, calibration)},
            {"title": {"text": f"{name} ({unit})", "standoff": 6}, "range": [low - margin, high + margin]},
        )
        panels.append(_panel(name, calibration, table_id, figures))
    for axis in "XYZ":
        own = [name for name in known if name[2] == axis]
        if own:
            tables.append(_table(title, axis, own, calibration, unit))
    return element(
        "section",
        element("h3", title),
        element("div", *panels, class_="panels"),
        values(table_id, f"Values of {title.lower()}", *tables) if tables else None,
        aria_label=title,
    )


def _travel(name: str, calibration: Calibration) -> dict[str, Any]:
    """Range and ticks of a position: from home to the end of travel, or as far as the table goes."""
    edge, nodes = float(calibration.volume["XYZ".index(name[2])]), calibration.functions[name][0]
    round_steps = [m * 10.0**n for m in (1.0, 2.0, 2.5, 5.0) for n in range(-3, 6)]
    counts = [count for count in (4, 5, 3, 6, 2) if edge / count in round_steps]
    ticks = {"tickvals": [k * edge / counts[0] for k in range(counts[0] + 1)]} if counts else {}
    return ticks | {"range": [min(0.0, float(nodes[0])), max(edge, float(nodes[-1]))]}


def _reach(kind: Kind, names: Sequence[str], calibration: Calibration | None) -> Iterator[float]:
    """The ends of all bands, in report units."""
    if calibration is None:
        return
    for name in names:
        for functions in (calibration.functions, calibration.negative_functions):
            if name in functions:
                _, value, u = functions[name]
                half = COVERAGE_FACTOR * np.nan_to_num(u)
                yield in_report_units(kind, float(np.min(value - half)))
                yield in_report_units(kind, float(np.max(value + half)))


def _traces(name: str, calibration: Calibration, before: Calibration | None) -> Iterator[dict[str, Any]]:
    kind = kind_of(name)
    factor, unit = in_report_units(kind, 1.0), REPORT_UNIT[kind]
    position_, value, u = calibration.functions[name]
    where, curve, half = position_.tolist(), factor * value, factor * COVERAGE_FACTOR * u
    if np.isfinite(half).all():
        band = {"type": "scatter", "mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
        yield band | {"x": where, "y": (curve - half).tolist(), "name": "low"}
        yield band | {"x": where, "y": (curve + half).tolist(), "name": "high", "fill": "tonexty", "fillcolor": BAND}
    if before is not None and name in before.functions:
        yield _line(before.functions[name][0], factor * before.functions[name][1], BEFORE, "dash", "before", unit)
    if name in calibration.negative_functions:
        there, negative, _ = calibration.negative_functions[name]
        yield _line(there, factor * negative, NEGATIVE, "dot", "− direction", unit)
    main = _line(position_, curve, LINE, "solid", name, unit)
    if np.isfinite(half).all():
        main["customdata"] = half.tolist()
        main["hovertemplate"] = f"%{{y:.2f}} ± %{{customdata:.2f}} {unit}<extra>{name}</extra>"
    yield main


def _line(x: Any, y: Any, colour: str, dash: str, name: str, unit: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "x": x.tolist(),
        "y": y.tolist(),
        "name": name,
        "line": {"color": colour, "width": 1.8, "dash": dash},
        "hovertemplate": f"%{{y:.2f}} {unit}<extra>{name}</extra>",
    }


def _panel(name: str, calibration: Calibration, described_by: str, figures: Figures) -> Markup:
    kind = kind_of(name)
    unit = REPORT_UNIT[kind]
    where, value, u = calibration.functions[name]
    worst = int(np.argmax(np.abs(value)))
    shape = ", shape only" if name in calibration.undetermined_slopes else ""
    largest = with_interval(in_report_units(kind, value[worst]), in_report_units(kind, u[worst]), unit)
    caption = markup(element("strong", name), f" {what_it_is(name)}{shape}")
    label = f"{name}, {what_it_is(name)}{shape}: largest {largest} at {position(where[worst])} mm"
    return figures.place(f"figure-{name}", label, caption, "panel", described_by)


def _table(title: str, axis: str, names: Sequence[str], calibration: Calibration, unit: str) -> Markup:
    """Values and half widths of the intervals, at the positions of all functions of an axis."""
    positions = sorted({float(p) for name in names for p in calibration.functions[name][0]})
    cells: dict[str, dict[float, tuple[float, float]]] = {}
    for name in names:
        where, value, u = calibration.functions[name]
        cells[name] = {float(p): (float(v), float(s)) for p, v, s in zip(where, value, u, strict=True)}
    heading = [f"{axis} (mm)", *(text for name in names for text in (f"{name} ({unit})", f"± ({unit}, 95 %)"))]
    rows = []
    for p in positions:
        row = [position(p)]
        for name in names:
            v, half = cells[name].get(p, (math.nan, math.nan))
            row += [_cell(name, v), _cell(name, COVERAGE_FACTOR * half)]
        rows.append(row)
    return value_table(f"{title} of axis {axis}", heading, rows)


def _cell(name: str, number: float) -> str:
    return "" if math.isnan(number) else f"{in_report_units(kind_of(name), number):.3f}".replace("-", "−")


def squareness_section(calibration: Calibration, before: Calibration | None) -> Markup:
    """The three right angles, drawn with what they lack."""
    known = [name for name in SQUARENESSES if name in calibration.squareness]
    reach = [abs(v) + COVERAGE_FACTOR * np.nan_to_num(u) for v, u in calibration.squareness.values()]
    if before is not None:
        reach += [abs(v) for v, _ in before.squareness.values()]
    exaggeration = _round(math.radians(14.0) / max(reach)) if reach and max(reach) > 0.0 else 1.0
    drawings = []
    for name in SQUARENESSES:
        if name in known:
            old = None if before is None or name not in before.squareness else before.squareness[name][0]
            drawings.append(_corner(name, calibration, exaggeration, old))
        else:
            drawings.append(element("div", element("p", element("strong", name), " is not determined.")))
    return section(
        "squareness",
        "Squareness",
        element(
            "p",
            f"Dashed: the right angle. Line: the axis as found, its lean drawn {exaggeration:,.0f} times as large; the "
            f"wedge is the 95 % interval.{' Dotted: before.' if before is not None else ''}",
        ),
        element("div", *drawings, class_="panels"),
    )


def _round(value: float) -> float:
    """1, 2 or 5 times a power of ten, at most the value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-12)) * power)


def _corner(name: str, calibration: Calibration, exaggeration: float, before: float | None) -> Markup:
    first, second, sign = _CORNER[name]
    angle, u = calibration.squareness[name]
    half = COVERAGE_FACTOR * u if math.isfinite(u) else 0.0
    length, x0, y0 = 120.0, 90.0, 150.0

    def tip(lean: float) -> str:
        turned = sign * lean * exaggeration
        return f"{x0 + length * math.sin(turned):.2f},{y0 - length * math.cos(turned):.2f}"

    travel = float(calibration.volume["XYZ".index(second)])
    figure, opening = in_report_units("squareness", angle), -sign * in_report_units("squareness", angle)
    said = with_interval(figure, in_report_units("squareness", u), "µrad")
    angle_text = (
        f"The angle from +{first} to +{second} is 90° {'+' if opening >= 0 else '−'} {shown(abs(opening))} µrad"
    )
    apart = f"{shown(abs(angle) * travel * 1e3)} µm over {position(travel)} mm of {second}"
    lines = [
        element("polygon", points=f"{x0},{y0} {tip(angle - half)} {tip(angle)} {tip(angle + half)}", fill=BAND),
        element("path", d=f"M{x0},{y0}H{x0 + length}", stroke=INK, stroke_width=2),
        element("path", d=f"M{x0},{y0}V{y0 - length}", stroke=QUIET, stroke_dasharray="4 4"),
        element("path", d=f"M{x0},{y0 - 14}h14v14", stroke=GRID, stroke_width=1.5, fill="none"),
        element("path", d=f"M{x0},{y0}L{tip(angle)}", stroke=LINE, stroke_width=2.5),
        element("text", f"+{first}", x=x0 + length + 6, y=y0 + 4, fill=INK),
        element("text", f"+{second}", x=x0 - 8, y=y0 - length - 10, fill=INK),
    ]
    if before is not None:
        lines.append(
            element("path", d=f"M{x0},{y0}L{tip(before)}", stroke=BEFORE, stroke_width=2, stroke_dasharray="2 4")
        )
    drawing = element(
        "svg",
        *lines,
        viewBox="0 0 250 170",
        role="img",
        aria_label=f"{name}, squareness of {second} to {first}: {said}. {angle_text}.",
        class_="corner",
    )
    caption = markup(
        element("strong", name),
        f" squareness of {second} to {first}: ",
        element("strong", said),
        element("br"),
        f"{angle_text}: {apart}.",
    )
    return element("figure", drawing, element("figcaption", caption), class_="panel")
