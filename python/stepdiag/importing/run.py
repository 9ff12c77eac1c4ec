"""Sheets to one measurement."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import InvalidArgument, Measurement, Plan
from stepdiag.config.toml_text import located
from stepdiag.importing.columns import (
    CLOCK,
    LABELS,
    POSITIONS,
    Column,
    Mapped,
    columns_of,
    is_signal,
    is_unit,
    parse_mapping,
    quantity_of,
    unit_in,
)
from stepdiag.importing.numbers import clock, decimal_mark, is_lost, native, number, shown_by
from stepdiag.importing.sheet import Cell, Formatted, Hidden, Sheet, read_sheet

_SIGNS: Final = str.maketrans("+-\N{MINUS SIGN}", "pnn")
_DAY: Final = 86_400  # s


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
    first_time: tuple[int | None, Decimal] | None = None  # day and second of the first clock time


@dataclass(frozen=True)
class _Said:
    """What the user says of all files."""

    mappings: Sequence[Mapped]
    decimal: str | None
    plan: Plan | None
    hidden: Hidden | None
    first_point: int | None
    origin: tuple[float, float, float]


def import_files(
    files: Sequence[Path],
    *,
    column: Sequence[str] = (),
    separator: str | None = None,
    decimal: str | None = None,
    sheet: str | None = None,
    plan: Plan | None = None,
    hidden: Hidden | None = None,
    first_point: int | None = None,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Imported:
    """Read sheets in the forms of spreadsheet programs as one measurement.

    Args:
        files: texts with commas, semicolons or tabs, or workbooks (.xlsx, .ods).
        column: what heads mean, such as "Tilt A=-alpha [µrad]"; "HEAD=" leaves a column out.
        separator: "comma", "semicolon" or "tab"; found if None.
        decimal: "point" or "comma"; found if None.
        sheet: name of the sheet of workbooks; found if None.
        plan: gives the commanded positions of sheets that have none.
        hidden: "take" or "leave" hidden rows and columns; a sheet that has any is refused if None.
        first_point: number that the sheets give to the first point of a line, 0 or 1; found if None.
        origin: the sheets' coordinates of home, mm.

    Raises:
        InvalidArgument: a file cannot be read, or in two ways; names file, place and what decides.
    """
    mappings = [parse_mapping(text) for text in column]
    said = _Said(mappings, decimal, plan, hidden, first_point, origin)
    rows = _Rows()
    text: list[str] = []
    for path in files:
        text += _add(rows, read_sheet(path, mappings, separator, sheet, hidden), said)
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


def _add(rows: _Rows, sheet: Sheet, said: _Said) -> list[str]:
    """Adds the rows of a sheet; returns what it was taken for."""
    path, plan = sheet.path, said.plan
    try:
        taken, left_out = columns_of(sheet.heads, said.mappings)
        taken, unseen = _not_hidden(taken, sheet, said.hidden)
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
    if not given and any(said.origin):
        raise InvalidArgument(f"{path}: has no positions, which come from the plan: `origin` goes with a sheet's own")
    if not sheet.rows:
        raise InvalidArgument(f"{path}: has heads but no rows")
    mark = _mark(sheet, taken, said.decimal)
    start = len(rows.line)
    above: dict[str, Cell] = {}
    is_filled = False
    for place, cells in sheet.rows:
        where = f"{path}, {place}"
        labels: dict[str, Cell] = {name: cells[columns[name].index] for name in LABELS if name in columns}
        if labels["line"] == "" and above:  # written once for all rows of a line
            is_filled = True
            labels |= {name: above[name] for name in labels if name != "point" and labels[name] == ""}
        above = labels
        rows.places.append(where)
        line = str(labels["line"]).lower()
        rows.line.append(line if set(line) & set("pn") else line.translate(_SIGNS))
        rows.point.append(_integer(labels["point"], mark, f"{where}: point"))
        empty_run = labels.get("run", "") == ""
        rows.run.append(0 if empty_run else _integer(labels["run"], mark, f"{where}: run"))
        direction = str(labels.get("direction", "")).lower() or "forward"
        if direction not in ("forward", "backward"):
            raise InvalidArgument(f"{where}: direction: expected forward or backward, got {labels['direction']!r}")
        rows.direction.append(direction)
        _reject_line(rows, where)
    count = len(rows.line)
    numbered = _count_from_0(rows, start, said)
    for place, index in sheet.repeated:
        column = next((one for one in taken if one.index == index), None)
        if column is not None and (is_signal(column.name) or column.name.startswith("u_")):
            raise InvalidArgument(f"{path}, {place}: {column.head}: cells of readings are merged: split them")
    values = {
        c.name: (
            _clock_times(rows, sheet, c)
            if c.unit == CLOCK
            else [_value(cells[c.index], c, mark, f"{path}, {place}") for place, cells in sheet.rows]
        )
        for c in taken
        if c.unit is not None
    }
    for axis, home in zip(given, said.origin, strict=False):
        values[axis] = [position - home for position in values[axis]]
    if not given and plan is not None:
        values |= _planned(rows, start, plan)
    for name in {**rows.numbers, **values}:
        before = rows.numbers.get(name, [float("nan")] * start)
        rows.numbers[name] = before + values.get(name, [float("nan")] * (count - start))
    form = sheet.form + (f", decimal {mark}" if mark else "")
    text = [f"{path}: {form}; heads in {sheet.head_place}"]
    text += [f"  {column.head}: {column.meaning}" for column in taken]
    text += ["  x, y, z: from the plan"] if not given else []
    text += ["  empty cells of the line: as above"] if is_filled else []
    text += ["  points are counted from 1 in the file"] if numbered else []
    return [*text, *(f"  {head}: left out" for head in left_out), *unseen, *sheet.said]


def _not_hidden(taken: Sequence[Column], sheet: Sheet, hidden: Hidden | None) -> tuple[list[Column], list[str]]:
    """The columns without hidden ones, where these are left, and what is said of them."""
    unseen = [column for column in taken if column.index in sheet.hidden_columns]
    if unseen and hidden is None:
        raise InvalidArgument(
            f'the column "{unseen[0].head}" is hidden: `hidden` take or `hidden` leave says what becomes of it'
        )
    said = [f"  {column.head}: hidden, {'taken' if hidden == 'take' else 'left out'}" for column in unseen]
    if hidden != "leave":
        return list(taken), said
    for column in unseen:
        if column.name in ("line", "point"):
            raise InvalidArgument(f'the column "{column.head}" is hidden, and cannot be left out')
    return [column for column in taken if column not in unseen], said


def _count_from_0(rows: _Rows, start: int, said: _Said) -> bool:
    """Numbers points from 0, where a file counts from 1. Returns whether it does.

    Raises InvalidArgument where nothing tells a file that counts from 1 from one whose first points are missing."""
    last: dict[tuple[str, int], int] = {}
    first: dict[tuple[str, int], int] = {}
    for k in range(start, len(rows.line)):
        key, point = (rows.line[k], rows.run[k]), rows.point[k]
        first[key], last[key] = min(first.get(key, point), point), max(last.get(key, point), point)
    counts_from = said.first_point
    if counts_from is None:
        if set(first.values()) != {1}:
            return False
        plan = said.plan
        known = (
            {}
            if plan is None
            else {key: plan.points(*key) for key in first if key[0] in (*plan.lines, *plan.scale_lines)}
        )
        if not any(last[key] == len(points) for key, points in known.items()):
            raise InvalidArgument(
                f"{rows.places[start]}: all lines begin with point 1: `first_point` 1 if the file counts from 1, "
                "`first_point` 0 if the first point of each line is missing"
            )
        counts_from = 1
    if counts_from == 0:
        return False
    for k in range(start, len(rows.line)):
        rows.point[k] -= counts_from
        if rows.point[k] < 0:
            raise InvalidArgument(f"{rows.places[k]}: point: expected a number of at least {counts_from}")
    return True


def _clock_times(rows: _Rows, sheet: Sheet, column: Column) -> list[float]:
    """Seconds since the first clock time of all files; one that goes back by more than half a day is of the next."""
    found: list[float] = []
    before, days = Decimal(0), 0
    for place, cells in sheet.rows:
        where, cell = f"{sheet.path}, {place}: {column.head}", cells[column.index]
        if isinstance(cell, str) and is_lost(cell):
            found.append(float("nan"))
            continue
        time = clock(cell) if isinstance(cell, str) else None
        if time is None:
            raise InvalidArgument(
                f"{where}: expected a clock time such as 10:23:45, got {cell!r}; a number needs a unit: "
                f'`column` "{column.head}=time [s]"'
            )
        rows.first_time = rows.first_time or time
        day, second = time
        if (day is None) != (rows.first_time[0] is None):
            raise InvalidArgument(f"{where}: expected times that all have a date, or none, got {cell!r}")
        if day is None:
            days += second < before - _DAY // 2
            before = second
        else:
            days = day - (rows.first_time[0] or 0)
        found.append(float(_DAY * days + second - rows.first_time[1]))
    return found


def _reject_line(rows: _Rows, where: str) -> None:
    line = rows.line[-1]
    if len(line) != 3 or set(line) - set("pn0") or line == "000":
        raise InvalidArgument(f"{where}: line: expected a name such as ppp, npp or p00, got {line!r}")
    if rows.point[-1] < 0:
        raise InvalidArgument(f"{where}: point: expected a whole number of at least 0, got {rows.point[-1]}")


def _mark(sheet: Sheet, taken: Sequence[Column], decimal: str | None) -> str:
    fields = [
        (where := f"{sheet.path}, {place}: {column.head}", _without_unit(text, column, where))
        for place, cells in sheet.rows
        for column in taken
        if column.unit not in (None, CLOCK) and isinstance(text := cells[column.index], str) and not is_lost(text)
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
    value = number(_without_unit(cell, column, where), mark) if isinstance(cell, str) else Decimal(repr(cell))
    if value is None or not value.is_finite():
        raise InvalidArgument(f"{where}: {column.head}: expected a number, got {cell!r}")
    if isinstance(cell, Formatted):
        value = as_shown(value, cell.code, column, where)
    result = native(value, column.unit, column.sign)
    if column.name.startswith("u_") and not 1e-12 <= result <= 1e6:
        raise InvalidArgument(f"{where}: {column.head}: expected a standard uncertainty above 0, got {cell!r}")
    return result


def _without_unit(text: str, column: Column, where: str) -> str:
    """The number in "62 %", in a column of %. Raises InvalidArgument for another unit."""
    found = re.fullmatch(r"(.*\d[.,]?)\s*(\D+)", text.strip())
    if found is None or not is_unit(found[2]):
        return text
    if column.unit is None or unit_in(found[2], str(quantity_of(column.name))) != column.unit:
        unit = "" if column.unit is None else column.unit.name
        raise InvalidArgument(f"{where}: {text!r} is not in {unit}, as the head says: make them alike")
    return found[1]


def as_shown(value: Decimal, code: str, column: Column, where: str) -> Decimal:
    """The value as people see it in the workbook, in the column's unit. Raises InvalidArgument where that is something
    else than the head says."""
    assert column.unit is not None
    factor, words = shown_by(code)
    shown = value * factor
    unit = unit_in(words, str(quantity_of(column.name)))
    if factor == 100 and unit is None and column.unit.name == "%":
        return shown  # 62 % is the number 0.62
    if unit is None and factor == 1 and not is_unit(words):
        return value
    seen, meant = native(shown, unit or column.unit), native(value, column.unit)
    if (unit is not None or not words) and math.isclose(seen, meant, rel_tol=1e-9, abs_tol=1e-15):
        return value
    percent = " %" if factor == 100 and not words else ""
    raise InvalidArgument(
        f"{where}: {column.head}: the cell shows {shown.normalize():f}{percent}{' ' if words else ''}{words}, "
        f"but is {value.normalize():f} {column.unit.name} by its head: make them alike"
    )


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
