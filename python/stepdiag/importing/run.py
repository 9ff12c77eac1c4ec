"""Sheets to one measurement."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path

import numpy as np

from stepdiag._core import InvalidArgument, Measurement, Plan
from stepdiag.config.toml_text import located
from stepdiag.importing.columns import LABELS, POSITIONS, Column, Mapped, columns_of, is_signal, parse_mapping
from stepdiag.importing.numbers import decimal_mark, is_lost, native, number
from stepdiag.importing.sheet import Cell, Sheet, read_sheet


@dataclass(frozen=True)
class Imported:
    """The measurement, and what each file was taken for."""

    measurement: Measurement
    text: tuple[str, ...]


@dataclass
class _Rows:
    """Rows of all files so far; a channel that a file does not have is NaN in its rows."""

    places: list[str] = field(default_factory=list)
    line: list[str] = field(default_factory=list)
    point: list[int] = field(default_factory=list)
    run: list[int] = field(default_factory=list)
    direction: list[str] = field(default_factory=list)
    numbers: dict[str, list[float]] = field(default_factory=dict)


def import_files(
    files: Sequence[Path],
    *,
    column: Sequence[str] = (),
    separator: str | None = None,
    decimal: str | None = None,
    sheet: str | None = None,
    plan: Plan | None = None,
) -> Imported:
    """Read sheets in the forms of spreadsheet programs as one measurement.

    Args:
        files: texts with commas, semicolons or tabs, or workbooks (.xlsx, .ods).
        column: what heads mean, such as "Tilt A=-alpha [µrad]"; "HEAD=" leaves a column out.
        separator: "comma", "semicolon" or "tab"; found if None.
        decimal: "point" or "comma"; found if None.
        sheet: name of the sheet of workbooks; found if None.
        plan: gives the commanded positions of sheets that have none.

    Raises:
        InvalidArgument: a file cannot be read, or in two ways; names file, place and what decides.
    """
    mappings = [parse_mapping(text) for text in column]
    rows = _Rows()
    text: list[str] = []
    for path in files:
        text += _add(rows, read_sheet(path, mappings, separator, sheet), mappings, decimal, plan)
    _reject_repeated(rows)
    channels = {name: values for name, values in rows.numbers.items() if name not in POSITIONS and name[:2] != "u_"}
    uncertainties = {name[2:]: np.array(values) for name, values in rows.numbers.items() if name[:2] == "u_"}
    if not any(is_signal(name) for name in channels):
        raise InvalidArgument(f"{files[0]}: has no column of readings, such as distance_mm: `column` names it")
    signals = [name for name in channels if is_signal(name)]
    lost = int(np.count_nonzero(np.any([np.isnan(channels[name]) for name in signals], axis=0)))
    text.append(f"{len(rows.line)} points on {len(set(rows.line))} lines, {lost} without a complete reading")
    with located(", ".join(map(str, files))):
        measurement = Measurement(
            rows.line,
            rows.point,
            np.column_stack([rows.numbers[axis] for axis in POSITIONS]),
            {name: np.array(values) for name, values in channels.items()},
            run=rows.run,
            direction=rows.direction,
            standard_uncertainty=uncertainties,
        )
    return Imported(measurement, tuple(text))


def _add(rows: _Rows, sheet: Sheet, mappings: Sequence[Mapped], decimal: str | None, plan: Plan | None) -> list[str]:
    """Adds the rows of a sheet; returns what it was taken for."""
    path = sheet.path
    try:
        taken, left_out = columns_of(sheet.heads, mappings)
    except InvalidArgument as error:
        raise InvalidArgument(f"{path}, {sheet.head_place}: {error}") from None
    columns = {column.name: column for column in taken}
    given = [axis for axis in POSITIONS if axis in columns]
    if len(given) != 3 and (given or plan is None):
        missing = ", ".join(axis for axis in POSITIONS if axis not in columns)
        raise InvalidArgument(
            f"{path}: the commanded positions {missing} are missing: `column` names their columns, "
            "or `scenario` has the plan that gives all three"
        )
    if not sheet.rows:
        raise InvalidArgument(f"{path}: has heads but no rows")
    mark = _mark(sheet, taken, decimal)
    start = len(rows.line)
    for place, cells in sheet.rows:
        where = f"{path}, {place}"
        labels = {name: cells[columns[name].index] for name in LABELS if name in columns}
        rows.places.append(where)
        rows.line.append(str(labels["line"]).lower())
        rows.point.append(_integer(labels["point"], mark, f"{where}: point"))
        empty_run = labels.get("run", "") == ""
        rows.run.append(0 if empty_run else _integer(labels["run"], mark, f"{where}: run"))
        direction = str(labels.get("direction", "")).lower() or "forward"
        if direction not in ("forward", "backward"):
            raise InvalidArgument(f"{where}: direction: expected forward or backward, got {labels['direction']!r}")
        rows.direction.append(direction)
        _reject_line(rows, where)
    count = len(rows.line)
    values = {
        c.name: [_value(cells[c.index], c, mark, f"{path}, {place}") for place, cells in sheet.rows]
        for c in taken
        if c.unit is not None
    }
    if not given and plan is not None:
        values |= _planned(rows, start, plan)
    for name in {**rows.numbers, **values}:
        before = rows.numbers.get(name, [float("nan")] * start)
        rows.numbers[name] = before + values.get(name, [float("nan")] * (count - start))
    form = sheet.form + (f", decimal {mark}" if mark else "")
    text = [f"{path}: {form}; heads in {sheet.head_place}"]
    text += [f"  {column.head}: {column.meaning}" for column in taken]
    text += ["  x, y, z: from the plan"] if not given else []
    return text + [f"  {head}: left out" for head in left_out]


def _reject_line(rows: _Rows, where: str) -> None:
    line = rows.line[-1]
    if len(line) != 3 or set(line) - set("pn0") or line == "000":
        raise InvalidArgument(f"{where}: line: expected a name such as ppp, npp or p00, got {line!r}")
    if rows.point[-1] < 0:
        raise InvalidArgument(f"{where}: point: expected a whole number of at least 0, got {rows.point[-1]}")


def _mark(sheet: Sheet, taken: Sequence[Column], decimal: str | None) -> str:
    fields = [
        (f"{sheet.path}, {place}: {column.head}", text)
        for place, cells in sheet.rows
        for column in taken
        if column.unit is not None and isinstance(text := cells[column.index], str) and not is_lost(text)
    ]
    if not fields and decimal is None:
        return ""  # all numbers are cells of a workbook
    if decimal is None and sheet.has_commas and not any("," in text for _, text in fields):
        decimal = "point"  # a decimal comma would be in quotes
    return decimal_mark(fields, decimal)


def _value(cell: Cell, column: Column, mark: str, where: str) -> float:
    """In native units; NaN where it is lost."""
    assert column.unit is not None
    if isinstance(cell, str) and is_lost(cell):
        if column.name in POSITIONS:
            raise InvalidArgument(f"{where}: {column.head}: expected a commanded position, got {cell!r}")
        return float("nan")
    value = number(cell, mark) if isinstance(cell, str) else Decimal(repr(cell))
    if value is None or not value.is_finite():
        raise InvalidArgument(f"{where}: {column.head}: expected a number, got {cell!r}")
    result = native(value, column.unit, column.sign)
    if column.name.startswith("u_") and not 1e-12 <= result <= 1e6:
        raise InvalidArgument(f"{where}: {column.head}: expected a standard uncertainty above 0, got {cell!r}")
    return result


def _integer(cell: Cell, mark: str, where: str) -> int:
    value = number(cell, mark or "point") if isinstance(cell, str) else Decimal(repr(cell))
    if value is None or not value.is_finite() or value != int(value) or abs(value) >= 2**31:
        raise InvalidArgument(f"{where}: expected a whole number, got {cell!r}")
    return int(value)


def _planned(rows: _Rows, start: int, plan: Plan) -> dict[str, list[float]]:
    """The plan's positions of the rows from `start` on."""
    found = []
    for k in range(start, len(rows.line)):
        line, point = rows.line[k], rows.point[k]
        points = plan.points(line, rows.run[k]) if line in (*plan.lines, *plan.scale_lines) else ()
        if point >= len(points):
            where = f"{rows.places[k]}: line {line}, point {point} is not in the plan of the scenario"
            if line in plan.scale_lines and plan.scale_points == "ends" and point <= plan.steps:
                where += ', which reads this scale line at its two ends (expected scale_points = "steps")'
            raise InvalidArgument(where)
        found.append(points[point])
    return {axis: [float(position[a]) for position in found] for a, axis in enumerate(POSITIONS)}


def _reject_repeated(rows: _Rows) -> None:
    seen: dict[tuple[int, str, int], str] = {}
    keys = zip(rows.run, rows.line, rows.point, strict=True)
    for place, (run, line, point) in zip(rows.places, keys, strict=True):
        if (run, line, point) in seen:
            raise InvalidArgument(
                f"{place}: run {run}, line {line}, point {point} is already given in {seen[run, line, point]}"
            )
        seen[run, line, point] = place
