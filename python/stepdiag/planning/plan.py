"""`plan`: the best plan for the available time."""

from collections.abc import Callable

from stepdiag.planning.best_plan import best_plans
from stepdiag.planning.plan_by_time import Choice, Family, aim_of, choose, squareness_goal, volume_goal
from stepdiag.scenario.description import Scenario
from stepdiag.units import MICROMETRE, MICRORADIAN
from stepdiag.wrong_arguments import checked


@checked
def plan(
    scenario: Scenario,
    *,
    minutes: float | None = None,
    spacing: float | None = None,
    best_at: Family = "volume",
    volume_u: float | None = None,
    squareness_u: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Choice:
    """Find the best plan for the available time, or the shortest one that reaches goals, as the command `plan` does.

    `taken` of the result has the lines, steps and repeats in `candidate`, the time and the uncertainties; it is None
    where no plan is fast enough. Head, uncertainties, unknowns and times are those of the scenario.

    Args:
        scenario: what is measured with what; its own plan is one of those that are looked at.
        minutes: the available time, set-ups included; none: [plan_by_time] minutes, or with goals any.
        spacing: how far nodes may be apart, mm; none: as far as those of the scenario's plan.
        best_at: what is to be most certain: "volume", "length", "angle", "squareness", or "faults".
        volume_u: goal: standard uncertainty of the functional point in the volume, mm.
        squareness_u: goal: standard uncertainty of the squarenesses, rad.
        progress: called with the number of parts that are done, and of all.

    Raises:
        InvalidArgument: the scenario names lines that do not exist, or an argument is not valid.
    """
    goals = [
        *([volume_goal(volume_u / MICROMETRE)] if volume_u is not None else []),
        *([squareness_goal(squareness_u / MICRORADIAN)] if squareness_u is not None else []),
    ]
    aim = aim_of(scenario.known, minutes=minutes, spacing=spacing, family=best_at, goals=goals)
    return choose(best_plans(scenario, aim, progress=progress), aim)
