"""Machine: how is it now, how was it? Its runs come in here, and become calibrations."""

from starlette.responses import HTMLResponse

from stepdiag.app.frame import (
    action,
    address,
    banner,
    curve,
    day,
    drop,
    file_address,
    largest_error,
    number,
    page,
    verdict,
)
from stepdiag.book.blocks import due_text
from stepdiag.book.book import Entry, MachineFolder
from stepdiag.book.facts import Value
from stepdiag.book.layout import FOLDERS
from stepdiag.book.overview import Overview, overview
from stepdiag.parameters import SQUARENESSES
from stepdiag.presentation.page.html import Markup, definitions, element, markup, section, table


def machine_screen(machine: MachineFolder) -> HTMLResponse:
    row = overview(machine)
    entries = machine.listed(removed=True)
    name = machine.name
    return page(
        name,
        _now(row),
        _about(row),
        element(
            "p",
            element("a", "Plan a measurement", href=address(name, "plan"), class_="button"),
            " ",
            element("a", "Measure", href=address(name, "measure"), class_="button"),
        ),
        _import(name),
        _calibrations(row, entries),
        _runs(name, entries),
        _others(entries),
        _bin(name, entries),
        command=("book", "show", name),
        path=[(address(name), name)],
    )


def _now(row: Overview) -> Markup:
    facts = row.last.facts.calibration if row.last else None
    if row.last is None or facts is None:
        words = f"No calibration that counts: {row.caution}." if row.caution else "No calibration yet."
        return element("p", words, " Import a run, then evaluate it.")
    said = markup(
        element("p", "Largest error ", largest_error(facts), " on ", day(row.last.date), "."),
        element("p", f"Do not rely on this: {row.caution}.") if row.caution else None,
    )
    if row.about.limit_um is None:
        words = element("p", "No limit is stated for this machine.")
        return element("section", said, words, class_="banner", aria_label="Verdict")
    limit = markup(number(row.about.limit_um, 0 if row.about.limit_um.is_integer() else 1), " µm")
    if row.verdict is None:
        return banner("undecided", markup("Not known whether the machine is within ", limit), said)
    headline = {
        "within": markup("The machine is within ", limit),
        "not within": markup("The machine is not within ", limit),
        "undecided": markup("Undecided whether the machine is within ", limit),
    }[row.verdict]
    return banner("undecided" if row.caution else row.verdict, headline, said)


def _about(row: Overview) -> Markup | None:
    about = row.about
    pairs: list[tuple[object, object]] = [
        (label, text)
        for label, text in (
            ("Machine type", about.title),
            ("Serial number", about.serial_number),
            ("Customer", about.customer),
            ("Place", about.place),
            ("Notes", about.notes),
        )
        if text
    ]
    pairs += [("Due", due_text(row.due))] if due_text(row.due) else []
    return definitions(pairs, "facts") if pairs else None


def _import(name: str) -> Markup:
    words = "Drop runs, scenarios, calibrations or documents here, or choose them:"
    return section("import", "Import files", drop("files", words, name))


def _calibrations(row: Overview, entries: list[Entry]) -> Markup | None:
    kept = [one for one in entries if one.folder == "calibrations" and not one.removed and one.kind == "calibration"]
    cells: list[tuple[object, ...]] = []
    errors: list[tuple[float, tuple[float, float] | None]] = []
    for one in reversed(kept):
        facts = one.facts.calibration
        if facts is None:
            continue
        if facts.largest is not None:
            errors.insert(0, (facts.largest.value, facts.largest.interval))
        cells.append(
            (
                element("a", one.name, href=address(one.machine, "calibration", one.name)),
                day(one.date),
                verdict(facts.fit),
                largest_error(facts),
                verdict(facts.verdict(row.about.limit_um)) if row.about.limit_um else "",
                *(_value(facts.squareness.get(name)) for name in SQUARENESSES),
                action("Remove", address(one.machine, "remove"), file=one.file),
            )
        )
    if not cells:
        return None
    heading = ("File", "Day", "Fit", "Largest error", "Machine", *(f"{n}, µrad" for n in SQUARENESSES), "")
    small = curve(errors[-20:], row.about.limit_um)
    link = element("p", element("a", "Trend", href=address(row.name, "trend"), class_="button"))
    return section("calibrations", "Calibrations", small, link, table("The latest first", heading, cells))


def _runs(name: str, entries: list[Entry]) -> Markup | None:
    kept = [one for one in entries if one.folder == "runs" and not one.removed]
    cells = [
        (
            element("a", one.name, href=file_address(one), download=True),
            day(one.date),
            verdict("damaged") if one.facts.damaged else one.facts.summary,
            action("Evaluate", address(name, "evaluate"), main=True, run=one.file)
            if one.kind == "measurement"
            else one.facts.damaged,
            action("Remove", address(name, "remove"), file=one.file),
        )
        for one in reversed(kept)
    ]
    return (
        section("runs", "Runs", table("The latest first", ("File", "Day", "Content", "", ""), cells)) if cells else None
    )


def _others(entries: list[Entry]) -> Markup | None:
    shown = [folder for folder in FOLDERS if folder not in ("calibrations", "runs")]
    kept = [one for folder in shown for one in entries if one.folder == folder and not one.removed]
    kept += [one for one in entries if one.folder == "calibrations" and not one.removed and one.kind != "calibration"]
    cells = [
        (
            element("a", one.file, href=file_address(one), download=True),
            day(one.date),
            markup(verdict("damaged"), " ", one.facts.damaged)
            if one.facts.damaged
            else one.facts.summary or one.kind or "",
            action("Remove", address(one.machine, "remove"), file=one.file),
        )
        for one in kept
    ]
    return (
        section(
            "others",
            "Other files",
            table("Scenarios, plans, reports, exports, documents", ("File", "Day", "Content", ""), cells),
        )
        if cells
        else None
    )


def _bin(name: str, entries: list[Entry]) -> Markup | None:
    cells = [
        (one.name, one.folder, day(one.date), action("Restore", address(name, "restore"), file=one.file))
        for one in entries
        if one.removed
    ]
    if not cells:
        return None
    removed = table("Removed files", ("File", "Folder", "Day", ""), cells)
    return element("details", element("summary", f"Bin ({len(cells)})"), removed)


def _value(value: Value | None) -> Markup:
    """With its expanded uncertainty, k = 2."""
    if value is None:
        return markup("–")
    return markup(number(value[0]), None if value[1] is None else element("small", " ± ", number(2.0 * value[1])))
