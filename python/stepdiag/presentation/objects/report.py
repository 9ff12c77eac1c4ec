"""The object of `stepdiag report --json`."""

from collections.abc import Sequence
from pathlib import Path

from typing_extensions import TypedDict

from stepdiag._core import Calibration
from stepdiag.calibration.functional_point import functional_point_straightness
from stepdiag.presentation.blocks import data_of
from stepdiag.presentation.calibration import calibration_blocks
from stepdiag.presentation.objects.calibration import (
    CalibrationTables,
    Fit,
    LargestValue,
    fit_of,
    largest_of,
    tables_of,
)
from stepdiag.presentation.objects.writer import Reported, first_keys
from stepdiag.presentation.quantity import Quantities, quantities


class FunctionalPointStraightness(TypedDict):
    parameter: str
    position: Quantities
    value: Quantities
    """Of the functional point."""
    table: Quantities
    """Of the axis' own frame."""


class ReportObject(Reported):
    """Result of `stepdiag report`."""

    fit: Fit
    file: str
    calibration: CalibrationTables
    largest_values: list[LargestValue]
    largest_standard_uncertainties: list[LargestValue]
    functional_point: list[FunctionalPointStraightness]
    """Straightnesses of the functional point that differ from the tables'."""


def report_object(calibration: Calibration, file: Path, warnings: Sequence[str]) -> ReportObject:
    """What the file of a calibration says."""
    return {
        **first_keys("report", warnings),
        "report": data_of(calibration_blocks(calibration)),
        "fit": fit_of(calibration),
        "file": str(file),
        "calibration": tables_of(calibration),
        "largest_values": largest_of(calibration),
        "largest_standard_uncertainties": largest_of(calibration, uncertainty=True),
        "functional_point": _functional_point(calibration),
    }


def _functional_point(calibration: Calibration) -> list[FunctionalPointStraightness]:
    return [
        {
            "parameter": name,
            "position": quantities("mm", position),
            "value": quantities("um", value, u),
            "table": quantities("um", calibration.functions[name][1]),
        }
        for name, (position, value, u) in functional_point_straightness(calibration).items()
    ]
