"""Which mistake explains a run: every hypothesis of the catalogue is fitted, and the best are adjusted.

A mistake is named where the fit with it undone is better by `CLEAR` in chi-square than with the readings and the
scenario as they are (relative to the variance factor that is left, so that noise of any size names nothing), is not
itself rejected, and explains more than the faults of single readings that the adjustment found. What is less than
`ALTERNATIVE` behind the best is not told from it, and is named with it."""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

import numpy as np

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.mistakes.catalogue import CATALOGUE
from stepdiag.mistakes.copies import Copy, Family, Hypothesis, in_turn, passes_of, without
from stepdiag.mistakes.nominal_way import gross_lines
from stepdiag.scenario.description import Scenario, adjust_scenario, adjustment_options
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.known import Known
from stepdiag.scenario.planned_readings import check_points, only

CLEAR: Final = 60.0  # least gain in chi-square
ALTERNATIVE: Final = 25.0  # what is less behind the best may be it, as of faults
FAULT: Final = 28.0  # what one fault of single readings must explain to be one
CREDIBLE: Final = 9.0  # variance factor above which a fit is rejected: not worth an exact adjustment
MOST_ADJUSTED: Final = 4
BEGUN: Final = 2  # singles on which a second mistake is sought
SCREENING: Final = 3  # steps of Gauss-Newton after which a run that fits is told from the others
ENOUGH: Final = 30  # after which it is at its minimum
REFINED: Final = 10  # of the best of a screening
MOST_PARABOLAS: Final = 6
NEAR: Final = 10.0  # times the least square sum of a screening, above which nothing becomes the best


@dataclass(frozen=True)
class FoundMistake:
    """A mistake that would explain a run.

    entry: its name in the catalogue; of two at once both.
    text, edit: what happened, and what to change; without a full stop.
    fit, variance_factor: verdict of the adjustment with the mistake undone.
    variance_factor_before: with it; None where the readings could not be adjusted."""

    entry: str
    text: str
    edit: str
    fit: str
    variance_factor: float
    variance_factor_before: float | None


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


def find_mistakes(
    scenario: Scenario | Known,
    measurement: _core.Measurement,
    adjustment: _core.Adjustment | None = None,
    *,
    refused: bool = False,
) -> list[FoundMistake]:
    """The mistakes of which one would explain why a run and its scenario disagree; none where nothing does, or nothing
    needs to.

    Several mean that the readings do not tell which of them it was. Looks for each entry of the catalogue
    (docs/mistakes.md) and for two at once.

    Args:
        scenario: its `known` half is used.
        measurement: the run, as it was read.
        adjustment: of this run, if there is one: faults of single readings that it found are not explained again.
        refused: the run cannot be adjusted, or not to what a machine can be.

    Raises:
        InvalidArgument: a point of the run is not in the scenario's plan.
    """
    known = scenario.known
    check_points(measurement, known.plan)
    copy = Copy(known, only(measurement, known.signals))
    with ThreadPoolExecutor(min(2, os.cpu_count() or 1)) as pool:
        return _Search(copy, adjustment, refused, pool).found()


class _Search:
    def __init__(
        self, copy: Copy, adjustment: _core.Adjustment | None, refused: bool, pool: ThreadPoolExecutor
    ) -> None:
        self._copy, self._adjustment, self._pool = copy, adjustment, pool
        # However well they fit: no machine is off by so much.
        self._is_impossible = refused or gross_lines(copy.known, copy.run) > 0
        self._as_read = _NONE if self._is_impossible else _fit_of(copy, ENOUGH)

    def found(self) -> list[FoundMistake]:
        singles = self._singles(self._copy)
        return (
            self._named(singles)
            or self._named(self._of_families())
            or self._named([pair for first in self._begun(singles) for pair in self._with_second(first)])
            or self._named(self._disturbed())
        )

    def _singles(self, copy: Copy) -> list[_Tried]:
        """The best of all mistakes without a number of their own, in the order of the catalogue."""
        gross = gross_lines(copy.known, copy.run)

        def screened(hypothesis: Hypothesis) -> _Tried | None:
            changed = _changed(hypothesis, copy)
            # What leaves distances off by millimetres needs no adjustment.
            if changed is None or not (left := gross_lines(changed.known, changed.run)) < max(gross, 1):
                return None
            return _Tried(hypothesis, _fit_of(changed, SCREENING if left == 0 else 1))

        tried = [one for one in self._pool.map(screened, _hypotheses(copy)) if one is not None]
        sums = sorted(one.fit.square_sum for one in tried)
        limit = min(sums[:REFINED][-1], NEAR * sums[0]) if sums else 0.0
        best = [one.hypothesis for one in tried if one.fit.square_sum <= limit]
        fits = self._pool.map(lambda hypothesis: _fit_of(hypothesis.change(copy), ENOUGH), best)
        return list(map(_Tried, best, fits))

    def _of_families(self) -> list[_Tried]:
        """The best of each family."""
        if self._is_impossible:
            return []  # what is no round number does not repair that
        families = [family for mistake in CATALOGUE for family in mistake.families_of(self._copy)]
        best = self._pool.map(lambda family: _best_of(family, self._copy, self._as_read), families)
        return [one for one in best if one is not None]

    def _begun(self, tried: list[_Tried]) -> list[_Tried]:
        """Mistakes that explain a part. What the readings do not tell apart begins once."""
        begun: list[_Tried] = []
        for one in sorted(tried, key=lambda one: one.fit.square_sum):
            if self._gain(one) < CLEAR:
                break
            if all(abs(other.fit.square_sum - one.fit.square_sum) > ALTERNATIVE * one.fit.factor for other in begun):
                begun.append(one)
            if len(begun) == BEGUN:
                break
        return begun

    def _with_second(self, first: _Tried) -> Iterator[_Tried]:
        for second in self._singles(first.hypothesis.change(self._copy)):
            a, b = first.hypothesis, second.hypothesis
            yield _Tried(
                Hypothesis(
                    f"{a.entry}, {b.entry}",
                    f"{a.text}, and {b.text}",
                    f"{a.edit}; then {b.edit}",
                    in_turn(a.change, b.change),
                    a.free + b.free + 10.0,  # of so many pairs
                ),
                second.fit,
            )

    def _gain(self, tried: _Tried) -> float:
        factor = max(1.0, tried.fit.factor)
        return self._as_read.excess(factor) - tried.excess(factor)

    def _named(self, tried: Sequence[_Tried]) -> list[FoundMistake]:
        """The best with all that is not told from it, adjusted exactly."""
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
            key=lambda one: round(one.excess(factor) - best),
        )
        return [found for one in alike[:MOST_ADJUSTED] if (found := self._adjusted(one.hypothesis)) is not None]

    def _is_explained_by_faults(self, best: float, factor: float, *, last: bool) -> bool:
        """Whether the faults that the adjustment found explain as much."""
        adjustment = self._adjustment
        if adjustment is None or not adjustment.faults:
            return False
        left = _Fit(adjustment.weighted_square_sum, adjustment.degrees_of_freedom).excess(factor)
        return left + FAULT * len(adjustment.faults) * (not last) < best + (CLEAR if last else 10.0)

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
        if len(passes) < 2:
            return []
        names = self._copy.known.signals

        def left(rows: "np.typing.NDArray[np.int_]") -> _Fit:
            return _fit_of(without(rows, names)(self._copy), ENOUGH)

        keys = list(passes)
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


def _best_of(family: Family, copy: Copy, as_read: _Fit) -> _Tried | None:
    """The hypothesis of a family that fits best; None where it is at the end of the trials, or as things are."""
    fits = {0.0: as_read}
    for value in family.trials:
        fits[value] = _fit_of(family.make(value).change(copy), SCREENING)
    for _ in range(MOST_PARABOLAS):
        before, least = min(fit.square_sum for fit in fits.values()), _least(fits)
        if least is None or least in fits:
            break
        fits[least] = _fit_of(family.make(least).change(copy), ENOUGH)
        if abs(before - fits[least].square_sum) < 0.1:
            break
    values = sorted(fits)
    best = min(values, key=lambda value: fits[value].square_sum)
    if best in (values[0], values[-1], 0.0):
        return None
    return _Tried(family.make(best), fits[best])


def _least(fits: dict[float, _Fit]) -> float | None:
    """Where the parabola through the best value and its neighbours is least; None at the end."""
    values = sorted(fits)
    k = min(range(len(values)), key=lambda i: fits[values[i]].square_sum)
    if not 0 < k < len(values) - 1:
        return None
    x = np.array(values[k - 1 : k + 2])
    y = np.array([fits[value].square_sum for value in x])
    if not np.isfinite(y).all():
        return None
    left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    if not right > left:
        return None
    bend = (right - left) / (x[2] - x[0])
    return float(np.clip(0.5 * (x[0] + x[1]) - left / (2.0 * bend), x[0], x[2]))
