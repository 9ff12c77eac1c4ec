"""The order in which a run is measured: what the measuring program moves through, and what readings are taken in."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from stepdiag._core import Plan
from stepdiag.scenario.known import Known, runs_of


@dataclass(frozen=True)
class Visit:
    """One way along a line. Head and mirror stay as they are while `set_up` stays the same."""

    number: int  # from 1
    set_up: int  # from 1: the place of the line among the plan's lines and scale lines
    run: int
    line: str
    direction: Literal["forward", "backward"]
    is_scale_line: bool
    points: npt.NDArray[np.int_]  # (n,) in the order in which they are read: of a backward visit they descend
    positions: npt.NDArray[np.float64]  # (n, 3) commanded, mm
    approach: npt.NDArray[np.int_]  # (3,) +1 or -1: how the axes come to every point, the first included


def visits_of(known: Known) -> Iterator[Visit]:
    """The visits of a scenario's plan, in the order of the rows that `simulate` makes: lines, then scale lines; of each
    its runs, and with `backward` after each forward run its backward one."""
    keys, plan = known.keys.plan, known.plan
    runs = runs_of(keys) * (2 if keys.backward else 1)
    number = 0
    for set_up, line in enumerate([*plan.lines, *plan.scale_lines], start=1):
        for run in range(runs):
            number += 1
            yield _visit(plan, number, set_up, run, line, backward=keys.backward and run % 2 == 1)


def _visit(plan: Plan, number: int, set_up: int, run: int, line: str, *, backward: bool) -> Visit:
    positions = plan.points(line, run)
    points = np.arange(len(positions))
    travel = np.array([-1 if sign == "n" else 1 for sign in line])
    moved = np.array([sign != "0" for sign in line])
    return Visit(
        number=number,
        set_up=set_up,
        run=run,
        line=line,
        direction="backward" if backward else "forward",
        is_scale_line=line in plan.scale_lines,
        points=points[::-1] if backward else points,
        positions=positions[::-1] if backward else positions,
        approach=np.where(moved, -travel if backward else travel, 1),
    )
