"""A reading: wait until the values have settled, then average."""

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from fractions import Fraction
from typing import Literal

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.ids3010 import Sample

PICOMETRES_PER_MICROMETRE = 1_000_000


@dataclass(frozen=True)
class Settling:
    """When values count as settled, and how many are averaged.

    Raises InvalidArgument naming the field."""

    count: int = 5  # consecutive values that must agree
    # Largest range of these on every axis, and largest distance of averaged values from their mean.
    limit_um: float = 0.5
    timeout: float = 20.0  # s; after that the reading is lost
    average: int = 10  # number of values
    interval: float = 0.01  # s between two values
    retries: int = 5  # consecutive values without a beam before the beam counts as lost
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
            ("timeout", self.timeout, True),
            ("interval", self.interval, False),
            ("retry_wait", self.retry_wait, False),
        ):
            if not math.isfinite(number) or number < 0.0 or (positive and number == 0.0):
                least = "a finite number above 0" if positive else "a finite number of at least 0"
                raise InvalidArgument(f"settling: {name}: expected {least}, got {number!r}")

    @property
    def limit_pm(self) -> float:
        return self.limit_um * PICOMETRES_PER_MICROMETRE


ValueKind = Literal["settling", "average", "lost"]


@dataclass(frozen=True)
class TakenValue:
    """One value of every axis."""

    time: datetime
    kind: ValueKind
    pm: tuple[int | None, ...]


@dataclass
class Reading:
    """All values taken at a point, and why axes are lost.

    Mean and standard deviation are None there."""

    axes: int
    values: list[TakenValue] = field(default_factory=list)
    lost: dict[int, str] = field(default_factory=dict)  # reason by index of the axis

    @property
    def averaged(self) -> list[tuple[int | None, ...]]:
        return [value.pm for value in self.values if value.kind == "average"]

    @property
    def mean_pm(self) -> list[int | None]:
        """The means, rounded to 1 pm."""
        averaged = self.averaged
        return [None if i in self.lost else _mean(_column(averaged, i)) for i in range(self.axes)]

    @property
    def deviation_pm(self) -> list[float | None]:
        """Standard deviations of a single value; None for fewer than two values."""
        averaged = self.averaged
        if len(averaged) < 2:
            return [None] * self.axes
        return [None if i in self.lost else _deviation(_column(averaged, i)) for i in range(self.axes)]


def take_reading(read: Callable[[], Sample], axes: int, options: Settling, told: Callable[[int], str] = str) -> Reading:
    """Read until the values of every axis settle, then average.

    An axis without a beam is given up after `retries` values in a row; the others are read on.
    Values that do not settle in time are lost. `told` returns the text of a warning number."""
    return _Taking(axes, options, told).take(read)


class _Taking:
    def __init__(self, axes: int, options: Settling, told: Callable[[int], str]) -> None:
        self._options = options
        self._told = told
        self._reading = Reading(axes)
        self._live = set(range(axes))
        self._misses = [0] * axes
        self._window: deque[tuple[int | None, ...]] = deque(maxlen=options.count)
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
        """Add a value. Returns False if a beam is missing."""
        missing = [i for i in self._live if sample.pm[i] is None]
        for i in self._live:
            self._misses[i] = self._misses[i] + 1 if i in missing else 0
        if missing:
            self._note("lost", sample)
            self._start_again()
            for i in missing:
                if self._misses[i] > self._options.retries:
                    self._live.discard(i)
                    self._reading.lost[i] = f"no beam ({self._told(sample.warnings[i])})"
            return False
        if self._centre is not None and self._stays(sample.pm):
            self._averaged += 1
            self._note("average", sample)
            return True
        if self._centre is not None:
            self._start_again()
        self._note("settling", sample)
        self._window.append(sample.pm)
        if len(self._window) == self._options.count and self._spread() <= self._options.limit_pm:
            self._centre = {i: float(_mean(_column(self._window, i))) for i in self._live}
        return True

    def _note(self, kind: ValueKind, sample: Sample) -> None:
        self._reading.values.append(TakenValue(datetime.now(UTC), kind, sample.pm))

    def _start_again(self) -> None:
        """Discard the average: the mirror was not at rest."""
        values = self._reading.values
        values[:] = [TakenValue(v.time, "settling" if v.kind == "average" else v.kind, v.pm) for v in values]
        self._window.clear()
        self._centre = None
        self._averaged = 0

    def _stays(self, pm: tuple[int | None, ...]) -> bool:
        assert self._centre is not None
        return all(abs((pm[i] or 0) - centre) <= self._options.limit_pm for i, centre in self._centre.items())

    def _spread(self) -> float:
        columns = [_column(self._window, i) for i in self._live]
        return max((max(column) - min(column) for column in columns if column), default=0)

    def _give_up(self) -> None:
        spread = self._spread() / PICOMETRES_PER_MICROMETRE
        text = f"did not settle within {self._options.timeout:g} s (last values {spread:.3g} um apart)"
        self._start_again()
        for i in self._live:
            self._reading.lost[i] = text


def _column(rows: Sequence[tuple[int | None, ...]] | deque[tuple[int | None, ...]], i: int) -> list[int]:
    return [value for row in rows if (value := row[i]) is not None]


def _mean(values: Sequence[int]) -> int:
    return round(Fraction(sum(values), len(values)))


def _deviation(values: Sequence[int]) -> float:
    mean = Fraction(sum(values), len(values))
    return math.sqrt(sum((value - mean) ** 2 for value in values) / (len(values) - 1))
