"""Parts of objects that describe a calibration: its fit, its tables, and the largest values of each kind."""

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration, Undetermined
from stepdiag.calibration.largest_by_kind import largest_entries
from stepdiag.findings.meaning import NOISE_ALONE
from stepdiag.parameters import FUNCTIONS, SQUARENESSES, Kind, units_of
from stepdiag.presentation.quantity import Array, Quantities, Quantity, Unit, number, quantities, quantity, stated

Tables = tuple[Array, Array, Array]  # positions, values, standard uncertainties
Verdict = Literal["accepted", "doubtful", "rejected", "unchecked"]


class Reason(TypedDict):
    code: str | None
    """Stable; null: the file of an earlier version, which has sentences alone."""
    text: str


class Fit(TypedDict):
    """Whether the calibration is valid: the readings agree with each other and with the scenario. This does not tell
    how accurate the machine is."""

    verdict: Verdict | None
    """Of the calibration, not of the machine; null: not known"""
    reasons: list[Reason]
    """Why that verdict, the most important first."""
    variance_factor: float | None
    uncertainties_multiplied_by: float | None
    """What all standard uncertainties were multiplied by; null: by nothing."""
    unseen_faults: list[str]
    """How large faults of readings may be in it unseen, and what they then do, a sentence each."""
    noise_alone: bool
    """Whether the standard uncertainties are of noise alone, as those of linear methods are."""
    unverified: bool
    """Whether a checksum was absent when the calibration was read: its values may have been changed."""


class Temperature(TypedDict):
    """To which temperature positioning errors belong."""

    temperature_reference: Quantity
    """Positioning errors are referred to it; null: they are as found."""
    temperature_as_found: Quantities
    """Of the scales of X, Y, Z."""


class Function(TypedDict):
    parameter: str
    slope_determined: bool
    """false: the shape alone is known, and both ends are 0; or nothing is."""
    position: Quantities
    value: Quantities
    """By position; null: not determined, with the reason."""


class Reversal(TypedDict):
    parameter: str
    constant_determined: bool
    """false: the change from home alone is known, and the value at home is 0."""
    position: Quantities
    value: Quantities
    """Approached in + direction less in - direction."""


class Squareness(TypedDict):
    parameter: Literal["C0Y", "B0Z", "A0Z"]
    value: Quantity


class Setup(TypedDict):
    run: int
    line: str


class OpenFinding(TypedDict):
    """What the readings leave open."""

    text: str
    part: Literal["whole", "slope", "positions", "reversal", "reversal_at_home", "setup"]
    parameters: list[str]
    """Error parameters; of a set-up its quantity."""
    component: int
    """Of a set-up's quantity, from 0."""
    positions: Quantities
    setups: list[Setup]
    reason: str
    """Stable code."""
    remedies: list[str]
    """Stable codes, the best first; any of them helps."""


class CalibrationTables(Temperature):
    """The 21 parameters."""

    method: str
    date: str
    """ISO 8601, UTC; empty: not known"""
    provenance: dict[str, str]
    """By the keys of a calibration file: program, run_sha256, ..."""
    chain: str
    volume: Quantities
    tool: Quantities
    straightness_reference: str
    expansion: Quantities
    """Of the scales of X, Y, Z, by which positioning errors are referred."""
    fixed_point: Quantities
    """Positions from which these scales expand."""
    functions: list[Function]
    """All 18; approached in + direction if there are reversal errors."""
    reversal_errors: list[Reversal]
    """Those that are known."""
    squarenesses: list[Squareness]
    """All three."""
    conditions: list[str]
    """Under which it was evaluated, as they were used, a sentence each; empty: not known."""
    budget: str
    """What makes its largest positioning uncertainty; empty: not known."""
    undetermined: list[str]
    """What is not determined, a sentence each."""
    findings: list[OpenFinding]
    """The same as data; empty for a calibration that was read from a file."""


class LargestValue(TypedDict):
    kind: Kind
    parameter: str
    position: Quantity
    """null: a squareness"""
    value: Quantity


def value_unit(parameter: str) -> Unit:
    """The unit of a parameter's values: um or urad."""
    return "um" if units_of(parameter) == "mm" else "urad"


def fit_of(calibration: Calibration) -> Fit:
    """The verdict that a calibration carries."""
    verdict: Any = calibration.fit
    texts = calibration.fit_reasons
    codes: Sequence[str | None] = calibration.fit_codes or [None] * len(texts)
    return {
        "verdict": verdict,
        "reasons": [{"code": code, "text": text} for code, text in zip(codes, texts, strict=True)],
        "variance_factor": number(calibration.variance_factor),
        "uncertainties_multiplied_by": number(calibration.uncertainty_scaled),
        "unseen_faults": list(calibration.unseen_faults),
        "noise_alone": calibration.method in NOISE_ALONE,
        "unverified": calibration.unverified,
    }


def temperature_of(calibration: Calibration) -> Temperature:
    """The temperature that a calibration carries."""
    as_found = "positioning errors are referred to a temperature" if calibration.temperature_reference else "not known"
    return {
        "temperature_reference": stated("degC", calibration.temperature_reference, reason="as found"),
        "temperature_as_found": quantities("degC", calibration.temperature_as_found, reason=as_found),
    }


def tables_of(calibration: Calibration) -> CalibrationTables:
    """All values of a calibration, but for its covariance."""
    fixed_point = None if calibration.expansion is None else calibration.fixed_point
    return {
        "method": calibration.method,
        "date": calibration.date,
        "provenance": dict(calibration.provenance),
        "chain": calibration.chain.name,
        "volume": quantities("mm", calibration.volume),
        "tool": quantities("mm", calibration.tool),
        "straightness_reference": calibration.straightness_reference,
        **temperature_of(calibration),
        "expansion": quantities("um/(m K)", calibration.expansion),
        "fixed_point": quantities("mm", fixed_point),
        "functions": [_function(calibration, name) for name in FUNCTIONS],
        "reversal_errors": [
            _at_nodes(name, calibration.reversal, "constant_determined", calibration.undetermined_reversal_constants)
            for name in FUNCTIONS
            if name in calibration.reversal
        ],
        "squarenesses": [_squareness(calibration, name) for name in SQUARENESSES],
        "conditions": list(calibration.conditions),
        "budget": calibration.budget,
        "undetermined": list(calibration.undetermined),
        "findings": findings_of(calibration.findings, calibration.undetermined),
    }


def _function(calibration: Calibration, name: str) -> Any:
    if name in calibration.functions:
        return _at_nodes(name, calibration.functions, "slope_determined", calibration.undetermined_slopes)
    return {
        "parameter": name,
        "slope_determined": False,
        "position": quantities("mm", []),
        "value": quantities(value_unit(name), None, reason=_why_open(calibration, name)),
    }


def _at_nodes(name: str, tables: Mapping[str, Tables], known: str, unknown: Collection[str]) -> Any:
    position, value, u = tables[name]
    return {
        "parameter": name,
        known: name not in unknown,
        "position": quantities("mm", position),
        "value": quantities(value_unit(name), value, u),
    }


def _squareness(calibration: Calibration, name: Any) -> Squareness:
    value, u = calibration.squareness.get(name, (None, None))
    return {"parameter": name, "value": quantity("urad", value, u, reason=_why_open(calibration, name))}


def _why_open(calibration: Calibration, name: str) -> str:
    """Why a calibration has no value of a parameter."""
    about = (sentence for sentence in calibration.undetermined if re.search(rf"\b{name}\b", sentence))
    return next(about, "not in the calibration")


def findings_of(findings: Sequence[Undetermined], texts: Sequence[str]) -> list[OpenFinding]:
    """Findings with their sentences; none where there are sentences alone."""
    found: list[Any] = [
        {
            "text": text,
            "part": finding.part,
            "parameters": list(finding.parameters),
            "component": finding.component,
            "positions": quantities("mm", finding.positions),
            "setups": [{"run": run, "line": line} for run, line in finding.setups],
            "reason": finding.reason,
            "remedies": list(finding.remedies),
        }
        for finding, text in zip(findings, texts, strict=False)
    ]
    return found


def largest_of(calibration: Calibration, *, uncertainty: bool = False) -> list[LargestValue]:
    """The largest value of each kind that has values, or the value with the largest standard uncertainty."""
    return [
        {
            "kind": kind,
            "parameter": entry.parameter,
            "position": quantity("mm", entry.position, reason="a squareness"),
            "value": quantity(value_unit(entry.parameter), entry.value, entry.standard_uncertainty),
        }
        for kind, entry in largest_entries(calibration, uncertainty=uncertainty).items()
    ]
