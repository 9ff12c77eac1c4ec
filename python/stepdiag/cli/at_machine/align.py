"""The command that aligns head and mirror."""

from pathlib import Path
from typing import Any

import click

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.options import AcquireOptions
from stepdiag.acquisition.settling import Settling
from stepdiag.cli.at_machine.operators import Terminal, Watched
from stepdiag.cli.in_book import OfMachine
from stepdiag.cli.interrupts import unwinding
from stepdiag.cli.options import NOT_TO_BE_TRUSTED, PATH, made_of, options_of, tell


@click.command(
    cls=OfMachine,
    epilog="\b\nExample: stepdiag align scenario.toml --source ids3010://192.168.1.1 --line ppp",
)
@click.argument("scenario", type=PATH)
@click.option(
    "--source",
    metavar="URL",
    required=True,
    help="The instrument, as `stepdiag acquire` has it.",
)
@click.option("--line", "lines", multiple=True, metavar="LINE", help="Only this line; may be given again.")
@options_of(AcquireOptions, only=("axes", "sign", "timeout"))
@click.option(
    "--watched",
    is_flag=True,
    help="Questions are answered by whoever watches .align.live.json, not at standard input.",
)
def align(scenario: Path, source: str, lines: tuple[str, ...], watched: bool, **given: Any) -> None:
    """Align head and mirror of SCENARIO's lines, one after the other.

    Says where both go, reads at six places of the machine, and says what to turn until laser and
    mirror are within what the plan takes for granted. Nothing is written.
    """
    from stepdiag.acquisition.acquire import instrument_of
    from stepdiag.acquisition.conductor import Conductor
    from stepdiag.alignment.loop import AlignmentLoop, first_visits
    from stepdiag.scenario.description import read_scenario
    from stepdiag.scenario.order_of_run import visits_of

    known = read_scenario(scenario).known
    chosen = first_visits(visits_of(known), lines)
    unknown = [line for line in lines if line not in {visit.line for visit in chosen}]
    if unknown:
        raise InvalidArgument(f"--line: expected lines of the plan, got {unknown[0]!r}")
    options = made_of(AcquireOptions, given)
    operator = Watched() if watched else Terminal()
    with (
        unwinding(),
        instrument_of(source, known, options, operator.tell) as instrument,
        Conductor(instrument, operator, Path("align.raw.jsonl") if watched else None, options.sign) as conductor,
    ):
        settling = Settling(count=3, average=5)
        found = AlignmentLoop(known, instrument, conductor, settling, options.sign).run(chosen)
    astray = [line for line, fit in found.items() if not (fit.is_ready and fit.fits_mirror)]
    if astray:
        tell("warning", f"not aligned: {', '.join(astray)}")
        raise click.exceptions.Exit(NOT_TO_BE_TRUSTED)
