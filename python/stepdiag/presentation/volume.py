"""What `stepdiag volume` tells: the verdict, how large the error of the tool is and where, and what causes it."""

import math
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from stepdiag._core import Calibration, Machine
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.calibration.volume import MOST_NODES, Interval, VolumeContribution, VolumeErrors, VolumeFigure
from stepdiag.findings.meaning import headline, is_valid
from stepdiag.findings.temperature import temperature_rows
from stepdiag.units import report_value

_RANKED: Final = 5  # parameters in the report; the JSON object has all


def volume_report(found: VolumeErrors) -> Iterator[str]:
    """Verdicts on machine and calibration; then largest error, rms, ranges, tilts, diagonals, what causes them,
    and what they refer to."""
    yield from _verdict_rows(found)
    if not math.isnan(found.largest):
        place = ", ".join(f"{axis} {p:g}" for axis, p in zip("XYZ", found.largest_at, strict=True))
        components = zip("XYZ", found.largest_components, strict=True)
        parts = ", ".join(f"{axis} {_um(e)}" for axis, e in components)
        yield f"largest error {_um(found.largest)}{_ends(found.largest_interval, 'mm')} µm"
        yield f"  at {place} mm: {parts} µm"
        yield f"rms error     {_um(found.rms)}{_ends(found.rms_interval, 'mm')} µm"
    yield from _named("ranges", found.ranges, "mm")
    yield from _named("tilts up to", found.tilts, "rad")
    yield from _named("diagonals", found.diagonals, "mm")
    yield from _ranking_rows(found.ranking)
    yield from _frame_rows(found)


def _verdict_rows(found: VolumeErrors) -> Iterator[str]:
    source = found.source
    is_first = not isinstance(source, Calibration) or not is_valid(source)
    of_calibration = f"fit: {found.fit or 'not known'}"
    if isinstance(source, Calibration):
        of_calibration = f"{headline(source, 'calibration')} ({of_calibration})"
    if is_first:
        yield of_calibration
    for names, parts in _by_missing(found.missing):
        yield f"not determined: {', '.join(parts)}; no figures that need {names}"
    if found.limit is None:
        if not is_first:
            yield of_calibration
        return
    limit = f"{found.limit * 1e3:g} µm"
    if found.verdict is None:
        yield f"machine: no verdict on the limit of {limit}: {found.no_verdict_because}"
        return
    assert found.bounds is not None
    above, below = (f"{1e3 * end:.4g} µm" for end in found.bounds)
    yield {
        "within": f"machine: within {limit}: the largest error is below {below} (95 %)",
        "not within": f"machine: not within {limit}: the largest error is above {above} (95 %)",
        "undecided": f"machine: undecided at {limit}: the largest error is above {above}, below {below} (95 % each)",
    }[found.verdict]
    if found.interval_note:
        yield f"  {found.interval_note}"
    if not is_first:
        yield of_calibration


def _by_missing(missing: Mapping[str, tuple[str, ...]]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Components with the same missing parameters, together."""
    for parts in dict.fromkeys(missing.values()):
        yield ", ".join(name for name, own in missing.items() if own == parts), parts


def _named(title: str, figures: Mapping[str, VolumeFigure], unit: str) -> Iterator[str]:
    """Figures with their intervals, two or three a line."""
    cells = [
        f"{name} {_value(figure.value, unit)}{_ends(figure.interval, unit)}"
        for name, figure in figures.items()
        if not math.isnan(figure.value)
    ]
    name = report_value(unit, 0.0)[1]
    for k in range(0, len(cells), 3):
        last = f" {name}" if k + 3 >= len(cells) else ","
        yield f"{title if k == 0 else '':<14}{', '.join(cells[k : k + 3])}{last}"


def _ranking_rows(ranking: tuple[VolumeContribution, ...]) -> Iterator[str]:
    axes = [one for one in ranking if len(one.name) == 1]
    for title, members in (
        ("one axis", axes),
        ("one parameter", [one for one in ranking if one not in axes][:_RANKED]),
    ):
        if members:
            cells = ", ".join(f"{one.name} {_um(one.largest)}" for one in members)
            yield f"largest without {title}: {cells} µm"


def _frame_rows(found: VolumeErrors) -> Iterator[str]:
    shape = " x ".join(str(n) for n in found.shape)
    low, high = (_lengths(corner) for corner in found.box)
    yield f"box {low} to {high} mm, tool offset {_lengths(found.tool)} mm, {shape} positions, approached in +"
    if not found.every_node:
        yield f"the tables have more than {MOST_NODES} nodes an axis: {MOST_NODES} of them, evenly"
    yield from _reversal_rows(found)
    if found.largest_interval is not None:
        kind = "estimated from the tables" if found.between_nodes_estimated else "stated"
        yield f"95 % intervals in brackets; between nodes ({kind}): standard uncertainty {_um(found.between_nodes)} µm"
    elif isinstance(found.source, Calibration) and found.source.covariance is None:
        yield "no intervals: the file has no covariance; evaluate writes it to netCDF (-o calibration.nc)"
    if isinstance(found.source, Calibration):
        yield from temperature_rows(found.source)
    yield "error: of the functional point, actual minus nominal; 0 at home, so it depends on that reference"


def _reversal_rows(found: VolumeErrors) -> Iterator[str]:
    source = found.source
    if isinstance(source, Machine) or not source.reversal:
        return
    if not found.other_approaches:
        yield "approached in other directions: not known, as not all reversal errors are"
        return
    worst = max(found.other_approaches, key=found.other_approaches.__getitem__)
    directions = " ".join(f"{axis}{sign}" for axis, sign in zip("XYZ", worst, strict=True))
    yield (
        f"approached in {directions}: largest error {_um(found.other_approaches[worst])} µm, the most of other "
        "directions;"
    )
    yield "  no interval: the covariance of reversal errors is not known; figures and verdict are of +"


def _um(value: float) -> str:
    return f"{value * 1e3:.4g}"


def _value(value: float, unit: str) -> str:
    return f"{report_value(unit, value)[0]:.4g}"


def _ends(interval: Interval | None, unit: str) -> str:
    return "" if interval is None else f" [{_value(interval[0], unit)}, {_value(interval[1], unit)}]"


def _lengths(values: FloatArray) -> str:
    return " ".join(f"{value:g}" for value in np.asarray(values))
