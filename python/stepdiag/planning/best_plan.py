"""The search for the best plan: which lines, in which setting (steps, repeats, returns, scale points, backward runs).

1. The lines to choose from are those of the scenario's plan, four body diagonals, six face diagonals, three single axes
   and three scale lines. A reversed line ("ppn" for "nnp") is the same line. All lines of a plan have as many steps:
   what differs by line is where scale lines are read, at their ends or at every step.
2. For each setting, and for some times around the available one (and for the shortest one), lines are exchanged as
   in optimum experimental design: of all sets with one line more, one less, or one in place of another, that best set
   is taken which is better than the present one; until there is none (V. V. Fedorov, Theory of Optimal Experiments,
   1972; R. D. Cook and C. J. Nachtsheim, Technometrics 22 (1980) 315). A set that would not be the best one even if
   nothing had been taken off is passed over. The order of lines and settings is fixed, and numbers that differ in the
   seventh digit are equal: the same scenario gives the same plan.
3. In step 2 a plan is estimated from the exact covariances of 5 and of 10 steps (of more where the mirror is too small
   for so long ones), without repeats. The variance of a value is a constant plus a sum over steps (a random walk), and
   so it is taken as linear in their number, at every point of the volume and for every kind of parameter, and beyond 10
   steps as not falling. At 50 steps this is within a tenth or so; four digits of it count. Where lines have nothing in
   common but the machine, the covariance of a set of lines is that of the sum of what each of them tells
   (planning/estimates.py).
4. What step 2 ends with is evaluated with exact covariances: by adjustment, or by propagation where more than the noise
   of the readings is uncertain. So is the scenario's own plan.
5. The best of these are exchanged again, line by line, now by exact covariances; only sets are evaluated that the
   estimate, made smaller by a fifth, would prefer.

A plan that determines fewer parameters is never better than one that determines more. Where [plan_by_time] states
`line_sets`, all of them are evaluated exactly in all settings, and nothing is exchanged.
"""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from operator import itemgetter
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag.config.plan_by_time_keys import PlanByTimeSection
from stepdiag.planning.estimates import Estimates
from stepdiag.planning.measuring_time import OnLine, in_turn, on_lines, times_of
from stepdiag.planning.plan_by_time import (
    Aim,
    Candidate,
    Evaluated,
    Outcome,
    Setting,
    choose,
    complete,
    outcome,
    own_candidate,
    plan_of,
    root_of_largest,
    runs_of_candidate,
    settings,
    stated_candidates,
)
from stepdiag.scenario.description import Scenario
from stepdiag.units import MINUTE

_LINES: Final = ("ppp", "npp", "pnp", "nnp", "pp0", "np0", "p0p", "n0p", "0pp", "0np", "p00", "0p0", "00p")
_SCALES: Final = _LINES[10:]
# Sets that a search starts from.
_STARTS: Final = ((_LINES[:4], _SCALES), (_LINES[:4], _SCALES[:2]), (_LINES[:3], _SCALES), (_LINES[4:10], ()))
SCREENED: Final = ((5, 10), (10, 20), (25, 50))  # steps; the first of which the mirror is not too small
SLACK: Final = 1.25  # of estimates
TIMES: Final = (0.7, 1.0, 1.2, 1.5, 2.0)  # by the available time
REFINED: Final = 2  # plans that are exchanged by exact covariances

FloatArray = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]
LineSet = tuple[tuple[str, ...], tuple[str, ...]]  # lines and scale lines
Rank = tuple[float, ...]  # of two plans, the one with the smaller is the better one
# Of a candidate, were it as good as the second one.
Order = Callable[[Candidate, Candidate], Rank]
# At most a candidate's rank. All its lines are some of those of the second one.
Bound = Callable[[Candidate, Candidate | None], Rank]


def best_plans(
    scenario: Scenario, aim: Aim, *, times: PlanByTimeSection | None = None, progress: Progress | None = None
) -> list[Outcome]:
    """Plans among which is the best one for an aim (`choose`), and others that are faster or better.

    `times`: in place of those of the scenario's [plan_by_time]. `progress` receives how many of how many parts are
    done. Raises InvalidArgument where the scenario names lines that do not exist."""
    report = progress or (lambda done, total: None)
    if scenario.known.keys.plan_by_time.line_sets is not None:
        stated, found = stated_candidates(scenario), []
        for done, candidate in enumerate(stated, 1):
            found.append(outcome(scenario, candidate, faults=aim.family == "faults", times=times))
            report(done, len(stated))
        return found
    return _Search(scenario, aim, times).run(report)


class _Search:
    def __init__(self, scenario: Scenario, aim: Aim, times: PlanByTimeSection | None) -> None:
        self.scenario, self.known, self.aim, self.stated = scenario, scenario.known, aim, times
        self.own = own_candidate(self.known)
        self.times = times_of(times or self.known.keys.plan_by_time, f"{self.known.path}: plan_by_time")
        self.faults = aim.family == "faults"
        self.lines = _with_others(self.own.lines, _LINES)
        self.scales = _with_others(self.own.scale_lines, _SCALES)
        self.estimates = Estimates(scenario, self.lines, self.scales, faults=self.faults)
        self.exact: dict[Candidate, Outcome] = {}
        self.on_lines: dict[Setting, dict[tuple[str, bool], OnLine]] = {}
        self.taken: dict[Candidate, tuple[float, float]] = {}
        self.estimated: dict[Candidate, Outcome] = {}
        # Whether more counts than the volume, which is not known where a parameter is not.
        self.by_kind = aim.family != "volume" or any(goal.of != "volume" for goal in aim.goals)
        self.few = self._screened_steps()

    def run(self, report: Progress) -> list[Outcome]:
        combined = settings(self.known)
        parts = len(combined) + 2
        starts = self._starts()
        self.evaluated(self.own)
        if not self.aim.goals:
            limits = [share * self.aim.minutes for share in TIMES]
        else:
            reached = self._fastest(combined, starts)
            limits = [share * reached for share in TIMES]
        once = min(setting.repeats for setting in combined)
        quickest = [one for one in self._near(combined) if one.repeats == once]
        ends = dict.fromkeys(self._best(setting, starts, self._by_time) for setting in quickest)
        for done, setting in enumerate(combined, 1):
            at = starts
            for minutes in limits:
                aim = replace(self.aim, minutes=minutes, goals=())
                best = self._best(setting, at, self._by_estimates(aim))
                if self.seconds(best) <= minutes * MINUTE:
                    ends[best] = None
                    at = [*starts, (best.lines, best.scale_lines)]
            report(done, parts)
        most = max((len(self.estimate(candidate).determined) for candidate in ends), default=0)
        for candidate in ends:
            if len(self.estimate(candidate).determined) == most:
                self.evaluated(candidate)
        report(parts - 1, parts)
        self._refine()
        report(parts, parts)
        return list(self.exact.values())

    def _fastest(self, combined: Sequence[Candidate], starts: Sequence[LineSet]) -> float:
        """The minutes of the fastest plan that reaches the goals, or of the one that comes nearest; the best of each
        setting has been evaluated then."""
        order = self._by_estimates(self.aim)
        best = [self._best(setting, starts, order) for setting in self._near(combined)]
        for candidate in sorted(best, key=lambda one: order(one, one)):
            self.evaluated(candidate)
        taken = choose(list(self.exact.values()), self.aim).taken
        return (taken or self.evaluated(self.own)).minutes

    def _near(self, combined: Sequence[Candidate]) -> list[Candidate]:
        """Settings with nodes near enough; where there are none, those with the nearest."""
        edge = float(max(self.known.plan.volume))
        most = max(one.steps for one in combined)
        return [one for one in combined if edge / one.steps <= self.aim.spacing * (1.0 + 1e-9) or one.steps == most]

    def _refine(self) -> None:
        """Exchanges by exact covariances, of plans with nodes as near as the time allows."""
        found = complete(list(self.exact.values()))
        taken = choose(found, self.aim).taken
        spacing = self.aim.spacing if taken is None else max(self.aim.spacing, taken.spacing)
        allowed = [o for o in found if o.spacing <= spacing * (1.0 + 1e-9)]
        for one in sorted(allowed, key=self.aim.order)[:REFINED]:
            self._exchanged(one.candidate, self._by_evaluations, self._of_estimate())

    # --- exchanges ---------------------------------------------------------------------------------------------------
    def _starts(self) -> list[LineSet]:
        sets = [(self.own.lines, self.own.scale_lines), *_STARTS]
        known = {*self.lines}, {*self.scales}
        return [(a, b) for a, b in dict.fromkeys(sets) if known[0] >= {*a} and known[1] >= {*b}]

    def _best(self, setting: Candidate, starts: Sequence[LineSet], order: Order) -> Candidate:
        """Of a setting, from the best of the starts."""
        found = [setting.with_lines(*chosen) for chosen in starts]
        return self._exchanged(min(found, key=lambda one: order(one, one)), order, self._of_whole(order))

    def _exchanged(self, candidate: Candidate, order: Order, bound: Bound) -> Candidate:
        """Those that cannot be best are passed over; of equal ones the first is taken."""
        own = order(candidate, candidate)
        while True:
            best = (own, -1, candidate)
            bounds = [(bound(*pair), place, pair[0]) for place, pair in enumerate(self._neighbours(candidate))]
            for least, place, one in sorted(bounds, key=itemgetter(0, 1)):
                if least > best[0]:
                    break
                best = min(best, (order(one, one), place, one), key=itemgetter(0, 1))
            if best[2] is candidate:
                return candidate
            own, _, candidate = best

    def _neighbours(self, candidate: Candidate) -> Iterator[tuple[Candidate, Candidate | None]]:
        """With one line more, one less, or one in place of another; and what that is with both, if it is a plan."""
        inside = {(line, False) for line in candidate.lines} | {(line, True) for line in candidate.scale_lines}
        every = [(line, False) for line in self.lines] + [(line, True) for line in self.scales]
        outside = [one for one in every if one not in inside]
        for added in [None, *outside]:
            more = inside | ({added} if added else set())
            whole = self._of(candidate, more)
            for removed in [None, *(one for one in every if one in inside)]:
                chosen = more - {removed}
                one = self._of(candidate, chosen)
                if one is not None and chosen != inside:
                    yield one, whole

    def _of(self, setting: Candidate, chosen: Collection[tuple[str, bool]]) -> Candidate | None:
        """Of a setting, with these lines, if they make a plan; with each stands whether it is a scale line."""
        lines = tuple(line for line in self.lines if (line, False) in chosen)
        scales = tuple(line for line in self.scales if (line, True) in chosen)
        if not lines or {*lines} & {*scales}:
            return None
        return setting.with_lines(lines, scales)

    # --- what plans take and give ------------------------------------------------------------------------------------
    def seconds(self, candidate: Candidate) -> float:
        return self._time(candidate)[0]

    def _time(self, candidate: Candidate) -> tuple[float, float]:
        if candidate not in self.taken:
            self.taken[candidate] = self._in_turn(candidate)
        return self.taken[candidate]

    def _in_turn(self, candidate: Candidate) -> tuple[float, float]:
        of_lines = self.on_lines.setdefault(candidate.setting, {})
        chosen = [(line, False) for line in candidate.lines] + [(line, True) for line in candidate.scale_lines]
        for line, is_scale in chosen:
            if (line, is_scale) not in of_lines:
                # A plan has at least one line that is no scale line.
                lines = ("ppp",) if is_scale else (line,)
                plan = plan_of(self.known, candidate.with_lines(lines, (line,) if is_scale else ()))
                runs = runs_of_candidate(self.known, candidate)
                of_lines[line, is_scale] = on_lines(plan, self.times, repeats=runs, backward=candidate.backward)[line]
        return in_turn([of_lines[one] for one in chosen], self.times)

    def evaluated(self, candidate: Candidate) -> Outcome:
        if candidate not in self.exact:
            found = outcome(self.scenario, candidate, faults=self.faults, times=self.stated)
            self.exact[candidate] = found
        return self.exact[candidate]

    def _screen(self, candidate: Candidate) -> Evaluated:
        return self.estimates.of(candidate, lambda one: self._time(one)[1])

    def _screened_steps(self) -> tuple[int, int]:
        for few in SCREENED:
            if all(self._screen(self._standing_for(self.own, steps, 1)).variances is not None for steps in few):
                return few
        return self.own.steps, 2 * self.own.steps

    def _standing_for(self, candidate: Candidate, steps: int, repeats: int) -> Candidate:
        returns = math.ceil(steps * candidate.check_points / candidate.steps)
        return replace(candidate, steps=steps, repeats=repeats, check_points=returns)

    def estimate(self, candidate: Candidate) -> Outcome:
        """Without its mirror."""
        if candidate not in self.estimated:
            self.estimated[candidate] = self._estimate(candidate)
        return self.estimated[candidate]

    def _estimate(self, candidate: Candidate) -> Outcome:
        few, more = self.few
        seconds = self.seconds(candidate)
        spacing = float(max(self.known.plan.volume)) / candidate.steps
        nothing = Outcome(candidate, seconds, spacing, (math.nan, math.nan), {}, frozenset())
        # Two runs distinguish faults that one does not.
        repeats = min(candidate.repeats, 2 if self.faults else 1)
        steps = self.few if candidate.steps >= few else (candidate.steps, candidate.steps)
        first = self._screen(self._standing_for(candidate, steps[0], repeats))
        if not self.by_kind and math.isinf(first.volume):
            return replace(nothing, determined=first.determined, trouble=first.trouble)
        at = [first, self._screen(self._standing_for(candidate, steps[1], repeats))]
        if at[1].variances is None or at[0].variances is None:
            return replace(nothing, trouble=at[1].trouble or at[0].trouble)
        share = (candidate.steps - more) / (more - few)
        least = 0.0 if share > 0.0 else -math.inf
        runs = candidate.repeats / repeats

        def of_steps(low: FloatArray, high: FloatArray) -> FloatArray:
            """Of variances."""
            result: FloatArray = (high + share * np.maximum(high - low, least)) / runs
            return result

        kinds = [kind for kind in at[1].largest if kind in at[0].largest]
        low, high = (np.array([found.largest[kind] for kind in kinds]) ** 2 for found in at)
        return replace(
            nothing,
            largest=dict(zip(kinds, map(_as_good, np.sqrt(of_steps(low, high)).tolist()), strict=True)),
            determined=at[1].determined,
            volume=_as_good(root_of_largest(of_steps(at[0].variances, at[1].variances))),
            faults=at[1].faults,
        )

    # --- orders ------------------------------------------------------------------------------------------------------
    def _by_estimates(self, aim: Aim, slack: float = 1.0) -> Order:
        def order(candidate: Candidate, like: Candidate) -> Rank:
            seconds = self.seconds(candidate)
            if seconds > aim.minutes * MINUTE:  # however good it is
                return (math.inf, seconds)
            found = self.estimate(like)
            if slack != 1.0:
                smaller = {kind: u / slack for kind, u in found.largest.items()}
                found = replace(found, volume=found.volume / slack, largest=smaller)
            return (self._lacking(found), *aim.order(found, seconds))

        return order

    def _by_evaluations(self, candidate: Candidate, like: Candidate) -> Rank:
        found = self.evaluated(like)
        return (self._lacking(found), *self.aim.order(found, self.seconds(candidate)))

    def _by_time(self, candidate: Candidate, like: Candidate) -> Rank:
        return (self._lacking(self.estimate(like)), self.seconds(candidate))

    def _lacking(self, one: Outcome) -> float:
        """How many parameters it does not determine that another plan does; of fewer no plan is better."""
        return float(-len(one.determined))

    def _of_whole(self, order: Order) -> Bound:
        """Who measures less knows nothing better, but may have fewer faults to distinguish."""

        def bound(candidate: Candidate, whole: Candidate | None) -> Rank:
            unknown = (-math.inf,)
            if self.faults or whole is None:
                return unknown
            rank = order(candidate, whole)
            if rank[0] < math.inf and self.estimate(whole).trouble:  # such as a mirror too small
                return unknown
            return rank

        return bound

    def _of_estimate(self) -> Bound:
        order = self._by_estimates(self.aim, SLACK)
        return lambda candidate, whole: order(candidate, candidate)


def _as_good(estimate: float) -> float:
    """To four digits: what is estimated from two numbers of steps is no better, and rounding must not choose."""
    return float(f"{estimate:.4g}")


def _with_others(own: Sequence[str], usual: Sequence[str]) -> tuple[str, ...]:
    """Own lines, and of the usual ones those that are not among them, reversed or not."""
    turned = str.maketrans("pn", "np")
    inside = {*own, *(line.translate(turned) for line in own)}
    return (*own, *(line for line in usual if line not in inside))
