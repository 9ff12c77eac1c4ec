"""What a command does at the moment, what it said, and the way on."""

from starlette.responses import HTMLResponse

from stepdiag.app.frame import action, address, banner, page
from stepdiag.app.jobs import CommandJob
from stepdiag.platform import command_line
from stepdiag.presentation.page.html import Markup, element


def job_screen(job: CommandJob) -> HTMLResponse:
    """While it runs the script asks for its state, and goes on to its result."""
    machine, back = job.machine, address(job.machine) if job.machine else "/"
    running = job.status is None
    state: list[Markup | None] = []
    if running:
        share = None if job.share is None else f"{job.share:.3f}"
        state = [
            element("p", job.doing or "working", id="doing", role="status"),
            element("progress", value=share, max="1", id="share", aria_label="Progress"),
            action("Stop", f"/jobs/{job.id}/stop"),
        ]
    elif job.status in (0, 3):
        good = job.status == 0
        headline = "Done" if good else "Done, but the result must not be used"
        state = [banner("accepted" if good else "rejected", headline)]
        files = [
            element("a", file, href=address(machine, "file", *file.split("/")), download=True) for file in job.kept
        ]
        state += [element("ul", *(element("li", file) for file in files), class_="files")] if files and machine else []
        if job.next:
            state.append(element("p", element("a", "Show the result", href=job.next, class_="button main")))
    elif job.status in (130, 143):
        state = [banner("undecided", "Stopped", element("p", "Nothing was changed by the step that was stopped."))]
    else:
        state = [banner("damaged", "Not done", *(element("p", line) for line in job.said[-3:]))]
    commands = [element("li", element("code", command_line(("stepdiag", *words)))) for words in job.commands]
    return page(
        job.title,
        *state,
        element(
            "details",
            element("summary", "What the commands said"),
            element("pre", "\n".join(job.said)),
            open=not running,
        ),
        element("p", "Commands:"),
        element("ol", *commands),
        element("p", element("a", "Back", href=back)),
        element("p", data_job=job.id, data_running=running, hidden=True),
        path=[(back, machine)] if machine else [],
    )
