"""Numbers as spreadsheet programs write them: decimal point or comma, from all fields of a file."""

import re
from collections.abc import Sequence
from decimal import Context, Decimal
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.importing.columns import SheetUnit, plain

LOST: Final = frozenset(("", "-", "--", "---", "–", "—", "n/a", "na", "nan", "#n/a", "#nv", "lost"))
MARKS: Final = {"point": ".", "comma": ","}
# Enough that a product of a field and a unit's factor is rounded once, to a double.
_EXACT: Final = Context(prec=800)


def is_lost(field: str) -> bool:
    """Whether a field is a mark of a lost reading."""
    return plain(field) in LOST


def decimal_mark(fields: Sequence[tuple[str, str]], said: str | None = None) -> str:
    """The decimal mark of a file, "point" or "comma".

    `fields`: place and text of every number that is not lost; `said`: the mark, if the user gives it.
    Raises InvalidArgument where both marks make sense and mean different numbers, and where none does."""
    ways = {name: [number(text, name) for _, text in fields] for name in MARKS if said in (None, name)}
    sensible = [name for name, values in ways.items() if None not in values]
    if len(sensible) == 2:
        pairs = zip(fields, ways["point"], ways["comma"], strict=True)
        for (place, text), point, comma in pairs:
            if point != comma:
                raise InvalidArgument(
                    f"{place}: {text!r} is {_shown(point)} with a decimal point and {_shown(comma)} with a decimal "
                    "comma: `decimal` point or `decimal` comma decides"
                )
        return "point"
    if not sensible:
        _reject_none(fields, ways)
    mark = sensible[0]
    other = "." if MARKS[mark] == "," else ","
    grouped = [(place, text) for place, text in fields if other in text]
    proven = any(MARKS[mark] in text for _, text in grouped)
    if grouped and not proven and said is None:
        fractional = next((f"{text!r} ({place})" for place, text in fields if MARKS[mark] in text), "")
        raise InvalidArgument(
            f"{grouped[0][0]}: {grouped[0][1]!r} may be a decimal number or one with thousands, beside {fractional}: "
            "write all numbers alike, or `decimal` decides"
        )
    return mark


def _shown(value: Decimal | None) -> str:
    return "" if value is None else f"{value:f}"


def _reject_none(fields: Sequence[tuple[str, str]], ways: dict[str, list[Decimal | None]]) -> None:
    name = min(ways, key=lambda mark: ways[mark].count(None))
    first = ways[name].index(None)
    place, text = fields[first]
    other = next((mark for mark in MARKS if mark != name and number(text, mark) is not None), None)
    if other is not None and any(MARKS[name] in field for _, field in fields):
        shown = next((where, field) for where, field in fields if MARKS[name] in field)
        raise InvalidArgument(
            f"{place}: {text!r} has a decimal {other}, but {shown[1]!r} ({shown[0]}) a decimal {name}: "
            "write all numbers alike"
        )
    raise InvalidArgument(f"{place}: expected a number, or a mark of a lost reading such as - or #N/A, got {text!r}")


def number(text: str, mark: str) -> Decimal | None:
    """A number with this decimal mark, perhaps with thousands in groups; None for another text."""
    decimal, group = (r"\.", ",") if mark == "point" else (",", r"\.")
    text = text.strip().replace("\N{MINUS SIGN}", "-")
    sign, fraction, exponent = "[-+]?", rf"(?:{decimal}\d*)?", r"(?:[eE][-+]?\d{1,3})?"
    digits = rf"(?:\d+{fraction}|{decimal}\d+){exponent}"
    groups = rf"[1-9]\d{{0,2}}(?:(?:{group}\d{{3}})+|(?:['’ \u00a0\u202f]\d{{3}})+){fraction}"
    if len(text) > 100 or not re.fullmatch(rf"{sign}(?:{digits}|{groups})", text, re.ASCII):
        return None
    kept = re.sub(rf"[{group}'’\s]", "", text)
    return Decimal(kept.replace(",", "."))


def native(value: Decimal, unit: SheetUnit, sign: int = 1) -> float:
    """A value in native units, rounded once."""
    shifted = _EXACT.add(value, unit.offset)
    result = float(_EXACT.multiply(shifted, unit.factor))
    return result if sign > 0 else 0.0 - result  # not -0
