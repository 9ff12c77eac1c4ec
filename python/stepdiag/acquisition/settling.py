"""A reading: wait until the values have settled, then average."""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from fractions import Fraction
from typing import Literal

from stepdiag._core import InvalidArgument
from stepdiag.instruments.instrument import EXPONENTS, Number, ReadColumn, Row, Sample
from stepdiag.option_field import option


@dataclass(frozen=True)
class Settling:
    """When values count as settled, and how many are averaged.

    Raises InvalidArgument naming the field."""

    count: int = option(5, "Values in a row that must agree.", name="settle_count", least=2)
    # Also the largest distance of averaged values from their mean.
    limit_um: float = option(0.5, "Largest range of these values, of distances.", name="settle_limit_um", above=0.0)
    limit_spot_um: float = option(5.0, "Largest range of these values, of spots.", name="settle_spot_um", above=0.0)
    limit_tilt_urad: float = option(5.0, "Largest range of these values, of tilts.", name="settle_tilt_urad", above=0.0)
    timeout: float = option(
        20.0,
        "Seconds to wait for settled values; after that the reading is lost.",
        name="settle_timeout",
        above=0.0,
    )
    average: int = option(10, "Values to average after settling.", least=1)
    interval: float = option(0.01, "Time between two values.", name="interval_ms", least=0.0, factor=1e-3)  # s
    retries: int = option(5, "Consecutive values without a beam before the beam counts as lost.", least=0)
    retry_wait: float = 0.1  # s between these

    def __post_init__(self) -> None:
        for name, value, lowest in (
            ("count", self.count, 2),
            ("average", self.average, 1),
            ("retries", self.retries, 0),
        ):
            if value < lowest:
                raise InvalidArgument(f"settling: {name}: expected at least {lowest}, got {value}")
        for name, number, positive in (
            ("limit_um", self.limit_um, True),
            ("limit_spot_um", self.limit_spot_um, True),
            ("limit_tilt_urad", self.limit_tilt_urad, True),
            ("timeout", self.timeout, True),
            ("interval", self.interval, False),
            ("retry_wait", self.retry_wait, False),
        ):
            if not math.isfinite(number) or number < 0.0 or (positive and number == 0.0):
                least = "a finite number above 0" if positive else "a finite number of at least 0"
                raise InvalidArgument(f"settling: {name}: expected {least}, got {number!r}")

    def limit(self, column: ReadColumn) -> float:
        """The limit of a column, in its own unit."""
        if column.is_tilt:
            return self.limit_tilt_urad
        micrometres = self.limit_um if column.is_distance else self.limit_spot_um
        return micrometres * float(10 ** (-3 - EXPONENTS[column.unit]))


ValueKind = Literal["settling", "average", "lost"]


@dataclass(frozen=True)
class TakenValue:
    """One value of every column."""

    time: datetime
    kind: ValueKind
    values: Row


@dataclass
class Reading:
    """All values taken at a point, and why columns are lost.

    Mean and standard deviation are None there."""

    columns: Sequence[ReadColumn]
    values: list[TakenValue] = field(default_factory=list)
    lost: dict[int, str] = field(default_factory=dict)  # reason by index of the column

    @property
    def averaged(self) -> list[Row]:
        return [value.values for value in self.values if value.kind == "average"]

    @property
    def mean(self) -> Row:
        """The means; whole picometres are rounded to 1 pm."""
        averaged = self.averaged
        return tuple(
            None if i in self.lost else column.mean(_values(averaged, i)) for i, column in enumerate(self.columns)
        )

    @property
    def deviation(self) -> list[float | None]:
        """Standard deviations of a single value; None for fewer than two values."""
        averaged = self.averaged
        if len(averaged) < 2:
            return [None] * len(self.columns)
        return [None if i in self.lost else _deviation(_values(averaged, i)) for i in range(len(self.columns))]


def take_reading(read: Callable[[], Sample], columns: Sequence[ReadColumn], options: Settling) -> Reading:
    """Read until the values of every column settle, then average.

    A column without a value is given up after `retries` samples in a row; the others are read on.
    Values that do not settle in time are lost."""
    return _Taking(columns, options).take(read)


class _Taking:
    def __init__(self, columns: Sequence[ReadColumn], options: Settling) -> None:
        self._columns = columns
        self._options = options
        self._limits = [options.limit(column) for column in columns]
        self._reading = Reading(columns)
        self._live = set(range(len(columns)))
        self._misses = [0] * len(columns)
        self._window: deque[Row] = deque(maxlen=options.count)
        self._centre: dict[int, float] | None = None  # mean of the settled window, while averaging
        self._averaged = 0

    def take(self, read: Callable[[], Sample]) -> Reading:
        deadline = time.monotonic() + self._options.timeout
        while self._live and self._averaged < self._options.average:
            if time.monotonic() > deadline:
                self._give_up()
                break
            began = time.monotonic()
            wait = self._options.interval if self._add(read()) else self._options.retry_wait
            left = began + wait - time.monotonic()
            if left > 0.0 and self._averaged < self._options.average:
                time.sleep(left)
        return self._reading

    def _add(self, sample: Sample) -> bool:
        """Add a sample. Returns False if a value is missing."""
        missing = [i for i in self._live if sample.values[i] is None]
        for i in self._live:
            self._misses[i] = self._misses[i] + 1 if i in missing else 0
        if missing:
            self._note("lost", sample)
            self._start_again()
            for i in missing:
                if self._misses[i] > self._options.retries:
                    self._live.discard(i)
                    what = "no beam" if self._columns[i].is_distance else "no value"
                    self._reading.lost[i] = f"{what} ({sample.reasons[i]})"
            return False
        if self._centre is not None and self._stays(sample.values):
            self._averaged += 1
            self._note("average", sample)
            return True
        if self._centre is not None:
            self._start_again()
        self._note("settling", sample)
        self._window.append(sample.values)
        if len(self._window) == self._options.count and not self._unsettled():
            self._centre = {i: float(self._columns[i].mean(_values(self._window, i))) for i in self._live}
        return True

    def _note(self, kind: ValueKind, sample: Sample) -> None:
        self._reading.values.append(TakenValue(sample.time or datetime.now(UTC), kind, sample.values))

    def _start_again(self) -> None:
        """Discard the average: the mirror was not at rest."""
        values = self._reading.values
        values[:] = [TakenValue(v.time, "settling" if v.kind == "average" else v.kind, v.values) for v in values]
        self._window.clear()
        self._centre = None
        self._averaged = 0

    def _stays(self, row: Row) -> bool:
        assert self._centre is not None
        return all(abs((row[i] or 0) - centre) <= self._limits[i] for i, centre in self._centre.items())

    def _unsettled(self) -> list[tuple[int, Number]]:
        """The columns whose values differ by more than the limit, and by how much."""
        spreads = [(i, spread(_values(self._window, i))) for i in sorted(self._live)]
        return [(i, wide) for i, wide in spreads if wide > self._limits[i]]

    def _give_up(self) -> None:
        apart = [
            f"{self._columns[i].channel} {_in_report_units(self._columns[i], wide)}" for i, wide in self._unsettled()
        ]
        told = f" (last values apart: {', '.join(apart)})" if apart else ""
        self._start_again()
        for i in self._live:
            self._reading.lost[i] = f"did not settle within {self._options.timeout:g} s{told}"


def spread(values: Sequence[Number]) -> Number:
    """Largest minus smallest."""
    return max(values) - min(values) if values else 0


def _in_report_units(column: ReadColumn, value: Number) -> str:
    return f"{value:.3g} urad" if column.is_tilt else f"{float(column.native(value)) * 1e3:.3g} um"


def _values(rows: Iterable[Row], i: int) -> list[Number]:
    return [value for row in rows if (value := row[i]) is not None]


def _deviation(values: Sequence[Number]) -> float:
    exact = [Fraction(value) for value in values]
    mean = sum(exact, Fraction(0)) / len(exact)
    return math.sqrt(sum((value - mean) ** 2 for value in exact) / (len(exact) - 1))
