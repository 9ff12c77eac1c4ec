"""The object of `stepdiag recheck --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import ChangeCombination, ChangeTerm, Measurement, PredictedReading, __version__
from stepdiag.calibration.volume import VolumeErrors
from stepdiag.presentation.objects.calibration import Fit, fit_of
from stepdiag.presentation.objects.evaluation import Faults, faults_of
from stepdiag.presentation.objects.writer import in_unit, measured
from stepdiag.rechecking.recheck import Judged
from stepdiag.units import MICROMETRE


class Change(TypedDict):
    """How a parameter has changed."""

    parameter: str
    told: float
    """How much of it the readings tell, 0 to 1: near 1 they tell it alone; in between only in sums."""


class ScaleChange(Change):
    """Of a positioning deviation, by the position."""

    value_um_per_m: float
    standard_uncertainty_um_per_m: float
    """With the prior."""
    prior_um_per_m: float


class BowChange(Change):
    """Of a straightness, in the middle of the travel."""

    value_um: float
    standard_uncertainty_um: float
    """With the prior."""
    prior_um: float


class AngleChange(Change):
    """Of an angle, from one end of the travel to the other, or of a squareness."""

    value_urad: float
    standard_uncertainty_urad: float
    """With the prior."""
    prior_urad: float


class SumOfChanges(TypedDict):
    """A sum of changes, each by its prior, that readings tell."""

    weight: dict[str, float]
    """By parameter; the square sum is 1."""
    sum: float
    u_sum: float
    """Standard uncertainty, of the readings and the calibration alone."""


class Misfit(TypedDict):
    """A reading against the machine with the change."""

    row: int
    """Of the file, from 0."""
    run: int
    line: str
    point: int
    channel: str


class LengthMisfit(Misfit):
    deviation_um: float
    """Read minus predicted."""
    standard_uncertainty_um: float


class AngleMisfit(Misfit):
    deviation_urad: float
    """Read minus predicted."""
    standard_uncertainty_urad: float


class RecheckObject(TypedDict):
    """Result of `stepdiag recheck`."""

    stepdiag: str
    format: Literal["stepdiag recheck 1"]
    warnings: list[str]
    baseline: str
    """The file."""
    date: str
    """Of the baseline; ISO 8601, UTC; empty: not known"""
    fit: Fit
    """Of the baseline."""
    run: str
    """The file."""
    updated: str | None
    """The file that was written; null: none."""
    changed: bool
    """The probability is below alpha."""
    explained: bool
    """The probability of the readings, with the change, is at least alpha."""
    verdict: Literal["unchanged", "changed", "unexplained"]
    """unexplained: neither the baseline nor a change of low order explains the readings."""
    left_out: list[Faults]
    """Of the readings. All that they may have spoilt are left out of everything else."""
    misfits: list[LengthMisfit | AngleMisfit]
    """Where the readings are not explained: those that are farthest from the machine with the change, worst first."""
    alpha: float
    chi_square: float
    """Of no change."""
    degrees_of_freedom: int
    probability: float
    """Of a larger chi-square, if nothing has changed."""
    fit_chi_square: float
    """Of all readings, with the change."""
    fit_degrees_of_freedom: int
    fit_probability: float
    scales: list[ScaleChange]
    bows: list[BowChange]
    slopes: list[AngleChange]
    squarenesses: list[AngleChange]
    sums: list[SumOfChanges]
    """The best told first."""
    hidden_um: float
    """What changes that the readings do not tell may move the tool by (k = 2)."""
    largest_um: float | None
    """Error in the volume with the change; null: not known"""
    largest_interval_um: tuple[float, float] | None
    """95 %; null: not known"""


def recheck_object(
    judged: Judged,
    measurement: Measurement,
    volume: VolumeErrors,
    files: tuple[Path, Path, Path | None],
    warnings: Sequence[str],
) -> RecheckObject:
    """Whether a machine has changed, and by what. `files`: the baseline, the run and what was written."""
    found = judged.recheck
    interval = volume.largest_interval
    return {
        "stepdiag": __version__,
        "format": "stepdiag recheck 1",
        "warnings": list(warnings),
        "baseline": str(files[0]),
        "date": judged.baseline.date,
        "fit": fit_of(judged.baseline),
        "run": str(files[1]),
        "updated": None if files[2] is None else str(files[2]),
        "changed": judged.has_changed,
        "explained": judged.is_explained,
        "verdict": judged.verdict,
        "left_out": [faults_of(one) for one in found.left_out],
        "misfits": [_misfit(one, measurement) for one in found.misfits if not judged.is_explained],
        "alpha": judged.alpha,
        "chi_square": found.chi_square,
        "degrees_of_freedom": found.degrees_of_freedom,
        "probability": found.probability,
        "fit_chi_square": found.fit_chi_square,
        "fit_degrees_of_freedom": found.fit_degrees_of_freedom,
        "fit_probability": found.fit_probability,
        "scales": _changes(found.terms, "scale", "um_per_m"),
        "bows": _changes(found.terms, "bow", "um"),
        "slopes": _changes(found.terms, "slope", "urad"),
        "squarenesses": _changes(found.terms, "squareness", "urad"),
        "sums": [_sum(one, found.terms) for one in found.combinations],
        "hidden_um": judged.hidden / MICROMETRE,
        "largest_um": in_unit("um", volume.largest),
        "largest_interval_um": None if interval is None else (interval[0] / MICROMETRE, interval[1] / MICROMETRE),
    }


def _misfit(found: PredictedReading, measurement: Measurement) -> Any:
    values = measured(
        "urad" if found.channel in ("alpha", "beta") else "um",
        deviation=found.deviation,
        standard_uncertainty=found.standard_uncertainty,
    )
    place = {
        "row": found.row,
        "run": int(measurement.run[found.row]),
        "line": measurement.line[found.row],
        "point": int(measurement.point[found.row]),
    }
    return {**place, "channel": found.channel, **values}


def _changes(terms: Sequence[ChangeTerm], kind: str, unit: str) -> Any:
    return [
        {"parameter": term.parameter, "told": term.determined}
        | measured(unit, value=term.value, standard_uncertainty=term.standard_uncertainty, prior=term.prior)
        for term in terms
        if term.kind == kind
    ]


def _sum(one: ChangeCombination, terms: Sequence[ChangeTerm]) -> SumOfChanges:
    return {
        "weight": {term.parameter: weight for term, weight in zip(terms, one.weight, strict=True)},
        "sum": one.value,
        "u_sum": one.standard_uncertainty,
    }
