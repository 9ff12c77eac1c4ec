"""Plan: what do I learn in the time I have? And the program that measures it."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from starlette.responses import HTMLResponse

from stepdiag.acquisition.placement import corner_words
from stepdiag.app.frame import address, day, file_address, page
from stepdiag.app.machine_drawing import PlannedLine, plan_figure, planned_lines
from stepdiag.book.book import Entry, MachineFolder
from stepdiag.book.layout import main_file
from stepdiag.planning.measuring_time import measuring_time, times_of
from stepdiag.presentation.page.html import Markup, definitions, element, section, table
from stepdiag.scenario.description import read_scenario
from stepdiag.scenario.known import Known, runs_of
from stepdiag.units import MINUTE

DIALECTS: Final = ("linuxcnc", "iso")


def plan_screen(machine: MachineFolder, wanted: str = "") -> HTMLResponse:
    """wanted: a scenario, as "scenarios/scenario.toml"; none: the latest."""
    name = machine.name
    scenarios = [one for one in machine.listed("scenarios") if one.kind == "scenario"]
    chosen = next((one for one in scenarios if one.file == wanted), scenarios[-1] if scenarios else None)
    return page(
        f"Plan for {name}",
        *(
            [*_scenario(name, scenarios, chosen), *_with(machine, chosen)]
            if chosen
            else [element("p", "No scenario yet: import one, or make one with a new machine.")]
        ),
        _made(machine),
        command=("plan", "--machine", name, *([chosen.name] if chosen else []), "--minutes", "45"),
        path=[(address(name), name), (address(name, "plan"), "Plan")],
    )


def _scenario(name: str, scenarios: Sequence[Entry], chosen: Entry) -> list[Markup]:
    """Which of the machine's scenarios, the latest first."""
    options = [element("option", one.name, value=one.file, selected=one is chosen) for one in reversed(scenarios)]
    return [
        element(
            "form",
            element("label", "Scenario ", for_="scenario"),
            element("select", *options, id="scenario", name="scenario"),
            element("button", "Show its plan"),
            element("a", "Download", href=file_address(chosen), download=True),
            class_="actions",
            action=address(name, "plan"),
        )
    ]


def _with(machine: MachineFolder, chosen: Entry) -> list[Markup]:
    known = read_scenario(main_file(chosen.path)).known
    return [
        _facts(known),
        _lines(known, planned_lines(known)),
        section(
            "determines",
            "What does this plan determine?",
            element(
                "p", "The uncertainty of each parameter before anything is measured, and which faults would be found."
            ),
            _form(machine.name, chosen, "observe", "Ask the plan"),
        ),
        _search(machine, chosen),
        section(
            "program",
            "The measuring program",
            element("p", "Moves the axes through the points of this plan, and waits for a reading at each."),
            _form(
                machine.name,
                chosen,
                "nc",
                "Write the program",
                element("label", "Controller ", for_="dialect"),
                element(
                    "select", *(element("option", one, value=one) for one in DIALECTS), id="dialect", name="dialect"
                ),
            ),
        ),
    ]


def _facts(known: Known) -> Markup:
    plan, repeats = known.plan, runs_of(known.keys.plan)
    times = times_of(known.keys.plan_by_time, f"{known.path}: plan_by_time")
    seconds, _ = measuring_time(plan, times, repeats=repeats, backward=known.keys.plan.backward)
    width, height = plan.smallest_mirror()
    spacing = float(max(plan.volume)) / plan.steps
    readings = sum(len(one.positions) for one in plan.passes(repeats, backward=known.keys.plan.backward))
    return definitions(
        [
            ("Time at the machine", f"about {seconds / MINUTE:.0f} minutes"),
            ("Set-ups", f"{len(plan.lines) + len(plan.scale_lines)}, each with head and mirror at another place"),
            ("Readings", f"{readings}"),
            ("Steps", f"{plan.steps} per axis, nodes at most {spacing:.3g} mm apart"),
            ("Mirror", f"at least {width:.0f} × {height:.0f} mm, and the beam's diameter"),
        ],
        "facts",
    )


def _lines(known: Known, lines: Sequence[PlannedLine]) -> Markup:
    volume = np.asarray(known.plan.volume)
    rows = [
        (
            f"{one.set_up}",
            f"{one.name}{', scale line' if one.is_scale_line else ''}",
            corner_words(one.first.positions[0], volume),
            corner_words(one.first.positions[-1], volume),
            ", ".join(f"{float(x) + 0.0:.0f}".replace("-", "−") for x in one.head + np.asarray(known.tool)),
            f"{len(one.first.positions)}" + (f" × {one.passes}" if one.passes > 1 else ""),
        )
        for one in lines
    ]
    controls = element(
        "div",
        element("button", "Play", id="dry-run-play", type="button"),
        element("label", "Point ", for_="dry-run-at"),
        element("input", type="range", id="dry-run-at", min="0", value="0", step="1"),
        element("output", "", id="dry-run-said", for_="dry-run-at"),
        class_="dry-run",
        id="dry-run",
        hidden=True,
    )
    key = element(
        "p",
        "Blue: lines. Dashed: scale lines, the laser along the axis. Circles: the head, with the number of the set-up; "
        "from it the beam to the mirror at the line's first point.",
        class_="quiet",
    )
    return section(
        "lines",
        "The lines, and a dry run",
        element("figure", plan_figure(known, lines), controls, key),
        table(
            "Where the mirror begins and ends, and where the head stands (mm, machine frame)",
            ("Set-up", "Line", "From", "To", "Head", "Points"),
            rows,
        ),
    )


def _search(machine: MachineFolder, chosen: Entry) -> Markup:
    limit = machine.about.limit_um
    goals = [element("option", "the best plan in the time", value="time")]
    if limit is not None:
        words = f"the shortest plan that shows whether the machine is within {limit:g} µm"
        goals.append(element("option", words, value="decide"))
    minutes = element("input", id="minutes", name="minutes", type="number", min="1", step="any", value="45")
    box = element("input", type="checkbox", id="write", name="write", value="yes")
    return section(
        "search",
        "Which plan is best in the time I have?",
        element(
            "p",
            "Searches lines, steps and repeats for this head and its noise. A long time to plan for takes minutes.",
        ),
        _form(
            machine.name,
            chosen,
            "plan",
            "Search",
            element("label", "Find ", for_="goal"),
            element("select", *goals, id="goal", name="goal"),
            element("label", "Minutes at the machine ", for_="minutes"),
            minutes,
            element(
                "p", box, element("label", "Write a scenario with it, for the next run", for_="write"), class_="choice"
            ),
        ),
    )


def _form(machine: str, chosen: Entry, what: str, words: str, *fields: Markup) -> Markup:
    return element(
        "form",
        *fields,
        element("input", type="hidden", name="what", value=what),
        element("input", type="hidden", name="scenario", value=chosen.file),
        element("button", words, class_="main"),
        method="post",
        action=address(machine, "plans"),
        class_="action",
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
