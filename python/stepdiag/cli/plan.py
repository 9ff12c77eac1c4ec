"""The command that chooses a plan for the available time."""

import math
from pathlib import Path
from typing import Any, Literal

import click

from stepdiag.cli.options import PATH, Writes
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import FIGURE, PLANS, OutputFile
from stepdiag.progress import Progress

Family = Literal["length", "angle", "squareness"]


class _Positive(click.FloatRange):
    """FloatRange accepts NaN; this type does not."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail("expected a positive number, got nan", param, ctx)
        return number


_POSITIVE = _Positive(min=0.0, min_open=True, max=1e9)


@click.command(epilog="\b\nExample: stepdiag plan scenario.toml --minutes 30 -o plan.png")
@click.argument("scenario", type=PATH)
@click.option(
    "--minutes",
    type=_POSITIVE,
    metavar="T",
    help="Available time.  [default: plan_by_time.minutes of the scenario, 30]",
)
@click.option(
    "--spacing",
    type=_POSITIVE,
    metavar="MM",
    help="Largest distance between the nodes of an axis.  [default: that of the scenario's plan]",
)
@click.option(
    "--for",
    "family",
    type=click.Choice(["length", "angle", "squareness"]),
    default="length",
    show_default=True,
    help="Minimise the largest standard uncertainty of this family; length: positioning and straightness.",
)
@click.option(
    "-o",
    "output",
    type=Writes(*FIGURE, PLANS),
    metavar="FILE",
    help="Also draw the curve (.png, .svg, .pdf) or write all plans (.csv).",
)
def plan(
    scenario: Path, minutes: float | None, spacing: float | None, family: Family, output: OutputFile | None
) -> None:
    """Choose the plan to measure in the available time.

    Uses head, uncertainties and unknowns of SCENARIO, and the times in its section [plan_by_time].
    For numbers of steps, sets of lines and repeats it calculates the measuring time, set-ups
    included, and the largest standard uncertainties of an adjustment, for a machine with the errors
    of [machine.random].

    The table contains the plans that no other plan beats in time, in distance between nodes and in
    uncertainty (see --for). More steps resolve more, but take longer and make each value less
    certain, because it is a sum over more steps.
    """
    from stepdiag.io.whole_files import write_whole
    from stepdiag.planning.plan_by_time import choose, outcomes, own_spacing, telling
    from stepdiag.report.plan_by_time import advice, fault_advice, left_out_rows, plan_csv, plan_rows
    from stepdiag.scenario.description import read_scenario

    described = read_scenario(scenario)
    path = None if output is None else output.claim(scenario, error_map=described.truth.error_map)
    available = described.known.keys.plan_by_time.minutes if minutes is None else minutes
    near = own_spacing(described.known) if spacing is None else spacing
    with Progress("plans") as progress:
        found = outcomes(described, progress)
    choice = choose(found, available, near, family)
    say("largest standard uncertainties by measuring time, for a machine with usual errors")
    say("(lines: body and face diagonals, single-axis and scale lines):")
    for line in plan_rows(found, choice, available, family):
        say(line)
    for line in [*left_out_rows(found), *advice(found, available, near, family)]:
        say(line)
    if choice.taken is not None:
        with Progress("faults of the chosen plan"):
            told = telling(described, found, choice.taken, family)
        for line in fault_advice(*told):
            say(line)
    suffix = "" if path is None else path.suffix.lower().lstrip(".")
    if path is not None and suffix == "csv":
        write_whole(path, plan_csv(found))
    elif path is not None:
        from stepdiag.figures.plan_by_time import draw_plans

        write_whole(path, draw_plans(found, choice.taken, available, suffix))
