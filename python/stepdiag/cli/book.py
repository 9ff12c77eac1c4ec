"""The commands `stepdiag book ...`, the register of machines and their files, and `stepdiag app`, its pages."""

import re
import sys
from pathlib import Path
from typing import Any, Final

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.in_book import BOOK
from stepdiag.cli.options import PATH, Command, InOrder, PointInMm, tell
from stepdiag.cli.terminal import say
from stepdiag.progress import Progress

EPILOG = """\b
Begin a book with a machine, and calibrate it from a run:
  stepdiag book new VMC-1200 --book calibrations --serial-number 0815 --limit 20
  cd calibrations
  stepdiag book add --machine VMC-1200 scenario.toml run.csv
  stepdiag evaluate --machine VMC-1200
  stepdiag book show VMC-1200
"""
_DAY: Final = re.compile(r"\d{4}-\d\d-\d\d")
_ABOUT: Final = {
    "title": "Maker and type of the machine.",
    "serial_number": "Serial number.",
    "customer": "Whose machine it is.",
    "place": "Where it stands.",
    "notes": "What else to know.",
}
_MACHINE: Final = click.option("--machine", metavar="NAME", required=True, help="Machine of the book.")


@click.group(cls=InOrder, epilog=EPILOG)
def book() -> None:
    """Keep machines, their runs, calibrations and reports in a folder: the machine book.

    A book is a folder of plain files, machines/NAME/runs, calibrations and so on. It can be copied,
    mailed and opened without stepdiag. Nothing in it is replaced or deleted. Other commands work on
    a machine of the book with --machine NAME.
    """


def _about_options(command: Command) -> Command:
    for name, meaning in reversed(_ABOUT.items()):
        command = click.option(f"--{name.replace('_', '-')}", metavar="TEXT", help=meaning)(command)
    return command


@book.command(short_help="Add a machine.", epilog="\b\nExample: stepdiag book new VMC-1200 --serial-number 0815")
@click.argument("name")
@_about_options
@click.option("--limit", type=float, metavar="UM", help="Limit of the largest error in the volume, µm.")
@click.option("--interval", type=float, metavar="DAYS", help="Longest time between two calibrations, days.")
@click.option("--volume", type=PointInMm(), help="Travels of X, Y and Z, mm: writes a scenario to measure it.")
@click.option(
    "--chain", metavar="CHAIN", help='Which axes carry the workpiece, such as "[w X\' b Y Z t]", of that scenario.'
)
@click.option("--head", metavar="NAME", help="Laser head of that scenario: a shipped one (see head list).")
@click.option("--distance-noise", type=float, metavar="UM", help="Standard deviation of its distances, µm.")
@click.option("--tilt-noise", type=float, metavar="URAD", help="Standard deviation of its tilts, µrad.")
@BOOK
@click.pass_context
def new(
    context: click.Context,
    /,
    name: str,
    limit: float | None,
    interval: float | None,
    volume: tuple[float, float, float] | None,
    chain: str | None,
    head: str | None,
    distance_noise: float | None,
    tilt_noise: float | None,
    book: Path | None,
    **about: str | None,
) -> None:
    """Add the machine NAME to the book; --book names a new or empty folder to begin a book.

    What is known of the machine is written to machines/NAME/machine.toml, which you can edit. With
    --volume a scenario is written too, as `stepdiag init` does.
    """
    from stepdiag.book.book import Book, find_book
    from stepdiag.book.machine_keys import AboutMachine
    from stepdiag.config.toml_text import check_keys

    words = {key: text for key, text in about.items() if text is not None}
    numbers = {key: number for key, number in (("limit_um", limit), ("interval_days", interval)) if number is not None}
    checked = check_keys({**words, **numbers}, AboutMachine, f"machine {name}")
    of_scenario = {"chain": chain, "head": head, "distance_noise": distance_noise, "tilt_noise": tilt_noise}
    scenario = None
    if volume is not None:
        scenario = _new_scenario(volume, chain, head, distance_noise, tilt_noise)
    else:
        for option, value in of_scenario.items():
            if value is not None:
                raise InvalidArgument(f"`{option}`: goes with --volume")
    machine = (find_book(None) if book is None else Book.make(book)).new_machine(name, checked)
    click.echo(f"wrote {machine.folder / 'machine.toml'}")
    if scenario is not None:
        command = ("stepdiag", *context.command_path.split()[1:], name)
        path = machine.write("scenarios", "scenario.toml", scenario, command=command)
        click.echo(f"wrote {path}")


def _new_scenario(
    volume: tuple[float, float, float],
    chain: str | None,
    head: str | None,
    distance_noise: float | None,
    tilt_noise: float | None,
) -> str:
    """The text. Raises InvalidArgument for what no scenario may have."""
    from stepdiag.config.scenario_template import short_template
    from stepdiag.head.description import find_shipped_head
    from stepdiag.scenario.description import parse_scenario

    if head is not None:
        find_shipped_head(head)
    stated = {
        **{("volume", f"{axis}_mm"): travel for axis, travel in zip("xyz", volume, strict=True)},
        ("machine", "chain"): chain,
        ("noise", "distance_um"): distance_noise,
        ("noise", "tilt_urad"): tilt_noise,
    }
    text = short_template(head, {place: value for place, value in stated.items() if value is not None})
    parse_scenario(text, "scenario.toml")
    return text


@book.command("list", short_help="List the machines.", epilog="\b\nExample: stepdiag book list")
@BOOK
def list_machines(book: Path | None) -> None:
    """List the machines: last calibration, verdict of its fit, largest error against the limit, when due."""
    from stepdiag.book.blocks import machines_blocks
    from stepdiag.book.book import find_book
    from stepdiag.book.overview import overview
    from stepdiag.presentation.blocks import text_of

    found = find_book(book)
    rows = []
    for machine in found.machines():
        with Progress(f"files of {machine.name}") as progress:
            rows.append(overview(machine, progress=progress))
    for line in text_of(machines_blocks(rows)):
        say(line)
    _tell_index(found)


@book.command(short_help="Show a machine and its files.", epilog="\b\nExample: stepdiag book show VMC-1200")
@click.argument("machine")
@click.option("--removed", is_flag=True, help="Also list the files in the bin.")
@BOOK
def show(machine: str, removed: bool, book: Path | None) -> None:
    """Show what is known of MACHINE, its calibrations in the order of time, and its files."""
    from stepdiag.book.blocks import machine_blocks
    from stepdiag.book.book import find_book
    from stepdiag.book.overview import overview
    from stepdiag.presentation.blocks import text_of

    found = find_book(book).machine(machine)
    with Progress(f"files of {found.name}") as progress:
        row = overview(found, progress=progress)
    entries = found.entries(removed=removed)
    for line in text_of(machine_blocks(row, entries)):
        say(line)
    _tell_index(found.book)


@book.command(short_help="Show how a machine changes.", epilog="\b\nExample: stepdiag book trend VMC-1200")
@click.argument("machine")
@BOOK
def trend(machine: str, book: Path | None) -> None:
    """Show how MACHINE changes from calibration to calibration, and when it is due.

    Largest error in the volume, squarenesses, slopes of positioning and temperatures: their change a
    year with its expanded uncertainty, and significant changes. Due is the first day on which the
    trend of the largest error may reach the limit, but not later than the stated interval.
    """
    from stepdiag.book.blocks import trend_blocks
    from stepdiag.book.book import find_book
    from stepdiag.book.overview import overview
    from stepdiag.book.trend import trends
    from stepdiag.presentation.blocks import text_of

    found = find_book(book).machine(machine)
    with Progress(f"files of {found.name}") as progress:
        row = overview(found, progress=progress)
    for line in text_of(trend_blocks(trends(found.listed("calibrations")), row.due)):
        say(line)
    _tell_index(found.book)


@book.command(
    short_help="Take in files.", epilog="\b\nExample: stepdiag book add --machine VMC-1200 scenario.toml run.csv"
)
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@_MACHINE
@click.option("--measured", metavar="DATE", help="Day of the measurement, such as 2026-03-31.")
@BOOK
@click.pass_context
def add(context: click.Context, files: tuple[Path, ...], machine: str, measured: str | None, book: Path | None) -> None:
    """Copy each FILE into the book: scenarios, runs, calibrations, exports, reports, any document.

    A scenario comes with the files that it names. A damaged file is refused. A file that the book
    already has is not taken in again.
    """
    from stepdiag.book.book import find_book

    if measured is not None and not _DAY.fullmatch(measured):
        raise InvalidArgument(f"--measured: expected a day such as 2026-03-31, got {measured!r}")
    found = find_book(book).machine(machine)
    command = ("stepdiag", "book", "add", "--machine", found.name)
    refused = 0
    for file in files:
        try:
            with Progress(f"add {file.name}"):
                entry, is_new = found.add(file, command=(*command, str(file)), measured=measured or "")
        except InvalidArgument as error:  # the others are taken in
            tell("error", str(error))
            refused += 1
            continue
        say(f"{file}: {'kept as' if is_new else 'already in the book as'} {entry.file}")
        for warning in entry.facts.warnings:
            tell("warning", f"{file}: {warning}")
    if refused:
        context.exit(2)


@book.command(short_help="Search machines and files.", epilog="\b\nExample: stepdiag book find 0815")
@click.argument("words", nargs=-1, required=True, metavar="WORD...")
@BOOK
def find(words: tuple[str, ...], book: Path | None) -> None:
    """List the machines and files in which every WORD occurs: names, serial numbers, dates, verdicts."""
    from stepdiag.book.book import Entry, find_book

    found = list(find_book(book).find(words))
    for one in found:
        if isinstance(one, Entry):
            say(f"{one.machine}: {one.file}: {one.kind or 'file'} of {one.date[:10]}")
        else:
            about = [text for text in (one.about.title, one.about.serial_number, one.about.customer) if text]
            say(f"{one.name}: machine{': ' if about else ''}{', '.join(about)}")
    if not found:
        tell("note", f"nothing in the book has {' and '.join(words)}")


@book.command(short_help="Move a file into the bin.", epilog="\b\nExample: stepdiag book remove --machine M run.csv")
@click.argument("name")
@_MACHINE
@BOOK
def remove(name: str, machine: str, book: Path | None) -> None:
    """Move the file NAME of a machine into the bin. `stepdiag book restore` moves it back."""
    _move(name, machine, book, restored=False)


@book.command(short_help="Move a file back.", epilog="\b\nExample: stepdiag book restore --machine M run.csv")
@click.argument("name")
@_MACHINE
@BOOK
def restore(name: str, machine: str, book: Path | None) -> None:
    """Move the file NAME of a machine back from the bin."""
    _move(name, machine, book, restored=True)


def _move(name: str, machine: str, book: Path | None, *, restored: bool) -> None:
    from stepdiag.book.book import find_book

    found = find_book(book).machine(machine)
    entry = found.entry(name, removed=restored)
    verb, move = ("restore", found.restore) if restored else ("remove", found.remove)
    say(f"moved to {move(entry, command=('stepdiag', 'book', verb, '--machine', found.name, name))}")


@book.command(short_help="Make the index again.", epilog="\b\nExample: stepdiag book reindex")
@BOOK
def reindex(book: Path | None) -> None:
    """Make book.sqlite again from the files."""
    from stepdiag.book.book import find_book

    found = find_book(book)
    with Progress("machines") as progress:
        count = found.reindex(progress)
    say(f"{count} files of {len(found.machines())} machines")
    _tell_index(found)


def _tell_index(found: Any) -> None:
    if found.index.only_in_memory:
        tell("note", found.index.only_in_memory)


@click.command(epilog="\b\nExample: stepdiag app calibrations")
@click.argument("book", type=PATH, required=False)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    help="Port on this computer, 127.0.0.1.  [default: a free one]",
)
@click.option("--browser/--no-browser", default=True, show_default=True, help="Open the page in the browser.")
def app(book: Path | None, port: int, browser: bool) -> None:
    """Open the machine book BOOK as pages in your browser; a new or empty folder begins a book.

    The pages come from this computer alone, and no other computer can open them. The address that is
    printed lets a browser in. Ctrl-C ends the application; what its commands have written stays.
    """
    from stepdiag.app.dependencies import check_installed
    from stepdiag.book.book import Book, find_book
    from stepdiag.platform import open_browser

    check_installed()
    from stepdiag.app.server import serve

    folder = find_book(None).folder if book is None else Book.make(book).folder

    def opened(address: str) -> None:
        click.echo(f"{folder}: {address} (Ctrl-C ends)")
        sys.stdout.flush()
        if browser:
            open_browser(address)

    serve(folder, port, opened)
