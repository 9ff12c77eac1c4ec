"""The object of `stepdiag positions --json`."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration, __version__
from stepdiag.positions.evaluation import MeasuredPositions, TargetScatter
from stepdiag.positions.figures import PositionFigure
from stepdiag.positions.prediction import PredictedPositions
from stepdiag.presentation.objects.calibration import Fit, fit_of
from stepdiag.presentation.objects.writer import in_unit, measured


class Figure(TypedDict):
    value_um: float | None
    at_mm: list[float]
    """Where it occurs: one target, or those of the highest and of the lowest value; empty for a mean."""
    standard_uncertainty_um: float | None
    """Measured: from the scatter of the readings alone. Predicted: from the calibration. null: not known."""
    interval_um: list[float | None] | None
    """95 %; null: not known"""


class Scatter(TypedDict):
    """Deviations at a target that was approached in one direction."""

    target_mm: float
    mean_um: float | None
    standard_deviation_um: float | None
    """Sample standard deviation"""
    readings: int


class LeftOut(TypedDict):
    target_mm: float
    direction: Literal["+", "-"]
    readings: int


class Reversal(TypedDict):
    target_mm: float
    reversal_um: float | None
    repeatability_um: float | None


class Measured(TypedDict):
    """Evaluation of repeated readings."""

    line: str
    """What was measured, as the file says."""
    targets_mm: list[float]
    cycles: list[int]
    readings: int
    lost: int
    figures: dict[str, Figure]
    """By symbol: A, A_up, A_down, E, E_up, E_down, M, R, R_up, R_down, B, B_mean, as far as they are known."""
    up: list[Scatter]
    """Targets approached in + direction."""
    down: list[Scatter]
    both: list[Reversal]
    left_out: list[LeftOut]
    """Targets with fewer than two readings in a direction."""


class PredictedLine(TypedDict):
    name: str
    """An axis, a diagonal, or line"""
    start_mm: list[float]
    end_mm: list[float]
    figures: dict[str, Figure]
    """By symbol: E, E_up, E_down, M, B, B_mean, as far as they are known; systematic part."""
    target_mm: list[float]
    """Distance from the start."""
    up_um: list[float | None]
    """Deviations at the targets, approached from start to end."""
    up_standard_uncertainty_um: list[float | None]
    down_um: list[float | None]
    """Approached from end to start; where reversal_um is null, known but for a constant."""
    reversal_um: list[float | None]
    reversal_standard_uncertainty_um: list[float | None]
    reasons: list[str]
    """Why figures or intervals are missing."""


class Predicted(TypedDict):
    """Prediction from a calibration."""

    fit: Fit
    tool_mm: list[float]
    lines: list[PredictedLine]


class PositionsObject(TypedDict):
    """Result of `stepdiag positions`."""

    stepdiag: str
    format: Literal["stepdiag positions 1"]
    warnings: list[str]
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
        "targets_mm": list(readings.targets),
        "cycles": list(readings.cycles),
        "readings": len(readings.deviations),
        "lost": readings.lost,
        "figures": _figures(result.figures),
        "up": _scatters(result.up),
        "down": _scatters(result.down),
        "both": [
            {"target_mm": target, **measured("um", reversal=reversal, repeatability=result.repeatability[target])}
            for target, reversal in result.reversal.items()
        ],
        "left_out": [
            {"target_mm": target, "direction": direction, "readings": count}
            for target, direction, count in result.left_out
        ],
    }
    return _object(file, warnings, own, None)


def predicted_object(
    calibration: Calibration, lines: Mapping[str, PredictedPositions], file: Path, warnings: Sequence[str]
) -> PositionsObject:
    """What a calibration predicts along lines."""
    own: Any = {
        "fit": fit_of(calibration),
        "tool_mm": list(next(iter(lines.values())).tool),
        "lines": [
            {
                "name": name,
                "start_mm": list(line.start),
                "end_mm": list(line.end),
                "figures": _figures(line.figures),
                "target_mm": line.target.tolist(),
                **measured(
                    "um",
                    up=line.up,
                    up_standard_uncertainty=line.up_standard_uncertainty,
                    down=line.down,
                    reversal=line.reversal,
                    reversal_standard_uncertainty=line.reversal_standard_uncertainty,
                ),
                "reasons": list(line.reasons),
            }
            for name, line in lines.items()
        ],
    }
    return _object(file, warnings, None, own)


def _object(
    file: Path, warnings: Sequence[str], measured: Measured | None, predicted: Predicted | None
) -> PositionsObject:
    return {
        "stepdiag": __version__,
        "format": "stepdiag positions 1",
        "warnings": list(warnings),
        "file": str(file),
        "measured": measured,
        "predicted": predicted,
    }


def _figures(figures: Mapping[str, PositionFigure]) -> dict[str, Any]:
    return {
        name: {
            "at_mm": list(figure.at),
            "interval_um": None if figure.interval is None else [in_unit("um", end) for end in figure.interval],
            **measured("um", value=figure.value, standard_uncertainty=figure.standard_uncertainty),
        }
        for name, figure in figures.items()
    }


def _scatters(scatters: Iterable[TargetScatter]) -> list[Any]:
    return [
        {
            "target_mm": scatter.target,
            "readings": scatter.count,
            **measured("um", mean=scatter.mean, standard_deviation=scatter.deviation),
        }
        for scatter in scatters
    ]
