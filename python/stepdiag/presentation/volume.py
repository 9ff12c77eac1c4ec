"""What is said of the error in the volume: the verdict, how large it is and where, and what causes it."""

import math
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from stepdiag._core import Calibration, Machine
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.calibration.volume import (
    MOST_NODES,
    Interval,
    PlaneErrors,
    VolumeContribution,
    VolumeErrors,
    VolumeFigure,
)
from stepdiag.findings.meaning import fit_word, headline, is_valid
from stepdiag.findings.temperature import temperature_text
from stepdiag.presentation.blocks import Block, NoteBlock, RowBlock, TableBlock, VerdictBlock
from stepdiag.units import report_value

_RANKED: Final = 5  # parameters in the report; the JSON object has all


def volume_blocks(found: VolumeErrors) -> Iterator[Block]:
    """Verdicts on machine and calibration; then largest error, rms, ranges, tilts, diagonals, what causes them,
    and what they refer to."""
    yield from verdicts(found)
    if not math.isnan(found.largest):
        components = zip("XYZ", found.largest_components, strict=True)
        parts = ", ".join(f"{axis} {_um(e)}" for axis, e in components)
        yield RowBlock("largest error", f"{length_text(found.largest, found.largest_interval)}")
        yield NoteBlock(f"at {place_of_largest(found)}: {parts} µm", indented=True)
        yield RowBlock("rms error", length_text(found.rms, found.rms_interval))
    if found.plane is not None:
        yield from _plane(found.plane)
    yield figure_table(found)
    yield from _ranking(found.ranking)
    yield from frame_notes(found)


def verdicts(found: VolumeErrors) -> Iterator[Block]:
    """Of the machine against its limit, and of the calibration: first what warns."""
    source = found.source
    is_warning = not isinstance(source, Calibration) or not is_valid(source)
    if is_warning:
        yield _of_calibration(found)
    for names, parts in _by_missing(found.missing):
        yield RowBlock("not determined", f"{', '.join(parts)}; no figures that need {names}")
    verdict = limit_verdict(found)
    if verdict is not None:
        yield verdict
        if found.verdict is not None and found.interval_note:
            yield NoteBlock(found.interval_note, indented=True)
    if not is_warning:
        yield _of_calibration(found)


def _plane(plane: PlaneErrors) -> Iterator[Block]:
    """Of a machine of two axes."""
    yield RowBlock("plane", f"{' and '.join(plane.axes)}; {plane.unmeasured} was not measured, and stands at home")
    u = (
        ""
        if plane.largest_uncertainty is None
        else f", standard uncertainty at most {_um(plane.largest_uncertainty)} µm"
    )
    yield RowBlock("largest error in the plane", f"{_um(plane.largest)} µm{u}")
    at = ", ".join(f"{axis} {p:g}" for axis, p in zip("XYZ", plane.largest_at, strict=True) if axis in plane.axes)
    parts = ", ".join(f"{axis} {_um(e)}" for axis, e in zip(plane.axes, plane.largest_components, strict=True))
    yield NoteBlock(f"at {at} mm: {parts} µm", indented=True)
    yield RowBlock("rms error in the plane", f"{_um(plane.rms)} µm")


def _of_calibration(found: VolumeErrors) -> VerdictBlock:
    if isinstance(found.source, Calibration):
        words = headline(found.source, "").strip()
        return VerdictBlock(
            "calibration", found.source.fit or "not known", f"{words} (fit: {found.fit or 'not known'})"
        )
    return VerdictBlock("fit", found.fit or "not known", fit_word(found.fit or "not known"))


def limit_verdict(found: VolumeErrors) -> VerdictBlock | None:
    """Of the machine against the limit that was given; None without one."""
    if found.limit is None:
        return None
    limit = f"{found.limit * 1e3:g} µm"
    if found.verdict is None or found.bounds is None:
        return VerdictBlock("machine", "none", f"no verdict on the limit of {limit}", found.no_verdict_because)
    above, below = (f"{1e3 * end:.4g} µm" for end in found.bounds)
    headline, why = {
        "within": (f"within {limit}", f"the largest error is below {below} (95 %)"),
        "not within": (f"not within {limit}", f"the largest error is above {above} (95 %)"),
        "undecided": (f"undecided at {limit}", f"the largest error is above {above}, below {below} (95 % each)"),
    }[found.verdict]
    return VerdictBlock("machine", found.verdict, headline, why)


def place_of_largest(found: VolumeErrors) -> str:
    """The commanded position of the largest error."""
    return ", ".join(f"{axis} {p:g}" for axis, p in zip("XYZ", found.largest_at, strict=True)) + " mm"


def why_not_known(found: VolumeErrors) -> str:
    """Which parameters are missing for the error in the volume; without a full stop."""
    names = dict.fromkeys(name for axis in "XYZ" for name in found.missing.get(axis, ()))
    return f"not known, because it needs parameters that are not determined: {', '.join(names)}"


def _by_missing(missing: Mapping[str, tuple[str, ...]]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Components with the same missing parameters, together."""
    for parts in dict.fromkeys(missing.values()):
        yield ", ".join(name for name, own in missing.items() if own == parts), parts


def figure_table(found: VolumeErrors) -> TableBlock:
    """Ranges, tilts and diagonals, with their 95 % intervals in brackets, three a row."""
    rows = []
    for label, figures, unit in (
        ("ranges", found.ranges, "mm"),
        ("tilts up to", found.tilts, "rad"),
        ("diagonals", found.diagonals, "mm"),
    ):
        cells = [_cell(name, figure, unit) for name, figure in figures.items() if not math.isnan(figure.value)]
        for k in range(0, len(cells), 3):
            three = [*cells[k : k + 3], "", ""][:3]
            rows.append((label if k == 0 else "", *three, report_value(unit, 0.0)[1]))
    return TableBlock(tuple(rows), left=(0, 1, 2, 3, 4))


def _cell(name: str, figure: VolumeFigure, unit: str) -> str:
    ends = "" if figure.interval is None else f" [{', '.join(_value(end, unit) for end in figure.interval)}]"
    return f"{name} {_value(figure.value, unit)}{ends}"


def _ranking(ranking: tuple[VolumeContribution, ...]) -> Iterator[Block]:
    axes = [one for one in ranking if len(one.name) == 1]
    for title, members in (
        ("one axis", axes),
        ("one parameter", [one for one in ranking if one not in axes][:_RANKED]),
    ):
        if members:
            yield RowBlock(
                f"largest without {title}", f"{', '.join(f'{one.name} {_um(one.largest)}' for one in members)} µm"
            )


def frame_notes(found: VolumeErrors) -> Iterator[Block]:
    """What the figures refer to, and what is in their intervals."""
    shape = " x ".join(str(n) for n in found.shape)
    low, high = (_lengths(corner) for corner in found.box)
    yield RowBlock(
        "box",
        f"{low} to {high} mm, tool offset {_lengths(found.tool)} mm, {shape} positions, approached in + direction",
    )
    if not found.every_node:
        yield NoteBlock(f"the tables have more than {MOST_NODES} nodes an axis: {MOST_NODES} of them, evenly")
    yield from _reversal(found)
    if found.largest_interval is not None:
        kind = "estimated from the tables" if found.between_nodes_estimated else "stated"
        yield RowBlock(
            "between nodes", f"standard uncertainty {_um(found.between_nodes)} µm ({kind}), in the 95 % intervals"
        )
    elif isinstance(found.source, Calibration) and found.source.covariance is None:
        yield RowBlock(
            "intervals", "none: the file has no covariance; evaluate writes it to netCDF (-o calibration.nc)"
        )
    if isinstance(found.source, Calibration):
        yield RowBlock("temperature", temperature_text(found.source))
    yield RowBlock("error", "of the functional point, actual minus nominal; 0 at home, so it depends on that reference")


def _reversal(found: VolumeErrors) -> Iterator[Block]:
    source = found.source
    if isinstance(source, Machine) or not source.reversal:
        return
    if not found.other_approaches:
        yield RowBlock("other directions of approach", "not known, as not all reversal errors are")
        return
    worst = max(found.other_approaches, key=found.other_approaches.__getitem__)
    directions = " ".join(f"{axis}{sign}" for axis, sign in zip("XYZ", worst, strict=True))
    yield RowBlock(
        "other directions of approach",
        f"approached in {directions}, the largest error is {_um(found.other_approaches[worst])} µm; it has no "
        "interval, because the covariance of reversal errors is not known",
    )


def length_text(value: float, interval: Interval | None = None) -> str:
    """A length of mm in µm, with its 95 % interval where there is one."""
    ends = "" if interval is None else f" (95 %: {_um(interval[0])} to {_um(interval[1])} µm)"
    return f"{_um(value)} µm{ends}"


def _um(value: float) -> str:
    return _value(value, "mm")


def _value(value: float, unit: str) -> str:
    return f"{report_value(unit, value)[0]:.4g}"


def _lengths(values: FloatArray) -> str:
    return " ".join(f"{value:g}" for value in np.asarray(values))
