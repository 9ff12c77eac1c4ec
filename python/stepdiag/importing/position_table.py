"""Tables of positioning tests as people keep them: targets in rows, runs in columns.

    Target [mm];Run 1 + [µm];Run 1 - [µm];Run 2 + [µm];Run 2 - [µm]
    0;0,2;-1,0;0,3;-0,9

The direction may stand in a row below the numbers of the runs, as may the units.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.importing.columns import Column, SheetUnit, plain, split_head, unit_in
from stepdiag.importing.numbers import decimal_mark, is_lost, native, number
from stepdiag.importing.run import as_shown
from stepdiag.importing.sheet import LAST_HEAD, Cell, Formatted, Rows, pages_of
from stepdiag.positions.readings import PositionReadings, PositionRow, readings_of

_TARGETS: Final = ("target", "target_position", "targets", "position", "nominal", "soll", "sollposition", "ziel")
_DIRECTIONS: Final = {
    **dict.fromkeys(("+", "↑", "forward", "fwd", "up", "vorwärts", "vor", "hin"), "+"),
    **dict.fromkeys(("-", "−", "↓", "backward", "bwd", "down", "rückwärts", "rück", "zurück"), "-"),
}
_RUN: Final = re.compile(r"(?:run|cycle|series|no\.?|lauf|zyklus|messreihe|reihe|r|c)?\s*#?(\d{1,3})")
_LARGEST_DEVIATION: Final = 2.0  # mm; a larger value is a position


@dataclass(frozen=True)
class _Series:
    index: int
    head: str
    cycle: int
    direction: str
    unit: SheetUnit


def is_position_table(path: Path) -> bool:
    """Whether a file is a workbook, or a text with a head of targets and one of a run."""
    try:
        return any(_find(rows) is not None for _, rows, _ in pages_of(path))
    except InvalidArgument:
        return False


def read_position_table(path: Path) -> tuple[PositionReadings, list[str]]:
    """The readings, and what the file was taken for.

    Raises InvalidArgument naming file and place: a column without direction or unit, hidden rows and columns, or
    numbers that can be read in two ways."""
    tables = [(form, rows, at, unseen) for form, rows, unseen in pages_of(path) if (at := _find(rows)) is not None]
    if len(tables) != 1:
        ways = " and with ".join(form for form, *_ in tables) or "none"
        raise InvalidArgument(f"{path}: expected a table with targets in rows and runs in columns, got {ways}")
    form, rows, at, unseen = tables[0]
    if unseen:
        raise InvalidArgument(f"{path}: {unseen[0]}: show it or delete it, so that it is clear whether it counts")
    heads, body = _heads(rows, at)
    where = f"{path}, {rows[at][0]}"
    target, unit = next((k, found) for k, head in enumerate(heads) if (found := _target_unit(head, where)) is not None)
    series = [one for k, head in enumerate(heads) if k != target and (one := _series(k, head, where)) is not None]
    left_out = [head for k, head in enumerate(heads) if head and k not in (target, *(one.index for one in series))]
    wanted = [(target, unit, heads[target]), *((one.index, one.unit, one.head) for one in series)]
    fields = [
        (f"{path}, {place}: {head}", cell)
        for place, cells in body
        for k, _, head in wanted
        if k < len(cells) and isinstance(cell := cells[k], str) and not is_lost(cell)
    ]
    mark = decimal_mark(fields) if fields else "point"

    def value(cell: Cell, of: SheetUnit, head: str, place: str) -> float | None:
        if isinstance(cell, str) and is_lost(cell):
            return None
        exact = number(cell, mark) if isinstance(cell, str) else Decimal(repr(cell))
        if exact is not None and isinstance(cell, Formatted):
            exact = as_shown(exact, cell.code, Column(0, head, "distance", of), f"{path}, {place}")
        return None if exact is None else native(exact, of)

    read: list[PositionRow] = []
    for place, cells in body:
        cells = [*cells, *[""] * (len(heads) - len(cells))]
        at_target = value(cells[target], unit, heads[target], place)
        deviations = [value(cells[one.index], one.unit, one.head, place) for one in series]
        if at_target is None:
            if any(deviation is not None for deviation in deviations):
                raise InvalidArgument(f"{path}, {place}: {heads[target]}: expected a target, got {cells[target]!r}")
            continue
        for one, deviation in zip(series, deviations, strict=True):
            read.append((f"{path}, {place}: {one.head}", at_target, one.direction, one.cycle, deviation))
    read, are = _deviations(read, str(path))
    said = [f"{path}: {form}, decimal {mark}; {heads[target]}: target in {unit.name}"]
    said += [f"  {one.head}: {are} of cycle {one.cycle}, direction {one.direction}, {one.unit.name}" for one in series]
    return readings_of(read, "", str(path)), said + [f"  {head}: left out" for head in left_out]


def _find(rows: Rows) -> int | None:
    """Index of the row of heads: one of targets, and one or more with the number of a run."""
    for k, (_, row) in enumerate(rows[:LAST_HEAD]):
        words = [cell if isinstance(cell, str) else "" for cell in row]
        if any(split_head(word)[0] in _TARGETS for word in words) and any(map(_run_of, words)):
            return k
    return None


def _heads(rows: Rows, at: int) -> tuple[list[str], Rows]:
    """The heads with what rows of directions and units below them say, and the other rows."""
    heads = [cell if isinstance(cell, str) else f"{cell:g}" for cell in rows[at][1]]
    body = rows[at + 1 :]
    while body:
        below = [cell.strip() if isinstance(cell, str) else None for cell in body[0][1]]
        below += [""] * (len(heads) - len(below))
        filled = [cell for cell in below if cell]
        if None in below or not filled:
            break
        directions = all(plain(cell) in _DIRECTIONS for cell in filled)
        if not directions and not all(unit_in(cell.strip("[]()"), "length") for cell in filled):
            break
        run = ""
        for k, cell in enumerate(below):
            run = heads[k] or run  # the number stands above the first column of a run
            if cell:
                heads[k] = f"{run} {cell}" if directions else f"{heads[k]} [{cell.strip('[]()')}]"
        body = body[1:]
    return heads, body


def _bare(head: str) -> str:
    return re.sub(r"\s*[\[({].*[\])}]\s*$", "", plain(head)).replace("_", " ").strip()


def _target_unit(head: str, where: str) -> SheetUnit | None:
    name, word = split_head(head)
    if name not in _TARGETS:
        return None
    unit = unit_in(word or "", "length")
    if unit is None:
        raise InvalidArgument(f'{where}: "{head}": expected targets with a unit, such as Target [mm]')
    return unit


def _run_of(head: str) -> tuple[int, list[str], str] | None:
    """Number, marks of the direction and unit in the head of a run; None for another head."""
    text = _bare(head)
    bracketed = re.search(r"[\[({](.*)[\])}]\s*$", head)
    suffixed = re.fullmatch(r"(.*\S)\s+(\S+)", text)
    word = bracketed[1] if bracketed else ""
    if not word and suffixed and unit_in(suffixed[2], "length"):
        text, word = suffixed[1], suffixed[2]
    marks = [mark for mark in _DIRECTIONS if re.search(rf"(?:^|[\s\d,;/]){re.escape(mark)}(?:$|[\s\d,;/#])", text)]
    for mark in marks:
        text = text.replace(mark, " ")
    found = _RUN.fullmatch(" ".join(re.sub(r"[,;/]", " ", text).split()))
    return None if found is None else (int(found[1]), [_DIRECTIONS[mark] for mark in marks], word)


def _series(index: int, head: str, where: str) -> _Series | None:
    """None for a column that is no run."""
    found = _run_of(head)
    if found is None:
        return None
    cycle, directions, word = found
    if len(set(directions)) != 1:
        raise InvalidArgument(f'{where}: "{head}": expected the direction in the head, + or -, such as "Run 1 + [µm]"')
    unit = unit_in(word, "length")
    if unit is None:
        raise InvalidArgument(f'{where}: "{head}": expected a unit in the head or below it, such as "Run 1 + [µm]"')
    return _Series(index, head, cycle, directions[0], unit)


def _deviations(read: Sequence[PositionRow], path: str) -> tuple[list[PositionRow], str]:
    """Deviations, or positions of which the targets are subtracted. Raises InvalidArgument where that is not clear."""
    values = [(target, value) for _, target, _, _, value in read if value is not None]
    largest = max((abs(target) for target, _ in values), default=0.0)
    if all(abs(value) < _LARGEST_DEVIATION for _, value in values):
        if largest < 2.0 * _LARGEST_DEVIATION:
            raise InvalidArgument(
                f"{path}: targets within {largest:g} mm: write deviations to a file with deviation_um"
            )
        return list(read), "deviation"
    if all(abs(value - target) < _LARGEST_DEVIATION for target, value in values):
        return [(w, t, d, c, None if v is None else v - t) for w, t, d, c, v in read], "position"
    raise InvalidArgument(f"{path}: the values are neither all near 0 nor all near their targets")
