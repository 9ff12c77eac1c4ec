"""Comparisons from their files, CSV or netCDF."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from stepdiag._core import InvalidArgument
from stepdiag.calibration.comparison import Difference, significance_threshold
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.io.csv_text import finite_number, read_csv
from stepdiag.io.data_files import is_netcdf
from stepdiag.parameters import units_of
from stepdiag.units import native

if TYPE_CHECKING:
    from stepdiag.io.netcdf import NetcdfFile

COMPARISON_FORMAT: Final = "stepdiag comparison 1"
_PARAMETER: Final = re.compile(r"(E[XYZABC][XYZ](_reversal)?)|C0Y|B0Z|A0Z")
_COLUMNS: Final = ("parameter", "position_mm", "difference", "unit", "standard_uncertainty", "shape_only")


@dataclass(frozen=True, eq=False)
class StoredComparison:
    """What the file of a comparison holds: differences B - A, native units (mm, rad)."""

    differences: tuple[Difference, ...]
    volume: FloatArray  # mm
    limit: float
    count: int  # how many values were tested
    made: dict[str, str]  # method_a, date_a, temperature_a and the same of b; empty: not known

    @property
    def threshold(self) -> float:
        """The normalised difference beyond which one of all values is significant."""
        return significance_threshold(self.limit, self.count)


def read_comparison(path: Path) -> StoredComparison:
    """Read a comparison. Raises InvalidArgument naming the file, and the line or variable."""
    return _read_netcdf(path) if is_netcdf(path) else _read_csv(path)


def _read_netcdf(path: Path) -> StoredComparison:
    from stepdiag.io.netcdf import read_netcdf

    file = read_netcdf(path)
    file.check_format(COMPARISON_FORMAT)
    names = [name.removesuffix("_difference") for name in file.names if name.endswith("_difference")]
    differences = tuple(_difference(file, name) for name in names if _PARAMETER.fullmatch(name))
    numbers = {key: file.number(key) for key in ("limit", "values")}
    made = {key: file.text(key, "") for key in _MADE}
    leading = {key: f"{number!r}" for key, number in numbers.items() if number is not None}
    return _checked(path, differences, file.lengths("volume_mm"), leading, made)


def _difference(file: "NetcdfFile", name: str) -> Difference:
    whole = f"{name}_difference"
    dimensions, units = file.dimensions(whole), units_of(name[:3])
    if len(dimensions) > 1:
        raise file.fail(whole, f"expected one dimension, that of its positions, got {len(dimensions)}")
    value = np.atleast_1d(file.numbers(whole, dimensions, units))
    position = file.numbers(dimensions[0], dimensions, "mm") if dimensions else np.array([np.nan])
    u = np.atleast_1d(file.numbers(f"{whole}_u", dimensions, units, missing=True))
    return Difference(name, position, value, u, file.text("shape_only", "false", of=whole) == "true")


_MADE: Final = tuple(f"{key}_{which}" for which in "ab" for key in ("method", "date", "temperature"))


def _read_csv(path: Path) -> StoredComparison:
    table = read_csv(path, _COLUMNS, COMPARISON_FORMAT)
    rows: dict[str, list[tuple[float, float, float, bool]]] = {}
    for where, row in table.rows:
        name, unit = row["parameter"], row["unit"]
        if not _PARAMETER.fullmatch(name):
            raise InvalidArgument(f"{where}: parameter: expected EXX ... ECZ, C0Y, B0Z or A0Z, got {name!r}")
        expected = "um" if units_of(name[:3]) == "mm" else "urad"
        if unit != expected:
            raise InvalidArgument(f"{where}: unit: expected {expected} for {name}, got {unit!r}")
        position, value, u = (
            finite_number(row[key], f"{where}: {key}") if row[key] else np.nan
            for key in ("position_mm", "difference", "standard_uncertainty")
        )
        if np.isnan(value):
            raise InvalidArgument(f"{where}: difference: expected a number, got an empty field")
        shape_only = row["shape_only"] == "true"
        rows.setdefault(name, []).append((position, native(f"_{unit}", value), native(f"_{unit}", u), shape_only))
    differences = tuple(_of_rows(name, own) for name, own in rows.items())
    made = {key: table.leading.get(key, "") for key in _MADE}
    return _checked(path, differences, table.lengths("volume_mm"), table.leading, made)


def _of_rows(name: str, rows: Sequence[tuple[float, float, float, bool]]) -> Difference:
    position, value, u, shape_only = (np.array(column) for column in zip(*rows, strict=True))
    return Difference(name, position, value, u, bool(shape_only[0]))


def _checked(
    path: Path,
    differences: tuple[Difference, ...],
    volume: FloatArray,
    leading: Mapping[str, str],
    made: dict[str, str],
) -> StoredComparison:
    if not differences:
        raise InvalidArgument(f"{path}: expected differences of the parameters EXX ... A0Z, got none")
    for problem in _problems(differences):
        raise InvalidArgument(f"{path}: {problem}")
    try:
        limit, count = float(leading.get("limit", "")), int(float(leading.get("values", "")))
    except ValueError:
        raise InvalidArgument(f"{path}: limit and values: expected two numbers") from None
    if not 0.0 < limit < 1.0 or count < 0:
        raise InvalidArgument(f"{path}: limit: expected a probability between 0 and 1, got {limit:g}")
    return StoredComparison(differences, volume, limit, count, made)


def _problems(differences: Sequence[Difference]) -> Iterator[str]:
    for difference in differences:
        has_position = np.isfinite(difference.position)
        if difference.parameter[0] == "E" and not has_position.all():
            yield f"{difference.parameter}: expected a position of every value"
        if difference.parameter[0] != "E" and (has_position.any() or len(has_position) != 1):
            yield f"{difference.parameter}: expected one value without a position"
        if difference.parameter[0] == "E" and not (np.diff(difference.position) > 0.0).all():
            yield f"{difference.parameter}: expected positions that ascend"
