"""The object of `stepdiag report --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import Calibration, __version__
from stepdiag.calibration.functional_point import functional_point_straightness
from stepdiag.presentation.objects.calibration import (
    CalibrationTables,
    Fit,
    LargestAngle,
    LargestLength,
    LeastKnownAngle,
    LeastKnownLength,
    fit_of,
    largest_of,
    tables_of,
)
from stepdiag.presentation.objects.writer import measured


class FunctionalPointStraightness(TypedDict):
    parameter: str
    position_mm: list[float]
    value_um: list[float | None]
    """Of the functional point."""
    standard_uncertainty_um: list[float | None]
    table_um: list[float | None]
    """Of the axis' own frame."""


class ReportObject(TypedDict):
    """Result of `stepdiag report`."""

    stepdiag: str
    format: Literal["stepdiag report 1"]
    fit: Fit
    warnings: list[str]
    file: str
    calibration: CalibrationTables
    largest_values: list[LargestLength | LargestAngle]
    largest_standard_uncertainties: list[LeastKnownLength | LeastKnownAngle]
    functional_point: list[FunctionalPointStraightness]
    """Straightnesses of the functional point that differ from the tables'."""


def report_object(calibration: Calibration, file: Path, warnings: Sequence[str]) -> ReportObject:
    """What the file of a calibration says."""
    return {
        "stepdiag": __version__,
        "format": "stepdiag report 1",
        "fit": fit_of(calibration),
        "warnings": list(warnings),
        "file": str(file),
        "calibration": tables_of(calibration),
        "largest_values": largest_of(calibration),
        "largest_standard_uncertainties": largest_of(calibration, uncertainty=True),
        "functional_point": _functional_point(calibration),
    }


def _functional_point(calibration: Calibration) -> list[Any]:
    return [
        {
            "parameter": name,
            "position_mm": position.tolist(),
            **measured("um", value=value, standard_uncertainty=u, table=calibration.functions[name][1]),
        }
        for name, (position, value, u) in functional_point_straightness(calibration).items()
    ]
