"""A plan's points: the empty sheet to fill in, what a run lacks of them, and copies of runs with other channels."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import Measurement, Plan

# Channels that are no readings of the head.
RECORDS: Final = (
    "time",
    "temperature",
    "temperature_x",
    "temperature_y",
    "temperature_z",
    "air_temperature",
    "air_pressure",
    "air_humidity",
)


def empty_sheet(plan: Plan, signals: Sequence[str], *, repeats: int = 1, backward: bool = False) -> Measurement:
    """The plan's rows in measuring order, with all readings lost."""
    passes = plan.passes(repeats, backward=backward)
    rows = [planned for planned in passes for _ in planned.points]
    return Measurement(
        [planned.line for planned in rows],
        [int(point) for planned in passes for point in planned.points],
        np.concatenate([planned.positions for planned in passes]),
        dict.fromkeys(signals, np.full(len(rows), np.nan)),
        run=[planned.run for planned in rows],
        direction=[planned.direction for planned in rows],
    )


def lost_readings(measurement: Measurement, plan: Plan, signals: Sequence[str]) -> tuple[int, int]:
    """How many rows lack one of these readings, and how many points of the plan have no row (all runs)."""
    read = [measurement.channels[name] for name in signals if name in measurement.channels]
    incomplete = int(np.count_nonzero(np.any(np.isnan(read), axis=0))) if read else 0
    points = {name: len(plan.points(name)) for name in [*plan.lines, *plan.scale_lines]}
    given = set(zip(measurement.run.tolist(), measurement.line, measurement.point.tolist(), strict=True))
    visited = {(run, name) for run, name, _ in given}
    missing = sum(1 for run, name in visited for k in range(points.get(name, 0)) if (run, name, k) not in given)
    unvisited = sum(count for name, count in points.items() if not any(line == name for _, line in visited))
    return incomplete, missing + unvisited


def with_channels(
    measurement: Measurement,
    channels: Mapping[str, npt.ArrayLike],
    standard_uncertainty: Mapping[str, npt.ArrayLike] | None = None,
) -> Measurement:
    """The run with these channels in place of its own or beside them, and standard uncertainties likewise."""
    every: dict[str, npt.ArrayLike] = {**measurement.channels, **channels}
    return Measurement(
        measurement.line,
        measurement.point.tolist(),
        measurement.position,
        every,
        run=measurement.run.tolist(),
        direction=measurement.direction,
        standard_uncertainty={**measurement.standard_uncertainty, **(standard_uncertainty or {})},
    )


def only(measurement: Measurement, signals: Sequence[str]) -> Measurement:
    """The run without its other readings; what is no reading (time, temperatures, air) stays."""
    kept = {*signals, *RECORDS}
    if kept >= measurement.channels.keys():
        return measurement
    return Measurement(
        measurement.line,
        measurement.point.tolist(),
        measurement.position,
        {name: values for name, values in measurement.channels.items() if name in kept},
        run=measurement.run.tolist(),
        direction=measurement.direction,
        standard_uncertainty={
            name: values for name, values in measurement.standard_uncertainty.items() if name in kept
        },
    )
