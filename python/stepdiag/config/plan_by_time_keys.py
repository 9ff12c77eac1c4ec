"""The keys of a scenario that say how long measuring takes, and which plans to choose from: `[plan_by_time]`."""

from typing import Annotated, Final

from pydantic import Field

from stepdiag._core import Plan, largest_repeat_count
from stepdiag.config.key_types import POSITIVE, Positive, Section, key

USUAL_STEPS: Final = (5, 10, 20, 50, 100)
USUAL_REPEATS: Final = (1, 2, 4)

Duration = Annotated[float, Field(ge=0.0, le=1e6)]
Count = Annotated[int, Field(ge=1, le=Plan.largest_step_count)]
Repeats = Annotated[int, Field(ge=1, le=largest_repeat_count)]

_duration = "a time of at least 0"


class PlanByTimeSection(Section):
    """Times of moves and readings, for `plan` and `nc`, and the plans from which `plan` chooses.

    Head, order, uncertainties and unknowns of all plans are those of the scenario, and backward runs unless
    `[adjustment] reversal = false`."""

    minutes: Positive = key(POSITIVE, "The time available for measuring, set-ups included.", 30.0)
    feed_mm_per_min: Positive = key(POSITIVE, "Feed of all moves, along a straight line.", 6000.0)
    acceleration_mm_per_s2: Positive = key(POSITIVE, "Acceleration, and deceleration, of all moves.", 1000.0)
    seconds_per_mm: Positive | None = key(
        POSITIVE, "Time of a move by its length, in place of feed and acceleration.", None, 0.01
    )
    settle_s: Duration = key(_duration, "Waiting after each move, before a reading.", 1.0)
    measure_s: Duration = key(_duration, "A reading.", 1.0)
    line_change_min: Duration = key(_duration, "Setting up head and mirror for a line.", 3.0)
    scale_line_change_min: Duration | None = key(
        _duration, "Setting up for a scale line; by default as for the others.", None, 3.0
    )
    steps: Annotated[tuple[Count, ...], Field(min_length=1)] = key(
        f"a list of integers from 1 to {Plan.largest_step_count}",
        "Numbers of steps per axis to choose from, beside that of the scenario.",
        USUAL_STEPS,
    )
    repeats: Annotated[tuple[Repeats, ...], Field(min_length=1)] = key(
        f"a list of integers from 1 to {largest_repeat_count}",
        "How often each line is measured: numbers to choose from, beside that of the scenario.",
        USUAL_REPEATS,
    )
    line_sets: tuple[Annotated[tuple[str, ...], Field(min_length=1)], ...] | None = key(
        'a list of sets of lines such as ["ppp", "npp", "pnp", "p00"]',
        "The only sets of lines to choose from, beside that of the scenario; single axes in them are scale lines. By "
        "default `plan` searches all sets of body and face diagonals, single axes and scale lines.",
        None,
        [["ppp", "npp", "pnp", "nnp", "p00", "0p0"], ["pp0", "np0", "p0p", "n0p", "0pp", "0np"]],
    )
