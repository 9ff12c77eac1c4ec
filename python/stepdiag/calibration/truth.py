"""A calibration against the true errors of its machine: deviations in units of their standard uncertainties."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from stepdiag._core import Calibration, Chain, ErrorMap, InvalidArgument
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.findings.error_map import frame_deviation_texts
from stepdiag.parameters import SQUARENESSES

TRUTH: Final = "error map"  # the method of a truth that stands in place of a calibration
# Directions in which correlations leave a smaller share of the variance are fixed by the method, and say nothing.
_SINGULAR: Final = 1e-10


@dataclass(frozen=True)
class TruthAgreement:
    """How far a calibration is from the truth, in units of its standard uncertainties.

    The share of values beyond 2 u is 4.6 % on average if the uncertainties are right; neighbouring values are
    correlated, so that it scatters. Chi-square counts the correlations: it is of all values together, and None without
    covariance."""

    values: int  # with a standard uncertainty other than 0
    beyond_two: int  # of these: |deviation| > 2 u
    rms: float  # root mean square of deviation/u; NaN without uncertainties
    chi_square: float | None
    degrees_of_freedom: int
    probability: float | None  # of a larger chi-square, if the uncertainties are right


def truth_as_calibration(truth: ErrorMap, like: Calibration) -> tuple[Calibration, list[str]]:
    """The truth as a calibration with the parameters and nodes of another one and no uncertainty; and what is odd.

    Chain, volume and tool are those of the map's leading lines, or of the other calibration. Parameters that the map
    does not have are 0. Raises InvalidArgument for leading lines that are none."""
    functions = {
        name: (position, truth.function(name, position), np.zeros_like(position))
        for name, (position, _, _) in like.functions.items()
    }
    reversal = {
        name: (p, truth.function(name, p, "+") - truth.function(name, p, "-"), np.zeros_like(p))
        for name, (p, _, _) in like.reversal.items()
    }
    calibration = Calibration(
        TRUTH,
        Chain(truth.header["chain"]) if "chain" in truth.header else like.chain,
        _lengths(truth, "volume_mm", like.volume),
        _lengths(truth, "tool_mm", like.tool),
        functions,
        {name: (truth.squareness.get(name, 0.0), 0.0) for name in SQUARENESSES if name in like.squareness},
        reversal=reversal,
        reversal_negative_uncertainty={name: np.zeros_like(table[0]) for name, table in reversal.items()},
        unverified="unverified" in truth.header,
    )
    return calibration, [f"error map: {text}" for text in frame_deviation_texts(truth, like.volume)]


def agreement_with_truth(
    calibration: Calibration, deviations: Mapping[str, FloatArray], shapes: Collection[str], normalised: FloatArray
) -> TruthAgreement:
    """Count the deviations of a calibration from its truth.

    deviations: parameter -> values at the calibration's nodes; of `shapes` with both ends at 0. normalised: those that
    have a standard uncertainty, in its units."""
    chi_square, freedom = _chi_square(calibration, deviations, shapes)
    return TruthAgreement(
        len(normalised),
        int(np.count_nonzero(np.abs(normalised) > 2.0)),
        math.sqrt(float(np.mean(normalised**2))) if len(normalised) else math.nan,
        chi_square,
        freedom,
        None if chi_square is None else chi_square_probability(chi_square, freedom),
    )


def chi_square_probability(square_sum: float, degrees_of_freedom: int) -> float:
    """That chi-square of this whole number of degrees of freedom exceeds the sum (finite series of Q(n/2, x/2))."""
    half, odd = 0.5 * square_sum, degrees_of_freedom % 2
    if half <= 0.0:
        return 1.0
    exponents = 0.5 * odd + np.arange(degrees_of_freedom // 2)
    terms = (math.exp(a * math.log(half) - half - math.lgamma(a + 1.0)) for a in exponents.tolist())
    return min(1.0, math.fsum([math.erfc(math.sqrt(half)) if odd else 0.0, *terms]))


def _chi_square(
    calibration: Calibration, deviations: Mapping[str, FloatArray], shapes: Collection[str]
) -> tuple[float | None, int]:
    covariance = calibration.covariance
    if covariance is None:
        return None, 0
    names = np.array([name for name, _ in calibration.covariance_labels])
    deviation, shape = np.zeros(len(names)), np.eye(len(names))
    for name in dict.fromkeys(names.tolist()):  # reversal errors are not among them
        own = np.flatnonzero(names == name)
        deviation[own] = deviations[name]
        if name in shapes:
            position = calibration.functions[name][0]
            shape[own, own[-1]] -= position / position[-1]
    covariance = shape @ covariance @ shape.T
    u = np.sqrt(np.diagonal(covariance).clip(0.0))
    kept = u > 1e-9 * u.max()
    scale = u[kept]
    variances, directions = np.linalg.eigh(covariance[np.ix_(kept, kept)] / np.outer(scale, scale))
    known = variances > _SINGULAR * len(variances)
    along = directions[:, known].T @ (deviation[kept] / scale)
    return float(np.sum(along**2 / variances[known])), int(np.count_nonzero(known))


def _lengths(truth: ErrorMap, key: str, otherwise: FloatArray) -> FloatArray:
    if key not in truth.header:
        return otherwise
    try:
        values = np.array([float(word) for word in truth.header[key].split()])
    except ValueError:
        values = np.array([])
    if values.shape != (3,) or not np.all(np.isfinite(values)):
        raise InvalidArgument(f"# {key}: expected three lengths, got {truth.header[key]!r}")
    return values
