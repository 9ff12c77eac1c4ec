"""Parts of objects that describe a calibration: its fit, its tables, and the largest values of each kind."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from typing_extensions import TypedDict

from stepdiag._core import Calibration, Undetermined
from stepdiag.calibration.largest_by_kind import largest_entries
from stepdiag.findings.meaning import NOISE_ALONE
from stepdiag.parameters import FUNCTIONS, SQUARENESSES, Kind, units_of
from stepdiag.presentation.objects.writer import in_unit, measured, number

Array = npt.NDArray[np.float64]
Tables = tuple[Array, Array, Array]  # positions, values, standard uncertainties
Verdict = Literal["accepted", "doubtful", "rejected", "unchecked"]


class Fit(TypedDict):
    """Whether the calibration is valid: the readings agree with each other and with the scenario. This does not tell
    how accurate the machine is."""

    verdict: Verdict | None
    """Of the calibration, not of the machine; null: not known"""
    reasons: list[str]
    """Why that verdict, a sentence each."""
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

    temperature_reference_c: float | None
    """Positioning errors are referred to it; null: they are as found."""
    temperature_as_found_c: list[float] | None
    """Of the scales of X, Y, Z; null: not recorded, or referred to a temperature."""


class _Function(TypedDict):
    parameter: str
    slope_determined: bool
    """false: the shape alone is known, and both ends are 0."""
    position_mm: list[float]


class LengthFunction(_Function):
    value_um: list[float | None]
    standard_uncertainty_um: list[float | None]


class AngleFunction(_Function):
    value_urad: list[float | None]
    standard_uncertainty_urad: list[float | None]


class _Reversal(TypedDict):
    parameter: str
    constant_determined: bool
    """false: the change from home alone is known, and the value at home is 0."""
    position_mm: list[float]


class LengthReversal(_Reversal):
    value_um: list[float | None]
    standard_uncertainty_um: list[float | None]


class AngleReversal(_Reversal):
    value_urad: list[float | None]
    standard_uncertainty_urad: list[float | None]


class Squareness(TypedDict):
    parameter: Literal["C0Y", "B0Z", "A0Z"]
    value_urad: float | None
    standard_uncertainty_urad: float | None


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
    positions_mm: list[float]
    setups: list[Setup]
    reason: str
    remedies: list[str]
    """The best first; any of them helps."""


class CalibrationTables(Temperature):
    """The 21 parameters as far as they are determined."""

    method: str
    date: str
    """ISO 8601, UTC; empty: not known"""
    provenance: dict[str, str]
    """By the keys of a calibration file: program, run_sha256, ..."""
    chain: str
    volume_mm: list[float]
    tool_mm: list[float]
    straightness_reference: str
    expansion_um_per_m_k: list[float] | None
    """Of the scales of X, Y, Z, by which they are referred; null: as found, or not known."""
    fixed_point_mm: list[float] | None
    """Positions from which these scales expand."""
    functions: list[LengthFunction | AngleFunction]
    """Values by node; approached in + direction if there are reversal errors."""
    reversal_errors: list[LengthReversal | AngleReversal]
    """Approached in + direction less in - direction."""
    squarenesses: list[Squareness]
    conditions: list[str]
    """Under which it was evaluated, as they were used, a sentence each; empty: not known."""
    budget: str
    """What makes its largest positioning uncertainty; empty: not known."""
    undetermined: list[str]
    """What is not determined, a sentence each."""
    findings: list[OpenFinding]
    """The same as data; empty for a calibration that was read from a file."""


class _Largest(TypedDict):
    kind: Kind
    parameter: str
    position_mm: float | None
    """null: a squareness"""


class LargestLength(_Largest):
    value_um: float


class LargestAngle(_Largest):
    value_urad: float


class LeastKnownLength(_Largest):
    standard_uncertainty_um: float


class LeastKnownAngle(_Largest):
    standard_uncertainty_urad: float


def unit_key(parameter: str) -> str:
    """The ending of keys with values of a parameter: um or urad."""
    return "um" if units_of(parameter) == "mm" else "urad"


def fit_of(calibration: Calibration) -> Fit:
    """The verdict that a calibration carries."""
    verdict: Any = calibration.fit
    return {
        "verdict": verdict,
        "reasons": list(calibration.fit_reasons),
        "variance_factor": number(calibration.variance_factor),
        "uncertainties_multiplied_by": number(calibration.uncertainty_scaled),
        "unseen_faults": list(calibration.unseen_faults),
        "noise_alone": calibration.method in NOISE_ALONE,
        "unverified": calibration.unverified,
    }


def temperature_of(calibration: Calibration) -> Temperature:
    """The temperature that a calibration carries."""
    found = calibration.temperature_as_found
    return {
        "temperature_reference_c": calibration.temperature_reference,
        "temperature_as_found_c": None if found is None else found.tolist(),
    }


def tables_of(calibration: Calibration) -> CalibrationTables:
    """All values of a calibration, but for its covariance."""
    slopes, constants = calibration.undetermined_slopes, calibration.undetermined_reversal_constants
    found = calibration.expansion
    expansion: Any = None if found is None else [in_unit("um_per_m_k", coefficient) for coefficient in found]
    return {
        "method": calibration.method,
        "date": calibration.date,
        "provenance": dict(calibration.provenance),
        "chain": calibration.chain.name,
        "volume_mm": calibration.volume.tolist(),
        "tool_mm": calibration.tool.tolist(),
        "straightness_reference": calibration.straightness_reference,
        **temperature_of(calibration),
        "expansion_um_per_m_k": expansion,
        "fixed_point_mm": None if calibration.expansion is None else calibration.fixed_point.tolist(),
        "functions": _by_node(calibration.functions, "slope_determined", slopes),
        "reversal_errors": _by_node(calibration.reversal, "constant_determined", constants),
        "squarenesses": _squarenesses(calibration.squareness),
        "conditions": list(calibration.conditions),
        "budget": calibration.budget,
        "undetermined": list(calibration.undetermined),
        "findings": findings_of(calibration.findings, calibration.undetermined),
    }


def _by_node(tables: Mapping[str, Tables], known: str, unknown: Collection[str]) -> list[Any]:
    return [
        {
            "parameter": name,
            known: name not in unknown,
            "position_mm": tables[name][0].tolist(),
            **measured(unit_key(name), value=tables[name][1], standard_uncertainty=tables[name][2]),
        }
        for name in FUNCTIONS
        if name in tables
    ]


def _squarenesses(squareness: Mapping[str, tuple[float, float]]) -> list[Any]:
    return [
        {"parameter": name, **measured("urad", value=squareness[name][0], standard_uncertainty=squareness[name][1])}
        for name in SQUARENESSES
        if name in squareness
    ]


def findings_of(findings: Sequence[Undetermined], texts: Sequence[str]) -> list[OpenFinding]:
    """Findings with their sentences; none where there are sentences alone."""
    found: list[Any] = [
        {
            "text": text,
            "part": finding.part,
            "parameters": list(finding.parameters),
            "component": finding.component,
            "positions_mm": list(finding.positions),
            "setups": [{"run": run, "line": line} for run, line in finding.setups],
            "reason": finding.reason,
            "remedies": list(finding.remedies),
        }
        for finding, text in zip(findings, texts, strict=False)
    ]
    return found


def largest_of(calibration: Calibration, *, uncertainty: bool = False) -> list[Any]:
    """The largest value of each kind that has values, or its largest standard uncertainty."""
    what = "standard_uncertainty" if uncertainty else "value"
    return [
        {
            "kind": kind,
            "parameter": entry.parameter,
            "position_mm": entry.position,
            **measured(unit_key(entry.parameter), **{what: getattr(entry, what)}),
        }
        for kind, entry in largest_entries(calibration, uncertainty=uncertainty).items()
    ]
