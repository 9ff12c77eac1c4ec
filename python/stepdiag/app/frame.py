"""What all screens have: the frame of a page, and how numbers, days and verdicts look."""

from collections.abc import Sequence
from datetime import date
from importlib.resources import files
from typing import Final
from urllib.parse import quote

from starlette.responses import HTMLResponse

from stepdiag._core import __version__
from stepdiag.book.book import Entry
from stepdiag.book.facts import CalibrationFacts
from stepdiag.book.trend import Trend
from stepdiag.platform import command_line
from stepdiag.presentation.page.html import Markup, element, markup
from stepdiag.presentation.page.preview import ticks
from stepdiag.style import COLOUR

# Of a verdict of a fit or of a machine: the class of its look, and the sign beside the words.
_LOOKS: Final = {
    "accepted": ("good", "✓"),
    "within": ("good", "✓"),
    "doubtful": ("unsure", "?"),
    "unchecked": ("unsure", "?"),
    "undecided": ("unsure", "?"),
    "rejected": ("bad", "✕"),
    "not within": ("bad", "✕"),
    "damaged": ("bad", "✕"),
}
STATIC: Final = {"app.css": "text/css", "app.js": "text/javascript", "live.js": "text/javascript"}


def page(
    title: str,
    *content: object,
    command: Sequence[str] = (),
    path: Sequence[tuple[str, str]] = (),
    search: str = "",
    status: int = 200,
    scripts: Sequence[str] = (),
) -> HTMLResponse:
    """A whole page. command: what does the same on the command line. path: the screens above, address and name.
    scripts: beside app.js."""
    above = [element("li", element("a", name, href=address)) for address, name in [("/", "Machines"), *path]]
    form = element(
        "form",
        element("label", "Search", for_="search", class_="unseen"),
        element("input", type="search", id="search", name="q", value=search, placeholder="Search"),
        action="/search",
        role="search",
    )
    body = [
        element("a", "Skip to the content", href="#main", class_="skip"),
        element("header", element("nav", element("ol", *above), aria_label="Path"), form),
        element("main", element("h1", title), *content, id="main"),
        element(
            "footer",
            element("p", "On the command line: ", element("code", command_line(("stepdiag", *command))))
            if command
            else None,
            element("p", f"stepdiag {__version__}"),
        ),
    ]
    head = markup(
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("title", f"{title} – stepdiag"),
        element("link", rel="stylesheet", href="/static/app.css"),
        element("link", rel="icon", href="data:,"),
        *(element("script", type="module", src=f"/static/{name}") for name in ("app.js", *scripts)),
    )
    return HTMLResponse(
        f'<!DOCTYPE html>\n<html lang="en">\n<head>{head}</head>\n<body>\n{markup(*body)}\n</body>\n</html>\n', status
    )


def static_text(name: str) -> str:
    """A file of our own. The style sheet has the colours of all figures."""
    text = (files("stepdiag.app") / "static" / name).read_text(encoding="utf-8")
    if name != "app.css":
        return text
    colours = " ".join(f"--{key}: {COLOUR[key]};" for key in ("after", "limit"))
    return f":root {{ {colours} }}\n{text}"


def address(machine: str, *parts: str) -> str:
    return "/" + "/".join(quote(part, safe="") for part in ("machines", machine, *parts))


def day(value: str | date) -> Markup:
    """A day, which the browser writes as its person does."""
    text = value.isoformat() if isinstance(value, date) else value
    return element("time", text[:10], datetime=text)


def number(value: float, digits: int = 1) -> Markup:
    """A number, which the browser writes with its person's decimal sign."""
    return element("data", f"{value:.{digits}f}", value=f"{value:.{digits}f}", class_="number")


def verdict(word: str | None, about: str = "", caution: str = "") -> Markup:
    """A verdict in a list: a sign, a colour and the word; with a caution it looks undecided."""
    look, sign = _LOOKS.get("undecided" if caution else word or "", ("unsure", "–"))
    return element(
        "span", element("span", sign, aria_hidden="true"), f" {about}{word or 'not known'}", class_=f"mark {look}"
    )


def banner(word: str, headline: object, *why: object) -> Markup:
    """A verdict at the head of a screen."""
    look, sign = _LOOKS.get(word, ("unsure", "–"))
    heading = element("h2", element("span", sign, class_="sign", aria_hidden="true"), " ", headline)
    return element("section", heading, *why, class_=f"banner {look}", aria_label="Verdict")


def largest_error(facts: CalibrationFacts) -> Markup:
    """The largest error in the volume, with its 95 % interval."""
    if facts.largest is None:
        return markup("not known")
    found = facts.largest
    interval = None
    if found.interval is not None:
        interval = element("small", " (", number(found.interval[0]), " … ", number(found.interval[1]), ")")
    return markup(number(found.value), " µm", interval)


def action(label: str, target: str, *, main: bool = False, **fields: str) -> Markup:
    """A button that changes something."""
    hidden = [element("input", type="hidden", name=name, value=value) for name, value in fields.items()]
    button = element("button", label, class_="main" if main else None)
    return element("form", *hidden, button, method="post", action=target, class_="action")


def drop(identifier: str, label: str, machine: str, *, shows: bool = False) -> Markup:
    """A place for files that go to the book. shows: what was said of a file is shown, also if all went well."""
    target = address(machine, "files")
    field = element("input", type="file", id=identifier, multiple=not shows, data_target=target, data_shows=shows)
    said = element("p", "", role="status", class_="quiet")
    return element("div", element("label", label, for_=identifier), field, said, class_="drop")


def file_address(entry: Entry) -> str:
    return address(entry.machine, "file", *entry.file.split("/"))


def trend_figure(trend: Trend, limit: float | None) -> Markup:
    """Values with their 95 % bars against time, the line through them where it is significant, and the limit."""
    width, height, left, right, top, bottom = 720.0, 220.0, 64.0, 704.0, 12.0, 190.0
    days = [(one.day - trend.points[0].day).days for one in trend.points]
    ends = [(one.value - 1.96 * (one.u or 0.0), one.value + 1.96 * (one.u or 0.0)) for one in trend.points]
    low = min([a for a, _ in ends] + ([0.0] if limit is not None else []))
    high = max([b for _, b in ends] + ([limit] if limit is not None else []))
    room = 0.06 * (high - low) or 1.0
    low, high = low - (room if limit is None else 0.0), high + room

    def x(value: float) -> str:
        return f"{left + 12.0 + (right - left - 24.0) * value / max(days[-1], 1):.1f}"

    def y(value: float) -> str:
        return f"{bottom - (bottom - top) * (value - low) / (high - low):.1f}"

    parts: list[Markup | None] = []
    for tick in ticks(low, high):
        parts.append(element("line", x1=left, x2=right, y1=y(tick), y2=y(tick), class_="grid"))
        parts.append(
            element(
                "text", f"{tick:.6g}".replace("-", "−"), x=left - 8, y=f"{float(y(tick)) + 4.0:.1f}", text_anchor="end"
            )
        )
    if limit is not None:
        parts.append(element("line", x1=left, x2=right, y1=y(limit), y2=y(limit), class_="limit"))
        parts.append(element("text", "limit", x=right, y=f"{float(y(limit)) - 5.0:.1f}", text_anchor="end"))
    if trend.drift is not None and trend.drift.is_significant:
        a, b = (y(trend.drift.at(trend.points[k].day)) for k in (0, -1))
        parts.append(element("line", x1=x(0), x2=x(days[-1]), y1=a, y2=b, class_="drift"))
    for at, one, (below, above) in zip(days, trend.points, ends, strict=True):
        look = "unlike" if one.unlike else "changed" if one in trend.changed else None
        parts.append(element("line", x1=x(at), x2=x(at), y1=y(below), y2=y(above), class_="bar"))
        parts.append(element("circle", cx=x(at), cy=y(one.value), r=6 if look == "changed" else 4, class_=look))
    for k in (0, -1) if days[-1] else (0,):
        anchor = "start" if k == 0 else "end"
        parts.append(element("text", trend.points[k].day.isoformat(), x=x(days[k]), y=bottom + 20, text_anchor=anchor))
    said = f"{trend.name} of {len(trend.points)} calibrations, {trend.unit}; the values stand in the table"
    return element("svg", *parts, viewBox=f"0 0 {width:g} {height:g}", class_="trend", role="img", aria_label=said)


def curve(values: Sequence[tuple[float, tuple[float, float] | None]], limit: float | None) -> Markup | None:
    """The largest errors of the last calibrations in small, with their intervals and the limit; the numbers stand in
    the table of the machine."""
    if len(values) < 2:
        return None
    highest = max([high[1] if high else value for value, high in values] + ([limit] if limit else []))
    width, height = 160.0, 44.0

    def y(value: float) -> str:
        return f"{height - 4.0 - (height - 8.0) * value / highest:.1f}"

    at = [4.0 + (width - 8.0) * k / (len(values) - 1) for k in range(len(values))]
    bars = [
        element("line", x1=f"{x:.1f}", x2=f"{x:.1f}", y1=y(ends[0]), y2=y(ends[1]), class_="bar")
        for x, (_, ends) in zip(at, values, strict=True)
        if ends
    ]
    line = element("polyline", points=" ".join(f"{x:.1f},{y(v)}" for x, (v, _) in zip(at, values, strict=True)))
    edge = element("line", x1="0", x2=f"{width:g}", y1=y(limit), y2=y(limit), class_="limit") if limit else None
    said = f"largest error of the last {len(values)} calibrations: " + ", ".join(f"{v:.1f}" for v, _ in values) + " µm"
    return element(
        "svg", *bars, edge, line, viewBox=f"0 0 {width:g} {height:g}", class_="curve", role="img", aria_label=said
    )
