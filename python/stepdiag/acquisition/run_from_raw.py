"""From a raw file to a measurement. The raw file contains all that is needed."""

import math
from collections.abc import Sequence
from datetime import datetime
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument, Measurement
from stepdiag.acquisition.raw_file import RawContent, read_raw
from stepdiag.acquisition.raw_records import RawReading, TemperatureRow, Visited
from stepdiag.config.toml_text import located
from stepdiag.instruments.instrument import Number, ReadColumn
from stepdiag.io.data_files import write_measurement
from stepdiag.units import native

PICOMETRE: Final = Decimal("1e-9")  # mm
CLOCK_ERROR: Final = 2.0  # s; clocks are set by less all the time
TEMPERATURE_AGE: Final = 600.0  # s for which a temperature holds, unless told otherwise

Zero = Literal["none", "first"]
Row = tuple[Visited, int, RawReading]  # visit, index of the point in it, reading


def write_run(
    raw: Path,
    output: Path,
    *,
    zero: Zero = "none",
    uncertainties: bool = False,
    temperature_age: float = TEMPERATURE_AGE,
) -> None:
    """Write the measurement of a raw file, complete or not at all."""
    run = measurement_of(read_raw(raw), zero=zero, uncertainties=uncertainties, temperature_age=temperature_age)
    write_measurement(run, output)


def measurement_of(
    content: RawContent,
    *,
    zero: Zero = "none",
    uncertainties: bool = False,
    temperature_age: float = TEMPERATURE_AGE,
) -> Measurement:
    """The readings in the plan's order.

    A lost reading is NaN; a point not yet read has no row. There are no times where the clock was set back.

    Args:
        zero: "first": subtract a constant for each set-up and beam, such that its first reading is
            the nominal distance there.
        uncertainties: add the standard deviations of the means.
        temperature_age: how far in time a row of temperatures may be from a reading, s.

    Raises:
        InvalidArgument: there is no reading, or a reading does not belong to the plan of the
            header.
    """
    header, readings = content.header, content.readings()
    rows = _rows(content, readings)
    columns = header.read_columns
    constants = _constants(rows, header.sign, columns) if zero == "first" else {}
    values = {name: np.full(len(rows), np.nan) for name in header.channels}
    deviations = {name: np.full(len(rows), np.nan) for name in header.channels}
    for row, (visit, _, reading) in enumerate(rows):
        for i, column in enumerate(columns):
            value, deviation = reading.read[i], reading.sd[i]
            if value is not None:
                # Rounded once: the double nearest to the decimal number that was read.
                constant = constants.get((visit.set_up, i), Decimal(0))
                values[column.channel][row] = float(_signed(column, value, header.sign) - constant)
            if deviation is not None and deviation > 0.0 and reading.values > 0:
                deviations[column.channel][row] = float(column.native(deviation / math.sqrt(reading.values)))
    times = [reading.time for _, _, reading in rows]
    start = min(times)
    seconds = {"time": np.array([(time - start).total_seconds() for time in times])}
    recorded = [record for record in content.records if isinstance(record, TemperatureRow)]
    with located(str(content.path)):
        return Measurement(
            [visit.line for visit, _, _ in rows],
            [reading.point for _, _, reading in rows],
            np.array([visit.position_mm[index] for visit, index, _ in rows]),
            {
                **values,
                **({} if set_back(content) else seconds),
                **_recorded(recorded, times, temperature_age),
            },
            run=[visit.run for visit, _, _ in rows],
            direction=[visit.direction for visit, _, _ in rows],
            standard_uncertainty=deviations if uncertainties else {},
        )


def set_back(content: RawContent) -> str:
    """That the clock was set back between two readings, in words; else empty. One that was set forward looks like a
    pause."""
    readings = [record for record in content.records if isinstance(record, RawReading)]
    return next(filter(None, (clock_remark(before, after) for before, after in pairwise(readings))), "")


def clock_remark(before: RawReading, after: RawReading) -> str:
    """The same of two readings that follow each other."""
    seconds = (before.time - after.time).total_seconds()
    if seconds <= CLOCK_ERROR:
        return ""
    where = f"line {after.line}, point {after.point}"
    return f"the clock was set back by {seconds:.0f} s before {where}: the run has no times (time_s)"


def _rows(content: RawContent, readings: dict[tuple[int, int], RawReading]) -> list[Row]:
    if not readings:
        raise InvalidArgument(f"{content.path}: no reading yet")
    count = len(content.header.channels)
    places = {
        (visit.visit, point): (visit, index)
        for visit in content.header.plan
        for index, point in enumerate(visit.points)
    }
    for key, reading in readings.items():
        where = f"{content.path}: visit {key[0]}, point {key[1]}"
        if key not in places:
            raise InvalidArgument(f"{where}: not in the plan of the header")
        if not len(reading.read) == len(reading.sd) == count:
            raise InvalidArgument(f"{where}: expected {count} values ({', '.join(content.header.channels)})")
    return [(*place, readings[key]) for key, place in places.items() if key in readings]


def _recorded(
    rows: Sequence[TemperatureRow], times: Sequence[datetime], age: float
) -> dict[str, npt.NDArray[np.float64]]:
    """By channel: values at these times, interpolated between the rows before and after.

    Where only one of these is within `age`, its value; NaN where none is. Rows need not be in order."""
    channels = {}
    at = np.array([time.timestamp() for time in times])
    for column in dict.fromkeys(column for row in rows for column in row.values):
        known = {row.time.timestamp(): value for row in rows if (value := row.values.get(column)) is not None}
        moment = np.array([-np.inf, *sorted(known), np.inf])
        level = np.array([np.nan, *(native(column, known[time]) for time in sorted(known)), np.nan])
        after = np.searchsorted(moment, at, side="right")
        since, until = at - moment[after - 1], moment[after] - at
        with np.errstate(invalid="ignore"):  # infinite ones are not used
            between = level[after - 1] + since / (since + until) * (level[after] - level[after - 1])
        alone = np.where(since <= age, level[after - 1], np.where(until <= age, level[after], np.nan))
        channels[column.rsplit("_", 1)[0]] = np.where((since <= age) & (until <= age), between, alone)
    return channels


def _signed(column: ReadColumn, value: Number, sign: int) -> Decimal:
    """A value in mm or rad; `sign` is that of distances."""
    return column.native(value) * (sign if column.is_distance else 1)


def _constants(rows: list[Row], sign: int, columns: Sequence[ReadColumn]) -> dict[tuple[int, int], Decimal]:
    """By set-up and column of a distance: first reading minus nominal distance, mm."""
    constants: dict[tuple[int, int], Decimal] = {}
    for visit, index, reading in rows:
        for i, column in enumerate(columns):
            value = reading.read[i]
            if value is not None and column.is_distance:
                nominal = Decimal(repr(visit.nominal_mm[index])).quantize(PICOMETRE)
                constants.setdefault((visit.set_up, i), _signed(column, value, sign) - nominal)
    return constants
