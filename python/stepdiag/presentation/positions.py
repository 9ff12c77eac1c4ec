"""Figures of ISO 230-2 and ISO 230-6 in blocks: of repeated readings, and predicted from a calibration."""

import textwrap
from collections.abc import Iterator, Mapping

import numpy as np

from stepdiag._core import Calibration
from stepdiag.findings.meaning import fit_words
from stepdiag.positions.evaluation import CYCLES_OF_THE_STANDARD, MeasuredPositions
from stepdiag.positions.figures import FIGURES, PositionFigure, symbol
from stepdiag.positions.prediction import PredictedPositions
from stepdiag.presentation.blocks import Block, HeadingBlock, NoteBlock, RowBlock, TableBlock
from stepdiag.presentation.fit import fit_blocks
from stepdiag.units import report_value

_DIRECTIONS = {"+": "↑", "-": "↓"}


def measured_warnings(result: MeasuredPositions) -> Iterator[str]:
    """Why figures of readings are less than those of the standard."""
    for target, direction, count in result.left_out:
        readings = f"{count} reading{'' if count == 1 else 's'}"
        yield f"target {target:g} mm {_DIRECTIONS[direction]} is left out: it has {readings}, two are needed"
    fewest = result.fewest_readings
    if fewest < CYCLES_OF_THE_STANDARD:
        yield f"{fewest} readings of a target, where the standard takes {CYCLES_OF_THE_STANDARD} cycles"


def measured_blocks(result: MeasuredPositions) -> Iterator[Block]:
    """What was read, what is short of the standard, the figures, and the targets one by one."""
    readings = result.readings
    yield from (RowBlock("incomplete", warning) for warning in measured_warnings(result))
    if readings.line:
        yield RowBlock("line", readings.line)
    arrows = " and ".join(_DIRECTIONS[direction] for direction in readings.directions)
    yield NoteBlock(
        f"{len(readings.targets)} targets from {readings.targets[0]:g} to {readings.targets[-1]:g} mm, "
        f"{len(readings.cycles)} cycles, {arrows}, {len(readings.deviations)} readings, {readings.lost} lost"
        + (f", set-points up to {readings.apart * 1e3:.2g} µm from their target" if readings.apart else "")
    )
    yield HeadingBlock("figures")
    rows = (
        (symbol(name), _micrometres(figure.value), _u(figure), _places(figure), FIGURES[name])
        for name, figure in result.figures.items()
    )
    yield TableBlock(tuple(rows), ("", "µm", "u, µm", "at mm", ""), left=(0, 4))
    if len(readings.directions) == 1:
        yield NoteBlock(f"readings of {arrows} alone: no reversal error, no bidirectional figures")
    yield NoteBlock("u: from the scatter of the readings alone, cycles taken as independent; instrument, alignment and")
    yield NoteBlock("temperature are not in it")
    yield HeadingBlock("targets")
    columns = ("target", "mean ↑", "s ↑", "n ↑", "mean ↓", "s ↓", "n ↓", "B", "R")
    yield TableBlock(tuple(_targets(result)), columns, left=())
    yield NoteBlock("in mm and µm; s: sample standard deviation of n readings")


def _targets(result: MeasuredPositions) -> Iterator[tuple[str, ...]]:
    up, down = ({scatter.target: scatter for scatter in side} for side in (result.up, result.down))
    for target in result.readings.targets:
        cells = [f"{target:g}"]
        for side in (up, down):
            scatter = side.get(target)
            if scatter is None:
                cells += ["-", "-", "-"]
            else:
                cells += [_micrometres(scatter.mean), _micrometres(scatter.deviation), str(scatter.count)]
        yield (*cells, *(_micrometres(own.get(target)) for own in (result.reversal, result.repeatability)))


def predicted_blocks(calibration: Calibration, lines: Mapping[str, PredictedPositions]) -> Iterator[Block]:
    """Verdict of the fit, then the figures of one line in full, or a row for each of several lines."""
    yield from fit_blocks(fit_words(calibration))
    first = next(iter(lines.values()))
    yield NoteBlock(f"tool offset {_point(first.tool)} mm; systematic part alone: no scatter of positions is in it")
    if len(lines) == 1:
        yield from _one_line(*next(iter(lines.items())))
    else:
        yield from _several_lines(lines)
    reasons = dict.fromkeys(reason for line in lines.values() for reason in line.reasons)
    for reason in reasons:
        of = [name for name, line in lines.items() if reason in line.reasons]
        yield from _wrapped(reason if len(of) == len(lines) else f"{', '.join(of)}: {reason}")
    figures = [figure for line in lines.values() for figure in line.figures.items()]
    if any(figure.interval is not None and name == "E_up" for name, figure in figures):
        yield RowBlock("interval of E↑", "95 %, from the covariance of the calibration")
    if len(lines) == 1 and any(figure.interval is not None and name == "B" for name, figure in figures):
        yield RowBlock("interval of B", "95 %, from uncertainties of reversal errors; functions taken as independent")
    yield NoteBlock("errors between the nodes of the calibration are in no interval")


def _wrapped(text: str) -> Iterator[NoteBlock]:
    yield from map(NoteBlock, textwrap.wrap(text, 100, subsequent_indent="  "))


def _one_line(name: str, line: PredictedPositions) -> Iterator[Block]:
    yield HeadingBlock(f"{name}: {_ends(line)}, {len(line.target)} targets")
    rows = [
        (symbol(figure), _micrometres(value.value), _interval(value), _places(value), FIGURES[figure])
        for figure, value in line.figures.items()
    ]
    yield TableBlock(tuple(rows), ("", "µm", "95 %", "at mm", ""), left=(0, 4))


def _several_lines(lines: Mapping[str, PredictedPositions]) -> Iterator[Block]:
    names = ("E_up", "E_down", "E", "M", "B")
    shown = [name for name in names if name == "E_up" or any(name in line.figures for line in lines.values())]
    rows = []
    for name, line in lines.items():
        cells = [_micrometres(line.figures[figure].value) if figure in line.figures else "-" for figure in shown]
        interval = _interval(line.figures["E_up"]) if "E_up" in line.figures else "-"
        rows.append((name, _point(line.start), _point(line.end), cells[0], interval, *cells[1:]))
    yield HeadingBlock("lines")
    columns = ("µm", "from", "to", "E↑", "95 %", *(symbol(name) for name in shown[1:]))
    yield TableBlock(tuple(rows), columns, left=(0, 1, 2))


def _ends(line: PredictedPositions) -> str:
    return f"from {_point(line.start)} to {_point(line.end)} mm"


def _point(point: tuple[float, float, float]) -> str:
    return " ".join(f"{value:g}" for value in point)


def _micrometres(value: float | None) -> str:
    return "-" if value is None or np.isnan(value) else f"{report_value('mm', value)[0]:.4g}"


def _u(figure: PositionFigure) -> str:
    return "-" if figure.standard_uncertainty is None else f"{report_value('mm', figure.standard_uncertainty)[0]:.2g}"


def _interval(figure: PositionFigure) -> str:
    return "-" if figure.interval is None else " to ".join(_micrometres(end) for end in figure.interval)


def _places(figure: PositionFigure) -> str:
    return ", ".join(f"{place:g}" for place in figure.at) or "-"
