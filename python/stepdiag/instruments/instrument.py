"""What an acquisition reads: the interface of an instrument, its columns, and its samples.

Instruments: ids3010_instrument.py (attocube IDS3010), line_instrument.py (anything that sends lines).
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from decimal import Decimal
from fractions import Fraction
from types import TracebackType
from typing import Final, Literal, Protocol, Self, cast, get_args

PICOMETRES: Final = 10**9  # per mm

Number = int | float
Unit = Literal["pm", "mm", "urad"]
Row = tuple[Number | None, ...]  # a value of every column; None: lost
# The power of ten that leads to mm or rad.
EXPONENTS: Final[dict[str, int]] = {"pm": -9, "mm": 0, "urad": -6}


class InstrumentError(OSError):
    """The instrument cannot be reached, gives no valid answer, or reports an error."""


@dataclass(frozen=True)
class ReadColumn:
    """A channel of the head, and the unit in which an instrument gives its values."""

    channel: str  # distance, alpha, spot_x, d1, ...
    unit: Unit

    @classmethod
    def of(cls, name: str) -> Self:
        """The column of a name such as "d1_pm" or "spot_x_mm". Raises ValueError."""
        channel, _, unit = name.rpartition("_")
        if not channel or unit not in get_args(Unit):
            raise ValueError(f"expected a channel and its unit, such as d1_pm or spot_x_mm, got {name[:40]!a}")
        return cls(channel, cast(Unit, unit))

    @property
    def name(self) -> str:
        return f"{self.channel}_{self.unit}"

    @property
    def is_distance(self) -> bool:
        return re.fullmatch(r"distance|d[0-9]+", self.channel) is not None

    @property
    def is_tilt(self) -> bool:
        return self.unit == "urad"

    def native(self, value: Number) -> Decimal:
        """The value in mm or rad, without rounding: its float is the one nearest to the decimal number sent."""
        return Decimal(repr(value)).scaleb(EXPONENTS[self.unit])

    def mean(self, values: Sequence[Number]) -> Number:
        """The mean: whole picometres stay whole, other values are rounded to a float once."""
        mean = sum(map(Fraction, values), Fraction(0)) / len(values)
        return round(mean) if self.unit == "pm" else float(mean)


def columns_of_signals(signals: Sequence[str]) -> tuple[ReadColumn, ...]:
    """The columns that a measurement file has for these channels."""
    return tuple(ReadColumn(signal, "urad" if signal in ("alpha", "beta") else "mm") for signal in signals)


def change_of_distance(columns: Sequence[ReadColumn], row: Row, last: Row) -> float | None:
    """By how much the distances of two rows differ, mm: the mean over those in both; None if there are none."""
    changes = [
        column.native(now) - column.native(then)
        for column, now, then in zip(columns, row, last, strict=True)
        if column.is_distance and now is not None and then is not None
    ]
    return float(sum(changes) / len(changes)) if changes else None


def mean_distance(columns: Sequence[ReadColumn], row: Sequence[Number | None]) -> float:
    """The mean of a row's distances, mm; NaN where one is lost."""
    distances = [
        value if value is None else column.native(value)
        for column, value in zip(columns, row, strict=True)
        if column.is_distance
    ]
    present = [distance for distance in distances if distance is not None]
    return float(sum(present) / len(present)) if present and len(present) == len(distances) else math.nan


@dataclass(frozen=True)
class Sample:
    """Simultaneous values of the instrument's columns, None where lost, and the reasons for these."""

    values: Row
    reasons: tuple[str, ...]  # "" where there is a value
    time: datetime | None = None  # when it was taken, where the instrument tells
    signal: Mapping[str, float] = field(default_factory=dict)  # how much light comes back, as far as it is told

    @property
    def is_whole(self) -> bool:
        return None not in self.values


class Instrument(Protocol):
    """An instrument; inside a `with` block it is connected. Methods raise InstrumentError."""

    @property
    def name(self) -> str:
        """Its source."""

    @property
    def columns(self) -> tuple[ReadColumn, ...]:
        """What it reads, in the order of the head's channels."""

    @property
    def axes(self) -> tuple[int, ...]:
        """The instrument's axis (from 1) of each column; empty where it names its columns itself."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def describe(self) -> dict[str, str]:
        """What it says of itself: type, serial number and the like."""

    def read(self) -> Sample:
        """Values that were taken after this call. Ends within the instrument's time limit."""

    def use_line(self, line: str) -> None:
        """From now on the head of this line is read, where the instrument serves several."""

    def visit(self, number: int, index: int, digest: str) -> None:
        """Called before the first reading of a visit: a simulated instrument goes there."""

    def set_up(self, number: int) -> None:
        """Called where head and mirror of a set-up (from 1) are aligned: a simulated instrument goes there."""

    def go_to(self, position: Sequence[float]) -> bool:
        """Move a simulated machine to this position, mm. False: a person moves it."""

    @property
    def has_optics_alignment(self) -> bool:
        """Whether it shows its signal in a mode of its own, in which it measures no distances."""

    def optics_alignment(self, is_on: bool) -> None:
        """Begin or end that mode."""

    def signal(self) -> Sample:
        """In that mode: a sample without values, but with its signal."""

    def make_ready(self, is_begun: bool, tell: Callable[[str], None]) -> None:
        """Called at the first reading of a set-up, or where it is taken up again (`is_begun`)."""
