"""Measure: which scenario, which instrument, when to read; then align, and start."""

from starlette.responses import HTMLResponse

from stepdiag.app.frame import address, page
from stepdiag.app.live_runs import ALIGNMENT, LiveRun
from stepdiag.book.book import MachineFolder
from stepdiag.presentation.page.html import Markup, element, section, table

TRIGGERS = {
    "settle": "the mirror has come to rest (the machine runs a program with dwells)",
    "key": "I say so, at every point",
    "tcp://127.0.0.1:5080": "the controller asks, at 127.0.0.1:5080",
}


def measure_screen(machine: MachineFolder, runs: list[LiveRun]) -> HTMLResponse:
    name = machine.name
    scenarios = [one for one in machine.listed("scenarios") if one.kind == "scenario"]
    return page(
        f"Measure {name}",
        _running(name, runs),
        _start(name, [one.file for one in reversed(scenarios)])
        if scenarios
        else element("p", "A measurement needs a scenario: import one, or make the machine anew."),
        command=("acquire", "--machine", name, "--source", "ids3010://192.168.1.1", "--trigger", "settle"),
        path=[(address(name), name)],
    )


def _running(name: str, runs: list[LiveRun]) -> Markup | None:
    rows = []
    for run in runs:
        state = run.state()
        if run.name == ALIGNMENT:
            what, count = "alignment", ""
        else:
            what, count = "run", "" if state is None else f"{state['readings']} of {state['planned']}"
        doing = "did not start" if state is None else state["doing"]
        rows.append((element("a", run.name, href=address(name, "live", run.name)), what, doing, count))
    if not rows:
        return None
    return section("running", "Now and before", table("The latest first", ("Name", "What", "State", "Readings"), rows))


def _start(name: str, scenarios: list[str]) -> Markup:
    options = [element("option", one, value=one) for one in scenarios]
    triggers = [element("option", words, value=word) for word, words in TRIGGERS.items()]
    source = element(
        "input",
        id="source",
        name="source",
        required=True,
        placeholder="ids3010://192.168.1.1",
        aria_describedby="sources",
        maxlength=500,
    )
    fields = [
        element("p", element("label", "Scenario", for_="scenario"), _select("scenario", options)),
        element("p", element("label", "Instrument", for_="source"), source),
        element("p", element("label", "A point is read when", for_="trigger"), _select("trigger", triggers)),
    ]
    kinds = element(
        "p",
        "An attocube IDS3010: ids3010:// and its address. An adapter that sends lines: lines://127.0.0.1:PORT. "
        "A program that sends them is started on the command line; its run can be watched here.",
        class_="quiet",
        id="sources",
    )
    buttons = element(
        "p",
        element("button", "Align head and mirror", name="what", value="align"),
        " ",
        element("button", "Start the run", class_="main", name="what", value="acquire"),
    )
    return section(
        "start",
        "Begin",
        element("form", *fields, kinds, buttons, method="post", action=address(name, "begin"), class_="fields wide"),
    )


def _select(name: str, options: list[Markup]) -> Markup:
    return element("select", *options, id=name, name=name)
