"""What all screens have: the frame of a page, and how numbers, days and verdicts look."""

import shlex
from collections.abc import Sequence
from datetime import date
from importlib.resources import files
from typing import Final
from urllib.parse import quote

from starlette.responses import HTMLResponse

from stepdiag._core import __version__
from stepdiag.book.book import Entry
from stepdiag.book.facts import CalibrationFacts
from stepdiag.presentation.page.html import Markup, element, markup
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
STATIC: Final = {"app.css": "text/css", "app.js": "text/javascript"}


def page(
    title: str,
    *content: object,
    command: Sequence[str] = (),
    path: Sequence[tuple[str, str]] = (),
    search: str = "",
    status: int = 200,
) -> HTMLResponse:
    """A whole page. command: what does the same on the command line. path: the screens above, address and name."""
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
            element("p", "On the command line: ", element("code", shlex.join(("stepdiag", *command))))
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
        element("script", type="module", src="/static/app.js"),
    )
    return HTMLResponse(
        f'<!DOCTYPE html>\n<html lang="en">\n<head>{head}</head>\n<body>\n{markup(*body)}\n</body>\n</html>\n', status
    )


def static_text(name: str) -> str:
    """A file of our own. The style sheet has the colours of all figures."""
    text = (files("stepdiag.app") / "static" / name).read_text(encoding="utf-8")
    if name != "app.css":
        return text
    colours = " ".join(f"--{key}: {COLOUR[key]};" for key in ("accepted", "doubtful", "rejected", "after", "limit"))
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


def verdict(word: str | None, about: str = "") -> Markup:
    """A verdict in a list: a sign, a colour and the word."""
    look, sign = _LOOKS.get(word or "", ("unsure", "–"))
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


def data_table(caption: str, heading: Sequence[object], rows: Sequence[Sequence[object]]) -> Markup:
    """A table that scrolls in itself where it is wider than the screen."""
    head = element("thead", element("tr", *(element("th", cell, scope="col") for cell in heading)))
    body = [
        element("tr", element("th", first, scope="row"), *(element("td", cell) for cell in others))
        for first, *others in rows
    ]
    whole = element("table", element("caption", caption), head, element("tbody", *body))
    return element("div", whole, class_="scroll", tabindex="0", role="region", aria_label=caption)


def action(label: str, target: str, *, main: bool = False, **fields: str) -> Markup:
    """A button that changes something."""
    hidden = [element("input", type="hidden", name=name, value=value) for name, value in fields.items()]
    button = element("button", label, class_="main" if main else None)
    return element("form", *hidden, button, method="post", action=target, class_="action")


def file_address(entry: Entry) -> str:
    return address(entry.machine, "file", *entry.file.split("/"))


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
