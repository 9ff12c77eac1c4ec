"""The visits of a scenario's run: what the measuring program moves through, and what readings are taken in."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

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
    """The passes of a scenario's plan (`Plan.passes`), numbered."""
    keys, plan = known.keys.plan, known.plan
    for number, planned in enumerate(plan.passes(runs_of(keys), backward=keys.backward), start=1):
        yield Visit(
            number=number,
            set_up=planned.line_index + 1,
            run=planned.run,
            line=planned.line,
            direction="backward" if planned.direction == "backward" else "forward",
            is_scale_line=planned.line in plan.scale_lines,
            points=planned.points,
            positions=planned.positions,
            approach=planned.approach,
        )
