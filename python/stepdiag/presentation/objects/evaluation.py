"""The object of `stepdiag evaluate --json`."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import (
    Adjustment,
    Calibration,
    DriftEstimate,
    ExpansionEstimate,
    Fault,
    FaultClass,
    FaultControl,
    KnownCombination,
    Measurement,
    SetupEstimate,
    __version__,
)
from stepdiag.findings.faults import fault_text
from stepdiag.findings.mistakes import FoundMistake
from stepdiag.findings.undetermined import combination_text
from stepdiag.presentation.objects.calibration import (
    CalibrationTables,
    Fit,
    LeastKnownAngle,
    LeastKnownLength,
    Verdict,
    fit_of,
    largest_of,
    tables_of,
    unit_key,
)
from stepdiag.presentation.objects.conditions import PositioningParts, UsedConditions, budget_object, conditions_object
from stepdiag.presentation.objects.writer import in_unit, measured, number
from stepdiag.presentation.prior_effects import cosine_rows, drift_rows, rounding_rows
from stepdiag.scenario.description import JudgedEvaluation
from stepdiag.scenario.known import Known
from stepdiag.scenario.planned_readings import lost_readings
from stepdiag.setup_quantities import SETUP_QUANTITIES


class EvaluatedFiles(TypedDict):
    scenario: str
    run: str
    calibration: str
    """The file that was written."""


class Readings(TypedDict):
    points: int
    lines: int
    incomplete_rows: int
    """Rows without a complete reading."""
    missing_points: int
    """Points of the plan without a row."""


class _SetupUnknown(TypedDict):
    run: int
    """The first run that has this set-up."""
    line: str
    quantity: str
    component: int
    """From 0: about or along local x and y, or the beams d2, d3, ..."""


class SetupLength(_SetupUnknown):
    value_um: float | None
    """null: not determined"""
    standard_uncertainty_um: float | None
    prior_um: float | None
    """Standard uncertainty before the run; null: free."""


class SetupOffset(_SetupUnknown):
    value_mm: float | None
    standard_uncertainty_mm: float | None
    prior_mm: float | None


class SetupAngle(_SetupUnknown):
    value_urad: float | None
    standard_uncertainty_urad: float | None
    prior_urad: float | None


class SetupShare(_SetupUnknown):
    value_ppm: float | None
    standard_uncertainty_ppm: float | None
    prior_ppm: float | None


class SetupRate(_SetupUnknown):
    value_um_per_h: float | None
    standard_uncertainty_um_per_h: float | None
    prior_um_per_h: float | None


class _Fault(TypedDict):
    kind: Literal["reading", "slip", "factor"]
    channel: str
    run: int
    line: str
    point: int
    row: int
    """Of the measurement, from 0."""
    chi_square_gain: float | None


class LengthFault(_Fault):
    size_um: float | None
    standard_uncertainty_um: float | None


class AngleFault(_Fault):
    size_urad: float | None
    standard_uncertainty_urad: float | None


class Faults(TypedDict):
    """Faults of which the readings do not tell which one happened."""

    text: str
    treatment: Literal["left_out", "estimated", "none"]
    told_apart: bool
    members: list[LengthFault | AngleFault]
    """The most likely first."""


class CombinedTerm(TypedDict):
    weight: float
    name: str
    """An error parameter, whose slope is meant, or a quantity of a set-up."""


class _Combination(TypedDict):
    text: str
    terms: list[CombinedTerm]


class SlopeCombination(_Combination):
    value_um_per_m: float | None
    standard_uncertainty_um_per_m: float | None


class SetupCombination(_Combination):
    run: int
    line: str
    component: int
    value_urad: float | None
    standard_uncertainty_urad: float | None


class SmoothLength(TypedDict):
    parameter: str
    second_difference_um: float | None
    """Standard deviation of second differences."""


class SmoothAngle(TypedDict):
    parameter: str
    second_difference_urad: float | None


class ByKind(TypedDict):
    positioning_um: float | None
    straightness_um: float | None
    angle_urad: float | None
    squareness_urad: float | None


class _Control(TypedDict):
    fault: Literal["reading", "slip", "factor"]
    channel: Literal["distance", "tilt", "spot"]
    controlled: int
    uncontrolled: int
    twins: int
    """Of the controlled ones, those that are not told from another one at any size."""
    hidden: ByKind
    """Largest effect of a fault just not found; null: not limited."""


class LengthControl(_Control):
    found_from_um: float | None
    told_from_um: float | None


class AngleControl(_Control):
    found_from_urad: float | None
    told_from_urad: float | None


class FoundExpansion(TypedDict):
    """A coefficient of the scales' expansion, which was an unknown."""

    axes: list[str]
    """That have it in common."""
    value_um_per_m_k: float | None
    standard_uncertainty_um_per_m_k: float | None
    stated_um_per_m_k: float | None
    prior_um_per_m_k: float | None
    """Standard uncertainty before the run."""


class FoundDriftByTime(TypedDict):
    """A drift of the functional point, which was an unknown."""

    axis: str
    value_um_per_h: float | None
    standard_uncertainty_um_per_h: float | None
    prior_um_per_h: float | None
    """Standard uncertainty before the run."""


class FoundDriftByTemperature(TypedDict):
    """The same, with a recorded temperature."""

    axis: str
    value_um_per_k: float | None
    standard_uncertainty_um_per_k: float | None
    prior_um_per_k: float | None


class AdjustmentPart(TypedDict):
    """What an adjustment finds beside the calibration."""

    degrees_of_freedom: int
    weighted_square_sum: float | None
    chi_square_probability: float | None
    iterations: int
    setup: list[SetupLength | SetupOffset | SetupAngle | SetupShare | SetupRate]
    expansion: list[FoundExpansion]
    machine_drift: list[FoundDriftByTime | FoundDriftByTemperature]
    faults: list[Faults]
    combinations: list[SlopeCombination | SetupCombination]
    """What is known of unknowns that are not determined one by one."""
    smoothness: list[SmoothLength | SmoothAngle]
    reliability: list[LengthControl | AngleControl]
    """Which faults would have been found; empty without --reliability."""


class LinearPart(TypedDict):
    """Of a linear method: the two verdicts, of which the fit is the worse."""

    own_verdict: Verdict
    adjustment_verdict: Verdict | None
    refusal: str | None
    """Why the readings could not be adjusted."""


class NamedMistake(TypedDict):
    entry: str
    """Name in the catalogue; of two at once both."""
    text: str
    edit: str
    """What to change."""
    fit: Verdict
    """With the mistake undone, as the next."""
    variance_factor: float | None
    more_alternatives: int
    """Of the first of a list: how many more fit as well and are not listed."""
    or_faults: bool
    """Of the first of a list: whether the faults that were found explain as much."""


class EvaluationObject(TypedDict):
    """Result of `stepdiag evaluate`."""

    stepdiag: str
    format: Literal["stepdiag evaluation 1"]
    fit: Fit
    mistakes: list[NamedMistake]
    """Of which one would explain a fit that is not accepted; several: the readings do not tell which."""
    warnings: list[str]
    files: EvaluatedFiles
    readings: Readings
    conditions: UsedConditions
    calibration: CalibrationTables
    largest_standard_uncertainties: list[LeastKnownLength | LeastKnownAngle]
    budget: PositioningParts | None
    """null: no positioning error is determined"""
    adjustment: AdjustmentPart | None
    """null: a linear method"""
    linear: LinearPart | None
    """null: the adjustment"""
    notes: list[str]
    """Effects of angles and drifts that only priors know, a sentence each."""


def evaluation_object(
    result: JudgedEvaluation | Adjustment,
    written: Calibration,
    files: EvaluatedFiles,
    measurement: Measurement,
    known: Known,
    warnings: Sequence[str],
    mistakes: Sequence[FoundMistake] = (),
) -> EvaluationObject:
    """What an evaluation found. `written`: its calibration with the date and provenance of its file."""
    return {
        "stepdiag": __version__,
        "format": "stepdiag evaluation 1",
        "fit": fit_of(written),
        "mistakes": [mistake_of(found) for found in mistakes],
        "warnings": list(warnings),
        "files": files,
        "readings": readings_of(measurement, known),
        "conditions": conditions_object(known, measurement),
        "calibration": tables_of(written),
        "largest_standard_uncertainties": largest_of(written, uncertainty=True),
        "budget": budget_object(written, known),
        "adjustment": _adjustment(result, known) if isinstance(result, Adjustment) else None,
        "linear": _linear(result) if isinstance(result, JudgedEvaluation) else None,
        "notes": [*rounding_rows(result.rounded), *cosine_rows(measurement, known), *drift_rows(measurement, known)]
        if isinstance(result, Adjustment)
        else [],
    }


def mistake_of(found: FoundMistake) -> NamedMistake:
    """A mistake as an object."""
    fit: Any = found.fit
    return {
        "entry": found.entry,
        "text": found.text,
        "edit": found.edit,
        "fit": fit,
        "variance_factor": number(found.variance_factor),
        "more_alternatives": found.alternatives,
        "or_faults": found.or_faults,
    }


def evaluated_files(scenario: Path, run: Path, calibration: Path) -> EvaluatedFiles:
    """The files of an evaluation, as they were named."""
    return {"scenario": str(scenario), "run": str(run), "calibration": str(calibration)}


def _expansion(found: ExpansionEstimate) -> FoundExpansion:
    return {
        "axes": ["XYZ"[axis] for axis in found.axes],
        "value_um_per_m_k": in_unit("um_per_m_k", found.value),
        "standard_uncertainty_um_per_m_k": in_unit("um_per_m_k", found.standard_uncertainty),
        "stated_um_per_m_k": in_unit("um_per_m_k", found.stated),
        "prior_um_per_m_k": in_unit("um_per_m_k", found.prior),
    }


def readings_of(measurement: Measurement, known: Known) -> Readings:
    """How much was read."""
    incomplete, missing = lost_readings(measurement, known.plan, known.signals)
    return {
        "points": len(measurement),
        "lines": len(set(measurement.line)),
        "incomplete_rows": incomplete,
        "missing_points": missing,
    }


def setup_of(estimates: Iterable[SetupEstimate]) -> list[Any]:
    """The unknowns of set-ups, those that a scenario fixes left out."""
    return [
        {
            "run": unknown.run,
            "line": unknown.line,
            "quantity": unknown.quantity,
            "component": unknown.component,
            **measured(
                SETUP_QUANTITIES[unknown.quantity].report_unit,
                value=unknown.value,
                standard_uncertainty=None if unknown.value is None else unknown.standard_uncertainty,
                prior=unknown.prior,
            ),
        }
        for unknown in estimates
        if unknown.prior > 0.0
    ]


def combinations_of(combinations: Iterable[KnownCombination], *, value: bool = True) -> list[Any]:
    """Known combinations; without `value` the text has the standard uncertainty alone."""
    return [
        {
            "text": combination_text(known, value=value),
            "terms": [{"weight": weight, "name": name} for weight, name in known.terms],
            **({"run": known.run, "line": known.line, "component": known.component} if known.line else {}),
            **measured(
                "urad" if known.line else "um_per_m",
                value=known.value,
                standard_uncertainty=known.standard_uncertainty,
            ),
        }
        for known in combinations
    ]


def reliability_of(controls: Iterable[FaultControl]) -> list[Any]:
    """Which faults the readings control."""
    return [
        {
            "fault": control.kind,
            "channel": control.channel,
            "controlled": control.count,
            "uncontrolled": control.uncontrolled,
            "twins": control.twins,
            "hidden": by_kind(control.hidden),
            **measured(
                "urad" if control.channel == "tilt" else "um",
                found_from=control.found_from if control.count else None,
                told_from=control.told_from if control.count > control.twins else None,
            ),
        }
        for control in controls
    ]


def by_kind(native: Mapping[Any, float]) -> ByKind:
    """One number for each kind of parameter; None where there is none or it is not finite."""
    return {
        "positioning_um": in_unit("um", native.get("positioning")),
        "straightness_um": in_unit("um", native.get("straightness")),
        "angle_urad": in_unit("urad", native.get("angle")),
        "squareness_urad": in_unit("urad", native.get("squareness")),
    }


def _machine_drift(found: DriftEstimate, known: Known) -> Any:
    by_time = known.machine_drift is None or known.machine_drift.record == "time"
    numbers = {"value": found.value, "standard_uncertainty": found.standard_uncertainty, "prior": found.prior}
    return {"axis": "XYZ"[found.axis], **measured("um_per_h" if by_time else "um_per_k", **numbers)}


def _adjustment(found: Adjustment, known: Known) -> AdjustmentPart:
    return {
        "degrees_of_freedom": found.degrees_of_freedom,
        "weighted_square_sum": number(found.weighted_square_sum),
        "chi_square_probability": number(found.chi_square_probability),
        "iterations": found.iterations,
        "setup": setup_of(found.setup),
        "expansion": [_expansion(one) for one in found.expansion],
        "machine_drift": [_machine_drift(one, known) for one in found.machine_drift],
        "faults": [faults_of(one) for one in found.faults],
        "combinations": combinations_of(found.combinations),
        "smoothness": _smoothness(found.smoothness),
        "reliability": reliability_of(found.reliability),
    }


def _smoothness(deviations: Mapping[str, float]) -> list[Any]:
    return [
        {"parameter": name, **measured(unit_key(name), second_difference=deviation)}
        for name, deviation in deviations.items()
    ]


def faults_of(found: FaultClass) -> Faults:
    """A fault, or those that it may be."""
    treatment: Any = found.treatment
    return {
        "text": fault_text(found),
        "treatment": treatment,
        "told_apart": found.told_apart,
        "members": [_fault(fault) for fault in found.members],
    }


def _fault(fault: Fault) -> Any:
    return {
        "kind": fault.kind,
        "channel": fault.channel,
        "run": fault.run,
        "line": fault.line,
        "point": fault.point,
        "row": fault.row,
        "chi_square_gain": number(fault.chi_square_gain),
        **measured(
            "urad" if fault.channel in ("alpha", "beta") else "um",
            size=fault.size,
            standard_uncertainty=fault.standard_uncertainty,
        ),
    }


def _linear(judged: JudgedEvaluation) -> LinearPart:
    own: Any = judged.own
    other: Any = None if judged.adjustment is None else judged.adjustment.verdict.fit
    return {"own_verdict": own, "adjustment_verdict": other, "refusal": judged.refusal or None}
