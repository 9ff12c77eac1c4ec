"""Which short run to measure for a recheck: for lines, steps and repeats, how long each takes, and the smallest change
of each term that it shows, before anyone measures."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import Calibration, ChangesSeen, ChangeTerm, InvalidArgument, Plan
from stepdiag.calibration.volume import variances_in_volume
from stepdiag.config.scenario_keys import TruthKeys
from stepdiag.config.toml_text import located
from stepdiag.planning.measuring_time import measuring_time, times_of
from stepdiag.planning.observation import not_measured
from stepdiag.planning.plan_by_time import ALIKE, Candidate
from stepdiag.rechecking.recheck import changes_seen, hidden_by, moves_by
from stepdiag.rechecking.verification import ALPHA
from stepdiag.scenario.description import Scenario, simulate_scenario
from stepdiag.scenario.known import runs_of
from stepdiag.scenario.truth import truth_of
from stepdiag.units import MINUTE

POWER: Final = 0.95
FAR: Final = 2.0  # times the available time, up to which plans are looked at
IMPLAUSIBLE: Final = 2.0  # priors, beyond which a change counts no further
BEYOND: Final = 10.0  # priors: such a change is not one of those that are looked for

_DIAGONALS: Final = ("ppp", "npp", "pnp", "nnp")
_SCALES: Final = ("p00", "0p0", "00p")
_USUAL_SETS: Final = (
    (_DIAGONALS[:1], ()),
    (("pp0",), ()),
    *(((_DIAGONALS[0], other), ()) for other in _DIAGONALS[1:]),
    (_DIAGONALS[:3], ()),
    (("pp0", "p0p", "0pp"), ()),
    (_DIAGONALS, ()),
    (_DIAGONALS[:1], _SCALES),
    (_DIAGONALS, _SCALES),
    (("pp0", "np0", "p0p", "n0p", "0pp", "0np"), ()),
)


@dataclass(frozen=True)
class Power:
    """What a plan shows of changes, false alarms having the probability ALPHA. By term, in the order of `terms`:
    `smallest`: the change, of this term alone, that is seen with the probability POWER, in the unit of its prior; inf:
    none; `gains`: how far a change of 1 moves the tool where it moves it most, mm. `hidden`: as Judged has it, mm.
    `trouble`: why there is none of all this."""

    candidate: Candidate
    seconds: float
    terms: Sequence[ChangeTerm] = ()
    smallest: Sequence[float] = ()
    gains: tuple[float, ...] = ()
    hidden: float = math.inf
    trouble: str = ""

    @property
    def minutes(self) -> float:
        return self.seconds / MINUTE

    @property
    def moves(self) -> list[float]:
        """How far the smallest changes that are seen move the tool, mm; by term."""
        return [s * gain if gain > 0.0 else 0.0 for s, gain in zip(self.smallest, self.gains, strict=True)]

    def worst(self, kind: str) -> float:
        """The smallest change that is seen of that parameter of a kind of which it is largest; inf where it is beyond
        what the priors allow."""
        of_kind = [(s, term.prior) for s, term in zip(self.smallest, self.terms, strict=True) if term.kind == kind]
        return max((s if s < BEYOND * prior else math.inf for s, prior in of_kind), default=math.inf)

    def unseen(self, limit: float) -> list[ChangeTerm]:
        """The terms of which a change that moves the tool by `limit`, mm, may stay unseen."""
        return [term for term, move in zip(self.terms, self.moves, strict=True) if not move <= limit]

    @cached_property
    def left(self) -> float:
        """Root of the square sum of how far the tool may move unseen by each term, as far as priors allow it, mm."""
        allowed = [IMPLAUSIBLE * term.prior for term in self.terms]
        return math.hypot(
            *(min(s, most) * gain for s, most, gain in zip(self.smallest, allowed, self.gains, strict=True))
        )


def own_limit(baseline: Calibration) -> float:
    """The expanded uncertainty (k = 2) of the calibration where it is largest in the volume, mm: a smaller change
    hardly matters."""
    assert baseline.covariance is not None
    return 2.0 * float(np.sqrt(variances_in_volume(baseline).max()))


def candidates(scenario: Scenario, baseline: Calibration, minutes: float) -> list[tuple[float, Candidate]]:
    """Time in s, and plan, of all that take at most FAR times so long and whose points are nodes of the baseline; of
    repeats and sets of lines those of [plan_by_time]. Raises InvalidArgument where there are none."""
    known = scenario.known
    keys = known.keys.plan_by_time
    plan = known.plan
    sets = {(tuple(plan.lines), tuple(plan.scale_lines)): None}
    for lines in keys.line_sets or ():
        measured = tuple(line for line in lines if line.count("0") != 2)
        sets[measured, tuple(line for line in lines if line.count("0") == 2)] = None
    sets |= dict.fromkeys(_USUAL_SETS if keys.line_sets is None else ())
    times = times_of(keys, f"{known.path}: plan_by_time")
    runs = runs_of(known.keys.plan) // known.keys.plan.repeats
    found = []
    for lines, scale_lines in sets:
        for steps in common_steps(baseline):
            with located(f"{known.path}: plan_by_time.line_sets"):
                points = plan.scale_points if scale_lines else "ends"
                planned = Plan(
                    plan.volume,
                    list(lines),
                    steps,
                    order=plan.orders,
                    scale_lines=list(scale_lines),
                    scale_points=points,
                )
            for repeats in sorted({*keys.repeats, known.keys.plan.repeats}):
                seconds, _ = measuring_time(planned, times, repeats=repeats * runs, backward=known.keys.plan.backward)
                if seconds <= FAR * minutes * MINUTE:
                    found.append((seconds, Candidate(lines, scale_lines, steps, repeats)))
    if not found:
        raise InvalidArgument(
            f"{known.path}: no plan fits {FAR * minutes:g} minutes: see line_change_min and the other times of "
            "[plan_by_time]"
        )
    return sorted(found, key=lambda one: one[0])


def common_steps(baseline: Calibration) -> list[int]:
    """Numbers of steps whose points are nodes of all functions of the baseline."""
    nodes = {axis: [f[0] for name, f in baseline.functions.items() if name[2] == axis] for axis in "XYZ"}
    most = min(len(positions) for axis in nodes.values() for positions in axis) - 1
    return [
        steps
        for steps in range(2, most + 1)
        if all(
            np.isclose(np.linspace(0.0, travel, steps + 1)[:, None], positions, rtol=0.0, atol=1e-6).any(axis=1).all()
            for axis, travel in zip("XYZ", baseline.volume, strict=True)
            for positions in nodes[axis]
        )
    ]


def powers(
    scenario: Scenario,
    baseline: Calibration,
    minutes: float,
    *,
    alpha: float = ALPHA,
    progress: Callable[[int, int], None] | None = None,
) -> list[Power]:
    """Of all candidates, the fastest first. `progress` receives how many of how many are done."""
    everything = candidates(scenario, baseline, minutes)
    seen = _SeenByLines(scenario, baseline, [candidate for _, candidate in everything])
    result: list[Power] = []
    for done, (seconds, candidate) in enumerate(everything, 1):
        result.append(seen.power(candidate, seconds, alpha))
        if progress is not None:
            progress(done, len(everything))
    if all(one.trouble for one in result):
        raise InvalidArgument(result[0].trouble)
    return result


class _SeenByLines:
    """What each line shows of changes: of all lines of plans with the same steps together, where one run can have
    them."""

    def __init__(self, scenario: Scenario, baseline: Calibration, plans: Sequence[Candidate]) -> None:
        self.scenario, self.baseline, self.plans = scenario, baseline, plans
        self.by_steps: dict[int, ChangesSeen | None] = {}
        self.moves: npt.NDArray[np.float64] | None = None  # the same for all plans

    def power(self, plan: Candidate, seconds: float, alpha: float) -> Power:
        try:
            changes = self._of_all_lines(plan.steps) or self._of(plan.lines, plan.scale_lines, plan.steps)
            seen = changes.by(plan.lines, plan.scale_lines, repeats=plan.repeats, alpha=alpha, power=POWER)
        except InvalidArgument as error:
            return Power(plan, seconds, trouble=str(error))
        if self.moves is None:
            self.moves = moves_by(self.baseline, changes.shape)
        gains = tuple(np.sqrt((self.moves**2).sum(axis=1).max(axis=0)).tolist())
        hidden = hidden_by(self.moves, seen.covariance)
        return Power(plan, seconds, changes.terms, tuple(map(float, seen.smallest)), gains, hidden)

    def _of_all_lines(self, steps: int) -> ChangesSeen | None:
        if steps not in self.by_steps:
            plans = [plan for plan in self.plans if plan.steps == steps]
            lines = dict.fromkeys(line for plan in plans for line in plan.lines)
            scale_lines = dict.fromkeys(line for plan in plans for line in plan.scale_lines)
            try:
                self.by_steps[steps] = self._of(tuple(lines), tuple(scale_lines), steps)
            except InvalidArgument:  # of a line that not all plans have
                self.by_steps[steps] = None
        return self.by_steps[steps]

    def _of(self, lines: Sequence[str], scale_lines: Sequence[str], steps: int) -> ChangesSeen:
        """By readings without noise of a machine as the baseline has it."""
        plan = {"lines": lines, "scale_lines": scale_lines, "steps": steps, "repeats": 1, "check_points": 0}
        known = not_measured(self.scenario.known, plan)
        run = simulate_scenario(Scenario(known, truth_of(TruthKeys(), {}, known)), self.baseline.to_error_map())
        return changes_seen(self.baseline, known, run)


def choose(found: Sequence[Power], minutes: float, limit: float) -> Power | None:
    """Of the plans within the time the one that leaves the fewest terms that may move the tool by more than `limit`,
    mm, unseen; of these the one that leaves least at all, and among those that are hardly worse the fastest."""
    fitting = [one for one in found if one.minutes <= minutes and not one.trouble]
    if not fitting:
        return None
    fewest = min(len(one.unseen(limit)) for one in fitting)
    fitting = [one for one in fitting if len(one.unseen(limit)) == fewest]
    least = min(one.left for one in fitting)
    return min((one for one in fitting if one.left <= (1.0 + ALIKE) * least), key=lambda one: one.seconds)


def front(found: Sequence[Power], limit: float) -> list[Power]:
    """Those that no faster one equals, fastest first; what is but a little better is not."""
    kept: list[Power] = []
    for one in found:
        if one.trouble:
            continue
        unseen = len(one.unseen(limit))
        if not any(len(other.unseen(limit)) <= unseen and other.left <= (1.0 + ALIKE) * one.left for other in kept):
            kept.append(one)
    return kept
