"""A plan's points: the empty sheet to fill in, and what a run lacks of them."""

from collections.abc import Sequence

import numpy as np

from stepdiag._core import Measurement, Plan


def empty_sheet(plan: Plan, signals: Sequence[str], *, repeats: int = 1, backward: bool = False) -> Measurement:
    """The plan's rows in measuring order, with all readings lost."""
    line: list[str] = []
    point: list[int] = []
    run: list[int] = []
    direction: list[str] = []
    positions = []
    ways = ("forward", "backward") if backward else ("forward",)
    for name in [*plan.lines, *plan.scale_lines]:
        for number, way in enumerate(ways * repeats):
            points = plan.points(name, number)
            numbers = range(len(points))[:: 1 if way == "forward" else -1]
            positions.append(points[list(numbers)])
            line += [name] * len(points)
            point += numbers
            run += [number] * len(points)
            direction += [way] * len(points)
    lost = np.full(len(line), np.nan)
    return Measurement(
        line, point, np.concatenate(positions), dict.fromkeys(signals, lost), run=run, direction=direction
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


def only(measurement: Measurement, signals: Sequence[str]) -> Measurement:
    """The run without its other readings; what is no reading (time, temperature) stays."""
    kept = {*signals, "time", "temperature"}
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
