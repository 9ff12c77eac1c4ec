"""The command that chooses a plan for the available time."""

import math
from pathlib import Path
from typing import Any, Literal

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.options import PATH, Writes, tell_inputs, tell_trust
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import FIGURE, PLANS, OutputFile
from stepdiag.progress import Progress
from stepdiag.units import MICROMETRE

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
@click.option(
    "--recheck",
    "baseline",
    type=PATH,
    metavar="BASELINE",
    help="Choose a short run that shows whether the machine has changed since this calibration (netCDF).",
)
@click.option(
    "--limit",
    type=_POSITIVE,
    metavar="UM",
    help="With --recheck: change of the tool's position that matters, in µm.  [default: the largest expanded "
    "uncertainty of the calibration]",
)
def plan(
    scenario: Path,
    minutes: float | None,
    spacing: float | None,
    family: Family,
    output: OutputFile | None,
    baseline: Path | None,
    limit: float | None,
) -> None:
    """Choose the plan to measure in the available time.

    Uses head, uncertainties and unknowns of SCENARIO, and the times in its section [plan_by_time].
    For numbers of steps, sets of lines and repeats it calculates the measuring time, set-ups
    included, and the largest standard uncertainties of an adjustment, for a machine with the errors
    of [machine.random].

    The table contains the plans that no other plan beats in time, in distance between nodes and in
    uncertainty (see --for). More steps resolve more, but take longer and make each value less
    certain, because it is a sum over more steps.

    With --recheck it chooses the plan for `stepdiag recheck`: for each plan the smallest change of
    each kind that is seen, with the changes of [change]. Its points are nodes of the calibration.
    """
    if limit is not None and baseline is None:
        raise InvalidArgument("--limit: expected --recheck as well")
    if baseline is not None:
        _plan_recheck(scenario, baseline, minutes, limit, output)
        return
    from stepdiag.io.whole_files import write_whole
    from stepdiag.planning.plan_by_time import choose, outcomes, own_spacing, telling
    from stepdiag.report.plan_by_time import advice, fault_advice, left_out_rows, plan_csv, plan_rows
    from stepdiag.scenario.description import read_scenario

    described = read_scenario(scenario)
    tell_inputs(described)
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


def _plan_recheck(
    scenario: Path, baseline: Path, minutes: float | None, limit: float | None, output: OutputFile | None
) -> None:
    from stepdiag.config.toml_text import located
    from stepdiag.io.data_files import read_calibration
    from stepdiag.io.whole_files import check_input, write_whole
    from stepdiag.planning.recheck_plans import choose, own_limit, powers
    from stepdiag.rechecking.verification import ALPHA
    from stepdiag.report.recheck_plans import recheck_advice, recheck_plan_csv, recheck_plan_rows
    from stepdiag.scenario.description import read_scenario

    check_input(baseline)
    described = read_scenario(scenario)
    tell_inputs(described)
    path = None if output is None else output.claim(scenario, baseline, error_map=described.truth.error_map)
    before = read_calibration(baseline)
    available = described.known.keys.plan_by_time.minutes if minutes is None else minutes
    with located(str(baseline)), Progress("plans") as progress:
        found = powers(described, before, available, progress=progress)
        matters = own_limit(before) if limit is None else limit * MICROMETRE
    for line in (
        *recheck_plan_rows(found, available, matters, ALPHA),
        *recheck_advice(found, available, matters),
    ):
        say(line)
    suffix = "" if path is None else path.suffix.lower().lstrip(".")
    if path is not None and suffix == "csv":
        write_whole(path, recheck_plan_csv(found, matters))
    elif path is not None:
        from stepdiag.figures.recheck_plans import draw_powers

        write_whole(path, draw_powers(found, choose(found, available, matters), available, suffix))
    tell_trust(click.get_current_context(), baseline, before)
