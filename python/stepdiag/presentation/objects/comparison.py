"""The object of `stepdiag compare --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration
from stepdiag.calibration import truth, volume_change
from stepdiag.calibration.comparison import Comparison, Difference
from stepdiag.presentation.blocks import data_of
from stepdiag.presentation.comparison import comparison_blocks
from stepdiag.presentation.objects.calibration import Fit, Temperature, fit_of, temperature_of, value_unit
from stepdiag.presentation.objects.writer import Reported, first_keys
from stepdiag.presentation.quantity import Quantities, Quantity, number, quantities, quantity, with_interval


class ComparedCalibration(Temperature):
    file: str
    fit: Fit
    method: str
    date: str
    """ISO 8601, UTC; empty: not known"""
    tool: Quantities
    provenance: dict[str, str]


class ParameterDifference(TypedDict):
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
    position: Quantities
    """null: a squareness"""
    difference: Quantities
    """B - A"""
    normalised: list[float | None]
    """Differences by their standard uncertainties."""


class ChangedFigure(TypedDict):
    """A figure of the error of the tool in the volume, by A and by B."""

    a: Quantity
    b: Quantity
    change: Quantity
    """B - A"""
    verdict: Literal["improved", "worse", "undecided"] | None


class Effect(TypedDict):
    """The error of the tool in the volume that the difference of a parameter makes alone."""

    parameter: str
    largest: Quantity
    rms: Quantity
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


class ComparisonObject(Reported):
    """Result of `stepdiag compare`."""

    a: ComparedCalibration
    b: ComparedCalibration
    chain: str
    size: Quantities
    """Of the volume: edges along X, Y, Z"""
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
    differences: list[ParameterDifference]
    only_in_a: list[str]
    only_in_b: list[str]
    notes: list[str]


def comparison_object(
    comparison: Comparison, change: volume_change.VolumeChange, files: tuple[Path, Path], warnings: Sequence[str]
) -> ComparisonObject:
    """How two calibrations, or a calibration and an error map, differ."""
    significant = filter(comparison.is_significant, comparison.differences)
    return {
        **first_keys("comparison", warnings),
        "report": data_of(comparison_blocks(comparison, change, str(files[0]), str(files[1]))),
        "a": _compared(comparison.a, files[0]),
        "b": _compared(comparison.b, files[1]),
        "chain": comparison.a.chain.name,
        "size": quantities("mm", comparison.a.volume),
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
        "tool": quantities("mm", calibration.tool),
        "provenance": dict(calibration.provenance),
    }


def _change(figure: volume_change.FigureChange) -> ChangedFigure:
    open_because = "a parameter that acts in it is not determined"
    verdict: Any = figure.verdict
    return {
        "a": quantity("um", figure.a, reason=open_because),
        "b": quantity("um", figure.b, reason=open_because),
        "change": with_interval("um", figure.change, figure.interval, reason=open_because),
        "verdict": verdict,
    }


def _effect(effect: volume_change.ParameterEffect) -> Effect:
    return {
        "parameter": effect.parameter,
        "largest": quantity("um", effect.largest),
        "rms": quantity("um", effect.rms),
        "significant": effect.significant,
    }


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
        "position": quantities("mm", one.position),
        "difference": quantities(value_unit(one.parameter), one.value, one.standard_uncertainty),
        "normalised": list(map(number, one.normalised.tolist())),
    }
