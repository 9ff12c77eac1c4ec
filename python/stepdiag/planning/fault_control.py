"""Which faults of its readings a plan controls, and what more in the plan would do about the others."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from stepdiag._core import FaultControl, InvalidArgument
from stepdiag.planning.measuring_time import measuring_time, times_of
from stepdiag.planning.observation import not_measured, observe
from stepdiag.scenario.known import Known, runs_of
from stepdiag.units import MINUTE

# Of each plane one face diagonal; the other one does as well.
FACES: Final = (("pp0", "np0"), ("p0p", "n0p"), ("0pp", "0np"))


@dataclass(frozen=True)
class Extension:
    """A plan with more in it: the faults that it controls, and the minutes that it takes more. `trouble`: why there are
    none."""

    name: str
    minutes: float
    controls: Sequence[FaultControl]
    trouble: str = ""


def distinguishes_all(controls: Sequence[FaultControl]) -> bool:
    """Whether each fault that is found is distinguished from all others, and none is uncontrolled."""
    return not any(c.twins or c.uncontrolled for c in controls)


def extensions(known: Known) -> Iterator[Extension]:
    """The plan with three face diagonals, and with everything measured twice as often: what each of them controls is
    found from a run of it."""
    plan = known.keys.plan
    faces = [first for first, second in FACES if not {first, second} & {*plan.lines}]
    if faces:
        yield _extended(known, f"with {', '.join(faces)} in it", {"lines": (*plan.lines, *faces)})
    often = "twice" if plan.repeats == 1 else f"{2 * plan.repeats} times"
    yield _extended(known, f"with every line measured {often}", {"repeats": 2 * plan.repeats})


def _extended(known: Known, name: str, changes: Mapping[str, Any]) -> Extension:
    try:
        larger = not_measured(known, changes)
        return Extension(name, minutes(larger) - minutes(known), observe(larger)[1].reliability)
    except InvalidArgument as error:
        return Extension(name, 0.0, (), str(error))


def minutes(known: Known) -> float:
    """How long the plan takes, by the scenario's [plan_by_time]."""
    plan = known.keys.plan
    times = times_of(known.keys.plan_by_time, f"{known.path}: plan_by_time")
    return measuring_time(known.plan, times, repeats=runs_of(plan), backward=plan.backward)[0] / MINUTE
