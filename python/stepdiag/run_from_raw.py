"""From a raw file to the measurement that is evaluated. Nothing but the raw file is needed."""

from datetime import datetime
from typing import Any, Literal

import numpy as np

from stepdiag._core import InvalidArgument, Measurement
from stepdiag.raw_file import RawContent, Record

PICOMETRES = 10**9  # in a millimetre

Zero = Literal["none", "first"]


def measurement_of(content: RawContent, *, zero: Zero = "none", uncertainties: bool = False) -> Measurement:
    """The readings in the plan's order. A lost one is NaN, a point that was not read has no row.

    zero "first": of every set-up and beam a constant is taken off, so that its first reading is the nominal distance
    there. `uncertainties`: standard deviations of the means, beside the readings. Raises InvalidArgument where there
    is no reading, or one that is not in the plan of the header."""
    header, readings = content.header, content.readings()
    if not readings:
        raise InvalidArgument(f"{content.path}: no reading yet")
    channels = list(header["channels"])
    rows = _rows(content, readings, len(channels))
    sign = header["sign"]
    constants = _constants(rows, sign, len(channels)) if zero == "first" else {}
    start = min(_time(content, reading) for _, _, reading in rows)
    values = {name: np.full(len(rows), np.nan) for name in channels}
    deviations = {name: np.full(len(rows), np.nan) for name in channels}
    for row, (visit, _, reading) in enumerate(rows):
        for i, name in enumerate(channels):
            pm, deviation = reading["pm"][i], reading["sd_pm"][i]
            if pm is not None:
                # One division, which rounds once: the number nearest to the picometres.
                values[name][row] = (sign * pm - constants.get((visit["set_up"], i), 0)) / PICOMETRES
            if deviation is not None:
                deviations[name][row] = deviation / np.sqrt(reading["values"]) / PICOMETRES
    seconds = [(_time(content, reading) - start).total_seconds() for _, _, reading in rows]
    return Measurement(
        [visit["line"] for visit, _, _ in rows],
        [reading["point"] for _, _, reading in rows],
        np.array([visit["position_mm"][index] for visit, index, _ in rows]),
        {**values, "time": np.array(seconds)},
        run=[visit["run"] for visit, _, _ in rows],
        direction=[visit["direction"] for visit, _, _ in rows],
        standard_uncertainty=deviations if uncertainties else {},
    )


Row = tuple[dict[str, Any], int, Record]  # a visit of the plan, the place of the point in it, the reading


def _rows(content: RawContent, readings: dict[tuple[int, int], Record], channels: int) -> list[Row]:
    rows, known = [], set()
    try:
        for visit in content.header["plan"]:
            for index, point in enumerate(visit["points"]):
                key = (visit["visit"], point)
                known.add(key)
                if key in readings:
                    rows.append((visit, index, readings[key]))
                    if len(readings[key]["pm"]) != channels:
                        raise InvalidArgument(f"{content.path}: a reading has not {channels} values, as channels says")
    except (KeyError, TypeError, IndexError):
        raise InvalidArgument(f"{content.path}: header: plan: not as stepdiag acquire writes it") from None
    for visit_number, point in readings.keys() - known:
        raise InvalidArgument(f"{content.path}: visit {visit_number}, point {point}: not in the plan of the header")
    return rows


def _constants(rows: list[Row], sign: int, channels: int) -> dict[tuple[int, int], int]:
    """By set-up and channel, pm: what its first reading is too long."""
    constants: dict[tuple[int, int], int] = {}
    for visit, index, reading in rows:
        for i in range(channels):
            if reading["pm"][i] is not None:
                nominal = round(visit["nominal_mm"][index] * PICOMETRES)
                constants.setdefault((visit["set_up"], i), sign * reading["pm"][i] - nominal)
    return constants


def _time(content: RawContent, reading: Record) -> datetime:
    try:
        return datetime.fromisoformat(reading["time"])
    except ValueError:
        raise InvalidArgument(f"{content.path}: time: expected ISO 8601, got {reading['time']!r}") from None
