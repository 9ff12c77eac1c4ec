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
)
from stepdiag.findings.faults import fault_text
from stepdiag.findings.mistakes import FoundMistake
from stepdiag.findings.undetermined import combination_text
from stepdiag.presentation.blocks import data_of
from stepdiag.presentation.evaluation import evaluation_blocks
from stepdiag.presentation.objects.calibration import (
    CalibrationTables,
    Fit,
    LargestValue,
    Setup,
    Verdict,
    fit_of,
    largest_of,
    tables_of,
    value_unit,
)
from stepdiag.presentation.objects.conditions import PositioningParts, UsedConditions, budget_object, conditions_object
from stepdiag.presentation.objects.writer import Reported, first_keys
from stepdiag.presentation.prior_effects import cosine_rows, drift_rows, rounding_rows
from stepdiag.presentation.quantity import BY_KEY, Quantity, Unit, number, quantity
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


class SetupUnknown(TypedDict):
    run: int
    """The first run that has this set-up."""
    line: str
    quantity: str
    component: int
    """From 0: about or along local x and y, or the beams d2, d3, ..."""
    value: Quantity
    prior: Quantity
    """Standard uncertainty before the run; null: free."""


class MemberFault(TypedDict):
    kind: Literal["reading", "slip", "factor"]
    channel: str
    run: int
    line: str
    point: int
    row: int
    """Of the measurement, from 0."""
    chi_square_gain: float | None
    size: Quantity


class Faults(TypedDict):
    """Faults of which the readings do not determine which one happened."""

    text: str
    treatment: Literal["left_out", "estimated", "none"]
    distinguished: bool
    members: list[MemberFault]
    """The most likely first."""


class CombinedTerm(TypedDict):
    weight: float
    name: str
    """An error parameter, whose slope is meant, or a quantity of a set-up."""


class Combination(TypedDict):
    text: str
    terms: list[CombinedTerm]
    setup: Setup | None
    """null: a sum of slopes"""
    component: int
    """Of a set-up."""
    value: Quantity


class Smooth(TypedDict):
    parameter: str
    second_difference: Quantity
    """Standard deviation of second differences."""


class ByKind(TypedDict):
    positioning: Quantity
    straightness: Quantity
    angle: Quantity
    squareness: Quantity


class Control(TypedDict):
    """Which faults of one kind the readings control."""

    fault: Literal["reading", "slip", "factor"]
    channel: Literal["distance", "tilt", "spot"]
    controlled: int
    uncontrolled: int
    twins: int
    """Of the controlled ones, those that are not distinguished from another one at any size."""
    hidden: ByKind
    """Largest effect of a fault just not found; null: not limited."""
    found_from: Quantity
    distinguished_from: Quantity


class FoundExpansion(TypedDict):
    """A coefficient of the scales' expansion, which was an unknown."""

    axes: list[str]
    """That have it in common."""
    value: Quantity
    stated: Quantity
    """Before the run."""


class FoundDrift(TypedDict):
    """A drift of the functional point, which was an unknown: by time, or with a recorded temperature."""

    axis: str
    value: Quantity
    prior: Quantity
    """Standard uncertainty before the run."""


class AdjustmentPart(TypedDict):
    """What an adjustment finds beside the calibration."""

    degrees_of_freedom: int
    weighted_square_sum: float | None
    chi_square_probability: float | None
    iterations: int
    setup: list[SetupUnknown]
    expansion: list[FoundExpansion]
    machine_drift: list[FoundDrift]
    faults: list[Faults]
    combinations: list[Combination]
    """What is known of unknowns that are not determined one by one."""
    smoothness: list[Smooth]
    reliability: list[Control]
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


class EvaluationObject(Reported):
    """Result of `stepdiag evaluate`."""

    fit: Fit
    mistakes: list[NamedMistake]
    """Of which one would explain a fit that is not accepted; several: the readings do not distinguish them."""
    files: EvaluatedFiles
    readings: Readings
    conditions: UsedConditions
    calibration: CalibrationTables
    largest_standard_uncertainties: list[LargestValue]
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
        **first_keys("evaluation", warnings),
        "report": data_of(evaluation_blocks(result, measurement, known, mistakes)),
        "fit": fit_of(written),
        "mistakes": [mistake_of(found) for found in mistakes],
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
        "value": quantity("um/(m K)", found.value, found.standard_uncertainty),
        "stated": quantity("um/(m K)", found.stated, found.prior),
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


def setup_of(estimates: Iterable[SetupEstimate]) -> list[SetupUnknown]:
    """The unknowns of set-ups, those that a scenario fixes left out."""
    return [_setup_unknown(unknown) for unknown in estimates if unknown.prior > 0.0]


def _setup_unknown(unknown: SetupEstimate) -> SetupUnknown:
    unit = BY_KEY[SETUP_QUANTITIES[unknown.quantity].report_unit]
    u = None if unknown.value is None else unknown.standard_uncertainty
    return {
        "run": unknown.run,
        "line": unknown.line,
        "quantity": unknown.quantity,
        "component": unknown.component,
        "value": quantity(unit, unknown.value, u, reason="the readings do not determine it"),
        "prior": quantity(unit, unknown.prior, reason="free"),
    }


def combinations_of(combinations: Iterable[KnownCombination], *, value: bool = True) -> list[Combination]:
    """Known combinations; without `value` the text has the standard uncertainty alone."""
    return [
        {
            "text": combination_text(known, value=value),
            "terms": [{"weight": weight, "name": name} for weight, name in known.terms],
            "setup": {"run": known.run, "line": known.line} if known.line else None,
            "component": known.component,
            "value": quantity("urad" if known.line else "um/m", known.value, known.standard_uncertainty),
        }
        for known in combinations
    ]


def reliability_of(controls: Iterable[FaultControl]) -> list[Any]:
    """Which faults the readings control."""
    return [_control(control, "urad" if control.channel == "tilt" else "um") for control in controls]


def _control(control: FaultControl, unit: Unit) -> Any:
    found = control.found_from if control.count else None
    distinguished = control.distinguished_from if control.count > control.twins else None
    return {
        "fault": control.kind,
        "channel": control.channel,
        "controlled": control.count,
        "uncontrolled": control.uncontrolled,
        "twins": control.twins,
        "hidden": by_kind(control.hidden, reason="not limited"),
        "found_from": quantity(unit, found, reason="none is controlled"),
        "distinguished_from": quantity(unit, distinguished, reason="none is distinguished"),
    }


def by_kind(native: Mapping[Any, float], *, reason: str) -> ByKind:
    """One number for each kind of parameter; null where there is none or it is not finite."""
    return {
        "positioning": quantity("um", native.get("positioning"), reason=reason),
        "straightness": quantity("um", native.get("straightness"), reason=reason),
        "angle": quantity("urad", native.get("angle"), reason=reason),
        "squareness": quantity("urad", native.get("squareness"), reason=reason),
    }


def _machine_drift(found: DriftEstimate, known: Known) -> FoundDrift:
    by_time = known.machine_drift is None or known.machine_drift.record == "time"
    unit: Unit = "um/h" if by_time else "um/K"
    return {
        "axis": "XYZ"[found.axis],
        "value": quantity(unit, found.value, found.standard_uncertainty),
        "prior": quantity(unit, found.prior, reason="free"),
    }


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


def _smoothness(deviations: Mapping[str, float]) -> list[Smooth]:
    return [
        {"parameter": name, "second_difference": quantity(value_unit(name), deviation)}
        for name, deviation in deviations.items()
    ]


def faults_of(found: FaultClass) -> Faults:
    """A fault, or those that it may be."""
    treatment: Any = found.treatment
    return {
        "text": fault_text(found),
        "treatment": treatment,
        "distinguished": found.distinguished,
        "members": [_fault(fault) for fault in found.members],
    }


def channel_unit(channel: str) -> Unit:
    """The unit of a channel's deviations."""
    return "urad" if channel in ("alpha", "beta") else "um"


def _fault(fault: Fault) -> Any:
    return {
        "kind": fault.kind,
        "channel": fault.channel,
        "run": fault.run,
        "line": fault.line,
        "point": fault.point,
        "row": fault.row,
        "chi_square_gain": number(fault.chi_square_gain),
        "size": quantity(channel_unit(fault.channel), fault.size, fault.standard_uncertainty),
    }


def _linear(judged: JudgedEvaluation) -> LinearPart:
    own: Any = judged.own
    other: Any = None if judged.adjustment is None else judged.adjustment.verdict.fit
    return {"own_verdict": own, "adjustment_verdict": other, "refusal": judged.refusal or None}
