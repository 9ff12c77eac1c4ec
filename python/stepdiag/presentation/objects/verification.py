"""The object of `stepdiag verify --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration, LineDeviation, Measurement, Verification
from stepdiag.presentation.blocks import data_of
from stepdiag.presentation.objects.calibration import Fit, fit_of
from stepdiag.presentation.objects.evaluation import Faults, channel_unit, faults_of
from stepdiag.presentation.objects.writer import Reported, first_keys
from stepdiag.presentation.quantity import Quantity, quantity
from stepdiag.presentation.verification import agrees, verification_blocks
from stepdiag.rechecking.verification import Compensated


class VerifiedLine(TypedDict):
    """From the first to the last distance of a line."""

    run: int
    line: str
    direction: Literal["forward", "backward"]
    deviation: Quantity
    """Read minus predicted; of beams their mean."""
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
    deviation: Quantity
    normalised: float


class TableActing(TypedDict):
    """Chi-square of the readings with a table in force as it is, without it, and with its sign turned."""

    tables: list[str]
    """The files."""
    chi_square: float
    chi_square_without: float
    chi_square_turned: float
    degrees_of_freedom: int
    acts: Literal["as it is", "not", "turned"]
    """As the smallest of the three says."""


class VerificationObject(Reported):
    """Result of `stepdiag verify`."""

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
    compensated: TableActing | None
    """With `compensated`, whether the table acts."""


def verification_object(
    verification: Verification,
    calibration: Calibration,
    measurement: Measurement,
    alpha: float,
    files: tuple[Path, Path],
    warnings: Sequence[str],
    *,
    compensated: Compensated | None = None,
    tables: Sequence[Path] = (),
) -> VerificationObject:
    """How readings agree with a calibration."""
    return {
        **first_keys("verification", warnings),
        "report": data_of(verification_blocks(verification, measurement, alpha)),
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
        "compensated": None if compensated is None else _acting(compensated, tables),
    }


def _acting(found: Compensated, tables: Sequence[Path]) -> TableActing:
    return {
        "tables": [str(table) for table in tables],
        "chi_square": found.with_it,
        "chi_square_without": found.without,
        "chi_square_turned": found.turned,
        "degrees_of_freedom": found.degrees_of_freedom,
        "acts": found.acts,
    }


def _line(line: LineDeviation) -> Any:
    return {
        "run": line.run,
        "line": line.line,
        "direction": line.direction,
        "deviation": quantity("um", line.deviation, line.standard_uncertainty),
        "normalised": line.normalised,
    }


def _worst(verification: Verification, measurement: Measurement) -> WorstReading:
    row, channel = verification.worst
    deviation = float(verification.deviations[channel][row])
    return {
        "row": row,
        "run": int(measurement.run[row]),
        "line": measurement.line[row],
        "point": int(measurement.point[row]),
        "channel": channel,
        "deviation": quantity(channel_unit(channel), deviation),
        "normalised": float(verification.normalised[channel][row]),
    }
