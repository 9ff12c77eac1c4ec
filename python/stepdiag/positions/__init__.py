"""Figures of ISO 230-2 and ISO 230-6 along a line: from repeated readings, or predicted from a calibration."""

from stepdiag.positions.evaluation import MeasuredPositions, evaluate_positions
from stepdiag.positions.figures import PositionFigure
from stepdiag.positions.prediction import PredictedPositions, axis_line, diagonal_line, predict_positions
from stepdiag.positions.readings import PositionReadings, read_positions

__all__ = [
    "MeasuredPositions",
    "PositionFigure",
    "PositionReadings",
    "PredictedPositions",
    "axis_line",
    "diagonal_line",
    "evaluate_positions",
    "predict_positions",
    "read_positions",
]


def __dir__() -> list[str]:
    return __all__
