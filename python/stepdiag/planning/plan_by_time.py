"""Which plan to measure in the time that there is: for step numbers, sets of lines and repeats, how long each takes and
the largest standard uncertainty of each kind that it gives, before anyone measures."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.calibration.largest_by_kind import largest_uncertainties
from stepdiag.config.scenario_keys import MachineErrorsKeys, RandomSection, TruthKeys
from stepdiag.config.toml_text import located
from stepdiag.parameters import KINDS, Kind, kind_of
from stepdiag.planning.fault_control import tells_all
from stepdiag.planning.measuring_time import measuring_time, times_of
from stepdiag.planning.observation import extents, not_measured
from stepdiag.scenario.description import Scenario, adjust_scenario, simulate_scenario
from stepdiag.scenario.known import Known, runs_of
from stepdiag.scenario.truth import Truth, truth_of
from stepdiag.units import MINUTE

# What a plan is to be good at: the error of the functional point in the volume, a family of parameters, or power against
# faults of the readings.
Family = Literal["volume", "length", "angle", "squareness", "faults"]
FAMILIES: Final[dict[Family, tuple[Kind, ...]]] = {
    "length": ("positioning", "straightness"),
    "angle": ("angle",),
    "squareness": ("squareness",),
}

# Of two plans whose uncertainties differ by less than this share, the faster one is shown.
ALIKE: Final = 0.05
MOST_CANDIDATES: Final = 2000

_DIAGONALS: Final = ("ppp", "npp", "pnp", "nnp")
_FACES: Final = ("pp0", "np0", "p0p", "n0p", "0pp", "0np")
_SCALES: Final = ("p00", "0p0", "00p")
_USUAL_SETS: Final = (
    (*_DIAGONALS, *_SCALES),
    (*_DIAGONALS, *_SCALES[:2]),
    _DIAGONALS,
    (*_DIAGONALS[:3], *_SCALES),
    (*_DIAGONALS, *_FACES[::2], *_SCALES),
    _FACES,
    (*_FACES, *_SCALES),
    (*_DIAGONALS, *_FACES),
    (*_DIAGONALS, *_FACES, *_SCALES),
)


@dataclass(frozen=True)
class Candidate:
    lines: tuple[str, ...]
    scale_lines: tuple[str, ...]
    steps: int
    repeats: int
    check_points: int = 0
    """Steps after which the program returns to a line's check point; 0: never."""
    scale_points: Literal["ends", "steps"] = "ends"
    backward: bool = False

    @property
    def description(self) -> str:
        """In words: "4 body diagonals, 3 scale lines"."""
        return ", ".join(f"{count} {name}{'s' * (count > 1)}" for name, count in self.counts.items() if count)

    @property
    def counts(self) -> dict[str, int]:
        """Number of lines of each kind."""
        counts = {name: sum(_moved(line) == axes for line in self.lines) for axes, name in _NAMES}
        return counts | {"scale line": len(self.scale_lines)}


_NAMES: Final = ((3, "body diagonal"), (2, "face diagonal"), (1, "single-axis line"))


def _moved(line: str) -> int:
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
            return max((c.found_from if c.count and not c.uncontrolled else math.inf for c in self._readings), default=math.inf)
        return max(self.largest.get(kind, math.inf) for kind in FAMILIES[family])

    @property
    def untold(self) -> int:
        """How many kinds of faults are not told from all others, or not controlled."""
        return sum(bool(c.twins or c.uncontrolled or not c.count) for c in self.faults or ())

    @property
    def _readings(self) -> list[_core.FaultControl]:
        return [c for c in self.faults or () if (c.kind, c.channel) == ("reading", "distance")]


def candidates(scenario: Scenario) -> list[Candidate]:
    """All plans to choose from. Raises InvalidArgument where the scenario names lines that there are not."""
    known = scenario.known
    keys, plan = known.keys.plan_by_time, known.plan
    stated = known.keys.plan
    own = Candidate(tuple(plan.lines), tuple(plan.scale_lines), plan.steps, stated.repeats, stated.check_points)
    sets = {(own.lines, own.scale_lines): None}
    for index, lines in enumerate(_USUAL_SETS if keys.line_sets is None else keys.line_sets):
        measured = tuple(line for line in lines if _moved(line) != 1)
        scales = tuple(line for line in lines if _moved(line) == 1)
        with located(f"{scenario.path}: plan_by_time.line_sets: set {index + 1}"):
            _core.Plan(plan.volume, list(measured), plan.steps, scale_lines=list(scales))
        sets[measured, scales] = None
    steps, repeats = sorted({*keys.steps, own.steps}), sorted({*keys.repeats, own.repeats})
    returns = {n: _returns(known, n) for n in steps}
    count = len(sets) * sum(map(len, returns.values())) * len(repeats)
    if count > MOST_CANDIDATES:
        raise InvalidArgument(
            f"{scenario.path}: plan_by_time: expected at most {MOST_CANDIDATES} plans to choose from, got {count} "
            f"({len(sets)} sets of lines, {len(steps)} numbers of steps, {len(repeats)} of repeats)"
        )
    return [
        Candidate(*lines, n, r, every)
        for lines, n, r in itertools.product(sets, steps, repeats)
        for every in returns[n]
    ]


def _returns(known: Known, steps: int) -> list[int]:
    """After how many steps plans of so many steps return to a check point: as the scenario says, and, where the drift
    of the functional point is an unknown, never and after each fourth of a line."""
    own = min(known.keys.plan.check_points, steps)
    return sorted({own} if known.machine_drift is None else {0, own, math.ceil(steps / 4)})


def outcomes(scenario: Scenario, progress: Callable[[int, int], None] | None = None) -> list[Outcome]:
    """Of all candidates. `progress` is told how many of how many are done."""
    everything = candidates(scenario)
    result = []
    for done, candidate in enumerate(everything, 1):
        result.append(outcome(scenario, candidate))
        if progress is not None:
            progress(done, len(everything))
    return result


def outcome(scenario: Scenario, candidate: Candidate) -> Outcome:
    """The time that a plan takes, and the uncertainties of the adjustment of a run of it.

    The machine of that run has errors: some uncertainties depend on them, for a beam that is 1 mm beside its place
    reads more or less as the mirror tilts."""
    known, plan_keys = scenario.known, scenario.known.keys.plan
    plan = _core.Plan(
        known.plan.volume,
        list(candidate.lines),
        candidate.steps,
        order=known.plan.orders,
        scale_lines=list(candidate.scale_lines),
        check_points=_core.CheckPoints(candidate.check_points, min(plan_keys.check_point, candidate.steps)),
    )
    times = times_of(known.keys.plan_by_time, f"{known.path}: plan_by_time")
    runs = candidate.repeats * runs_of(plan_keys) // plan_keys.repeats
    seconds, between = measuring_time(plan, times, repeats=runs, backward=plan_keys.backward)
    spacing = float(max(plan.volume)) / candidate.steps
    width, height = plan.smallest_mirror()
    largest: dict[Kind, float] = {}
    determined: frozenset[str] = frozenset()
    trouble = ""
    try:
        usual = _usual(scenario, candidate, between)
        calibration, largest = _propagated(usual) if _says_more(known) else _adjusted(usual)
        determined = frozenset(extents(calibration, plan)[0])
    except InvalidArgument as error:
        trouble = str(error)
    return Outcome(candidate, seconds, spacing, (float(width), float(height)), largest, determined, trouble)


def _usual(scenario: Scenario, candidate: Candidate, between: float) -> Scenario:
    """A plan's run of a usual machine, with so many seconds from a reading to the next one."""
    changes = {
        "lines": candidate.lines,
        "scale_lines": candidate.scale_lines,
        "steps": candidate.steps,
        "repeats": candidate.repeats,
        "check_points": candidate.check_points,
        "seconds_per_reading": between or None,
    }
    planned = not_measured(scenario.known, changes)
    return Scenario(planned, _usual_truth(scenario.truth, planned))


def controls(scenario: Scenario, candidate: Candidate) -> Sequence[_core.FaultControl]:
    """The faults of its readings that a plan controls; none where it determines nothing."""
    try:
        usual = _usual(scenario, candidate, scenario.known.keys.plan.seconds_per_reading or 0.0)
        return adjust_scenario(usual.known, simulate_scenario(usual), reliability=True).reliability
    except InvalidArgument:
        return ()


@dataclass(frozen=True)
class Controlled:
    """A plan that is taken, or one that tells all faults apart, and the faults that it controls."""

    plan: Outcome
    faults: Sequence[_core.FaultControl]


def telling(
    scenario: Scenario, found: Sequence[Outcome], taken: Outcome, family: Family = "length"
) -> tuple[Controlled, Controlled | None]:
    """The plan that is taken, and the fastest one with as many steps and hardly larger uncertainties that tells all
    faults apart; None where none does."""
    own = Controlled(taken, controls(scenario, taken.candidate))
    if own.faults and tells_all(own.faults):
        return own, own
    limit = (1.0 + ALIKE) * taken.worst(family)
    for one in sorted(complete(found), key=_seconds):
        if one.candidate.steps != taken.candidate.steps or one is taken or one.worst(family) > limit:
            continue
        faults = controls(scenario, one.candidate)
        if faults and tells_all(faults):
            return own, Controlled(one, faults)
    return own, None


def _usual_truth(truth: Truth, planned: Known) -> Truth:
    """Of a machine with the errors of [machine.random], else of that section's defaults, with the [misalignment]."""
    machine = MachineErrorsKeys(random=truth.keys.machine.random or RandomSection(seed=0))
    return truth_of(TruthKeys(machine=machine, misalignment=truth.keys.misalignment), {}, planned)


def _says_more(known: Known) -> bool:
    """Whether its [uncertainty] names more than the noise of the readings."""
    return bool(known.uncertain.inputs) or any(noise.quantity != "channel" for noise in known.uncertain.noise)


def _adjusted(usual: Scenario) -> tuple[_core.Calibration, dict[Kind, float]]:
    """By the readings' own uncertainties."""
    calibration = adjust_scenario(usual.known, simulate_scenario(usual)).calibration
    return calibration, {kind: value for kind, (value, _) in largest_uncertainties(calibration).items()}


def _propagated(usual: Scenario) -> tuple[_core.Calibration, dict[Kind, float]]:
    """By all that [uncertainty] names: drifts and walks take the longer, the longer measuring takes."""
    from stepdiag.uncertainty.virtual_calibrations import virtual_calibrations

    model = virtual_calibrations(usual, method="adjustment")
    largest: dict[Kind, float] = {}
    with located(str(usual.path)):
        found = _core.propagate(model)
    for output, u in zip(model.outputs, found.standard_uncertainty, strict=True):
        kind = kind_of(output.name)
        largest[kind] = max(largest.get(kind, 0.0), float(u))
    return model.calibration, {kind: largest[kind] for kind in KINDS if kind in largest}


def complete(found: Sequence[Outcome]) -> list[Outcome]:
    """Those that determine as many parameters as any."""
    most = max((len(o.determined) for o in found), default=0)
    return [o for o in found if most > 0 and len(o.determined) == most]


def front(found: Sequence[Outcome], family: Family = "length") -> list[Outcome]:
    """Of the complete ones, those that no other one beats in time, spacing and the uncertainty of a family, fastest
    first. What is but a little better is not."""
    kept: list[Outcome] = []
    for one in sorted(complete(found), key=lambda o: (o.seconds, o.spacing, o.worst(family))):
        limit = (1.0 + ALIKE) * one.worst(family)
        if not any(other.spacing <= one.spacing and other.worst(family) <= limit for other in kept):
            kept.append(one)
    return kept


@dataclass(frozen=True)
class Choice:
    """The plan to take, None where none is fast enough; `next_better`: the fastest with nodes as near and an
    uncertainty smaller by a fifth at least. `spacing_kept`: its nodes are as near as was asked for."""

    taken: Outcome | None
    spacing_kept: bool
    next_better: Outcome | None
    fastest: Outcome | None  # of those with nodes near enough


def choose(found: Sequence[Outcome], minutes: float, spacing: float, family: Family = "length") -> Choice:
    """The plan of the smallest uncertainty within the time and with nodes at most `spacing` mm apart; where none has,
    of those within the time whose nodes are nearest."""
    plans = front(found, family)
    fitting = [o for o in plans if o.minutes <= minutes]
    near = [o for o in plans if o.spacing <= spacing * (1.0 + 1e-9)]
    allowed = [o for o in near if o in fitting]
    kept = bool(allowed)
    if not kept and fitting:
        nearest = min(o.spacing for o in fitting)
        allowed = [o for o in fitting if o.spacing == nearest]
    taken = min(allowed, key=lambda o: (o.worst(family), o.seconds), default=None)
    better = [o for o in plans if taken and o.spacing <= taken.spacing and o.worst(family) <= 0.8 * taken.worst(family)]
    return Choice(taken, kept, min(better, key=_seconds, default=None), min(near, key=_seconds, default=None))


def _seconds(one: Outcome) -> float:
    return one.seconds


def own_spacing(known: Known) -> float:
    """How far nodes of the scenario's own plan are apart, mm: the largest of three axes."""
    return float(max(known.plan.volume)) / known.plan.steps
