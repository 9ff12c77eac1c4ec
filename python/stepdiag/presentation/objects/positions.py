"""The object of `stepdiag positions --json`."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration
from stepdiag.positions.evaluation import MeasuredPositions, TargetScatter
from stepdiag.positions.figures import PositionFigure
from stepdiag.positions.prediction import PredictedPositions
from stepdiag.presentation.blocks import Block, data_of
from stepdiag.presentation.objects.calibration import Fit, fit_of
from stepdiag.presentation.objects.writer import Reported, first_keys
from stepdiag.presentation.positions import measured_blocks, predicted_blocks
from stepdiag.presentation.quantity import Quantities, Quantity, quantities, quantity, with_interval


class Figure(TypedDict):
    value: Quantity
    """Its standard uncertainty: measured, from the scatter of the readings alone; predicted, from the calibration."""
    at: Quantities
    """Where it occurs: one target, or those of the highest and of the lowest value; empty for a mean."""


class Scatter(TypedDict):
    """Deviations at a target that was approached in one direction."""

    target: Quantity
    mean: Quantity
    standard_deviation: Quantity
    """Sample standard deviation"""
    readings: int


class LeftOut(TypedDict):
    target: Quantity
    direction: Literal["+", "-"]
    readings: int


class TargetReversal(TypedDict):
    target: Quantity
    reversal: Quantity
    repeatability: Quantity


class Measured(TypedDict):
    """Evaluation of repeated readings."""

    line: str
    """What was measured, as the file says."""
    targets: Quantities
    cycles: list[int]
    readings: int
    lost: int
    figures: dict[str, Figure]
    """By symbol: A, A_up, A_down, E, E_up, E_down, M, R, R_up, R_down, B, B_mean, as far as they are known."""
    up: list[Scatter]
    """Targets approached in + direction."""
    down: list[Scatter]
    both: list[TargetReversal]
    left_out: list[LeftOut]
    """Targets with fewer than two readings in a direction."""


class PredictedLine(TypedDict):
    name: str
    """An axis, a diagonal, or line"""
    start: Quantities
    end: Quantities
    figures: dict[str, Figure]
    """By symbol: E, E_up, E_down, M, B, B_mean, as far as they are known; systematic part."""
    target: Quantities
    """Distance from the start."""
    up: Quantities
    """Deviations at the targets, approached from start to end."""
    down: Quantities
    """Approached from end to start; where reversal is null, known but for a constant."""
    reversal: Quantities
    reasons: list[str]
    """Why figures or intervals are missing."""


class Predicted(TypedDict):
    """Prediction from a calibration."""

    fit: Fit
    tool: Quantities
    lines: list[PredictedLine]


class PositionsObject(Reported):
    """Result of `stepdiag positions`."""

    file: str
    measured: Measured | None
    """null: the file is a calibration"""
    predicted: Predicted | None
    """null: the file has readings"""


def measured_object(result: MeasuredPositions, file: Path, warnings: Sequence[str]) -> PositionsObject:
    """What repeated readings say."""
    readings = result.readings
    own: Any = {
        "line": readings.line,
        "targets": quantities("mm", readings.targets),
        "cycles": list(readings.cycles),
        "readings": len(readings.deviations),
        "lost": readings.lost,
        "figures": _figures(result.figures),
        "up": _scatters(result.up),
        "down": _scatters(result.down),
        "both": [
            {
                "target": quantity("mm", target),
                "reversal": quantity("um", reversal),
                "repeatability": quantity("um", result.repeatability[target], reason="too few readings"),
            }
            for target, reversal in result.reversal.items()
        ],
        "left_out": [
            {"target": quantity("mm", target), "direction": direction, "readings": count}
            for target, direction, count in result.left_out
        ],
    }
    return _object(file, warnings, measured_blocks(result), own, None)


def predicted_object(
    calibration: Calibration, lines: Mapping[str, PredictedPositions], file: Path, warnings: Sequence[str]
) -> PositionsObject:
    """What a calibration predicts along lines."""
    own: Any = {
        "fit": fit_of(calibration),
        "tool": quantities("mm", next(iter(lines.values())).tool),
        "lines": [
            {
                "name": name,
                "start": quantities("mm", line.start),
                "end": quantities("mm", line.end),
                "figures": _figures(line.figures),
                "target": quantities("mm", line.target),
                "up": quantities("um", line.up, line.up_standard_uncertainty),
                "down": quantities("um", line.down),
                "reversal": quantities("um", line.reversal, line.reversal_standard_uncertainty),
                "reasons": list(line.reasons),
            }
            for name, line in lines.items()
        ],
    }
    return _object(file, warnings, predicted_blocks(calibration, lines), None, own)


def _object(
    file: Path,
    warnings: Sequence[str],
    blocks: Iterable[Block],
    measured: Measured | None,
    predicted: Predicted | None,
) -> PositionsObject:
    return {
        **first_keys("positions", warnings),
        "report": data_of(blocks),
        "file": str(file),
        "measured": measured,
        "predicted": predicted,
    }


def _figures(figures: Mapping[str, PositionFigure]) -> dict[str, Any]:
    return {
        name: {
            "value": with_interval("um", figure.value, figure.interval, figure.standard_uncertainty),
            "at": quantities("mm", figure.at),
        }
        for name, figure in figures.items()
    }


def _scatters(scatters: Iterable[TargetScatter]) -> list[Any]:
    return [
        {
            "target": quantity("mm", scatter.target),
            "mean": quantity("um", scatter.mean),
            "standard_deviation": quantity("um", scatter.deviation),
            "readings": scatter.count,
        }
        for scatter in scatters
    ]
