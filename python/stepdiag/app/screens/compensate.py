"""Compensate: what gets better, what remains, how do I go back?

Before a table is made, the person gives the one that the controller has now, or says that it has none. It is kept in
the book, and each table names the one that it replaces.
"""

from typing import Final

from starlette.responses import HTMLResponse

from stepdiag.app.frame import address, banner, day, drop, file_address, page
from stepdiag.book.book import Entry, MachineFolder
from stepdiag.exporting.formats import FORMATS
from stepdiag.presentation.page.html import Markup, element, markup, section, table

FIELDS: Final = ("at", "step", "axis", "depends_on")  # of the form, as far as a format has them
NONE: Final = "none"  # the controller has no table


def compensate_screen(machine: MachineFolder, entry: Entry) -> HTMLResponse:
    facts = entry.facts.calibration
    assert facts is not None
    name = machine.name
    rejected = facts.fit == "rejected" or facts.unverified
    warning = (
        banner(
            "rejected",
            "Do not compensate with this calibration",
            element("p", "Its fit is rejected, or it is unverified."),
        )
        if rejected
        else None
    )
    return page(
        f"Compensate with {entry.name}",
        warning,
        _present(machine),
        None if rejected else _form(machine, entry),
        _made(machine),
        _read_back(name),
        command=("export", "--machine", name, entry.name, "--to", "FORMAT", "--replaces", "TABLE"),
        path=[
            (address(name), name),
            (address(name, "calibration", entry.name), entry.name),
            (address(name, "compensate", entry.name), "Compensate"),
        ],
    )


def _present(machine: MachineFolder) -> Markup:
    words = (
        "Copy the compensation table that the controller has now, and drop it here. The book keeps it, so that you can "
        "bring it back."
    )
    return section(
        "present",
        "1. Keep what the controller has",
        element("p", words),
        drop("present", "The controller's present table:", machine.name),
    )


def _form(machine: MachineFolder, entry: Entry) -> Markup:
    tables = [one for one in machine.listed() if one.folder in ("exports", "documents")]
    kept = [element("option", "choose …", value="")]
    kept += [element("option", "the controller has no table", value=NONE)]
    kept += [element("option", f"{one.file} ({one.date[:10]})", value=one.file) for one in reversed(tables)]
    axes = [element("option", axis, value=axis) for axis in "XYZ"]
    return section(
        "table",
        "2. Make the new table",
        element(
            "form",
            _field("replaces", "It replaces", element("select", *kept, id="replaces", name="replaces", required=True)),
            _field("to", "Controller", element("select", *_formats(), id="to", name="to")),
            _field(
                "at",
                "Lines through X Y Z, mm (tables of one axis)",
                element("input", id="at", name="at", placeholder="centre"),
            ),
            _field(
                "step",
                "Spacing of the grid, mm",
                element("input", id="step", name="step", type="number", min="0", step="any"),
            ),
            _field("axis", "Axis in error (one axis)", element("select", *axes, id="axis", name="axis")),
            _field("depends_on", "Along axis (one axis)", element("select", *axes, id="depends_on", name="depends_on")),
            element(
                "p",
                element("input", id="incomplete", name="incomplete", type="checkbox", value="yes"),
                element("label", " Write 0 for what is not determined", for_="incomplete"),
                class_="choice",
            ),
            element(
                "p",
                element("input", id="proof", name="proof", type="checkbox", value="yes"),
                element("label", " Also a program that shows the sign before anything is cut", for_="proof"),
                class_="choice",
            ),
            element("p", element("button", "Make the table", class_="main")),
            element("input", type="hidden", name="file", value=entry.file),
            method="post",
            action=address(machine.name, "exports"),
            class_="fields",
        ),
        element("p", "The next page says what remains in the volume.", class_="quiet"),
        element(
            "details",
            element("summary", "Which table for which controller, and how each was tested"),
            table(
                "What remains of yours is said when the table is made",
                ("Controller", "Format", "What it holds", "How it was tested"),
                [(one.controllers, key, one.what, one.tested) for key, one in FORMATS.items()],
            ),
        ),
    )


def _formats() -> list[Markup]:
    """Options, in a group for each kind of controller."""
    groups = dict.fromkeys(one.controllers for one in FORMATS.values())
    return [
        element(
            "optgroup",
            *(
                element("option", f"{key} – {one.what}", value=key)
                for key, one in FORMATS.items()
                if one.controllers == group
            ),
            label=group,
        )
        for group in groups
    ]


def _made(machine: MachineFolder) -> Markup | None:
    rows = []
    listed = {one.file: one for one in machine.listed(removed=True)}
    for one in reversed([one for one in listed.values() if one.folder == "exports" and not one.removed]):
        record = one.record
        before = [listed[given.file] for given in record.inputs if given.file in listed] if record else []
        replaced = [given for given in before if given.folder in ("exports", "documents")]
        made_from = [given.name for given in before if given.folder == "calibrations"]
        if not made_from:  # not made here
            continue
        back = [
            element("a", f"Bring back {given.name}", href=file_address(given), download=True, class_="button")
            for given in replaced
        ]
        rows.append(
            (
                element("a", one.name, href=file_address(one), download=True),
                day(one.date),
                ", ".join(made_from),
                markup(*back) if back else "no table before",
            )
        )
    if not rows:
        return None
    return section("made", "Tables", table("The latest first", ("Table", "Day", "From", "How to go back"), rows))


def _read_back(name: str) -> Markup:
    words = (
        "After loading, copy the table from the controller and drop it here. “Already in the book as …” names the "
        "table that it equals, byte for byte; otherwise it differs from all of them."
    )
    return section(
        "read-back-part",
        "3. Check what the controller took",
        element("p", words),
        drop("read-back", "The table read back:", name, shows=True),
    )


def _field(name: str, label: str, control: Markup) -> Markup:
    return element("p", element("label", label, for_=name), control)
