"""Numbers as spreadsheet programs write them: decimal point or comma, from all fields of a file."""

import datetime
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


def shown_by(code: str) -> tuple[Decimal, str]:
    """By what a number format of a workbook multiplies what it shows, and the text that it shows beside it.

    "0.0%" multiplies by 100, a comma behind the digits divides by 1000, text stands in quotes or behind a backslash.
    The part for numbers above 0 decides (ECMA-376-1, 18.8.31)."""
    factor, text, is_after_digit, k = Decimal(1), "", False, 0
    while k < len(code) and code[k] != ";":
        mark = code[k]
        if mark == '"' or mark == "[":
            end = code.find('"' if mark == '"' else "]", k + 1)
            end = len(code) if end < 0 else end
            text += code[k + 1 : end] if mark == '"' else ""
            k = end
        elif mark in "\\_*":  # the next one is shown, or as wide, or repeated
            text += code[k + 1 : k + 2] if mark == "\\" else ""
            k += 1
        elif mark == "%":
            factor *= 100
        elif mark == "," and is_after_digit:
            if not re.match(r",*[0#?]", code[k:]):
                factor /= 1000
        elif mark not in "0#?.,+-() Ee/":
            text += mark
        is_after_digit = mark in "0#?" or (mark == "," and is_after_digit)
        k += 1
    return factor, text.strip(" []()\u00a0")


_CLOCK: Final = re.compile(
    r"(?:(\d{4})-(\d\d)-(\d\d)[T ]|(\d{1,2})\.(\d{1,2})\.(\d{4}),? )?"
    r"(\d{1,3}):([0-5]\d)(?::([0-5]\d(?:[.,]\d{1,9})?))?",
    re.ASCII,
)


def clock(text: str) -> tuple[int | None, Decimal] | None:
    """Day (counted from the year 1) and seconds of the day of a clock time such as 10:23:45.5, 2026-11-28 10:23 or
    28.11.2026 10:23:45; without a date the day is None. None for another text."""
    found = _CLOCK.fullmatch(text.strip())
    if found is None:
        return None
    year, month, day, german_day, german_month, german_year, hours, minutes, seconds = found.groups()
    second = Decimal((seconds or "0").replace(",", "."))
    of_day = 3600 * int(hours) + 60 * int(minutes) + second
    given = (year, month, day) if year else (german_year, german_month, german_day)
    if given[0] is None:
        return None, of_day
    try:
        return datetime.date(*map(int, given)).toordinal(), of_day
    except ValueError:
        return None


def native(value: Decimal, unit: SheetUnit, sign: int = 1) -> float:
    """A value in native units, rounded once."""
    shifted = _EXACT.add(value, unit.offset)
    result = float(_EXACT.multiply(shifted, unit.factor))
    return result if sign > 0 else 0.0 - result  # not -0
