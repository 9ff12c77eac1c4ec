"""Align and Run: what the instrument reads now, what to do, and what has come of it."""

from starlette.responses import HTMLResponse

from stepdiag.acquisition.placement import placement
from stepdiag.app.frame import address, page
from stepdiag.app.live_runs import ALIGNMENT, LiveRun
from stepdiag.app.machine_drawing import plan_figure, planned_lines
from stepdiag.book.book import Entry, MachineFolder
from stepdiag.book.layout import main_file
from stepdiag.presentation.page.html import Markup, element, markup, section, table
from stepdiag.scenario.description import read_scenario
from stepdiag.scenario.order_of_run import visits_of

BUTTONS = (
    ("pause", "Pause"),
    ("go_on", "Go on"),
    ("repeat_point", "Repeat the point"),
    ("repeat_line", "Repeat the line"),
    ("stop", "Stop"),
)


def live_screen(machine: MachineFolder, run: LiveRun, scenario: Entry | None) -> HTMLResponse:
    """The script fills it in from the stream of events. scenario: that of the run, for the drawing of where head and
    mirror go."""
    name, aligns = machine.name, run.name == ALIGNMENT
    state = run.state()
    line = _reading(aligns)
    asked = element(
        "section",
        element("p", state["question"] if state else "", id="question"),
        element("p", id="answers", class_="actions"),
        id="asks",
        class_="banner unsure",
        aria_live="assertive",
        aria_label="Question",
        hidden=not (state and state["question"]),
    )
    return page(
        f"Align {name}" if aligns else f"Run {run.name} of {name}",
        element("p", "", id="doing", class_="doing", role="status"),
        asked,
        line,
        _bar() if not aligns else None,
        element("div", _cross(), _turns() if aligns else _deviations(), class_="live-figures"),
        _buttons(aligns),
        _remark() if not aligns else None,
        element(
            "section",
            element("h2", "What happened"),
            element("ol", id="messages", class_="messages"),
            aria_live="polite",
        ),
        _ended(name, run, aligns),
        _where(machine, scenario),
        element("details", element("summary", "All that the command said"), element("pre", run.said(), id="said")),
        element("p", data_live=address(name, "live", run.name), data_aligns=aligns, hidden=True),
        path=[(address(name), name), (address(name, "measure"), "Measure")],
        scripts=["live.js"],
    )


def _where(machine: MachineFolder, scenario: Entry | None) -> Markup | None:
    if scenario is None:
        return None
    known = read_scenario(main_file(scenario.path)).known
    lines = planned_lines(known)
    first = {visit.set_up: visit for visit in reversed(list(visits_of(known)))}
    placements = [placement(known, first[line.set_up]) for line in lines]
    rows = [(f"{one.visit.set_up}", one.visit.line, one.corner, one.beam.words, one.face.words) for one in placements]
    return section(
        "places",
        "Where head and mirror go",
        element("figure", plan_figure(known, lines)),
        table(
            "Seen from before the machine: X+ right, Y+ away",
            ("Set-up", "Line", "Head", "It looks", "Mirror looks"),
            rows,
        ),
    )


def _reading(aligns: bool) -> Markup:
    parts = [
        element("p", element("output", "–", id="distance"), " ", element("span", "mm", id="unit"), class_="big"),
        element("p", "", id="beside", class_="quiet"),
        element("p", "", id="where"),
        element("p", "", id="signal", class_="quiet"),
        element("p", "", id="conditions", class_="quiet"),
    ]
    return element("section", *parts, aria_label="Reading", class_="reading")


def _bar() -> Markup:
    return element(
        "p",
        element("progress", value="0", max="1", id="share", aria_label="Readings of the run"),
        element("span", "", id="left"),
    )


def _cross() -> Markup:
    """Where the mirror looks, seen from the head: its circle is the limit, while head and mirror are aligned."""
    parts = [
        element("line", x1="-100", x2="100", y1="0", y2="0", class_="grid"),
        element("line", x1="0", x2="0", y1="-100", y2="100", class_="grid"),
        element("circle", cx="0", cy="0", r="50", class_="limit", id="cross-limit"),
        element("circle", cx="0", cy="0", r="7", class_="spot", id="cross-spot", visibility="hidden"),
        element("text", "up", x="6", y="-90"),
        element("text", "right", x="98", y="-6", text_anchor="end"),
    ]
    svg = element(
        "svg", *parts, viewBox="-104 -104 208 208", class_="cross", role="img", aria_label="Mirror against the beam"
    )
    return element("figure", svg, element("figcaption", "", id="cross-said", class_="quiet"), id="cross")


def _turns() -> Markup:
    return element("ul", id="turns", class_="turns", hidden=True, aria_live="polite")


def _deviations() -> Markup:
    svg = element(
        "svg",
        viewBox="0 0 720 260",
        class_="deviations",
        id="deviations",
        role="img",
        aria_label="Deviation from the nominal way against the point, a curve a line; the last values are in the list",
    )
    caption = element("figcaption", "Read minus nominal, µm, against the point of the line", class_="quiet")
    return element("figure", svg, caption)


def _buttons(aligns: bool) -> Markup:
    shown = [one for one in BUTTONS if not aligns or one[0] == "stop"]
    return element(
        "p",
        *(element("button", words, type="button", data_control=control) for control, words in shown),
        class_="actions",
        id="controls",
    )


def _remark() -> Markup:
    return element(
        "form",
        element("label", "Remark ", for_="remark"),
        element("input", id="remark", maxlength="500"),
        element("button", "Keep"),
        id="remarks",
        class_="actions",
    )


def _ended(name: str, run: LiveRun, aligns: bool) -> Markup:
    if aligns:
        return element(
            "p", element("a", "Measure", href=address(name, "measure"), class_="button main"), id="ended", hidden=True
        )
    evaluate = element(
        "form",
        element("input", type="hidden", name="run", value=f"runs/{run.name}.csv"),
        element("button", "Evaluate the run", class_="main"),
        method="post",
        action=address(name, "evaluate"),
        class_="action",
    )
    resume = element(
        "form",
        element("input", type="hidden", name="what", value="resume"),
        element("input", type="hidden", name="name", value=run.name),
        element("button", "Go on with this run"),
        method="post",
        action=address(name, "begin"),
        class_="action",
        id="resume",
    )
    return element("div", markup(evaluate, " ", resume), id="ended", class_="actions", hidden=True)
