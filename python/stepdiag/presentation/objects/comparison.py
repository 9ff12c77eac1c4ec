"""The object of `stepdiag compare --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration, __version__
from stepdiag.calibration import truth, volume_change
from stepdiag.calibration.comparison import Comparison, Difference
from stepdiag.presentation.objects.calibration import Fit, Temperature, fit_of, temperature_of, unit_key
from stepdiag.presentation.objects.writer import in_unit, measured, number


class ComparedCalibration(Temperature):
    file: str
    fit: Fit
    method: str
    date: str
    """ISO 8601, UTC; empty: not known"""
    tool_mm: list[float]
    provenance: dict[str, str]


class _ParameterDifference(TypedDict):
    parameter: str
    """NAME_reversal: a reversal error"""
    shape_only: bool
    """true: the slope, or the constant of a reversal error, is not determined in both; it is taken off."""
    interpolated: Literal["A", "B"] | None
    """Which of the two has no nodes at these positions."""
    significant: bool
    probability: float | None
    """That chance makes any of all values differ as much; null: uncertainties are not known."""
    largest: int
    """Index of the largest difference in the lists."""
    most_significant: int | None
    """Index of the largest normalised difference."""
    position_mm: list[float | None]
    """null: a squareness"""
    normalised: list[float | None]
    """Differences by their standard uncertainties."""


class LengthDifference(_ParameterDifference):
    difference_um: list[float | None]
    """B - A"""
    standard_uncertainty_um: list[float | None]


class AngleDifference(_ParameterDifference):
    difference_urad: list[float | None]
    """B - A"""
    standard_uncertainty_urad: list[float | None]


class ChangedFigure(TypedDict):
    """A figure of the error of the tool in the volume, by A and by B."""

    a_um: float | None
    """null: a parameter that acts in it is not determined"""
    b_um: float | None
    change_um: float | None
    """B - A"""
    interval_um: list[float | None] | None
    """95 % of the change; null: not known"""
    verdict: Literal["improved", "worse", "undecided"] | None


class Effect(TypedDict):
    """The error of the tool in the volume that the difference of a parameter makes alone."""

    parameter: str
    largest_um: float
    rms_um: float
    significant: bool


class ChangedVolume(TypedDict):
    """The error of the tool over the whole volume, at the tool offset of A."""

    largest: ChangedFigure
    rms: ChangedFigure
    no_verdict_because: str | None
    effects: list[Effect]
    """The largest first."""


class AgreementWithMap(TypedDict):
    """How a calibration agrees with an error map that is taken as the truth."""

    values: int
    """With a standard uncertainty other than 0."""
    beyond_two: int
    """Of these: deviation beyond two standard uncertainties."""
    rms_normalised: float | None
    """Root mean square of deviations by their standard uncertainties."""
    chi_square: float | None
    """Of all values with their covariance; null: there is none"""
    degrees_of_freedom: int
    chi_square_probability: float | None
    """Of a larger chi-square, if the uncertainties are right."""


class ComparisonObject(TypedDict):
    """Result of `stepdiag compare`."""

    stepdiag: str
    format: Literal["stepdiag comparison 1"]
    warnings: list[str]
    a: ComparedCalibration
    b: ComparedCalibration
    chain: str
    volume_mm: list[float]
    limit: float
    """A difference is significant up to this probability."""
    values: int
    """How many values are tested."""
    threshold: float | None
    """Normalised difference beyond which a value is significant; null: no value is tested."""
    significant: list[str]
    """Parameters that differ by more than chance explains."""
    volume: ChangedVolume
    agreement: AgreementWithMap | None
    """null: both are calibrations"""
    differences: list[LengthDifference | AngleDifference]
    only_in_a: list[str]
    only_in_b: list[str]
    notes: list[str]


def comparison_object(
    comparison: Comparison, change: volume_change.VolumeChange, files: tuple[Path, Path], warnings: Sequence[str]
) -> ComparisonObject:
    """How two calibrations, or a calibration and an error map, differ."""
    significant = filter(comparison.is_significant, comparison.differences)
    return {
        "stepdiag": __version__,
        "format": "stepdiag comparison 1",
        "warnings": list(warnings),
        "a": _compared(comparison.a, files[0]),
        "b": _compared(comparison.b, files[1]),
        "chain": comparison.a.chain.name,
        "volume_mm": comparison.a.volume.tolist(),
        "limit": comparison.limit,
        "values": comparison.count,
        "threshold": comparison.threshold if comparison.count else None,
        "significant": [difference.parameter for difference in significant],
        "volume": {
            "largest": _change(change.largest),
            "rms": _change(change.rms),
            "no_verdict_because": change.no_verdict_because or None,
            "effects": [_effect(effect) for effect in change.effects],
        },
        "agreement": None if comparison.agreement is None else _agreement(comparison.agreement),
        "differences": [_difference(comparison, one) for one in comparison.differences],
        "only_in_a": list(comparison.only_in_a),
        "only_in_b": list(comparison.only_in_b),
        "notes": list(comparison.notes),
    }


def _compared(calibration: Calibration, file: Path) -> ComparedCalibration:
    return {
        "file": str(file),
        "fit": fit_of(calibration),
        "method": calibration.method,
        "date": calibration.date,
        **temperature_of(calibration),
        "tool_mm": calibration.tool.tolist(),
        "provenance": dict(calibration.provenance),
    }


def _change(figure: volume_change.FigureChange) -> Any:
    interval = None if figure.interval is None else [in_unit("um", end) for end in figure.interval]
    values = measured("um", a=figure.a, b=figure.b, change=figure.change)
    return {**values, "interval_um": interval, "verdict": figure.verdict}


def _effect(effect: volume_change.ParameterEffect) -> Any:
    values = measured("um", largest=effect.largest, rms=effect.rms)
    return {"parameter": effect.parameter, **values, "significant": effect.significant}


def _agreement(agreement: truth.TruthAgreement) -> AgreementWithMap:
    return {
        "values": agreement.values,
        "beyond_two": agreement.beyond_two,
        "rms_normalised": number(agreement.rms),
        "chi_square": agreement.chi_square,
        "degrees_of_freedom": agreement.degrees_of_freedom,
        "chi_square_probability": agreement.probability,
    }


def _difference(comparison: Comparison, one: Difference) -> Any:
    return {
        "parameter": one.parameter,
        "shape_only": one.shape_only,
        "interpolated": one.interpolated or None,
        "significant": comparison.is_significant(one),
        "probability": comparison.probability(one),
        "largest": one.largest,
        "most_significant": one.most_significant,
        "position_mm": list(map(number, one.position.tolist())),
        "normalised": list(map(number, one.normalised.tolist())),
        **measured(unit_key(one.parameter), difference=one.value, standard_uncertainty=one.standard_uncertainty),
    }
