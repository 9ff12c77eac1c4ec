"""The object of `stepdiag export --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from typing_extensions import TypedDict

from stepdiag._core import Calibration, __version__
from stepdiag.exporting.left_in_volume import ErrorSize
from stepdiag.exporting.result import Export
from stepdiag.presentation.objects.calibration import Fit, fit_of
from stepdiag.presentation.objects.writer import in_unit


class SizeInVolume(TypedDict):
    """Errors of the functional point over the volume."""

    largest_um: float | None
    rms_um: float | None
    components_um: list[float | None]
    """Largest absolute X, Y, Z."""


class ExportObject(TypedDict):
    """Result of `stepdiag export`."""

    stepdiag: str
    format: Literal["stepdiag export 1"]
    fit: Fit
    warnings: list[str]
    file: str
    to: str
    """The format."""
    files: list[str]
    """What was written."""
    chain: str
    volume_mm: list[float]
    compensated: list[str]
    """Of the 21 parameters."""
    compensated_in_part: list[str]
    left_out: list[str]
    """Of the 21 parameters: nothing of them is compensated."""
    without: SizeInVolume | None
    """Errors in the volume without the export; null: not known, or all 21 parameters are compensated"""
    with_it: SizeInVolume | None
    """Errors in the volume with the export, applied as its controller applies it."""
    squareness_urad: dict[str, float | None] | None
    """Of squareness: C0Y, B0Z, A0Z, as in the calibration."""
    fitted_squareness_urad: dict[str, float | None] | None
    """Of squareness: the three angles with the least rms error in the volume."""
    with_fitted: SizeInVolume | None
    """Errors in the volume with these."""
    linear: list[list[float]] | None
    """Of matrix and calibxyzkins: actual = linear motor + quadratic motor^2 + constant; rows X, Y, Z."""
    quadratic_per_mm: list[list[float]] | None
    constant_mm: list[float] | None
    notes: list[str]
    """The report, a sentence each, without warnings."""


def export_object(
    done: Export, calibration: Calibration, to: str, file: Path, fit_warnings: Sequence[str]
) -> ExportObject:
    """The files of an export, and the errors that remain."""
    warnings = [line.removeprefix("warning: ") for line in done.report if line.startswith("warning: ")]
    with_fitted = done.values.get("with_fitted")
    return {
        "stepdiag": __version__,
        "format": "stepdiag export 1",
        "fit": fit_of(calibration),
        "warnings": [*warnings, *fit_warnings],
        "file": str(file),
        "to": to,
        "files": [str(path) for path in done.files],
        "chain": calibration.chain.name,
        "volume_mm": calibration.volume.tolist(),
        "compensated": list(done.coverage.whole),
        "compensated_in_part": list(done.coverage.in_part),
        "left_out": done.coverage.left_out,
        "without": None if done.left is None else _size(done.left.without),
        "with_it": None if done.left is None else _size(done.left.with_it),
        "squareness_urad": _angles(done, "squareness"),
        "fitted_squareness_urad": _angles(done, "fitted"),
        "with_fitted": None if with_fitted is None else _size(with_fitted.with_it),
        "linear": _numbers(done, "linear"),
        "quadratic_per_mm": _numbers(done, "quadratic"),
        "constant_mm": _numbers(done, "constant"),
        "notes": [line for line in done.report if not line.startswith("warning: ")],
    }


def _size(size: ErrorSize) -> SizeInVolume:
    return {
        "largest_um": in_unit("um", size.largest),
        "rms_um": in_unit("um", size.rms),
        "components_um": [in_unit("um", component) for component in size.components],
    }


def _angles(done: Export, name: str) -> dict[str, float | None] | None:
    angles = done.values.get(name)
    return None if angles is None else {parameter: in_unit("urad", angle) for parameter, angle in angles.items()}


def _numbers(done: Export, name: str) -> list | None:  # type: ignore[type-arg]
    found = done.values.get(name)
    return None if found is None else np.asarray(found).tolist()
