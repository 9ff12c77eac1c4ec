"""From a raw file to a measurement. The raw file contains all that is needed."""

import math
from pathlib import Path
from typing import Literal

import numpy as np

from stepdiag._core import InvalidArgument, Measurement
from stepdiag.acquisition.raw_file import RawContent, read_raw
from stepdiag.acquisition.raw_records import RawReading, Visited
from stepdiag.config.toml_text import located
from stepdiag.io.data_files import write_measurement

PICOMETRES = 10**9  # per mm

Zero = Literal["none", "first"]
Row = tuple[Visited, int, RawReading]  # visit, index of the point in it, reading


def write_run(raw: Path, output: Path, *, zero: Zero = "none", uncertainties: bool = False) -> None:
    """Write the measurement of a raw file, complete or not at all."""
    write_measurement(measurement_of(read_raw(raw), zero=zero, uncertainties=uncertainties), output)


def measurement_of(content: RawContent, *, zero: Zero = "none", uncertainties: bool = False) -> Measurement:
    """The readings in the plan's order. A lost reading is NaN; a point not yet read has no row.

    Args:
        zero: "first": subtract a constant for each set-up and beam, such that its first reading is
            the nominal distance there.
        uncertainties: add the standard deviations of the means.

    Raises:
        InvalidArgument: there is no reading, or a reading does not belong to the plan of the
            header.
    """
    header, readings = content.header, content.readings()
    rows = _rows(content, readings)
    constants = _constants(rows, header.sign, len(header.channels)) if zero == "first" else {}
    values = {name: np.full(len(rows), np.nan) for name in header.channels}
    deviations = {name: np.full(len(rows), np.nan) for name in header.channels}
    for row, (visit, _, reading) in enumerate(rows):
        for i, name in enumerate(header.channels):
            pm, deviation = reading.pm[i], reading.sd_pm[i]
            if pm is not None:
                # A single division rounds once: the double nearest to the picometres.
                values[name][row] = (header.sign * pm - constants.get((visit.set_up, i), 0)) / PICOMETRES
            if deviation is not None and deviation > 0.0 and reading.values > 0:
                deviations[name][row] = deviation / math.sqrt(reading.values) / PICOMETRES
    start = min(reading.time for _, _, reading in rows)
    with located(str(content.path)):
        return Measurement(
            [visit.line for visit, _, _ in rows],
            [reading.point for _, _, reading in rows],
            np.array([visit.position_mm[index] for visit, index, _ in rows]),
            {**values, "time": np.array([(reading.time - start).total_seconds() for _, _, reading in rows])},
            run=[visit.run for visit, _, _ in rows],
            direction=[visit.direction for visit, _, _ in rows],
            standard_uncertainty=deviations if uncertainties else {},
        )


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
        if not len(reading.pm) == len(reading.sd_pm) == count:
            raise InvalidArgument(f"{where}: expected {count} values ({', '.join(content.header.channels)})")
    return [(*place, readings[key]) for key, place in places.items() if key in readings]


def _constants(rows: list[Row], sign: int, channels: int) -> dict[tuple[int, int], int]:
    """By set-up and channel: first reading minus nominal distance, pm."""
    constants: dict[tuple[int, int], int] = {}
    for visit, index, reading in rows:
        for i in range(channels):
            pm = reading.pm[i]
            if pm is not None:
                nominal = round(visit.nominal_mm[index] * PICOMETRES)
                constants.setdefault((visit.set_up, i), sign * pm - nominal)
    return constants
