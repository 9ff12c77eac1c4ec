"""Measurements and calibrations from netCDF files, bit by bit as they were written.

This module checks units, dimensions and labels; the core checks the values.
"""

import re
from pathlib import Path
from typing import Any, Final

import numpy as np

from stepdiag._core import Calibration, InvalidArgument, Measurement, without_lost_marks
from stepdiag.config.toml_text import located
from stepdiag.io.labelled_tables import channel_units
from stepdiag.io.netcdf import NetcdfFile, read_netcdf
from stepdiag.memory import check_memory, for_covariance_file
from stepdiag.parameters import units_of

MEASUREMENT_FORMAT: Final = "stepdiag measurement 1"
CALIBRATION_FORMAT: Final = "stepdiag calibration 1"

_STATION: Final = frozenset(("line", "point", "run", "direction", "x", "y", "z"))
_FUNCTION = re.compile(r"E[XYZABC][XYZ]")
_REVERSAL = re.compile(r"E[XYZABC][XYZ]_reversal")
_SQUARENESS = re.compile(r"C0Y|B0Z|A0Z")


def kind_of_netcdf(path: Path) -> str:
    """ "measurement", "calibration", "uncertainty", ... according to the attribute `format`.

    Without that attribute the variables decide between the first two. Raises InvalidArgument for
    other files."""
    file = read_netcdf(path)
    ours = re.fullmatch(r"stepdiag (.+) \d+", file.text("format", ""))
    if ours is not None:
        return ours[1]
    if {"line", "point"} & set(file.names):
        return "measurement"
    if any(_FUNCTION.fullmatch(name) or _SQUARENESS.fullmatch(name) for name in file.names):
        return "calibration"
    raise InvalidArgument(f"{path}: expected a measurement (variables line, point, ...) or a calibration (EXX, ...)")


def read_measurement_netcdf(path: Path) -> Measurement:
    """Read a measurement. Raises InvalidArgument naming file and variable."""
    file = read_netcdf(path)
    file.check_format(MEASUREMENT_FORMAT)
    rows = file.dimensions("line")
    if len(rows) != 1:
        raise file.fail("line", f"expected one dimension, got {len(rows)}")
    channels, uncertainties = _channels(file, rows)
    line, point = file.texts("line", rows), file.integers("point", rows)
    position = np.column_stack([file.numbers(axis, rows, "mm") for axis in "xyz"])
    run = file.integers("run", rows) if "run" in file else None
    direction = file.texts("direction", rows) if "direction" in file else None
    with located(str(path)):
        return without_lost_marks(
            Measurement(
                line, point, position, channels, run=run, direction=direction, standard_uncertainty=uncertainties
            )
        )


def read_calibration_netcdf(path: Path) -> Calibration:
    """Read a calibration. Raises InvalidArgument naming file and variable."""
    file = read_netcdf(path)
    file.check_format(CALIBRATION_FORMAT)
    functions = {name: _function(file, name) for name in file.names if _FUNCTION.fullmatch(name)}
    reversals = {name[:3]: name for name in file.names if _REVERSAL.fullmatch(name)}
    parts: dict[str, Any] = {
        "method": file.text("method", ""),
        "chain": file.text("chain"),
        "volume": file.lengths("volume_mm"),
        "tool": file.lengths("tool_mm"),
        "functions": functions,
        "squareness": {name: _squareness(file, name) for name in file.names if _SQUARENESS.fullmatch(name)},
        "undetermined_slopes": [name for name in functions if not _flag(file, name, "slope_determined")],
        "undetermined": list(filter(None, file.text("undetermined", "").split("\n"))),
        "reversal": {name: _function(file, variable) for name, variable in reversals.items()},
        "reversal_negative_uncertainty": {
            name: file.numbers(f"{name}_negative_u", file.dimensions(variable), units_of(name), missing=True)
            for name, variable in reversals.items()
            if f"{name}_negative_u" in file
        },
        "undetermined_reversal_constants": [
            name for name, variable in reversals.items() if not _flag(file, variable, "constant_determined")
        ],
        "date": file.text("date", ""),
        "provenance": {key: text for key in Calibration.provenance_keys() if (text := file.text(key, ""))},
        "unverified": not file.has_checksum or bool(file.text("unverified", "")),
        "fit": file.text("fit", "") or None,
        "variance_factor": file.number("variance_factor"),
        "fit_codes": file.text("fit_codes", "").split(),
        "fit_reasons": list(filter(None, file.text("fit_reasons", "").split("\n"))),
        "unseen_faults": list(filter(None, file.text("unseen_faults", "").split("\n"))),
        "conditions": list(filter(None, file.text("conditions", "").split("\n"))),
        "budget": file.text("budget", ""),
        "uncertainty_scaled": file.number("uncertainty_scaled"),
        "between_nodes": file.number("between_nodes_mm"),
        "temperature_reference": file.number("temperature_reference_c"),
        "temperature_as_found": file.lengths_if_there("temperature_as_found_c"),
        "expansion": file.lengths_if_there("expansion_per_k"),
        "fixed_point": file.lengths_if_there("fixed_point_mm"),
    }
    with located(str(path)):
        calibration = Calibration(**parts)
    if "covariance" in file:
        check_memory(
            for_covariance_file(path.stat().st_size),
            f"{path}: its covariance",
            "evaluate the run with --no-covariance, or use a computer with more",
        )
    covariance = _covariance(file, calibration) if "covariance" in file else None
    if covariance is None:
        return calibration
    with located(str(path)):
        return Calibration(**parts, covariance=covariance)


def _channels(file: NetcdfFile, rows: tuple[str, ...]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The channels, and their standard uncertainties."""
    channels: dict[str, Any] = {}
    uncertainties: dict[str, Any] = {}
    for name in file.names:
        channel = name.removesuffix("_u")
        units = channel_units(channel)
        if units is not None:
            (channels if name == channel else uncertainties)[channel] = file.numbers(name, rows, units, missing=True)
        elif file.dimensions(name) == rows and name not in _STATION:
            raise file.fail(name, "expected a channel: distance, alpha, beta, spot_x, spot_y, d1 ..., or its NAME_u")
    return channels, uncertainties


def _function(file: NetcdfFile, name: str) -> tuple[Any, Any, Any]:
    """Position, value and standard uncertainty (NaN if unknown)."""
    dimensions = file.dimensions(name)
    if len(dimensions) != 1:
        raise file.fail(name, f"expected one dimension, that of its positions, got {len(dimensions)}")
    value = file.numbers(name, dimensions, units_of(name))
    position = file.numbers(dimensions[0], dimensions, "mm")
    if f"{name}_u" not in file:
        return position, value, np.full_like(value, np.nan)
    return position, value, file.numbers(f"{name}_u", dimensions, units_of(name), missing=True)


def _squareness(file: NetcdfFile, name: str) -> tuple[float, float]:
    value = float(file.numbers(name, (), "rad"))
    return value, float(file.numbers(f"{name}_u", (), "rad", missing=True)) if f"{name}_u" in file else float("nan")


def _flag(file: NetcdfFile, name: str, attribute: str) -> bool:
    """The flag in an attribute; True if it is missing."""
    given = file.text(attribute, "true", of=name)
    if given not in ("true", "false"):
        raise file.fail(f"{name}: attribute {attribute}", f'expected "true" or "false", got "{given}"')
    return given == "true"


def _covariance(file: NetcdfFile, calibration: Calibration) -> Any:
    dimensions = file.dimensions("covariance")
    if len(dimensions) != 2:
        raise file.fail("covariance", f"expected two dimensions, got {len(dimensions)}")
    names = file.texts("covariance_parameter", dimensions[:1])
    positions = file.numbers("covariance_position", dimensions[:1], "mm", missing=True)
    expected = calibration.covariance_labels
    if names != [name for name, _ in expected]:
        raise file.fail("covariance_parameter", "expected the parameters of this file, functions before squarenesses")
    wanted = np.array([np.nan if position is None else position for _, position in expected])
    if not np.array_equal(positions, wanted, equal_nan=True):
        raise file.fail("covariance_position", "expected the positions of the parameters, none for a squareness")
    return file.numbers("covariance", dimensions, None)
