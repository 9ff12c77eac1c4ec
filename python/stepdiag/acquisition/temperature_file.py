"""Temperatures, and the state of the air, from a CSV file that another program appends to while a run is read."""

import csv
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final, get_args

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.raw_records import RecordedColumn, TemperatureRow
from stepdiag.config.temperature_keys import HIGHEST, LOWEST
from stepdiag.io.csv_text import finite_number
from stepdiag.io.whole_files import reason

TIME: Final = "time"
COLUMNS: Final[tuple[RecordedColumn, ...]] = get_args(RecordedColumn)
ONE_SENSOR: Final = "temperature_c"
OWN_SENSORS: Final = ("temperature_x_c", "temperature_y_c", "temperature_z_c")
# Smallest and largest values; those of columns that are not here are temperatures.
LIMITS: Final[Mapping[str, tuple[float, float]]] = {
    "air_pressure_hpa": (100.0, 1400.0),
    "air_humidity_percent": (0.0, 100.0),
}
AHEAD: Final = timedelta(minutes=1)  # by which the other program's clock may be fast


class TemperatureFile:
    """The file, read on where it was left. It is opened for each look, as the other program may replace it."""

    def __init__(self, path: Path, *, age: float, tell: Callable[[str], None]) -> None:
        """age: how long a value holds, s; what is older already is left out. tell: takes warnings.

        Raises InvalidArgument naming the file, and line and column, where it cannot be read, where columns are
        missing, and where the last row is not sound."""
        self.path = path
        self._age, self._tell = timedelta(seconds=age), tell
        self._after = datetime.now(UTC) - self._age
        self._identity: tuple[int, int] | None = None
        self._offset = self._line = 0
        self._columns: Sequence[str] = ()
        self._newest: dict[str, datetime] = {}  # by column, of all rows
        self._old: set[str] = set()  # columns that no value holds of, as was told
        self._unreadable = False
        if path.exists() and not path.is_file():
            raise InvalidArgument(f"{path}: expected a file that can be read again, got a folder, a pipe or a device")
        try:
            self._first = list(self._look())
        except OSError as error:
            raise InvalidArgument(f"{path}: cannot be read: {reason(error)}") from None
        for problem in self._first if not self._columns else self._first[-1:]:
            if isinstance(problem, InvalidArgument):
                raise problem
        if not self._columns:
            raise InvalidArgument(f"{path}: expected a line with the names of its columns, got none")
        others = [column for column in self._columns if column not in (TIME, *COLUMNS)]
        if others:
            tell(f"{path}: columns that are not read: {', '.join(others)}")

    def leave_out(self, rows: Sequence[TemperatureRow]) -> None:
        """Leave out what is not newer than these rows, which are known already."""
        self._after = max((self._after, *(row.time for row in rows)))

    def new_rows(self) -> list[TemperatureRow]:
        """The rows that have come since the last call; the last one is left until it is whole.

        Those that are not sound are told and left out."""
        try:
            found = [*self._first, *self._look()]
        except OSError as error:
            if not self._unreadable:
                self._tell(f"warning: {self.path}: cannot be read: {reason(error)}")
            self._unreadable = True
            return []
        self._unreadable, self._first = False, []
        problems = [problem for problem in found if isinstance(problem, InvalidArgument)]
        if problems:
            more = f", and {len(problems) - 1} more" if len(problems) > 1 else ""
            self._tell(f"warning: {problems[0]}; the row is left out{more}")
        return [row for row in found if isinstance(row, TemperatureRow) and row.time > self._after]

    def warn_of_age(self, now: datetime) -> None:
        """Tell once that no value of a column holds any more."""
        since = {column: self._newest.get(column) for column in self._columns if column in COLUMNS}
        old = {column: time for column, time in since.items() if time is None or now - time > self._age}
        if old.keys() - self._old:
            newest = max((time for time in old.values() if time is not None), default=None)
            last = "no value" if newest is None else f"no value since {newest:%Y-%m-%d %H:%M:%S} UTC"
            self._tell(f"warning: {self.path}: {', '.join(old)}: {last}; readings have none until there is a new one")
        self._old = set(old)

    def _look(self) -> Iterator[TemperatureRow | InvalidArgument]:
        """Rows, and what is wrong with lines that are none. Raises OSError."""
        for line in self._new_lines():
            if not line.strip() or line.startswith("#"):
                continue
            try:
                if self._columns:
                    yield self._row(line)
                else:
                    self._columns = _header(line, f"{self.path}, line {self._line}")
            except InvalidArgument as problem:
                yield problem

    def _new_lines(self) -> Iterator[str]:
        with self.path.open("rb") as file:
            status = os.fstat(file.fileno())
            if (status.st_dev, status.st_ino) != self._identity or status.st_size < self._offset:
                self._after = max((self._after, *self._newest.values()))  # another file may begin with known rows
                self._identity = status.st_dev, status.st_ino
                self._offset, self._line, self._columns = 0, 0, ()
            file.seek(self._offset)
            data = file.read()
        whole = data[: data.rfind(b"\n") + 1]
        self._offset += len(whole)
        for line in whole.split(b"\n")[:-1]:
            self._line += 1
            yield line.decode("utf-8-sig" if self._line == 1 else "utf-8", "replace").rstrip("\r")

    def _row(self, line: str) -> TemperatureRow:
        where = f"{self.path}, line {self._line}"
        fields = _fields(line, where)
        if len(fields) != len(self._columns):
            raise InvalidArgument(f"{where}: expected {len(self._columns)} fields, as in the header, got {len(fields)}")
        named = dict(zip(self._columns, fields, strict=True))
        time = _time(named[TIME], f"{where}: {TIME}")
        values = {column: _value(named[column], column, where) for column in COLUMNS if column in named}
        for column, value in values.items():
            if value is not None:
                self._newest[column] = max(time, self._newest.get(column, time))
        return TemperatureRow(time=time, line=self._line, values=values)


def _header(line: str, where: str) -> Sequence[str]:
    columns = _fields(line, where)
    for column in (TIME, *COLUMNS):
        if columns.count(column) > 1:
            raise InvalidArgument(f"{where}: {column}: expected it once, got it twice")
    scales = [column for column in OWN_SENSORS if column in columns]
    complete = ONE_SENSOR in columns or len(scales) in (0, len(OWN_SENSORS))
    if TIME not in columns or not complete or not set(columns) & set(COLUMNS):
        raise InvalidArgument(
            f"{where}: expected the columns time and {ONE_SENSOR}, or {', '.join(OWN_SENSORS)}, and if you like "
            f"{', '.join(column for column in COLUMNS if column.startswith('air_'))}; got {line[:80]!r}"
        )
    return columns


def _fields(line: str, where: str) -> list[str]:
    try:
        return [field.strip() for field in next(csv.reader([line], strict=True))]
    except csv.Error as error:
        raise InvalidArgument(f"{where}: not valid CSV: {error}") from None


def _time(field: str, where: str) -> datetime:
    """A moment with its offset from UTC (ISO 8601), or seconds since 1970."""
    try:
        seconds = re.fullmatch(r"[0-9]+(\.[0-9]*)?", field)
        time = datetime.fromtimestamp(float(field), UTC) if seconds else datetime.fromisoformat(field)
        if time.tzinfo is None:
            raise ValueError
        time = time.astimezone(UTC)
    except (ValueError, OverflowError, OSError):
        raise InvalidArgument(
            f"{where}: expected a time such as 2026-01-31T12:00:00Z, or seconds since 1970, got {field!r}"
        ) from None
    now = datetime.now(UTC)
    if time > now + AHEAD:
        raise InvalidArgument(f"{where}: expected a time that is past, at {now:%Y-%m-%d %H:%M:%S} UTC, got {field!r}")
    return time


def _value(field: str, column: str, where: str) -> float | None:
    if not field:
        return None
    value = finite_number(field, f"{where}: {column}")
    low, high = LIMITS.get(column, (LOWEST, HIGHEST))
    if not low <= value <= high:
        raise InvalidArgument(f"{where}: {column}: expected {low:g} to {high:g}, got {field!r}")
    return value
