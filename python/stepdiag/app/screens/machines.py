"""Machines: which one needs me?"""

from collections.abc import Sequence
from datetime import date
from typing import Final

from starlette.responses import HTMLResponse

from stepdiag.app.frame import address, curve, day, file_address, largest_error, page, verdict
from stepdiag.book.book import Book, Entry, MachineFolder
from stepdiag.book.overview import Overview, overview
from stepdiag.presentation.page.html import Markup, element, markup, table

_OF_CURVE: Final = 8  # calibrations


def machines_screen(book: Book) -> HTMLResponse:
    cards = [_card(machine, overview(machine)) for machine in book.machines()]
    what = element("ul", *cards, class_="cards") if cards else element("p", "No machine yet.")
    new = element("p", element("a", "New machine", href="/new", class_="button" if cards else "button main"))
    return page("Machines", what, new, command=("book", "list", "--book", str(book.folder)))


def search_screen(book: Book, words: str) -> HTMLResponse:
    found = list(book.find(words.split())) if words.split() else []
    rows = [
        (element("a", one.name, href=address(one.name)), "machine", one.about.serial_number or "", "")
        if isinstance(one, MachineFolder)
        else (_link(one), one.kind or "file", one.machine, day(one.date))
        for one in found[:200]
    ]
    listed = table(f"{len(found)} found", ("Name", "Kind", "Machine", "Day"), rows)
    return page(
        "Search",
        listed if rows else element("p", "Nothing in the book has these words."),
        command=("book", "find", *words.split()),
        search=words,
    )


def _link(entry: Entry) -> Markup:
    if entry.folder == "calibrations" and entry.kind == "calibration" and not entry.removed:
        return element("a", entry.name, href=address(entry.machine, "calibration", entry.name))
    return element("a", entry.file, href=file_address(entry), download=True)


def _card(machine: MachineFolder, row: Overview) -> Markup:
    facts = row.last.facts.calibration if row.last else None
    about = ", ".join(filter(None, (row.about.title, row.about.serial_number, row.about.customer)))
    said: list[object] = []
    if facts is None or row.last is None:
        said.append(element("p", "No calibration that counts." if row.caution else "Not calibrated yet."))
    else:
        x, y, z = facts.volume
        said += [
            element("p", _verdict(row)),
            element("p", "Largest error ", largest_error(facts), " on ", day(row.last.date)),
            element("p", f"{x:g} × {y:g} × {z:g} mm", class_="quiet"),
        ]
    if row.caution:
        said.append(element("p", f"Do not rely on this: {row.caution}."))
    if row.due.day is not None:
        overdue = row.due.day < date.today()
        words = "Overdue since " if overdue else "Due "
        said.append(element("p", words, day(row.due.day), class_="late" if overdue else None))
    return element(
        "li",
        element("h2", element("a", row.name, href=address(row.name))),
        element("p", about, class_="quiet") if about else None,
        *said,
        curve(_last_errors(machine), row.about.limit_um),
    )


def _verdict(row: Overview) -> Markup:
    """Of the machine beside its limit, or else of the last fit."""
    limit, facts = row.about.limit_um, row.last.facts.calibration if row.last else None
    if limit is None:
        return verdict(facts.fit if facts else None, "Fit ", row.caution)
    return markup(f"Limit {limit:g} µm: ", verdict(row.verdict, caution=row.caution))


def _last_errors(machine: MachineFolder) -> Sequence[tuple[float, tuple[float, float] | None]]:
    entries = [one for one in machine.listed("calibrations") if one.kind == "calibration"][-_OF_CURVE:]
    found = [one.facts.calibration.largest for one in entries if one.facts.calibration is not None]
    return [(one.value, one.interval) for one in found if one is not None]


def refusal_screen(title: str, why: str, status: int) -> HTMLResponse:
    """In place of a screen."""
    return page(title, element("p", why), status=status)
