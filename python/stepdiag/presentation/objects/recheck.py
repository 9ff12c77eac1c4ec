"""The object of `stepdiag recheck --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, Literal

from typing_extensions import TypedDict

from stepdiag._core import ChangeCombination, ChangeTerm, Measurement, PredictedReading
from stepdiag.calibration.volume import VolumeErrors
from stepdiag.presentation.blocks import data_of
from stepdiag.presentation.objects.calibration import Fit, fit_of
from stepdiag.presentation.objects.evaluation import Faults, channel_unit, faults_of
from stepdiag.presentation.objects.writer import Reported, first_keys
from stepdiag.presentation.quantity import Quantity, Unit, quantity, with_interval
from stepdiag.presentation.verification import recheck_blocks
from stepdiag.rechecking.recheck import Judged

_UNITS: Final[dict[str, Unit]] = {"scale": "um/m", "bow": "um", "slope": "urad", "squareness": "urad"}


class Change(TypedDict):
    """How a parameter has changed."""

    parameter: str
    kind: Literal["scale", "bow", "slope", "squareness"]
    """Of a positioning deviation, by the position; of a straightness, in the middle of the travel; of an angle, from
    one end of the travel to the other; of a squareness."""
    determined: float
    """How much of it the readings determine, 0 to 1: near 1 by itself; in between only in sums."""
    value: Quantity
    """Its standard uncertainty: with the prior."""
    prior: Quantity
    """Standard uncertainty before the recheck."""


class SumOfChanges(TypedDict):
    """A sum of changes, each by its prior, that readings determine."""

    weight: dict[str, float]
    """By parameter; the square sum is 1."""
    sum: Quantity
    """Its standard uncertainty: of the readings and the calibration alone."""


class Misfit(TypedDict):
    """A reading against the machine with the change."""

    row: int
    """Of the file, from 0."""
    run: int
    line: str
    point: int
    channel: str
    deviation: Quantity
    """Read minus predicted."""


class RecheckObject(Reported):
    """Result of `stepdiag recheck`."""

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
    misfits: list[Misfit]
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
    changes: list[Change]
    sums: list[SumOfChanges]
    """The best determined first."""
    hidden: Quantity
    """What changes that the readings do not determine may move the tool by (k = 2)."""
    largest: Quantity
    """Error in the volume with the change."""


def recheck_object(
    judged: Judged,
    measurement: Measurement,
    volume: VolumeErrors,
    files: tuple[Path, Path, Path | None],
    warnings: Sequence[str],
) -> RecheckObject:
    """Whether a machine has changed, and by what. `files`: the baseline, the run and what was written."""
    found = judged.recheck
    return {
        **first_keys("recheck", warnings),
        "report": data_of(recheck_blocks(judged, measurement, volume)),
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
        "changes": [_change(term) for term in found.terms],
        "sums": [_sum(one, found.terms) for one in found.combinations],
        "hidden": quantity("um", judged.hidden),
        "largest": with_interval("um", volume.largest, volume.largest_interval),
    }


def _misfit(found: PredictedReading, measurement: Measurement) -> Misfit:
    return {
        "row": found.row,
        "run": int(measurement.run[found.row]),
        "line": measurement.line[found.row],
        "point": int(measurement.point[found.row]),
        "channel": found.channel,
        "deviation": quantity(channel_unit(found.channel), found.deviation, found.standard_uncertainty),
    }


def _change(term: ChangeTerm) -> Change:
    kind: Any = term.kind
    unit = _UNITS[term.kind]
    return {
        "parameter": term.parameter,
        "kind": kind,
        "determined": term.determined,
        "value": quantity(unit, term.value, term.standard_uncertainty),
        "prior": quantity(unit, term.prior),
    }


def _sum(one: ChangeCombination, terms: Sequence[ChangeTerm]) -> SumOfChanges:
    return {
        "weight": {term.parameter: weight for term, weight in zip(terms, one.weight, strict=True)},
        "sum": quantity("1", one.value, one.standard_uncertainty),
    }
