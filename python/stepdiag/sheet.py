"""A plan's points: the empty sheet to fill in, and what a run lacks of them."""

import numpy as np

from stepdiag._core import Head, Measurement, Plan


def empty_sheet(plan: Plan, head: Head) -> Measurement:
    """The plan's rows in measuring order, with all readings of the head lost."""
    line: list[str] = []
    point: list[int] = []
    positions = []
    for name in [*plan.lines, *plan.scale_lines]:
        points = plan.points(name)
        line += [name] * len(points)
        point += range(len(points))
        positions.append(points)
    lost = np.full(len(line), np.nan)
    return Measurement(line, point, np.concatenate(positions), dict.fromkeys(head.signals, lost))


def lost_readings(measurement: Measurement, plan: Plan, head: Head) -> tuple[int, int]:
    """How many rows lack a reading of the head, and how many points of the plan have no row (all runs)."""
    read = [measurement.channels[name] for name in head.signals if name in measurement.channels]
    incomplete = int(np.count_nonzero(np.any(np.isnan(read), axis=0))) if read else 0
    points = {name: len(plan.points(name)) for name in [*plan.lines, *plan.scale_lines]}
    given = set(zip(measurement.run.tolist(), measurement.line, measurement.point.tolist(), strict=True))
    visited = {(run, name) for run, name, _ in given}
    missing = sum(1 for run, name in visited for k in range(points.get(name, 0)) if (run, name, k) not in given)
    unvisited = sum(count for name, count in points.items() if not any(line == name for _, line in visited))
    return incomplete, missing + unvisited
