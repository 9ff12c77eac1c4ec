"""The object of `stepdiag verify --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration, LineDeviation, Measurement, Verification, __version__
from stepdiag.presentation.objects.calibration import Fit, fit_of
from stepdiag.presentation.objects.evaluation import Faults, faults_of
from stepdiag.presentation.objects.writer import in_unit, measured
from stepdiag.presentation.verification import agrees


class VerifiedLine(TypedDict):
    """From the first to the last distance of a line."""

    run: int
    line: str
    direction: Literal["forward", "backward"]
    deviation_um: float
    """Read minus predicted; of beams their mean."""
    standard_uncertainty_um: float
    normalised: float
    """E_n: the deviation by its expanded uncertainty (k = 2)."""


class WorstReading(TypedDict):
    """The reading with the largest E_n."""

    row: int
    """Of the file, from 0."""
    run: int
    line: str
    point: int
    channel: str
    deviation_um: float | None
    """null: an angle"""
    deviation_urad: float | None
    """null: a length"""
    normalised: float


class VerificationObject(TypedDict):
    """Result of `stepdiag verify`."""

    stepdiag: str
    format: Literal["stepdiag verification 1"]
    warnings: list[str]
    calibration: str
    """The file."""
    date: str
    """Of the calibration; ISO 8601, UTC; empty: not known"""
    fit: Fit
    """Of the calibration."""
    run: str
    """The file."""
    agrees: bool
    """The probability is at least alpha."""
    left_out: list[Faults]
    """Of the readings. All that they may have spoilt are left out of everything else."""
    alpha: float
    chi_square: float
    degrees_of_freedom: int
    probability: float
    """Of a larger chi-square, if calibration, readings and uncertainties are right."""
    lines: list[VerifiedLine]
    worst: WorstReading


def verification_object(
    verification: Verification,
    calibration: Calibration,
    measurement: Measurement,
    alpha: float,
    files: tuple[Path, Path],
    warnings: Sequence[str],
) -> VerificationObject:
    """How readings agree with a calibration."""
    return {
        "stepdiag": __version__,
        "format": "stepdiag verification 1",
        "warnings": list(warnings),
        "calibration": str(files[0]),
        "date": calibration.date,
        "fit": fit_of(calibration),
        "run": str(files[1]),
        "agrees": agrees(verification, alpha),
        "left_out": [faults_of(one) for one in verification.left_out],
        "alpha": alpha,
        "chi_square": verification.chi_square,
        "degrees_of_freedom": verification.degrees_of_freedom,
        "probability": verification.probability,
        "lines": [_line(line) for line in verification.lines],
        "worst": _worst(verification, measurement),
    }


def _line(line: LineDeviation) -> Any:
    values = measured("um", deviation=line.deviation, standard_uncertainty=line.standard_uncertainty)
    return {**values, "run": line.run, "line": line.line, "direction": line.direction, "normalised": line.normalised}


def _worst(verification: Verification, measurement: Measurement) -> WorstReading:
    row, channel = verification.worst
    deviation = float(verification.deviations[channel][row])
    is_angle = channel in ("alpha", "beta")
    return {
        "row": row,
        "run": int(measurement.run[row]),
        "line": measurement.line[row],
        "point": int(measurement.point[row]),
        "channel": channel,
        "deviation_um": None if is_angle else in_unit("um", deviation),
        "deviation_urad": in_unit("urad", deviation) if is_angle else None,
        "normalised": float(verification.normalised[channel][row]),
    }
