"""Which mistake explains a run: every hypothesis of the catalogue is fitted, and the best are adjusted.

A mistake is named where the fit with it undone is better by `CLEAR` in chi-square than with the readings and the
scenario as they are (relative to the variance factor that is left, so that noise of any size names nothing), is not
itself rejected, and explains more than the faults of single readings that the adjustment found. What is less than
`ALTERNATIVE` behind the best is not distinguished from it, and is named with it.

Quick fits take plain steps of Gauss-Newton: what fits is at its minimum after a few, and what does not need not be.
Of many runs some are fitted first, and all only with the best of what explains those."""

import math
import os
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Final

import numpy as np

from stepdiag import _core
from stepdiag._core import InvalidArgument, check_points
from stepdiag.findings.mistakes import FoundMistake
from stepdiag.mistakes.catalogue import CATALOGUE
from stepdiag.mistakes.copies import Change, Copy, Family, Hypothesis, Rows, in_turn, of_rows, passes_of, without
from stepdiag.mistakes.nominal_way import Way, distance_of, ways_of
from stepdiag.scenario.description import Scenario, adjust_scenario, adjustment_options, reduced_run
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.known import Known
from stepdiag.wrong_arguments import checked

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

CLEAR: Final = _core.thresholds.mistake
ALTERNATIVE: Final = _core.thresholds.alternative
CHANCE: Final = _core.thresholds.chance
FAULT: Final = _core.thresholds.fault
FAULTS_OF_MISTAKE: Final = _core.thresholds.faults_of_mistake
LINES_OF_MISTAKE: Final = _core.thresholds.lines_of_mistake
CREDIBLE: Final = _core.thresholds.largest_variance_factor  # above it: not worth an exact adjustment
PROMISING: Final = 36.0  # after the screening: what is above is not below `CREDIBLE` at its minimum
MOST_ADJUSTED: Final = 4
BEGUN: Final = 2  # singles on which a second mistake is sought
LARGER: Final = 0.7  # of the square sum, which the larger of two mistakes leaves at most
SCREENING: Final = 3  # steps of Gauss-Newton after which a run that fits is distinguished from the others
ENOUGH: Final = 8  # after which it is at its minimum
REFINED: Final = 10  # of the best of a screening
MOST_PARABOLAS: Final = 6
SAMPLE: Final = 2500  # readings of the runs by which mistakes are screened: the time of a search is then limited
MOST_DISTURBED: Final = 40  # passes of which one is tried as the disturbed one
NEAR: Final = 10.0  # times the least square sum of a screening, above which nothing becomes the best


@dataclass(frozen=True)
class _Fit:
    square_sum: float
    freedom: int

    @property
    def factor(self) -> float:
        return self.square_sum / self.freedom if self.freedom > 0 else 1.0

    def excess(self, factor: float) -> float:
        """Of chi-square over what is expected where readings scatter by this variance factor."""
        return self.square_sum / factor - self.freedom


_NONE: Final = _Fit(float("inf"), 1)


@dataclass(frozen=True)
class _Tried:
    hypothesis: Hypothesis
    fit: _Fit

    def excess(self, factor: float) -> float:
        return self.fit.excess(factor) + self.hypothesis.free


@checked
def find_mistakes(
    scenario: Scenario | Known,
    measurement: _core.Measurement,
    adjustment: _core.Adjustment | None = None,
    *,
    refused: bool = False,
) -> list[FoundMistake]:
    """The mistakes of which one would explain why a run and its scenario disagree; none where nothing does, or nothing
    needs to.

    Several mean that the readings do not determine which of them it was. Looks for each entry of the catalogue
    (docs/mistakes.md) and for two at once.

    Args:
        scenario: its `known` half is used.
        measurement: the run, as it was read.
        adjustment: of this run, if there is one: faults of single readings that it found are not explained again.
        refused: the run cannot be adjusted, or not to what a machine can be.

    Raises:
        InvalidArgument: a point of the run is not in the scenario's plan.
    """
    return MistakeSearch(scenario, measurement).after(adjustment, refused=refused)


class MistakeSearch:
    """The search in one run, before its adjustment and after it. Raises InvalidArgument for a point that is not in the
    plan."""

    def __init__(self, scenario: Scenario | Known, measurement: _core.Measurement) -> None:
        known = scenario.known
        check_points(measurement, known.plan)
        reduced = replace(known, assumed_air=None, instrument=known.instrument.corrected())
        self._copy = Copy(reduced, reduced_run(known, measurement))
        with np.errstate(all="ignore"):  # of readings that are no numbers of a machine
            self._ways = ways_of(known, self._copy.run)
            # However well they fit: no machine is off by so much.
            self._is_impossible = _gross(self._ways) > 0
        self._sample = _some_runs(self._copy, self._ways)
        self._adjustment: _core.Adjustment | None = None

    def before(self) -> list[FoundMistake]:
        """Mistakes of a run that is far from its scenario, and fits with one of them undone: faults of single readings,
        which would take long to find, explain no more. None of other runs."""
        if self._as_read.factor <= CREDIBLE:
            return []
        with np.errstate(all="ignore"), _pool() as self._pool:
            found = (
                self._named(self._single)
                or self._named(self._of_families(of_faults=False))
                or self._named(self._pairs())
            )
        return found if found and found[0].fit == "accepted" else []

    def after(
        self, adjustment: _core.Adjustment | None, *, refused: bool = False, disturbed: bool = True
    ) -> list[FoundMistake]:
        """As find_mistakes. Without `disturbed` no line is named that merely disagrees with the others: without one
        of few lines nothing controls the noise of the others."""
        self._adjustment = adjustment
        if refused:
            self._is_impossible, self._as_read = True, _NONE
        elif adjustment is not None and not adjustment.faults and adjustment.weighted_square_sum > 0.0:
            as_adjusted = _Fit(adjustment.weighted_square_sum, adjustment.degrees_of_freedom)
            self._as_read = min(self._as_read, as_adjusted, key=lambda fit: fit.factor)
        with np.errstate(all="ignore"), _pool() as self._pool:
            return (
                self._named(self._single)
                or self._named(self._of_families())
                or self._named(self._pairs())
                or (self._named(self._disturbed()) if disturbed else [])
            )

    @cached_property
    def _as_read(self) -> _Fit:
        return _NONE if self._is_impossible else _fit_of(self._copy, ENOUGH)

    @cached_property
    def _single(self) -> list[_Tried]:
        return self._singles(lambda copy: copy)

    def _singles(self, begun: Change) -> list[_Tried]:
        """The best of all mistakes without a number of their own, in the order of the catalogue, in copies that are
        begun like this."""
        copy, sample = begun(self._copy), begun(self._sample)
        ways = ways_of(sample.known, sample.run)
        gross = max(_gross(ways), 1)

        def screened(hypothesis: Hypothesis) -> _Tried | None:
            changed = _changed(hypothesis, sample)
            # What leaves distances off by millimetres needs no adjustment.
            if changed is None or not (left := _gross_of(changed, sample, ways)) < gross:
                return None
            return _Tried(hypothesis, _fit_of(changed, SCREENING if left == 0 else 1))

        tried = [one for one in self._pool.map(screened, _hypotheses(sample)) if one is not None]
        sums = sorted(one.fit.square_sum for one in tried)
        limit = min(sums[:REFINED][-1], NEAR * sums[0]) if sums else 0.0

        def refined(one: _Tried) -> _Tried:
            if one.fit.factor > PROMISING:
                return one
            return replace(one, fit=_fit_of(one.hypothesis.change(sample), ENOUGH))

        best = list(self._pool.map(refined, [one for one in tried if one.fit.square_sum <= limit]))
        return best if sample is copy else list(self._pool.map(self._of_all_runs(copy), best))

    def _of_all_runs(self, copy: Copy) -> Callable[[_Tried], _Tried]:
        """Fits to all runs what was tried with some of them, where it may be better than the run as it was read."""
        whole = {(one.entry, one.text): one for one in _hypotheses(copy)}  # which know the rows of their run

        def fitted(one: _Tried) -> _Tried:
            factor = max(1.0, one.fit.factor)
            gain = self._sample_as_read.excess(factor) - one.excess(factor)
            own = whole.get((one.hypothesis.entry, one.hypothesis.text))
            changed = _changed(own, copy) if own is not None and gain > 0.5 * CLEAR * self._share else None
            if own is None or changed is None:
                return replace(one, fit=_NONE)
            return _Tried(own, _fit_of(changed, ENOUGH if one.fit.factor <= PROMISING else SCREENING))

        return fitted

    @cached_property
    def _sample_as_read(self) -> _Fit:
        """As `_as_read`, of the runs by which mistakes are screened."""
        if self._sample is self._copy or self._is_impossible:
            return self._as_read
        return _fit_of(self._sample, ENOUGH)

    @property
    def _share(self) -> float:
        """Of all readings, those of these runs."""
        return len(self._sample.run) / len(self._copy.run)

    def _of_families(self, *, of_faults: bool = True) -> list[_Tried]:
        """The best of each family; without `of_faults` not of those that the adjustment looks for itself."""
        if self._is_impossible:
            return []  # what is no round number does not repair that
        # Where the adjustment found a factor, or what may be one, its sentence is the one.
        found = self._adjustment.faults if self._adjustment else []
        told = {fault.line for each in found for fault in each.members if fault.kind == "factor"}
        families = self._families(self._copy, told if of_faults else None)
        some = self._families(self._sample, told if of_faults else None)

        def best(whole: Family, of_sample: Family) -> _Tried | None:
            # Readings of more runs show less gain.
            value = _best_of(of_sample, self._sample, self._sample_as_read, 0.5 * CLEAR * self._share)
            if value and self._sample is not self._copy:
                value = _best_of(whole, self._copy, self._as_read, 0.5 * CLEAR, begin=value)
            if not value:
                return None
            made = whole.make(value)
            return _Tried(made, _fit_of(made.change(self._copy), ENOUGH))

        return [one for one in self._pool.map(best, families, some) if one is not None]

    @staticmethod
    def _families(copy: Copy, told: Collection[str] | None) -> list[Family]:
        """Of a copy; those that the adjustment looks for itself only with `told`, the lines of which it found one."""
        return [
            family
            for mistake in CATALOGUE
            for family in mistake.families_of(copy)
            if family.fault is None or (told is not None and family.fault not in told)
        ]

    def _pairs(self) -> list[_Tried]:
        return [pair for first in self._begun(self._single) for pair in self._with_second(first)]

    def _begun(self, tried: list[_Tried]) -> list[_Tried]:
        """Mistakes that explain a part. What the readings do not distinguish begins once."""
        begun: list[_Tried] = []
        for one in sorted(tried, key=lambda one: one.fit.square_sum):
            # The larger of two mistakes makes more of the misfit than the other.
            if self._gain(one) < CLEAR or one.fit.square_sum > LARGER * self._as_read.square_sum:
                break
            if all(abs(other.fit.square_sum - one.fit.square_sum) > ALTERNATIVE * one.fit.factor for other in begun):
                begun.append(one)
            if len(begun) == BEGUN:
                break
        return begun

    def _with_second(self, first: _Tried) -> Iterator[_Tried]:
        for second in self._singles(first.hypothesis.change):
            a, b = first.hypothesis, second.hypothesis
            yield _Tried(
                Hypothesis(
                    f"{a.entry}, {b.entry}",
                    f"{a.text}, and {b.text}",
                    f"{a.edit}; then {b.edit}",
                    in_turn(a.change, b.change),
                    a.free + b.free + 10.0,  # the number of pairs that are compared
                ),
                second.fit,
            )

    def _gain(self, tried: _Tried) -> float:
        factor = max(1.0, tried.fit.factor)
        return self._as_read.excess(factor) - tried.excess(factor)

    def _named(self, tried: Sequence[_Tried]) -> list[FoundMistake]:
        """The best with all that is not distinguished from it, adjusted exactly."""
        if not tried:
            return []
        factor = max(1.0, min(one.fit.factor for one in tried))
        first = min(tried, key=lambda one: one.excess(factor))
        if self._gain(first) < CLEAR or factor > CREDIBLE:
            return []
        best = min(one.excess(factor) for one in tried)
        if self._is_explained_by_faults(best, factor, last=first.hypothesis.last_resort):
            return []
        # What fits equally well stays in the order of the catalogue.
        alike = sorted(
            (one for one in tried if one.excess(factor) - best < ALTERNATIVE),
            key=lambda one: (one.excess(factor) - best) // CHANCE,
        )
        adjusted = self._pool.map(self._adjusted, [one.hypothesis for one in alike[:MOST_ADJUSTED]])
        found = [one for one in adjusted if one is not None]
        if found:
            more, by_faults = max(0, len(alike) - MOST_ADJUSTED), self._left_by_faults(factor)
            # What explains as much without a number of its own does so by no chance.
            is_as_likely = first.hypothesis.free > 0.0 and not self._has_unlikely_faults()
            or_faults = by_faults - best < ALTERNATIVE and is_as_likely
            found[0] = replace(found[0], alternatives=more, or_faults=or_faults)
        return found

    def _left_by_faults(self, factor: float) -> float:
        """What the faults that the adjustment found leave of chi-square; infinite where it found none."""
        adjustment = self._adjustment
        if adjustment is None or not adjustment.faults:
            return math.inf
        return _Fit(adjustment.weighted_square_sum, adjustment.degrees_of_freedom).excess(factor)

    def _has_unlikely_faults(self) -> bool:
        """Whether one mistake is likelier than the faults that the adjustment found in its place."""
        faults = self._adjustment.faults if self._adjustment else []
        lines = {found.members[0].line for found in faults}
        return len(faults) >= FAULTS_OF_MISTAKE or len(lines) >= LINES_OF_MISTAKE

    def _is_explained_by_faults(self, best: float, factor: float, *, last: bool) -> bool:
        """Whether the faults that the adjustment found explain as much."""
        count = len(self._adjustment.faults) if self._adjustment else 0
        return self._left_by_faults(factor) + FAULT * count * (not last) < best + (CLEAR if last else 10.0)

    def _adjusted(self, hypothesis: Hypothesis) -> FoundMistake | None:
        try:
            changed = hypothesis.change(self._copy)
            adjustment = adjust_scenario(changed.known, changed.run)
        except InvalidArgument:
            return None
        verdict = adjustment.verdict
        if verdict.fit == "rejected" and any(r.finding not in ("fault", "alternatives") for r in verdict.reasons):
            return None
        before = self._as_read.factor if np.isfinite(self._as_read.square_sum) else None
        return FoundMistake(
            hypothesis.entry, hypothesis.text, hypothesis.edit, verdict.fit, adjustment.variance_factor, before
        )

    def _disturbed(self) -> list[_Tried]:
        """A stretch of one line without which all others agree: where it is sought, as nothing says what it was."""
        passes = passes_of(self._copy.run)
        # A stretch is named for what chi-square has above its expectation, not for what chance takes off.
        if len(passes) < 2 or self._as_read.excess(1.0) < CLEAR:
            return []
        names = self._copy.known.signals

        def left(rows: "np.typing.NDArray[np.int_]") -> _Fit:
            return _fit_of(without(rows, names)(self._copy), ENOUGH)

        keys = self._suspects(passes)
        fits = list(self._pool.map(lambda key: left(passes[key]), keys))
        (number, line), best = min(zip(keys, fits, strict=True), key=lambda pair: pair[1].factor)
        rows, factor = passes[number, line], max(1.0, best.factor)
        enough = best.excess(factor) + 0.5 * CLEAR

        def is_enough(first: int, last: int) -> bool:
            return left(rows[first : last + 1]).excess(factor) <= enough

        first, last = 0, len(rows) - 1
        low, high = 0, last  # the latest first row
        while low < high:
            middle = (low + high + 1) // 2
            low, high = (middle, high) if is_enough(middle, last) else (low, middle - 1)
        first = low
        low, high = first, last  # the earliest last row
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if is_enough(first, middle) else (middle + 1, high)
        last = low
        points = self._copy.run.point[rows[[first, last]]]
        run = f" (run {number})" if number else ""
        stretch = rows[first : last + 1]
        text = f"the readings of line {line}{run} from point {points[0]} to point {points[1]} do not go with the others"
        if len(stretch) == len(rows):
            text = f"no reading of line {line}{run} goes with the other lines"
        return [
            _Tried(
                Hypothesis(
                    "disturbed",
                    f"{text}, which agree without them",
                    "measure this line again, or empty these fields in the run",
                    without(stretch, names),
                    free=2.0,
                    last_resort=True,
                ),
                left(stretch),
            )
        ]

    def _suspects(self, passes: Mapping[tuple[int, str], Rows]) -> list[tuple[int, str]]:
        """The passes that may be disturbed: all, or of many those that fit worst."""
        if len(passes) <= MOST_DISTURBED:
            return list(passes)
        if self._adjustment is None:
            return [key for key in passes if key[0] in set(self._sample.run.run.tolist())][:MOST_DISTURBED]
        squares = np.zeros(len(self._copy.run))
        for values in self._adjustment.normalised_residuals.values():
            squares += np.nan_to_num(values) ** 2
        return sorted(passes, key=lambda key: -float(np.mean(squares[passes[key]])))[:MOST_DISTURBED]


def _some_runs(copy: Copy, ways: Sequence[Way]) -> Copy:
    """All of a run, or some of its repetitions: those with lines that are off their way, else the first and others
    evenly among the rest. A mistake in the scenario, or in how it was measured, is in all of them."""
    runs = sorted(set(copy.run.run.tolist()))
    count = max(1, SAMPLE * len(runs) // max(len(copy.run), 1))
    if count >= len(runs):
        return copy
    off = Counter(way.run for way in ways if way.is_gross)
    evenly = {runs[k * len(runs) // count] for k in range(count)}
    chosen = set(sorted(runs, key=lambda run: (-off[run], run not in evenly, run))[:count])
    return replace(copy, run=of_rows(copy.run, np.flatnonzero(np.isin(copy.run.run, list(chosen)))))


def _pool() -> "ThreadPoolExecutor":
    from concurrent.futures import ThreadPoolExecutor  # slow; most runs need no search

    return ThreadPoolExecutor(min(2, os.cpu_count() or 1), initializer=partial(np.seterr, all="ignore"))


def _gross(ways: Sequence[Way]) -> int:
    """How many lines are not on their way."""
    return sum(way.is_gross for way in ways)


def _gross_of(changed: Copy, copy: Copy, ways: Sequence[Way]) -> int:
    """The same of a changed copy; what its readings alone differ in, costs less."""
    if changed.known.plan is not copy.known.plan:
        return _gross(ways_of(changed.known, changed.run))
    distance = distance_of(changed.known, changed.run)
    return _gross([replace(way, distance=distance[way.rows]) for way in ways])


def _hypotheses(copy: Copy) -> Iterator[Hypothesis]:
    for mistake in CATALOGUE:
        yield from mistake.of(copy)


def _changed(hypothesis: Hypothesis, copy: Copy) -> Copy | None:
    try:
        return hypothesis.change(copy)
    except InvalidArgument:
        return None


def _fit_of(copy: Copy, steps: int) -> _Fit:
    """How well a copy fits."""
    known = copy.known
    try:
        found = _core.fit_quality(
            copy.run, known.plan, of_run(known.heads), known.chain, known.tool, adjustment_options(known), steps
        )
    except InvalidArgument:
        return _NONE
    return _NONE if found is None else _Fit(found.weighted_square_sum, found.degrees_of_freedom)


def _best_of(family: Family, copy: Copy, as_read: _Fit, least_gain: float, *, begin: float = 0.0) -> float:
    """The number of a family with which a copy fits best; 0 where it is as things are, where less than `least_gain`
    would be gained, or at the family's end."""
    fits = {0.0: as_read}

    def fit(value: float) -> _Fit:
        if value not in fits:
            made = family.make(value)
            fitted = _fit_of(made.change(copy), ENOUGH)
            # Smaller readings have smaller residuals, whatever they are.
            fits[value] = replace(fitted, square_sum=fitted.square_sum + made.free)
        return fits[value]

    if begin:
        fit(begin)
    elif as_read.excess(1.0) > least_gain:  # the minimum may be far
        for value in family.far:
            fit(value)
    for _ in range(MOST_PARABOLAS):
        best = min(fits, key=lambda value: fits[value].square_sum)
        before, middle, after = (fit(best + step).square_sum for step in (-family.near, 0.0, family.near))
        slope, bend = after - before, after - 2.0 * middle + before
        if not (math.isfinite(slope) and bend > 0.0):
            break
        # A parabola, as the square sum is one to first order, tells the gain before it is tried.
        if best == 0.0 and slope * slope / (8.0 * bend) < least_gain:
            return 0.0
        least = best - family.near * slope / (2.0 * bend)
        if abs(least) >= family.limit or middle - fit(least).square_sum < 0.1:
            break
    best = min(fits, key=lambda value: fits[value].square_sum)
    return 0.0 if abs(best) >= family.limit else best
