"""Trend: when will the machine leave its limit?"""

from starlette.responses import HTMLResponse

from stepdiag.app.frame import address, day, number, page, trend_figure
from stepdiag.book.blocks import due_text
from stepdiag.book.book import MachineFolder
from stepdiag.book.overview import overview
from stepdiag.book.trend import Trend, trends
from stepdiag.presentation.page.html import Markup, element, markup, section, sentence, table

_TITLES = {
    "largest error": "Largest error in the volume",
    "C0Y": "C0Y, squareness of Y to X",
    "B0Z": "B0Z, squareness of Z to X",
    "A0Z": "A0Z, squareness of Z to Y",
    "EXX": "EXX, slope of the positioning of X",
    "EYY": "EYY, slope of the positioning of Y",
    "EZZ": "EZZ, slope of the positioning of Z",
    "temperature": "Temperature of the scales",
}
_KEY = (
    "Bars: 95 % intervals. A large point: changed significantly since the calibration before. A hollow one: not "
    "compared, because method, chain or temperature differ. A line: a significant drift."
)


def trend_screen(machine: MachineFolder) -> HTMLResponse:
    row = overview(machine)
    found = trends(machine.listed("calibrations"))
    limit = machine.about.limit_um
    words = due_text(row.due)
    return page(
        f"Trend of {machine.name}",
        element("p", element("strong", sentence(f"due {words}" if row.due.day else words))) if words else None,
        element("p", _KEY, class_="quiet") if found else None,
        *(_of_quantity(one, limit if one.name == "largest error" else None) for one in found),
        element("p", "No calibration that can be used.") if not found else None,
        command=("book", "trend", machine.name),
        path=[(address(machine.name), machine.name), (address(machine.name, "trend"), "Trend")],
    )


def _of_quantity(trend: Trend, limit: float | None) -> Markup:
    rows = [
        (
            day(one.day.isoformat()),
            markup(number(one.value), None if one.u is None else element("small", " ± ", number(2.0 * one.u))),
            element("a", one.entry.name, href=address(one.entry.machine, "calibration", one.entry.name)),
            "changed significantly" if one in trend.changed else "",
            f"not compared: {one.unlike}" if one.unlike else "",
        )
        for one in reversed(trend.points)
    ]
    found = table(f"{trend.unit}, with expanded uncertainties (k = 2)", ("Day", "Value", "File", "Change", ""), rows)
    values = element("details", element("summary", "Values"), found)
    name = trend.name.replace(" ", "-")
    return section(
        name, _TITLES[trend.name], trend_figure(trend, limit), element("p", _drift(trend), class_="quiet"), values
    )


def _drift(trend: Trend) -> Markup:
    line = trend.drift
    if line is None:
        return markup("Not enough to say how it changes.")
    change = (number(line.per_year, 2), " ± ", number(2.0 * line.u_per_year, 2), f" {trend.unit} a year")
    return markup("Changes by ", *change, "." if line.is_significant else ", which is not significant.")
