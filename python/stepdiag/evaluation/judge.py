"""One judgement of a run (docs/conventions.md, "Verdict of a fit"): mistakes, evaluation, mistakes, verdict."""

from dataclasses import dataclass
from typing import Final, Literal

from stepdiag._core import (
    Adjustment,
    Calibration,
    FaultClass,
    InvalidArgument,
    Measurement,
    Outlier,
    VarianceComponent,
)
from stepdiag.findings.mistakes import FoundMistake, change_rows, mistake_text
from stepdiag.findings.reasons import mistake_reason
from stepdiag.mistakes.search import MistakeSearch
from stepdiag.scenario.description import (
    JudgedEvaluation,
    Scenario,
    adjust_scenario,
    evaluate_beside_adjustment,
    with_mistake,
)
from stepdiag.scenario.known import Known
from stepdiag.wrong_arguments import checked

# A sound run has a misfit at least as improbable in one of twenty cases. A search takes as long as an evaluation.
SEARCHED_BELOW: Final = 0.05


@dataclass(frozen=True, eq=False)
class Judgement:
    """A run's evaluation with its verdict.

    result: the adjustment, or what a linear method found beside it. Its verdict counts the mistakes.
    mistakes: of which one would explain the run; where the fit is accepted nevertheless, it is the faults of readings
    that were found and corrected, which no reading distinguishes from that."""

    result: Adjustment | JudgedEvaluation
    mistakes: tuple[FoundMistake, ...] = ()

    @property
    def adjustment(self) -> Adjustment | None:
        """The exact adjustment; None where a linear method was asked for and the readings cannot be adjusted."""
        return self.result.adjustment if isinstance(self.result, JudgedEvaluation) else self.result

    @property
    def calibration(self) -> Calibration:
        """What was found, with the verdict in `fit` and `fit_reasons`."""
        return self.result.calibration

    @property
    def left_out(self) -> list[Outlier]:
        """Readings that were left out; none of a linear method alone."""
        return self.adjustment.outliers if self.adjustment else []

    @property
    def freed(self) -> list[FaultClass]:
        """Faults of which the sizes became unknowns."""
        faults = self.adjustment.faults if self.adjustment else []
        return [found for found in faults if found.treatment == "estimated"]

    @property
    def variance_components(self) -> list[VarianceComponent]:
        """How much each channel scatters beside what is stated, and whether it was weighed with that."""
        return self.adjustment.variance_components if self.adjustment else []

    @property
    def conditions(self) -> list[str]:
        """Under which conditions it was evaluated: temperatures, the air, the instrument; a sentence each."""
        return self.calibration.conditions

    @property
    def fit(self) -> str:
        """\"accepted\", \"doubtful\", \"rejected\" or \"unchecked\"."""
        return self.calibration.fit or "unchecked"

    @property
    def reasons(self) -> list[str]:
        """Why it is not accepted, a sentence each, the most important first."""
        return self.calibration.fit_reasons


@checked
def evaluate(
    scenario: Scenario | Known,
    measurement: Measurement,
    *,
    method: Literal["adjustment", "enhanced", "conventional"] = "adjustment",
    full_covariance: bool = False,
) -> Calibration:
    """Evaluate a run of a scenario's plan: the calibration, with the verdict of `judge` in `fit` and `fit_reasons`.

    It is what the command `evaluate` writes. Arguments and errors are those of `judge`, which gives all that was found.
    """
    return judge(scenario, measurement, method=method, full_covariance=full_covariance).calibration


@checked
def judge(
    scenario: Scenario | Known,
    measurement: Measurement,
    *,
    method: Literal["adjustment", "enhanced", "conventional"] = "adjustment",
    full_covariance: bool = False,
    reliability: bool = False,
) -> Judgement:
    """Evaluates a run of a scenario's plan and judges it: the verdict that the commands `evaluate`, `check` and
    `report` give.

    A mistake in the whole run that would explain it is searched for beforehand where readings are far from the
    scenario, and afterwards where the fit is not accepted, where faults of readings were found, or where a sound run
    would rarely have so large a misfit.

    Args:
        scenario: its `known` half is used.
        measurement: the run, as it was read.
        method: the exact adjustment, or a linear method with the verdict of both.
        full_covariance: also the covariance of all values.
        reliability: also which faults the readings control (adjustment only).

    Raises:
        InvalidArgument: the run does not belong to the plan, cannot be evaluated, or gives what no machine can have;
            with the mistake that explains it, if one does.
    """
    known = scenario.known
    search = _searchable(known, measurement)
    mistakes = search.before() if search else []
    try:
        result = _evaluated(known, measurement, method, full_covariance, reliability, search_faults=not mistakes)
    except InvalidArgument as error:
        if search and not mistakes:
            mistakes = search.after(None, refused=True)
        raise _with_mistakes(error, mistakes) from None
    adjusted = result.adjustment if isinstance(result, JudgedEvaluation) else result
    if search and not mistakes and _is_noise(adjusted):
        # A mistake is what explains all of the scatter; a part of it is noise.
        mistakes = [found for found in search.after(None, disturbed=False) if found.fit == "accepted"]
    elif search and not mistakes and _is_odd(adjusted):
        mistakes = search.after(adjusted)
    is_corrected = adjusted is not None and adjusted.verdict.fit == "accepted"
    if mistakes and not (mistakes[0].or_faults and is_corrected):
        text = mistake_text(mistakes)
        result = result.with_mistake(text) if isinstance(result, JudgedEvaluation) else with_mistake(result, text)
    return Judgement(result, tuple(mistakes))


def _evaluated(
    known: Known,
    measurement: Measurement,
    method: Literal["adjustment", "enhanced", "conventional"],
    full_covariance: bool,
    reliability: bool,
    *,
    search_faults: bool,
) -> Adjustment | JudgedEvaluation:
    if method != "adjustment":
        return evaluate_beside_adjustment(
            known, measurement, method=method, full_covariance=full_covariance, search_faults=search_faults
        )
    return adjust_scenario(
        known, measurement, full_covariance=full_covariance, reliability=reliability, search_faults=search_faults
    )


def _is_noise(adjusted: Adjustment | None) -> bool:
    """Whether channels scatter more than stated, and the readings were weighed with that."""
    return adjusted is not None and any(component.used for component in adjusted.variance_components)


def _is_odd(adjusted: Adjustment | None) -> bool:
    """Whether something may be wrong with the run as a whole."""
    if adjusted is None or adjusted.faults or adjusted.verdict.fit in ("doubtful", "rejected"):
        return True
    return adjusted.degrees_of_freedom > 0 and adjusted.chi_square_probability < SEARCHED_BELOW


def _searchable(known: Known, measurement: Measurement) -> MistakeSearch | None:
    """The search for mistakes in a run; None where the run does not belong to the plan at all."""
    try:
        return MistakeSearch(known, measurement)
    except InvalidArgument:
        return None


def _with_mistakes(error: InvalidArgument, found: list[FoundMistake]) -> InvalidArgument:
    """The refusal of a run, with the mistake that explains it, if one does."""
    if not found:
        return error
    return InvalidArgument(
        "; ".join([str(error), mistake_reason(mistake_text(found)), *map(": ".join, change_rows(found))])
    )
