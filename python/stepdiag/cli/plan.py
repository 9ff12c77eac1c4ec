"""The command that chooses a plan for the available time."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.in_book import Kept, OfMachine
from stepdiag.cli.options import PATH, Writes, tell_inputs, tell_trust
from stepdiag.cli.terminal import say
from stepdiag.io.outputs import FIGURE, PLANS, SCENARIO, OutputFile
from stepdiag.progress import Progress
from stepdiag.units import MICROMETRE

if TYPE_CHECKING:
    from stepdiag.config.plan_by_time_keys import PlanByTimeSection
    from stepdiag.planning.plan_by_time import Aim, Outcome
    from stepdiag.scenario.description import Scenario
    from stepdiag.scenario.known import Known

Family = Literal["volume", "length", "angle", "squareness", "faults"]


class _Positive(click.FloatRange):
    """FloatRange accepts NaN; this type does not."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail("expected a positive number, got nan", param, ctx)
        return number


_POSITIVE = _Positive(min=0.0, min_open=True, max=1e9)


@click.command(
    cls=OfMachine,
    makes={"output": Kept("plans"), "written": Kept("scenarios")},
    epilog="\b\nExample: stepdiag plan scenario.toml --minutes 30 -o plan.png",
)
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
    type=click.Choice(["volume", "length", "angle", "squareness", "faults"]),
    default="volume",
    show_default=True,
    help="Minimise the largest standard uncertainty of the functional point in the volume, or of a family (length: "
    "positioning and straightness); faults: leave the fewest faults of readings unseen.",
)
@click.option(
    "--volume-u",
    type=_POSITIVE,
    metavar="UM",
    help="The shortest plan with at most this standard uncertainty (µm) of the functional point in the volume.",
)
@click.option(
    "--squareness-u",
    type=_POSITIVE,
    metavar="URAD",
    help="The shortest plan with at most this standard uncertainty (µrad) of the squarenesses.",
)
@click.option(
    "--decide",
    type=_POSITIVE,
    metavar="UM",
    help="The shortest plan that shows with 95 % whether the largest error is within this limit (µm), for machines "
    "with 0.8 of it and with 1.25 of it.",
)
@click.option(
    "--from",
    "measured",
    type=PATH,
    metavar="RUN.raw.jsonl",
    help="Take set-up, settling and reading times from this acquisition, in place of [plan_by_time].",
)
@click.option(
    "-o",
    "output",
    type=Writes(*FIGURE, PLANS),
    metavar="FILE",
    help="Also draw the curve (.png, .svg, .pdf) or write all plans (.csv).",
)
@click.option(
    "--write",
    "written",
    type=Writes(SCENARIO),
    metavar="FILE",
    help="Also write the scenario with the advised plan (.toml). Its comments are kept.",
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
    volume_u: float | None,
    squareness_u: float | None,
    decide: float | None,
    measured: Path | None,
    output: OutputFile | None,
    written: OutputFile | None,
    baseline: Path | None,
    limit: float | None,
) -> None:
    """Find the best plan for the available time, or the shortest plan for a goal.

    Uses head, uncertainties and unknowns of SCENARIO, and the times in its section [plan_by_time].
    Searches sets of lines (body and face diagonals, single axes, scale lines), numbers of steps,
    repeats, and where scale lines are read. Calculates the measuring time, set-ups included, and the
    largest standard uncertainties of an adjustment, for a machine with the errors of
    [machine.random].

    The table contains the plans that no other plan beats in time and in uncertainty (see --for), and
    with fewer steps the best ones in the time. More steps resolve more, but take longer and make
    each value less certain, because it is a sum over more steps.

    --volume-u, --squareness-u and --decide ask for the shortest plan that reaches them all; with
    --minutes, within this time.

    With --recheck it chooses the plan for `stepdiag recheck`: for each plan the smallest change of
    each kind that is seen, with the changes of [change]. Its points are nodes of the calibration.
    """
    if limit is not None and baseline is None:
        raise InvalidArgument("--limit: expected --recheck as well")
    if baseline is not None:
        of_new_plans = {
            "--volume-u": volume_u,
            "--squareness-u": squareness_u,
            "--decide": decide,
            "--from": measured,
            "--write": written,
        }
        for name, value in of_new_plans.items():
            if value is not None:
                raise InvalidArgument(f"{name}: not together with --recheck")
        _plan_recheck(scenario, baseline, minutes, limit, output)
        return
    from stepdiag.io.whole_files import check_input, write_whole
    from stepdiag.planning.plan_by_time import aim_of, deciding_goal, own_candidate, squareness_goal, volume_goal
    from stepdiag.planning.scenario_with_plan import scenario_with_plan
    from stepdiag.presentation.plan_by_time import plan_csv
    from stepdiag.scenario.description import read_scenario

    described = read_scenario(scenario)
    known = described.known
    inputs = [scenario]
    if measured is not None:
        check_input(measured)
        inputs.append(measured)
    tell_inputs(described)
    path = None if output is None else output.claim(*inputs, error_map=described.truth.error_map)
    new = None if written is None else written.claim(*inputs, error_map=described.truth.error_map)
    if new is not None:
        scenario_with_plan(known, own_candidate(known), new)  # refused before the search, not after it
    goals = [
        *([volume_goal(volume_u)] if volume_u is not None else []),
        *([squareness_goal(squareness_u)] if squareness_u is not None else []),
        *([deciding_goal(decide, known.between_nodes)] if decide is not None else []),
    ]
    times = None if measured is None else _times_of(measured, known)
    aim = aim_of(known, minutes=minutes, spacing=spacing, family=family, goals=goals)
    found = _searched(described, aim, times)
    taken = _say_choice(described, aim, found)
    if new is not None and taken is None:
        raise InvalidArgument(f"{new}: not written, for no plan is advised")
    if new is not None and taken is not None:
        write_whole(new, scenario_with_plan(known, taken.candidate, new))
    suffix = "" if path is None else path.suffix.lower().lstrip(".")
    if path is not None and suffix == "csv":
        write_whole(path, plan_csv(found, family))
    elif path is not None:
        from stepdiag.figures.plan_by_time import draw_plans

        own = next((one for one in found if one.candidate == own_candidate(known)), None)
        write_whole(path, draw_plans(found, taken, aim.minutes, suffix, family=family, own=own))


def _times_of(measured: Path, known: "Known") -> "PlanByTimeSection":
    """The times that an acquisition took, shown beside those of the scenario."""
    from stepdiag.acquisition.times_of_run import key_rows, measured_times

    taken_from = measured_times(measured, known.keys.plan_by_time, f"{known.path}: plan_by_time")
    for row in key_rows(taken_from):
        say(row)
    return taken_from.keys


def _searched(described: "Scenario", aim: "Aim", times: "PlanByTimeSection | None") -> "list[Outcome]":
    """All plans, those of the table with their faults."""
    from stepdiag.planning.best_plan import best_plans
    from stepdiag.planning.plan_by_time import choose, with_faults
    from stepdiag.presentation.plan_by_time import shown

    with Progress("plans") as progress:
        found = best_plans(described, aim, times=times, progress=progress)
    rows = shown(found, choose(found, aim), aim)
    with Progress("faults of the plans in the table") as progress:
        for done, one in enumerate(rows, 1):
            if one.minutes <= aim.minutes:
                tested = with_faults(described, one)
                found = [tested if other is one else other for other in found]
            progress(done, len(rows))
    return found


def _say_choice(described: "Scenario", aim: "Aim", found: "list[Outcome]") -> "Outcome | None":
    """Show the table and the advice. Returns the plan that is advised."""
    from stepdiag.planning.plan_by_time import choose, distinguishing, own_candidate
    from stepdiag.presentation.plan_by_time import (
        advice,
        fault_advice,
        inputs_row,
        left_out_rows,
        line_names,
        own_row,
        plan_rows,
        shown,
    )

    choice = choose(found, aim)
    own = own_candidate(described.known)
    for line in (
        inputs_row(described.known),
        "largest standard uncertainties by measuring time, for a machine with usual errors (lines: body diagonals/face",
        "diagonals/single axes/scale lines; found: smallest wrong distance that is found; kinds: kinds of faults",
        "that are distinguished):",
        *plan_rows(shown(found, choice, aim), choice, aim),
        *left_out_rows(found),
        *(own_row(one) for one in found if one.candidate == own),
        *advice(found, aim),
    ):
        say(line)
    if choice.taken is not None:
        say(f"  {line_names(choice.taken)}")
        with Progress("plans that distinguish all faults"):
            extended = distinguishing(described, found, choice.taken, aim.family)
        for line in fault_advice(*extended):
            say(line)
    return choice.taken


def _plan_recheck(
    scenario: Path, baseline: Path, minutes: float | None, limit: float | None, output: OutputFile | None
) -> None:
    from stepdiag.config.toml_text import located
    from stepdiag.io.data_files import read_calibration
    from stepdiag.io.whole_files import check_input, write_whole
    from stepdiag.planning.recheck_plans import choose, own_limit, powers
    from stepdiag.presentation.recheck_plans import recheck_advice, recheck_plan_csv, recheck_plan_rows
    from stepdiag.rechecking.verification import ALPHA
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
