"""What the application answers: routes, and what each of them does.

A screen shows what is in the files of the book. A change is a command of stepdiag in a process of its own, which the
page shows; there is no other way to a result. Names in addresses are looked up in the list of a machine's files, and
never joined to a path.
"""

import asyncio
import contextlib
import hashlib
import tempfile
import time
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, Final
from urllib.parse import parse_qs, quote

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import (
    FileResponse,
    JSONResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
    StreamingResponse,
)
from starlette.routing import Route

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.control import CONTROLS
from stepdiag.app.frame import STATIC, address, static_text
from stepdiag.app.jobs import CommandJob, Jobs
from stepdiag.app.live_runs import ALIGNMENT, LiveRun, LiveRuns, RawTail, event
from stepdiag.app.screens.calibration import calibration_screen
from stepdiag.app.screens.compensate import FIELDS as TABLE_FIELDS
from stepdiag.app.screens.compensate import NONE, compensate_screen
from stepdiag.app.screens.job import job_screen
from stepdiag.app.screens.live import live_screen
from stepdiag.app.screens.machine import machine_screen
from stepdiag.app.screens.machines import machines_screen, refusal_screen, search_screen
from stepdiag.app.screens.measure import measure_screen
from stepdiag.app.screens.new_machine import new_machine_screen
from stepdiag.app.screens.plan import plan_screen
from stepdiag.app.screens.report import FIELDS, report_screen
from stepdiag.app.screens.trend import trend_screen
from stepdiag.app.security import REPORT_POLICY, Guard, TooLarge
from stepdiag.book.book import Book, Entry, MachineFolder
from stepdiag.book.layout import main_file, safe_name
from stepdiag.exporting.formats import FORMATS
from stepdiag.io.data_files import date_of_today

BETWEEN_STATES: Final = 0.03  # s, of a stream
BETWEEN_LOOKS: Final = 1.0  # s, at what a process said
SHEETS: Final = (".xlsx", ".ods", ".xls", ".txt", ".tsv")  # that `stepdiag import` reads
# Of programs, by maker.
_ENDINGS: Final = {"siemens": ".mpf", "heidenhain": ".h", "linuxcnc": ".ngc"}


class NotHere(Exception):
    """There is no such machine, file or job."""


class App:
    """The routes of a book. temporary: a folder for uploads and pages, which goes with the server."""

    def __init__(self, book: Path, temporary: Path) -> None:
        self._folder, self._temporary = book.absolute(), temporary
        self.jobs = Jobs()
        self.live = LiveRuns()
        self._drawn: dict[str, asyncio.Lock] = {}

    # --- what is there ----------------------------------------------------------------------------------------------
    def machine(self, request: Request) -> MachineFolder:
        name = request.path_params["machine"]
        machine = next((one for one in Book(self._folder).machines() if one.name == name), None)
        if machine is None:
            raise NotHere(f"There is no machine {name} in this book.")
        machine.entries()
        return machine

    @staticmethod
    def entry(machine: MachineFolder, file: str) -> Entry:
        """A file of the machine by its exact name in the list."""
        found = next((one for one in machine.listed(removed=True) if one.file == file), None)
        if found is None:
            raise NotHere(f"There is no file {file} of {machine.name}.")
        return found

    def calibration(self, request: Request) -> tuple[MachineFolder, Entry]:
        machine = self.machine(request)
        entry = self.entry(machine, f"calibrations/{request.path_params['name']}")
        if entry.kind != "calibration":
            raise NotHere(f"{entry.file} is no calibration, or is damaged.")
        return machine, entry

    # --- screens ----------------------------------------------------------------------------------------------------
    def machines(self, request: Request) -> Response:
        return machines_screen(Book(self._folder))

    def search(self, request: Request) -> Response:
        return search_screen(Book(self._folder), request.query_params.get("q", "")[:200])

    def show_machine(self, request: Request) -> Response:
        return machine_screen(self.machine(request))

    def show_calibration(self, request: Request) -> Response:
        return calibration_screen(*self.calibration(request))

    def show_compensate(self, request: Request) -> Response:
        return compensate_screen(*self.calibration(request))

    def show_new(self, request: Request) -> Response:
        return new_machine_screen()

    def show_plan(self, request: Request) -> Response:
        return plan_screen(self.machine(request), request.query_params.get("scenario", ""))

    def picture(self, request: Request) -> Response:
        """A PNG picture of the book, to look at."""
        machine = self.machine(request)
        entry = self.entry(machine, request.path_params["file"])
        if entry.kind != "PNG picture":
            raise NotHere(f"{entry.file} is no picture.")
        return FileResponse(entry.path, media_type="image/png")

    def show_trend(self, request: Request) -> Response:
        return trend_screen(self.machine(request))

    def show_report(self, request: Request) -> Response:
        return report_screen(*self.calibration(request))

    def show_measure(self, request: Request) -> Response:
        machine = self.machine(request)
        return measure_screen(machine, self.live.of(machine))

    def show_live(self, request: Request) -> Response:
        machine, run = self._live_run(request)
        named = request.query_params.get("scenario", "")
        return live_screen(machine, run, self.entry(machine, named) if named else machine.last("scenario"))

    def _live_run(self, request: Request) -> tuple[MachineFolder, LiveRun]:
        machine, name = self.machine(request), request.path_params["name"]
        run = next((one for one in self.live.of(machine) if one.name == name), None)
        if run is None:
            raise NotHere(f"Nothing of the name {name} was measured here.")
        return machine, run

    async def live_events(self, request: Request) -> Response:
        """The stream of an acquisition: its state many times a second, its readings as they come, what it said."""
        _, run = await asyncio.to_thread(self._live_run, request)
        return StreamingResponse(_events(run), media_type="text/event-stream")

    async def control(self, request: Request) -> Response:
        """What the person wants of a process that runs."""
        _, run = await asyncio.to_thread(self._live_run, request)
        given = await _form(request)
        wanted = next((one for one in CONTROLS if one == given.get("control")), None)
        if wanted is None:
            raise NotHere("There is no such control.")
        run.ask(wanted, given.get("text", ""))
        return Response(status_code=204)

    async def begin(self, request: Request) -> Response:
        """Starts an alignment or a run, or goes on with a run; it does not end with the server."""
        machine, given = await asyncio.to_thread(self.machine, request), await _form(request)
        what = given.get("what", "")
        if what == "resume":
            entry = self.entry(machine, f"runs/{given.get('name', '')}.csv")
            begun = entry.record.command if entry.record is not None else ()
            if begun[1:2] != ("acquire",):
                raise NotHere(f"{entry.file} was not measured here.")
            words = [*begun[1:], *(["--resume"] if "--resume" not in begun else [])]
            run = LiveRun(machine, Path(entry.name).stem)
        else:
            if given.get("source", "").startswith("program:"):
                raise NotHere("A page starts no programs: begin with the command line, and watch it here.")
            common = [*self._of(machine), self.entry(machine, given.get("scenario", "")).file]
            common += ["--watched", *_options(given, ("source",))]
            if what == "align":
                run = LiveRun(machine, ALIGNMENT)
                words = ["align", *common]
            else:
                name = await asyncio.to_thread(_free, machine, "runs", date_of_today()[:10], ".csv")
                run = LiveRun(machine, Path(name).stem)
                words = ["acquire", *common, *_options(given, ("trigger",)), "-o", name]
        await asyncio.to_thread(self.live.begin, run, words)
        scenario = f"?scenario={quote(given['scenario'])}" if given.get("scenario") else ""
        return RedirectResponse(address(machine.name, "live", run.name) + scenario, 303)

    def show_job(self, request: Request) -> Response:
        return job_screen(self._job(request))

    def job_state(self, request: Request) -> Response:
        job = self._job(request)
        return JSONResponse({"status": job.status, "doing": job.doing, "share": job.share, "next": job.next})

    def file(self, request: Request) -> Response:
        """A file of the book, to keep."""
        machine = self.machine(request)
        path = main_file(self.entry(machine, request.path_params["file"]).path)
        return FileResponse(path, filename=path.name, media_type="application/octet-stream")

    def static(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in STATIC:
            raise NotHere("There is no such file.")
        return Response(static_text(name), media_type=STATIC[name])

    async def figures(self, request: Request) -> Response:
        """The report page of a calibration, made once for each content of its file and each limit."""
        machine, entry = await asyncio.to_thread(self.calibration, request)
        limit = machine.about.limit_um
        given = [str(entry.path), *self._origins(machine, entry)]
        given += ["--limit", f"{limit!r}"] if limit is not None else []
        made = hashlib.sha256("\n".join((entry.sha256, *given)).encode()).hexdigest()
        page = self._temporary / f"{made}.html"
        async with self._drawn.setdefault(made, asyncio.Lock()):
            if not page.exists():
                job = CommandJob("report", [["report", *given, "-o", str(page)]], self._folder)
                while job.status is None:
                    await asyncio.sleep(0.05)
                    if await request.is_disconnected():
                        await job.stop()
        if not page.exists():
            return PlainTextResponse("\n".join(job.said[-3:]), 500)
        return FileResponse(page, media_type="text/html", headers={"Content-Security-Policy": REPORT_POLICY})

    @staticmethod
    def _origins(machine: MachineFolder, entry: Entry) -> list[str]:
        words: list[str] = []
        for one in machine.origins(entry):
            flag = {"scenario": "--scenario", "measurement": "--run"}.get(one.kind or "")
            words += [flag, str(main_file(one.path))] if flag and flag not in words else []
        return words

    # --- changes: commands ------------------------------------------------------------------------------------------
    async def new_machine(self, request: Request) -> Response:
        given = await _form(request)
        words = ["book", "new", "--book", str(self._folder)]
        words += _options(given, ("title", "serial_number", "customer", "limit", "interval"))
        travels = [given.get(f"travel_{axis}", "") for axis in "xyz"]
        if all(travels):
            words += [
                f"--volume={','.join(travels)}",
                *_options(given, ("chain", "head", "distance_noise", "tilt_noise")),
            ]
        return self._begin("New machine", [[*words, "--", given.get("name", "")]], "", address(given.get("name", "")))

    async def upload(self, request: Request) -> Response:
        """One file as the body; its name in the query. Sheets are read as measurements of the machine's scenario."""
        machine = await asyncio.to_thread(self.machine, request)
        name = safe_name(request.query_params.get("name", "file")[:200])
        folder = Path(tempfile.mkdtemp(dir=self._temporary))
        path = folder / name
        with path.open("wb") as file:
            async for chunk in request.stream():
                file.write(chunk)
        of_book = ["--machine", machine.name, "--book", str(self._folder)]
        commands = [["book", "add", *of_book, str(path)]]
        if path.suffix.lower() in SHEETS:
            run = path.with_suffix(".csv")
            scenario = machine.last("scenario")
            known = ["--scenario", str(main_file(scenario.path))] if scenario is not None else []
            commands = [["import", str(path), "-o", str(run), *known], ["book", "add", *of_book, str(run)]]
        job = self._job_of(f"Import {name}", commands, machine.name, address(machine.name), uploaded=folder)
        return JSONResponse({"job": f"/jobs/{job.id}"})

    async def plan(self, request: Request) -> Response:
        """A search for plans, what the scenario's plan determines, or its program."""
        machine, given = await asyncio.to_thread(self.machine, request), await _form(request)
        what = given.get("what", "")
        of_scenario = [*self._of(machine), self.entry(machine, given.get("scenario", "")).file]
        if what == "observe":
            return self._begin("What the plan determines", [["observe", *of_scenario]], machine.name, "")
        if what == "nc":
            words = ["nc", *of_scenario, *_options(given, ("dialect",))]
            return self._begin("Measuring program", [words], machine.name, "")
        name = await asyncio.to_thread(_free, machine, "plans", "plans", ".png")
        words = ["plan", *of_scenario, "-o", name]
        decides = given.get("goal") == "decide" and machine.about.limit_um is not None
        words += [f"--decide={machine.about.limit_um!r}"] if decides else _options(given, ("minutes",))
        if given.get("write"):
            words += ["--write", await asyncio.to_thread(_free, machine, "scenarios", Path(name).stem, ".toml")]
        return self._begin("Plans", [words], machine.name, "")

    async def evaluate(self, request: Request) -> Response:
        machine, given = await asyncio.to_thread(self.machine, request), await _form(request)
        run = self.entry(machine, given.get("run", ""))
        words = ["evaluate", *self._of(machine), run.file]
        return self._begin(f"Evaluate {run.name}", [words], machine.name, address(machine.name, "result") + "/{file}")

    async def compare(self, request: Request) -> Response:
        machine, given = await asyncio.to_thread(self.machine, request), await _form(request)
        both = [self.entry(machine, given.get(name, "")) for name in ("file", "other")]
        words = ["compare", *self._of(machine), *(one.file for one in sorted(both, key=lambda one: one.date))]
        return self._begin("Compare", [words], machine.name, "")

    async def report(self, request: Request) -> Response:
        machine, given = await asyncio.to_thread(self.machine, request), await _form(request)
        entry = self.entry(machine, given.get("file", ""))
        before = [self.entry(machine, given["before"]).file] if given.get("before") else []
        ending = ".pdf" if given.get("ending") == ".pdf" else ".html"
        name = await asyncio.to_thread(_free, machine, "reports", Path(entry.name).stem, ending)
        words = ["report", *self._of(machine), *before, entry.file, "-o", name]
        words += _options(given, (*FIELDS, "limit", "language"))
        return self._begin(
            f"Report of {entry.name}", [words], machine.name, address(machine.name, "result") + "/{file}"
        )

    async def export(self, request: Request) -> Response:
        """Not before the controller's present table is in the book, or the person has said that there is none."""
        machine, given = await asyncio.to_thread(self.machine, request), await _form(request)
        entry, to, replaced = self.entry(machine, given.get("file", "")), given.get("to", ""), given.get("replaces", "")
        if to not in FORMATS:
            raise NotHere(f"There is no format {to}.")
        if not replaced:
            raise NotHere("First keep the table that the controller has now, or say that it has none.")
        words = ["export", *self._of(machine), entry.file, "--to", to]
        words += ["--replaces", self.entry(machine, replaced).file] if replaced != NONE else []
        words += ["--incomplete"] if given.get("incomplete") else []
        if given.get("proof"):
            ending = _ENDINGS.get(FORMATS[to].maker, ".iso")
            words += ["--proof", await asyncio.to_thread(_free, machine, "plans", f"sign-{to}", ending)]
        fields = [one for one in TABLE_FIELDS if one in FORMATS[to].options]
        words += _options(given, [field for field in fields if field != "at"])
        words += ["--at", *given["at"].replace(",", " ").split()] if "at" in fields and given.get("at") else []
        return self._begin(f"Table for {to}", [words], machine.name, "")

    async def remove(self, request: Request) -> Response:
        return await self._moved(request, "remove")

    async def restore(self, request: Request) -> Response:
        return await self._moved(request, "restore")

    async def stop(self, request: Request) -> Response:
        job = self._job(request)
        await job.stop()
        return RedirectResponse(f"/jobs/{job.id}", 303)

    def result(self, request: Request) -> Response:
        """Where a result is shown."""
        machine = self.machine(request)
        entry = self.entry(machine, request.path_params["file"])
        if entry.kind == "calibration" and entry.folder == "calibrations":
            return RedirectResponse(address(machine.name, "calibration", entry.name), 303)
        return RedirectResponse(address(machine.name) + "#others", 303)

    async def _moved(self, request: Request, verb: str) -> Response:
        machine, given = await asyncio.to_thread(self.machine, request), await _form(request)
        entry = self.entry(machine, given.get("file", ""))
        words = ["book", verb, *self._of(machine), entry.path.relative_to(machine.folder).as_posix()]
        return self._begin(f"{verb.capitalize()} {entry.name}", [words], machine.name, address(machine.name))

    def _of(self, machine: MachineFolder) -> list[str]:
        return ["--machine", machine.name, "--book", str(self._folder)]

    def _begin(self, title: str, commands: Sequence[Sequence[str]], machine: str, then: str) -> Response:
        return RedirectResponse(f"/jobs/{self._job_of(title, commands, machine, then).id}", 303)

    def _job_of(
        self, title: str, commands: Sequence[Sequence[str]], machine: str, then: str, uploaded: Path | None = None
    ) -> CommandJob:
        return self.jobs.add(CommandJob(title, commands, self._folder, machine, then, uploaded))

    def _job(self, request: Request) -> CommandJob:
        job = self.jobs.get(request.path_params["job"])
        if job is None:
            raise NotHere("There is no such command any more.")
        return job


def application(book: Path, temporary: Path, port: int, token: str) -> Guard:
    """The application with its guard. Raises InvalidArgument if the folder is not a book."""
    Book(book)
    app = App(book, temporary)

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        yield
        await app.jobs.stop_all()

    machine = "/machines/{machine}"
    routes = [
        Route("/", _told(app.machines)),
        Route("/search", _told(app.search)),
        Route("/static/{name}", _told(app.static)),
        Route("/new", _told(app.show_new)),
        Route("/machines", _told(app.new_machine), methods=["POST"]),
        Route(machine, _told(app.show_machine)),
        Route(f"{machine}/calibration/{{name}}", _told(app.show_calibration)),
        Route(f"{machine}/compensate/{{name}}", _told(app.show_compensate)),
        Route(f"{machine}/plan", _told(app.show_plan)),
        Route(f"{machine}/plans", _told(app.plan), methods=["POST"]),
        Route(f"{machine}/picture/{{file:path}}", _told(app.picture)),
        Route(f"{machine}/trend", _told(app.show_trend)),
        Route(f"{machine}/measure", _told(app.show_measure)),
        Route(f"{machine}/begin", _told(app.begin), methods=["POST"]),
        Route(f"{machine}/live/{{name}}", _told(app.show_live)),
        Route(f"{machine}/live/{{name}}/events", _told(app.live_events)),
        Route(f"{machine}/live/{{name}}/control", _told(app.control), methods=["POST"]),
        Route(f"{machine}/figures/{{name}}", _told(app.figures)),
        Route(f"{machine}/report/{{name}}", _told(app.show_report)),
        Route(f"{machine}/file/{{file:path}}", _told(app.file)),
        Route(f"{machine}/result/{{file:path}}", _told(app.result)),
        Route(f"{machine}/files", _told(app.upload), methods=["POST"]),
        Route(f"{machine}/evaluate", _told(app.evaluate), methods=["POST"]),
        Route(f"{machine}/compare", _told(app.compare), methods=["POST"]),
        Route(f"{machine}/reports", _told(app.report), methods=["POST"]),
        Route(f"{machine}/exports", _told(app.export), methods=["POST"]),
        Route(f"{machine}/remove", _told(app.remove), methods=["POST"]),
        Route(f"{machine}/restore", _told(app.restore), methods=["POST"]),
        Route("/jobs/{job}", _told(app.show_job)),
        Route("/jobs/{job}/state", _told(app.job_state)),
        Route("/jobs/{job}/stop", _told(app.stop), methods=["POST"]),
    ]
    return Guard(Starlette(routes=routes, lifespan=lifespan), port, token)


async def _events(run: LiveRun) -> AsyncIterator[bytes]:
    """Ends with the client."""
    tail, said, looked = RawTail(run.raw), "", -1.0
    shown: tuple[object, ...] = ()
    stored: tuple[object, ...] = ()
    while True:
        state = run.state()
        now = () if state is None else (state["process"], state["number"], state["doing"])
        if state is not None and now != shown:
            shown = now
            yield event("state", state)
            read = (state["process"], state["stored"], state["readings"])
            if read != stored:
                stored = read
                yield event("readings", await asyncio.to_thread(tail.new))
        if time.monotonic() - looked > BETWEEN_LOOKS:
            looked = time.monotonic()
            text = run.said()
            yield event("said", text) if text != said else b": \n\n"  # so that a client that is gone is noticed
            said = text
        await asyncio.sleep(BETWEEN_STATES)


def _told(handler: Callable[[Request], Any]) -> Callable[[Request], Any]:
    """What a handler refuses is a page that says so."""

    def refused(error: Exception) -> Response:
        if isinstance(error, TooLarge):
            return PlainTextResponse("The file is too large.", 413)
        if isinstance(error, NotHere):
            return refusal_screen("Not here", str(error), 404)
        return refusal_screen("This cannot be shown", str(error), 500)

    if asyncio.iscoroutinefunction(handler):

        @wraps(handler)
        async def asynchronous(request: Request) -> Response:
            try:
                found: Response = await handler(request)
                return found
            except ClientDisconnect:
                return Response(status_code=400)
            except (NotHere, TooLarge, InvalidArgument) as error:
                return refused(error)

        return asynchronous

    @wraps(handler)
    def synchronous(request: Request) -> Response:
        try:
            found: Response = handler(request)
            return found
        except (NotHere, InvalidArgument) as error:
            return refused(error)

    return synchronous


async def _form(request: Request) -> dict[str, str]:
    """The fields of a form; of one given twice the first."""
    body = (await request.body()).decode(errors="replace")
    return {name: values[0].strip() for name, values in parse_qs(body, max_num_fields=50).items()}


def _options(given: Mapping[str, str], names: Iterable[str]) -> list[str]:
    """Options of a command from the fields of a form that are filled in."""
    return [f"--{name.replace('_', '-')}={given[name]}" for name in names if given.get(name)]


def _free(machine: MachineFolder, folder: str, stem: str, ending: str) -> str:
    """A name that is free."""
    from stepdiag.book.layout import release

    path = machine.take(folder, f"{stem}{ending}")
    release(path)
    return path.name
