"""How long set-ups and readings took in a run that was made: what `plan --from` takes from a raw acquisition."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from statistics import median

import numpy as np

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.config.plan_by_time_keys import PlanByTimeSection
from stepdiag.planning.measuring_time import times_of
from stepdiag.units import MINUTE


@dataclass(frozen=True)
class MeasuredTimes:
    """In s, each with how many it is the median of: from a reading to the next one on a line, less the time of the
    move; and from the last reading of a set-up to the first one of the next, less that and less the move. None: the run
    has none of these."""

    path: Path
    reading: float
    readings: int
    line_change: float | None
    line_changes: int
    scale_line_change: float | None
    scale_line_changes: int
    keys: PlanByTimeSection = field(repr=False)
    """The scenario's, with these times in them."""


def measured_times(raw: Path, keys: PlanByTimeSection, place: str) -> MeasuredTimes:
    """Of a raw acquisition (`acquire`), for a machine that moves as `keys` say. `place` names these in messages.

    Medians, because a few pauses are no part of the work. Raises InvalidArgument where there are fewer than two
    readings in a row on a line."""
    content, times = read_raw(raw), times_of(keys, place)
    planned = {visit.visit: visit for visit in content.header.plan}
    on_line: list[float] = []
    changes: dict[bool, list[float]] = {False: [], True: []}
    readings = sorted(content.readings().values(), key=lambda one: one.time)
    for before, after in pairwise(readings):
        if before.visit not in planned or after.visit not in planned:
            raise InvalidArgument(f"{raw}: visit {after.visit}: not in the plan of the header")
        way = float(np.linalg.norm(np.subtract(after.position_mm, before.position_mm)))
        waited = (after.time - before.time).total_seconds() - float(times.move(way))
        new = planned[after.visit]
        if planned[before.visit].set_up == new.set_up:
            on_line.append(max(waited, 0.0))
        else:
            changes[new.scale_line].append(waited)
    if not on_line:
        raise InvalidArgument(f"{raw}: expected at least two readings in a row on a line, got none")
    reading = median(on_line)
    usual, scale = (max(median(found) - reading, 0.0) if found else None for found in (changes[False], changes[True]))
    measure = min(keys.measure_s, reading)
    taken = {"measure_s": measure, "settle_s": reading - measure}
    taken |= {} if usual is None else {"line_change_min": usual / MINUTE}
    taken |= {} if scale is None else {"scale_line_change_min": scale / MINUTE}
    return MeasuredTimes(
        raw,
        reading,
        len(on_line),
        usual,
        len(changes[False]),
        scale,
        len(changes[True]),
        keys.model_copy(update={name: float(f"{value:.3g}") for name, value in taken.items()}),
    )


def key_rows(found: MeasuredTimes) -> Iterator[str]:
    """What was measured, and the keys to write into the scenario."""
    yield f"times of {found.path}, to be written into the scenario (medians of {found.readings} readings in a row on a"
    yield f"line, and of {found.line_changes} set-ups of lines and {found.scale_line_changes} of scale lines):"
    yield "  [plan_by_time]"
    yield f"  settle_s = {found.keys.settle_s!r}"
    yield f"  measure_s = {found.keys.measure_s!r}"
    if found.line_change is not None:
        yield f"  line_change_min = {found.keys.line_change_min!r}"
    if found.scale_line_change is not None:
        yield f"  scale_line_change_min = {found.keys.scale_line_change_min!r}"
