"""What a plan takes and gives, before anyone measures: minutes, standard uncertainties, faults that it controls; and
which of several plans is the best one for an aim."""

import itertools
import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.calibration.largest_by_kind import largest_uncertainties
from stepdiag.calibration.volume import GRID, ONE_SIDED, variances_in_volume
from stepdiag.config.plan_by_time_keys import PlanByTimeSection
from stepdiag.config.scenario_keys import MachineErrorsKeys, RandomSection, TruthKeys
from stepdiag.config.toml_text import located
from stepdiag.parameters import KINDS, Kind, kind_of
from stepdiag.planning.fault_control import distinguishes_all
from stepdiag.planning.measuring_time import measuring_time, times_of
from stepdiag.planning.observation import extents, not_measured
from stepdiag.scenario.description import (
    Scenario,
    adjusted_numbers,
    adjustment_options,
    reduced_run,
    simulate_scenario,
)
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.known import Known, runs_of
from stepdiag.scenario.truth import Truth, truth_of
from stepdiag.units import MICROMETRE, MICRORADIAN, MINUTE

# What a plan is to be good at: the error of the functional point in the volume, a family of parameters, or power
# against faults of the readings.
Family = Literal["volume", "length", "angle", "squareness", "faults"]
KINDS_OF: Final[dict[Family, tuple[Kind, ...]]] = {
    "length": ("positioning", "straightness"),
    "angle": ("angle",),
    "squareness": ("squareness",),
}
ScalePoints = Literal["ends", "steps"]
Setting = tuple[int, int, int, ScalePoints, bool]  # of a Candidate

# Of two plans whose uncertainties differ by less than this share, the faster one is shown.
ALIKE: Final = 0.05
MOST_CANDIDATES: Final = 2000
# Largest errors of machines, by the limit, that `decide` finds to be within it and not within it.
WITHIN: Final = 0.8


@dataclass(frozen=True)
class Candidate:
    lines: tuple[str, ...]
    scale_lines: tuple[str, ...]
    steps: int
    repeats: int
    check_points: int = 0
    """Steps after which the program returns to a line's check point; 0: never."""
    scale_points: ScalePoints = "ends"
    backward: bool = False

    @property
    def setting(self) -> Setting:
        """All but the lines."""
        return self.steps, self.repeats, self.check_points, self.scale_points, self.backward

    def with_lines(self, lines: tuple[str, ...], scale_lines: tuple[str, ...]) -> "Candidate":
        """The same setting. Without scale lines it does not matter where these are read."""
        points = self.scale_points if scale_lines else "ends"
        return Candidate(lines, scale_lines, self.steps, self.repeats, self.check_points, points, self.backward)

    @property
    def description(self) -> str:
        """In words: "4 body diagonals, 3 scale lines at every step"."""
        said = ", ".join(f"{count} {name}{'s' * (count > 1)}" for name, count in self.counts.items() if count)
        return said + " at every step" * (self.scale_points == "steps")

    @property
    def counts(self) -> dict[str, int]:
        """Number of lines of each kind."""
        counts = {name: sum(moved(line) == axes for line in self.lines) for axes, name in _NAMES}
        return counts | {"scale line": len(self.scale_lines)}


_NAMES: Final = ((3, "body diagonal"), (2, "face diagonal"), (1, "single-axis line"))


def moved(line: str) -> int:
    """How many axes move on a line."""
    return 3 - line.count("0")


@dataclass(frozen=True)
class Outcome:
    """What a plan takes and gives. `seconds` include set-ups; `spacing`: mm, the farthest that nodes are apart; largest
    standard uncertainties in mm or rad; `determined`: the parameters that are, as a whole; `volume`: the largest
    standard uncertainty of the functional point's error in the volume (the root of three variances), mm, infinite where
    a parameter that acts in it is not determined. `faults`: what the readings control, None where nobody asked.
    `trouble`: why there is nothing of this."""

    candidate: Candidate
    seconds: float
    spacing: float
    mirror: tuple[float, float]
    largest: dict[Kind, float]
    determined: frozenset[str]
    volume: float = math.inf
    faults: Sequence[_core.FaultControl] | None = None
    trouble: str = ""

    @property
    def minutes(self) -> float:
        return self.seconds / MINUTE

    def worst(self, family: Family) -> float:
        """The largest standard uncertainty of a family, mm or rad; for faults the smallest wrong distance that is
        found, mm. Infinite where there is none."""
        if family == "volume":
            return self.volume
        if family == "faults":
            return found_from(self.faults or ())
        return max(self.largest.get(kind, math.inf) for kind in KINDS_OF[family])

    def undistinguished(self, family: Family = "faults") -> int:
        """How many kinds of faults are not distinguished from all others, or not controlled.

        0 where faults do not count."""
        return undistinguished(self.faults or ()) if family == "faults" else 0


def undistinguished(faults: Sequence[_core.FaultControl]) -> int:
    """How many kinds of faults are not distinguished from all others, or not controlled."""
    return sum(bool(c.twins or c.uncontrolled or not c.count) for c in faults)


def found_from(faults: Sequence[_core.FaultControl]) -> float:
    """From which size on a wrong distance is found, mm; infinite where one is that nothing controls."""
    of_distances = [c for c in faults if (c.kind, c.channel) == ("reading", "distance")]
    return max((c.found_from if c.count and not c.uncontrolled else math.inf for c in of_distances), default=math.inf)


@dataclass(frozen=True)
class Goal:
    """A largest standard uncertainty, mm or rad, and the words for it."""

    of: Literal["volume", "squareness"]
    u: float
    words: str


def volume_goal(micrometres: float) -> Goal:
    """Of the functional point's error in the volume."""
    return Goal("volume", micrometres * MICROMETRE, f"u of the volume of {micrometres:g} µm")


def squareness_goal(microradians: float) -> Goal:
    return Goal("squareness", microradians * MICRORADIAN, f"u of squareness of {microradians:g} µrad")


def deciding_goal(micrometres: float, between_nodes: float | None = None) -> Goal:
    """Whether the largest error is within a limit L, as `volume --limit` decides it: within where the estimate plus
    z u is at most L, not within where the estimate minus z u is above L, z = 1.645 (95 % on one side).

    The estimate is itself off by up to z u with 95 %. A machine of a largest error of 0.8 L is therefore called within
    with 95 % where 0.8 L + z u + z u <= L, which is u <= 0.2 L / 2z. One of L / 0.8 = 1.25 L is called not within where
    1.25 L - 2 z u > L, which then holds. `between_nodes`, mm: a stated standard uncertainty by what lies between the
    nodes, which is part of u; none: what `volume` estimates of it from the tables comes on top."""
    u = (1.0 - WITHIN) * micrometres * MICROMETRE / (2.0 * ONE_SIDED)
    left = math.sqrt(max(u**2 - (between_nodes or 0.0) ** 2, 0.0))
    return Goal("volume", left, f"a verdict within {micrometres:g} µm or not (u of the volume of {u * 1e3:.3g} µm)")


@dataclass(frozen=True)
class Aim:
    """What the best plan does: with goals the shortest one that reaches them all, else the one that is best at a family
    in the time; nodes at most `spacing` mm apart."""

    family: Family = "volume"
    minutes: float = math.inf
    spacing: float = math.inf
    goals: tuple[Goal, ...] = ()

    def missed(self, one: Outcome) -> float:
        """By which factor a plan is less certain than the goals at most; 1 where it reaches them."""
        ratios = [one.worst(goal.of) / goal.u if goal.u > 0.0 else math.inf for goal in self.goals]
        return max([1.0, *(rounded(ratio) for ratio in ratios)])

    def order(self, one: Outcome, seconds: float | None = None) -> tuple[float, ...]:
        """Of two plans, the one with the smaller is the better one. `seconds`: in place of its own."""
        seconds = one.seconds if seconds is None else seconds
        own = (self.missed(one),) if self.goals else (one.undistinguished(self.family), rounded(one.worst(self.family)))
        over = max(seconds - self.minutes * MINUTE, 0.0)
        return (over, *own, seconds)


def aim_of(
    known: Known, *, minutes: float | None, spacing: float | None, family: Family, goals: Sequence[Goal] = ()
) -> Aim:
    """The aim in the available time: none is [plan_by_time] minutes, or with goals any. No `spacing`: that of the
    scenario's own plan."""
    available = known.keys.plan_by_time.minutes if minutes is None and not goals else minutes
    near = own_spacing(known) if spacing is None else spacing
    return Aim(family, math.inf if available is None else available, near, tuple(goals))


def rounded(value: float) -> float:
    """To six digits: of plans that are mirror images of each other rounding must not choose."""
    return float(f"{value:.6g}")


def own_candidate(known: Known) -> Candidate:
    """The scenario's own plan."""
    plan, stated = known.plan, known.keys.plan
    setting = Candidate((), (), plan.steps, stated.repeats, stated.check_points, stated.scale_points, stated.backward)
    return setting.with_lines(tuple(plan.lines), tuple(plan.scale_lines))


def settings(known: Known) -> list[Candidate]:
    """All combinations of steps, repeats, returns, scale points and backward runs, with the lines of the own plan.

    Backward runs are there to determine reversal errors. Where these are unknowns, the errors of the other direction
    are no better known for them: they stay as the scenario has them. Where there are none (`reversal = false`), both
    are tried."""
    keys, own = known.keys.plan_by_time, own_candidate(known)
    ways = [own.backward] if known.keys.adjustment.reversal else [False, True]
    points: tuple[ScalePoints, ...] = ("ends", "steps")
    return [
        replace(own, steps=n, repeats=r, check_points=every, scale_points=where, backward=way)
        for n in sorted({*keys.steps, own.steps})
        for r in sorted({*keys.repeats, own.repeats})
        for every in _returns(known, n)
        for where in points
        for way in ways
    ]


def _returns(known: Known, steps: int) -> list[int]:
    """After how many steps plans of so many steps return to a check point: as the scenario says, and, where the drift
    of the functional point is an unknown, never and after each fourth of a line."""
    own = min(known.keys.plan.check_points, steps)
    return sorted({own} if known.machine_drift is None else {0, own, math.ceil(steps / 4)})


def stated_candidates(scenario: Scenario) -> list[Candidate]:
    """All plans with the sets of lines that [plan_by_time] states, and with those of the scenario's own. Raises
    InvalidArgument where it states lines that do not exist, or too many plans."""
    known = scenario.known
    keys, plan = known.keys.plan_by_time, known.plan
    sets = {(tuple(plan.lines), tuple(plan.scale_lines)): None}
    for index, lines in enumerate(keys.line_sets or ()):
        measured = tuple(line for line in lines if moved(line) != 1)
        scales = tuple(line for line in lines if moved(line) == 1)
        with located(f"{scenario.path}: plan_by_time.line_sets: set {index + 1}"):
            _core.Plan(plan.volume, list(measured), plan.steps, scale_lines=list(scales))
        sets[measured, scales] = None
    combined = settings(known)
    if len(sets) * len(combined) > MOST_CANDIDATES:
        raise InvalidArgument(
            f"{scenario.path}: plan_by_time: expected at most {MOST_CANDIDATES} plans to choose from, got "
            f"{len(sets) * len(combined)} ({len(sets)} sets of lines, {len(combined)} combinations of steps, repeats "
            "and the like)"
        )
    return list(
        dict.fromkeys(one.with_lines(lines, scales) for (lines, scales), one in itertools.product(sets, combined))
    )


def plan_of(known: Known, candidate: Candidate) -> _core.Plan:
    return _core.Plan(
        known.plan.volume,
        list(candidate.lines),
        candidate.steps,
        order=known.plan.orders,
        scale_lines=list(candidate.scale_lines),
        check_points=_core.CheckPoints(candidate.check_points, min(known.keys.plan.check_point, candidate.steps)),
        scale_points=candidate.scale_points,
        block=min(known.plan.block, candidate.steps),
    )


def runs_of_candidate(known: Known, candidate: Candidate) -> int:
    """How often it measures each line, backward runs not counted."""
    return candidate.repeats * runs_of(known.keys.plan) // known.keys.plan.repeats


def outcome(
    scenario: Scenario, candidate: Candidate, *, faults: bool = False, times: PlanByTimeSection | None = None
) -> Outcome:
    """The time that a plan takes, and the uncertainties of the adjustment of a run of it. `faults`: also the faults
    that it controls. `times`: in place of the scenario's.

    The machine of that run has errors: some uncertainties depend on them, for a beam that is 1 mm beside its place
    reads more or less as the mirror tilts."""
    known = scenario.known
    plan = plan_of(known, candidate)
    taken = times_of(times or known.keys.plan_by_time, f"{known.path}: plan_by_time")
    runs = runs_of_candidate(known, candidate)
    seconds, between = measuring_time(plan, taken, repeats=runs, backward=candidate.backward)
    spacing = float(max(plan.volume)) / candidate.steps
    width, height = plan.smallest_mirror()
    found = evaluate(scenario, candidate, between, faults=faults)
    return Outcome(
        candidate,
        seconds,
        spacing,
        (float(width), float(height)),
        found.largest,
        found.determined,
        found.volume,
        found.faults,
        found.trouble,
    )


@dataclass(frozen=True, eq=False)
class Evaluated:
    """What the adjustment of a run of a plan gives. `variances`: as `variances_in_volume`."""

    largest: dict[Kind, float]
    determined: frozenset[str] = frozenset()
    variances: npt.NDArray[np.float64] | None = None
    faults: Sequence[_core.FaultControl] | None = None
    trouble: str = ""

    @property
    def volume(self) -> float:
        """As an Outcome has it."""
        return math.inf if self.variances is None else root_of_largest(self.variances)


def root_of_largest(variances: npt.NDArray[np.float64]) -> float:
    largest = float(np.max(variances))
    return math.inf if math.isnan(largest) else math.sqrt(largest)


def evaluate(scenario: Scenario, candidate: Candidate, between: float, *, faults: bool = False) -> Evaluated:
    """Of a plan with so many seconds from a reading to the next one."""
    try:
        planned = usual(scenario, candidate, between)
        more = says_more(scenario.known)
        if not faults and not more:
            with suppress(InvalidArgument):  # of what the adjustment also does, or has a better word for
                return _known_by_run(planned)
        controls = None
        if faults or not more:
            run = simulate_scenario(planned)
            adjusted = adjusted_numbers(
                planned.known, run, full_covariance=not more, reliability=faults, search_faults=False
            )
            calibration = adjusted.calibration
            controls = adjusted.reliability if faults else None
        if more:
            calibration = _propagated(planned)
        largest = {kind: value for kind, (value, _) in largest_uncertainties(calibration).items()}
        determined = frozenset(extents(calibration, planned.known.plan)[0])
        return Evaluated(largest, determined, variances_in_volume(calibration), controls)
    except InvalidArgument as error:
        return Evaluated({}, trouble=str(error))


def _known_by_run(planned: Scenario) -> Evaluated:
    """What the adjustment of its run knows, without its tests of the readings."""
    known = planned.known
    run = reduced_run(known, simulate_scenario(planned))
    options = adjustment_options(known, run)
    return evaluated(
        _core.known_by_run(run, known.plan, of_run(known.heads), known.chain, known.tool, options, grid=GRID)
    )


def evaluated(known: _core.KnownByLines) -> Evaluated:
    largest: dict[Kind, float] = {}
    for parameter, u in known.largest.items():
        kind = kind_of(parameter)
        largest[kind] = max(largest.get(kind, 0.0), u)
    ordered = {kind: largest[kind] for kind in KINDS if kind in largest}
    return Evaluated(ordered, frozenset(known.determined), known.volume)


def usual(scenario: Scenario, candidate: Candidate, between: float) -> Scenario:
    """A plan's run of a usual machine, with so many seconds from a reading to the next one."""
    changes = {
        "lines": candidate.lines,
        "scale_lines": candidate.scale_lines,
        "steps": candidate.steps,
        "repeats": candidate.repeats,
        "check_points": candidate.check_points,
        "scale_points": candidate.scale_points,
        "backward": candidate.backward,
        "seconds_per_reading": between or None,
    }
    planned = not_measured(scenario.known, changes)
    return Scenario(planned, _usual_truth(scenario.truth, planned))


def _usual_truth(truth: Truth, planned: Known) -> Truth:
    """Of a machine with the errors of [machine.random], else of that section's defaults, with the [misalignment]."""
    machine = MachineErrorsKeys(random=truth.keys.machine.random or RandomSection(seed=0))
    return truth_of(TruthKeys(machine=machine, misalignment=truth.keys.misalignment), {}, planned)


def says_more(known: Known) -> bool:
    """Whether its [uncertainty] or [instrument] names more than the noise of the readings."""
    return bool(known.uncertain.inputs) or any(noise.quantity != "channel" for noise in known.uncertain.noise)


def _propagated(planned: Scenario) -> _core.Calibration:
    """By all that [uncertainty] names: drifts and walks take the longer, the longer measuring takes."""
    from stepdiag.uncertainty.virtual_calibrations import virtual_calibrations

    model = virtual_calibrations(planned, method="adjustment")
    with located(str(planned.path)):
        covariance = _core.propagate(model, covariance=True).covariance
    assert covariance is not None
    return _core.with_covariance(model.calibration, covariance)


def with_faults(scenario: Scenario, one: Outcome) -> Outcome:
    """The same with the faults that its readings control."""
    if one.faults is not None:
        return one
    faults = outcome(scenario, one.candidate, faults=True).faults
    return replace(one, faults=faults or ())


def distinguishing(
    scenario: Scenario, found: Sequence[Outcome], taken: Outcome, family: Family = "volume"
) -> tuple[Outcome, Outcome | None]:
    """The plan that is taken, and the fastest one with as many steps and hardly larger uncertainties that distinguishes
    all faults, both with their faults; None where none does."""
    own = with_faults(scenario, taken)
    if own.faults and distinguishes_all(own.faults):
        return own, own
    for one in sorted(complete(found), key=_seconds):
        if one.candidate.steps != taken.candidate.steps or one is taken:
            continue
        if _hardly_worse(one, taken, "volume" if family == "faults" else family):
            tested = with_faults(scenario, one)
            if tested.faults and distinguishes_all(tested.faults):
                return own, tested
    return own, None


def complete(found: Sequence[Outcome]) -> list[Outcome]:
    """Those that determine as many parameters as any."""
    most = max((len(o.determined) for o in found), default=0)
    return [o for o in found if most > 0 and len(o.determined) == most]


def _hardly_worse(one: Outcome, other: Outcome, family: Family) -> bool:
    limit = (1.0 + ALIKE) * other.worst(family)
    return one.undistinguished(family) <= other.undistinguished(family) and one.worst(family) <= limit


def front(found: Sequence[Outcome], family: Family = "volume") -> list[Outcome]:
    """Of the complete ones, those that no other one beats in time, spacing and what counts, fastest first. What is but
    a little better is not."""
    kept: list[Outcome] = []
    for one in sorted(
        complete(found), key=lambda o: (o.seconds, o.spacing, o.undistinguished(family), o.worst(family))
    ):
        if not any(other.spacing <= one.spacing and _hardly_worse(other, one, family) for other in kept):
            kept.append(one)
    return kept


@dataclass(frozen=True)
class Choice:
    """The plan to take, None where none is fast enough; `next_better`: the fastest with nodes as near that is better by
    a fifth at least. `spacing_kept`: its nodes are as near as was asked for; `reached`: it reaches the goals."""

    taken: Outcome | None
    spacing_kept: bool
    reached: bool
    next_better: Outcome | None
    fastest: Outcome | None  # of those with nodes near enough


def choose(found: Sequence[Outcome], aim: Aim) -> Choice:
    """The best plan for the aim within the time and with nodes near enough; where none has, of those within the time
    whose nodes are nearest."""
    plans = complete(found)
    fitting = [o for o in plans if o.minutes <= aim.minutes]
    near = [o for o in plans if o.spacing <= aim.spacing * (1.0 + 1e-9)]
    allowed = [o for o in near if o.minutes <= aim.minutes]
    kept = bool(allowed)
    if not kept and fitting:
        nearest = min(o.spacing for o in fitting)
        allowed = [o for o in fitting if o.spacing == nearest]
    taken = min(allowed, key=aim.order, default=None)
    better = [o for o in front(found, aim.family) if taken is not None and _much_better(o, taken, aim.family)]
    return Choice(
        taken,
        kept,
        taken is not None and aim.missed(taken) <= 1.0,
        min(better, key=_seconds, default=None),
        min(near, key=_seconds, default=None),
    )


def _much_better(one: Outcome, other: Outcome, family: Family) -> bool:
    fewer = one.undistinguished(family) < other.undistinguished(family)
    smaller = one.undistinguished(family) == other.undistinguished(family) and one.worst(family) <= 0.8 * other.worst(
        family
    )
    return one.spacing <= other.spacing and (fewer or smaller)


def _seconds(one: Outcome) -> float:
    return one.seconds


def own_spacing(known: Known) -> float:
    """How far nodes of the scenario's own plan are apart, mm: the largest of three axes."""
    return float(max(known.plan.volume)) / known.plan.steps
