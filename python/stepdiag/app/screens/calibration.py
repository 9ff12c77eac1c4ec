"""Calibration: can I trust it? Is the machine within its limit?"""

from starlette.responses import HTMLResponse

from stepdiag.app.frame import (
    action,
    address,
    banner,
    day,
    file_address,
    largest_error,
    number,
    page,
    verdict,
)
from stepdiag.book.book import Entry, MachineFolder
from stepdiag.book.facts import CalibrationFacts
from stepdiag.presentation.page.html import Markup, definitions, element, markup, section

_HEADLINES = {
    "accepted": "The readings agree: this calibration can be used",
    "doubtful": "Doubtful: do not rely on the stated uncertainties",
    "rejected": "Rejected: do not use this calibration",
    "unchecked": "Not checked: the readings do not test this calibration",
}


def calibration_screen(machine: MachineFolder, entry: Entry) -> HTMLResponse:
    facts = entry.facts.calibration
    assert facts is not None
    name = machine.name
    others = [one for one in machine.listed("calibrations") if one.kind == "calibration" and one.file != entry.file]
    return page(
        entry.name,
        _fit(facts),
        _limit(facts, machine.about.limit_um),
        _facts(machine, entry, facts),
        _actions(name, entry, others),
        section(
            "figures",
            "Figures",
            element("p", "The report is made …", class_="quiet", role="status", data_waits_for="report"),
            element(
                "iframe",
                title=f"Report of {entry.name}",
                src=address(name, "figures", entry.name),
                id="report",
                sandbox="allow-scripts allow-modals",
                class_="report",
            ),
        ),
        command=("report", "--machine", name, entry.name),
        path=[(address(name), name), (address(name, "calibration", entry.name), entry.name)],
    )


def _fit(facts: CalibrationFacts) -> Markup:
    word = "rejected" if facts.unverified else facts.fit or "not judged"
    headline = _HEADLINES.get(word, "Not judged")
    why = element("p", "The file has no checksum, or was changed: it is unverified.") if facts.unverified else None
    reasons = element("ul", *(element("li", reason) for reason in facts.reasons)) if facts.reasons else None
    return banner(word, headline, why, reasons)


def _limit(facts: CalibrationFacts, limit: float | None) -> Markup:
    """The slider asks the question for any limit; the answer follows from the bounds by the script."""
    if facts.largest is None:
        return section(
            "limit",
            "Is the machine within its limit?",
            element("p", "The largest error is not known: ", "; ".join(facts.undetermined)),
        )
    if facts.largest.bounds is None or facts.fit == "rejected":
        why = "the fit is rejected" if facts.fit == "rejected" else "the calibration has no covariance"
        return section("limit", "Is the machine within its limit?", element("p", f"Not known: {why}."))
    above, below = facts.largest.bounds
    start = limit if limit is not None else below
    slider = element(
        "input",
        type="range",
        id="limit-um",
        min="0",
        max=f"{2.0 * max(below, start):.3g}",
        step="any",
        value=f"{start:g}",
        data_above=f"{above:g}",
        data_below=f"{below:g}",
    )
    answer = element("output", verdict(facts.verdict(start)), for_="limit-um", id="limit-answer", aria_live="polite")
    return section(
        "limit",
        "Is the machine within its limit?",
        element(
            "p",
            element("label", "Limit ", for_="limit-um"),
            slider,
            " ",
            element("span", number(start), id="limit-value"),
            " µm ",
            answer,
        ),
        element(
            "p",
            "With 95 % the largest error is above ",
            number(above),
            " µm, and with 95 % below ",
            number(below),
            " µm.",
            class_="quiet",
        ),
    )


def _facts(machine: MachineFolder, entry: Entry, facts: CalibrationFacts) -> Markup:
    x, y, z = facts.volume
    pairs: list[tuple[object, object]] = [("Day", day(entry.date)), ("Largest error", largest_error(facts))]
    if facts.largest is not None:
        pairs.append(("At", "X {:g}, Y {:g}, Z {:g} mm".format(*facts.largest.at)))
    pairs += [("Volume", f"{x:g} × {y:g} × {z:g} mm"), ("Method", facts.method), ("Chain", facts.chain)]
    if facts.temperatures:
        said = ", ".join(f"{one:.1f}" for one in dict.fromkeys(facts.temperatures))
        pairs.append(("Referred to" if facts.referred else "As found at", f"{said} °C"))
    made_from = [one for one in machine.origins(entry) if not one.removed]
    pairs += [("Made from", markup(*_links(made_from)))] if made_from else []
    pairs.append(("File", element("a", entry.name, href=file_address(entry), download=True)))
    return definitions(pairs, "facts")


def _links(entries: list[Entry]) -> list[Markup]:
    return [element("a", one.name, " ", href=file_address(one), download=True) for one in entries]


def _actions(name: str, entry: Entry, others: list[Entry]) -> Markup:
    chosen = [element("option", f"{one.name} ({one.date[:10]})", value=one.file) for one in reversed(others)]
    compare = element(
        "form",
        element("label", "Compare with ", for_="other"),
        element("select", *chosen, id="other", name="other"),
        element("input", type="hidden", name="file", value=entry.file),
        element("button", "Compare"),
        method="post",
        action=address(name, "compare"),
        class_="action",
    )
    return element(
        "div",
        element("a", "Make the report", href=address(name, "report", entry.name), class_="button main"),
        element("a", "Compensate", href=address(name, "compensate", entry.name), class_="button"),
        compare if chosen else None,
        action("Remove", address(name, "remove"), file=entry.file),
        class_="actions",
    )
