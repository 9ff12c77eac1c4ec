"""What two diagonals leave open is the same for any number of steps, also where it is too much to look at each."""

import numpy as np
import pytest

import stepdiag as sd
from stepdiag import _core

VOLUME = (800.0, 600.0, 500.0)


def known(lines: list[str], scale_lines: list[str], steps: int) -> tuple[object, ...]:
    plan = sd.Plan(VOLUME, lines, steps, scale_lines=scale_lines)
    machine = sd.Machine("[w X' b Y Z t]", sd.random_error_map(VOLUME, seed=7, intervals=10))
    run = _core.simulate(machine, plan, sd.Head())
    found = _core.adjust(run, plan, sd.Head(), machine.chain, np.zeros(3), _core.AdjustmentOptions())
    of = found.calibration
    points = {name: len(position) / (steps + 1) for name, (position, _, _) in of.functions.items()}
    sums = [(one.line, one.component, [name for _, name in one.terms]) for one in found.combinations]
    whole = {name for name, share in points.items() if share == 1.0}
    return set(points), whole, set(of.squareness), sorted(of.undetermined_slopes), sums


@pytest.mark.parametrize(
    ("lines", "scale_lines"), [(["ppp", "npp"], ["p00", "0p0", "00p"]), (["ppp", "npp"], []), (["pp0", "np0"], ["00p"])]
)
def test_many_steps_leave_open_what_few_do(lines: list[str], scale_lines: list[str]) -> None:
    assert known(lines, scale_lines, 200) == known(lines, scale_lines, 40)
