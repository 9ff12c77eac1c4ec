"""The object of `stepdiag export --json`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from typing_extensions import TypedDict

from stepdiag._core import Calibration
from stepdiag.exporting.left_in_volume import ErrorSize
from stepdiag.exporting.result import Export
from stepdiag.presentation.objects.calibration import Fit, fit_of
from stepdiag.presentation.objects.writer import Object, first_keys
from stepdiag.presentation.quantity import Quantities, Quantity, Unit, quantities, quantity


class SizeInVolume(TypedDict):
    """Errors of the functional point over the volume."""

    largest: Quantity
    rms: Quantity
    components: Quantities
    """Largest absolute X, Y, Z."""


class ExportObject(Object):
    """Result of `stepdiag export`."""

    fit: Fit
    file: str
    to: str
    """The format."""
    files: list[str]
    """What was written."""
    chain: str
    volume: Quantities
    compensated: list[str]
    """Of the 21 parameters."""
    compensated_in_part: list[str]
    left_out: list[str]
    """Of the 21 parameters: nothing of them is compensated."""
    without: SizeInVolume | None
    """Errors in the volume without the export; null: not known, or all 21 parameters are compensated"""
    with_it: SizeInVolume | None
    """Errors in the volume with the export, applied as its controller applies it."""
    squareness: dict[str, Quantity] | None
    """Of squareness: C0Y, B0Z, A0Z, as in the calibration."""
    fitted_squareness: dict[str, Quantity] | None
    """Of squareness: the three angles with the least rms error in the volume."""
    with_fitted: SizeInVolume | None
    """Errors in the volume with these."""
    linear: list[Quantities] | None
    """Of matrix and calibxyzkins: actual = linear motor + quadratic motor^2 + constant; rows X, Y, Z."""
    quadratic: list[Quantities] | None
    constant: Quantities | None
    notes: list[str]
    """The report, a sentence each, without warnings."""


def export_object(
    done: Export, calibration: Calibration, to: str, file: Path, fit_warnings: Sequence[str]
) -> ExportObject:
    """The files of an export, and the errors that remain."""
    warnings = [line.removeprefix("warning: ") for line in done.report if line.startswith("warning: ")]
    constant = done.values.get("constant")
    with_fitted = done.values.get("with_fitted")
    return {
        **first_keys("export", [*warnings, *fit_warnings]),
        "fit": fit_of(calibration),
        "file": str(file),
        "to": to,
        "files": [str(path) for path in done.files],
        "chain": calibration.chain.name,
        "volume": quantities("mm", calibration.volume),
        "compensated": list(done.coverage.whole),
        "compensated_in_part": list(done.coverage.in_part),
        "left_out": done.coverage.left_out,
        "without": None if done.left is None else _size(done.left.without),
        "with_it": None if done.left is None else _size(done.left.with_it),
        "squareness": _angles(done, "squareness"),
        "fitted_squareness": _angles(done, "fitted"),
        "with_fitted": None if with_fitted is None else _size(with_fitted.with_it),
        "linear": _rows("1", done.values.get("linear")),
        "quadratic": _rows("1/mm", done.values.get("quadratic")),
        "constant": None if constant is None else quantities("mm", np.asarray(constant)),
        "notes": [line for line in done.report if not line.startswith("warning: ")],
    }


def _size(size: ErrorSize) -> SizeInVolume:
    return {
        "largest": quantity("um", size.largest),
        "rms": quantity("um", size.rms),
        "components": quantities("um", size.components),
    }


def _angles(done: Export, name: str) -> dict[str, Quantity] | None:
    angles = done.values.get(name)
    return None if angles is None else {parameter: quantity("urad", angle) for parameter, angle in angles.items()}


def _rows(unit: Unit, matrix: Any) -> list[Quantities] | None:
    return None if matrix is None else [quantities(unit, row) for row in np.asarray(matrix)]
