"""Plan: what do I learn in the time I have? And the program that measures it."""

from typing import Final

from starlette.responses import HTMLResponse

from stepdiag.app.frame import address, day, file_address, page
from stepdiag.book.book import Entry, MachineFolder
from stepdiag.presentation.page.html import Markup, element, section, table

DIALECTS: Final = ("linuxcnc", "iso")


def plan_screen(machine: MachineFolder) -> HTMLResponse:
    name = machine.name
    scenarios = [one for one in machine.listed("scenarios") if one.kind == "scenario"]
    return page(
        f"Plan for {name}",
        *(
            _with(name, scenarios)
            if scenarios
            else [element("p", "No scenario yet: import one, or make one with a new machine.")]
        ),
        _made(machine),
        command=("plan", "--machine", name, "--minutes", "45"),
        path=[(address(name), name), (address(name, "plan"), "Plan")],
    )


def _with(name: str, scenarios: list[Entry]) -> list[Markup]:
    latest = scenarios[-1]
    minutes = element("input", id="minutes", name="minutes", type="number", min="1", step="any", value="45")
    return [
        element(
            "p",
            "Scenario: ",
            element("a", latest.name, href=file_address(latest), download=True),
            f" ({latest.facts.summary})",
        ),
        section(
            "determines",
            "What does its plan determine?",
            element(
                "p", "The uncertainty of each parameter before anything is measured, and which faults would be found."
            ),
            _button(name, "observe", "Ask the scenario's plan"),
        ),
        section(
            "search",
            "Which plan is best in the time I have?",
            element("p", "Searches lines, steps and repeats. It takes some seconds."),
            element(
                "form",
                element("label", "Minutes at the machine ", for_="minutes"),
                minutes,
                element("input", type="hidden", name="what", value="plan"),
                element("button", "Search", class_="main"),
                method="post",
                action=address(name, "plans"),
                class_="action",
            ),
        ),
        section(
            "program",
            "The measuring program",
            element("p", "Moves the axes through the points of the plan, and waits for a reading at each."),
            element(
                "form",
                element("label", "Controller ", for_="dialect"),
                element(
                    "select", *(element("option", one, value=one) for one in DIALECTS), id="dialect", name="dialect"
                ),
                element("input", type="hidden", name="what", value="nc"),
                element("button", "Write the program", class_="main"),
                method="post",
                action=address(name, "plans"),
                class_="action",
            ),
        ),
    ]


def _button(name: str, what: str, words: str) -> Markup:
    hidden = element("input", type="hidden", name="what", value=what)
    return element(
        "form", hidden, element("button", words, class_="main"), method="post", action=address(name, "plans")
    )


def _made(machine: MachineFolder) -> Markup | None:
    kept = machine.listed("plans")
    pictures = [one for one in kept if one.kind == "PNG picture"]
    rows = [
        (element("a", one.name, href=file_address(one), download=True), day(one.date), one.kind or "")
        for one in reversed(kept)
    ]
    if not rows:
        return None
    last = pictures[-1] if pictures else None
    picture = (
        element(
            "img",
            src=address(machine.name, "picture", *last.file.split("/")),
            alt="Uncertainty against time of the plans",
            class_="picture",
        )
        if last
        else None
    )
    return section("made", "Plans and programs", picture, table("The latest first", ("File", "Day", "Kind"), rows))
