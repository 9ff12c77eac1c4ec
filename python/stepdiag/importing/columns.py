"""What the columns of a sheet are: channel, unit and sign, by their heads or as the user says.

A head is a column's name of the measurement file (docs/files.md) in any case, with a space, a hyphen or `_` between
its words, and the unit as a suffix or in brackets. What is nearly such a head is refused: a column of readings must
not be left out unnoticed.
"""

import difflib
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Context, Decimal
from typing import Final

from stepdiag._core import InvalidArgument

_PI: Final = Decimal("3.14159265358979323846264338327950288419716939937511")
_ATMOSPHERE: Final = Decimal(101325)  # Pa
_FIVE_NINTHS: Final = Context(prec=60).divide(Decimal(5), Decimal(9))


@dataclass(frozen=True)
class SheetUnit:
    """A unit: the native value is factor · (value + offset)."""

    name: str
    factor: Decimal
    offset: Decimal = Decimal(0)


def plain(text: str) -> str:
    """A text without differences of case and spelling: one µ, one space."""
    return " ".join(unicodedata.normalize("NFKC", text).casefold().split())


def _units(spellings: Mapping[str, str | Decimal]) -> dict[str, SheetUnit]:
    units = {words: SheetUnit(words.split()[0], Decimal(factor)) for words, factor in spellings.items()}
    return {plain(word): unit for words, unit in units.items() for word in words.split()}


# By what they measure. Native units: mm, rad, s, °C, Pa, 1.
UNITS: Final[Mapping[str, Mapping[str, SheetUnit]]] = {
    "length": _units(
        {"mm": "1", "µm um": "1e-3", "m": "1e3", "cm": "10", "nm": "1e-6", 'in inch inches " ″ ”': "25.4"}
    ),
    "angle": _units(
        {
            "µrad urad": "1e-6",
            "mrad": "1e-3",
            "rad": "1",
            "° deg": _PI / 180,
            "″ arcsec ” \" ''": _PI / 648000,
        }
    ),
    "time": _units({"s": "1", "ms": "1e-3", "min": "60", "h": "3600"}),
    "temperature": {
        **_units({"°C C degC": "1"}),
        "k": SheetUnit("K", Decimal(1), Decimal("-273.15")),
        **{word: SheetUnit("°F", _FIVE_NINTHS, Decimal(-32)) for word in ("°f", "f", "degf")},
    },
    # Columns of mercury at 0 °C and standard gravity, as NIST SP 811 converts them.
    "pressure": _units(
        {
            "hPa mbar": "100",
            "Pa": "1",
            "kPa": "1000",
            "mmHg": "133.322387415",
            "Torr": _ATMOSPHERE / 760,
            "inHg": "3386.388640341",
        }
    ),
    "humidity": _units({"% percent": "0.01"}),
}
_EVERY_UNIT: Final = {word for units in UNITS.values() for word in units}
LABELS: Final = ("line", "point", "run", "direction")  # without a unit
POSITIONS: Final = ("x", "y", "z")
_SIGNALS: Final = {"distance": "length", "alpha": "angle", "beta": "angle", "spot_x": "length", "spot_y": "length"}
_RECORDS: Final = {
    "time": "time",
    "temperature": "temperature",
    "temperature_x": "temperature",
    "temperature_y": "temperature",
    "temperature_z": "temperature",
    "air_temperature": "temperature",
    "air_pressure": "pressure",
    "air_humidity": "humidity",
}
# Standard uncertainties have one unit in files; a head with another one is a slip as a rule.
_UNIT_OF_UNCERTAINTY: Final = {"length": "µm", "angle": "µrad"}


CLOCK: Final = SheetUnit("clock time", Decimal(1))  # of a column of times whose head has no unit


@dataclass(frozen=True)
class Column:
    """A column of a sheet: where it is, its head, the channel it holds (distance, u_distance, x, line …)."""

    index: int
    head: str
    name: str
    unit: SheetUnit | None = None
    sign: int = 1

    @property
    def meaning(self) -> str:
        unit = "" if self.unit is None else f" in {self.unit.name}"
        if self.unit == CLOCK:
            unit = " by the clock, counted from the first one"
        return f"{'minus ' if self.sign < 0 else ''}{self.name}{unit}"


@dataclass(frozen=True)
class Mapped:
    """What the user says of a head: "HEAD=[-]NAME [UNIT]"; an empty name leaves the column out."""

    head: str
    name: str
    unit: str | None
    sign: int


def parse_mapping(text: str) -> Mapped:
    """What `column` says. Raises InvalidArgument."""
    head, equals, meaning = text.rpartition("=")
    match = re.fullmatch(r"\s*(-?)\s*(\w*)\s*(?:\[(.*)\])?\s*", meaning)
    name = _words(match[2]) if match else ""
    if not equals or not head.strip() or match is None or (name and name not in LABELS and quantity_of(name) is None):
        raise InvalidArgument(
            f'`column`: expected HEAD=NAME, such as "Tilt A=-alpha [µrad]" (HEAD= leaves the column out), got {text!r}'
        )
    if match[1] and not _has_sign(name):
        raise InvalidArgument(f"`column`: {text!r}: only readings and positions have a sign")
    return Mapped(head.strip(), name, match[3], -1 if match[1] else 1)


def quantity_of(name: str) -> str | None:
    """What a channel, its uncertainty (u_distance) or a coordinate measures: a key of UNITS."""
    if name in POSITIONS or re.fullmatch(r"d[1-9]\d*", name):
        return "length"
    if name.startswith("u_"):
        return quantity_of(name[2:]) if is_signal(name[2:]) else None
    return _SIGNALS.get(name) or _RECORDS.get(name)


def is_signal(name: str) -> bool:
    """Whether a channel is a reading of the head."""
    return name in _SIGNALS or re.fullmatch(r"d[1-9]\d*", name) is not None


def _has_sign(name: str) -> bool:
    return name in POSITIONS or is_signal(name)


def _words(text: str) -> str:
    return re.sub(r"[\s_\-./]+", "_", plain(text)).strip("_")


def split_head(head: str) -> tuple[str, str | None]:
    """The name in a head and its unit, if it has one: "Spot X [MM]" is spot_x and mm."""
    text = plain(head)
    bracketed = re.fullmatch(r"(.+?)\s*[\[({](.*)[\])}]", text)
    if bracketed:
        return _words(bracketed[1]), bracketed[2].strip()
    name = _words(text)
    if name in LABELS or quantity_of(name):
        return name, None
    suffixed = re.fullmatch(r"(.+?)(?:\s+in\s+|[\s_\-./]+)([^\s_\-./]+)", text)
    return (_words(suffixed[1]), suffixed[2]) if suffixed else (name, None)


def same_unit(head: str, own: str, word: str) -> bool:
    """Whether two words are the same unit of what a head measures; of an unknown column whether they are alike."""
    units = UNITS.get(quantity_of(split_head(head)[0]) or "", {})
    one, other = units.get(plain(own)), units.get(plain(word))
    return one == other if one and other else plain(own) == plain(word)


def unit_in(word: str, quantity: str) -> SheetUnit | None:
    """The unit that a word names among those of a quantity."""
    return UNITS[quantity].get(plain(word))


def is_unit(word: str) -> bool:
    """Whether a word is a unit of anything."""
    return plain(word) in _EVERY_UNIT


def find_heads(heads: Sequence[str], mappings: Sequence[Mapped]) -> bool:
    """Whether a row is that of the heads: it names line and point."""
    said = {plain(mapped.head): mapped.name for mapped in mappings}
    names = {said.get(plain(head), split_head(head)[0]) for head in heads}
    return {"line", "point"} <= names


def columns_of(heads: Sequence[str], mappings: Sequence[Mapped]) -> tuple[list[Column], list[str]]:
    """The columns that are taken, and the heads of those that are left out.

    Raises InvalidArgument for a head that is nearly a known one, a unit that is missing or wrong, two columns of
    one meaning, and a mapping of a head that the sheet does not have."""
    said: dict[int, Mapped] = {}
    for mapped in mappings:
        found = [index for index, head in enumerate(heads) if plain(head) == plain(mapped.head)]
        if len(found) != 1:
            known = ", ".join(f'"{head}"' for head in heads if head)
            raise InvalidArgument(f'`column`: expected one head "{mapped.head}", got {len(found)}; heads: {known}')
        if found[0] in said:
            raise InvalidArgument(f'`column`: the head "{mapped.head}" is given twice')
        said[found[0]] = mapped
    taken: list[Column] = []
    left_out: list[str] = []
    for index, head in enumerate(heads):
        column = _mapped(index, head, said[index]) if index in said else _recognised(index, head)
        if column is None:
            left_out += [head] if head else []
            continue
        for other in taken:
            if other.name == column.name:
                raise InvalidArgument(
                    f'both "{other.head}" and "{head}" are {column.name}: '
                    f'leave one out with `column` "{head}=" or `column` "{other.head}="'
                )
        taken.append(column)
    for column in taken:
        if column.name.startswith("u_") and not any(other.name == column.name[2:] for other in taken):
            raise InvalidArgument(f'"{column.head}": there are no readings of {column.name[2:]} that it belongs to')
    return taken, left_out


def _mapped(index: int, head: str, said: Mapped) -> Column | None:
    if not said.name:
        return None
    if said.name in LABELS:
        return Column(index, head, said.name)
    word = said.unit
    if word is None:
        own = split_head(head)[1]
        word = own if own is not None and own in _EVERY_UNIT else None
    return Column(index, head, said.name, _unit_of(head, said.name, word), said.sign)


def _recognised(index: int, head: str) -> Column | None:
    name, word = split_head(head)
    if name in LABELS and word in (None, "", "-", "1"):
        return Column(index, head, name)
    quantity = quantity_of(name)
    if quantity is None or name in LABELS:
        _reject_near_miss(head, name, word)
        return None
    unit = _unit_of(head, name, word)
    if name.startswith("u_") and unit.name != _UNIT_OF_UNCERTAINTY[quantity]:
        right = _UNIT_OF_UNCERTAINTY[quantity]
        raise InvalidArgument(
            f'"{head}": expected a standard uncertainty in {right}, got {unit.name}: '
            f'if that is meant, `column` "{head}={name} [{unit.name}]" takes it'
        )
    return Column(index, head, name, unit)


def _unit_of(head: str, name: str, word: str | None) -> SheetUnit:
    if name == "time" and (word is None or plain(word) in ("hh:mm", "hh:mm:ss", "h:m:s", "clock")):
        return CLOCK
    units = UNITS[str(quantity_of(name))]
    names = list(dict.fromkeys(unit.name for unit in units.values()))
    if word is None:
        raise InvalidArgument(
            f'"{head}": {name} has no unit: say which ({", ".join(names)}) with `column` "{head}={name} [{names[0]}]"'
        )
    unit = units.get(plain(word))
    if unit is None:
        raise InvalidArgument(f'"{head}": expected {name} in {", ".join(names)}, got {word or "no unit"}')
    return unit


def _reject_near_miss(head: str, name: str, word: str | None) -> None:
    """A column that is left out must not be one of readings."""
    known = [*LABELS, *_SIGNALS, *_RECORDS]
    whole = _words(head)
    near = next((k for k in (*known, *POSITIONS) if name == k or whole.startswith(f"{k}_")), None)
    near = near or next(iter(difflib.get_close_matches(name, known, n=1, cutoff=0.8)), None)
    leave = f'`column` "{head}=" leaves it out'
    if near or name.startswith("u_") or re.match(r"d\d+(_|$)", whole):
        like = f"looks like {near}" if near else "looks like a column of ours"
        raise InvalidArgument(f'"{head}": {like}, but is none: `column` "{head}={near or "NAME"}" takes it, {leave}')
    if word is not None and plain(word) in _EVERY_UNIT:
        raise InvalidArgument(
            f'"{head}": has a unit, but is no column that is known: `column` "{head}=NAME" takes it, {leave}'
        )
