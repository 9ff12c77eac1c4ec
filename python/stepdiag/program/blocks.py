"""The blocks of a measuring program: its header, and the lines for each action."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from stepdiag._core import __version__
from stepdiag.display import scale_lines_text
from stepdiag.planning.measuring_time import Times
from stepdiag.program.gcode import HANDSHAKE, PULSE, Trigger, Writer
from stepdiag.program.options import Options, writer_of
from stepdiag.program.path import AXES, Action, Align, Begin, Feed, Rapid, Read, SetUp, Space, Vector
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit
from stepdiag.units import MINUTE


def header(known: Known, options: Options, space: Space, times: Times, visits: list[Visit]) -> Iterator[str]:
    plan, keys = known.plan, known.keys
    scale = f", scale lines {scale_lines_text(plan)}" if plan.scale_lines else ""
    runs = 1 + max(visit.run for visit in visits)
    step = plan.volume / plan.steps
    yield f"Measuring program of {known.path.name}, by stepdiag {__version__}"
    yield f"volume {_triple(plan.volume)} mm, chain {keys.machine.chain}, tool {_triple(known.tool)} mm"
    yield (
        f"lines {' '.join(plan.lines)}{scale}; {plan.steps} steps an axis of {_triple(step)} mm, "
        f"order {' '.join(dict.fromkeys(plan.orders))}{f', in blocks of {plan.block}' if plan.block > 1 else ''}"
    )
    backward = ", forward and backward in turn" if keys.plan.backward else ""
    yield f"each line measured {f'{runs} times' if runs > 1 else 'once'}{backward}"
    yield f"home, where all positions are 0, is at {_triple(space.origin)} {_meaning(options)}"
    yield f"safe position {_triple(space.safe)}: one axis at a time to it, in the order {' '.join(space.retreat)}"
    if space.overrun > 0.0:
        shortened = ", as far as the limits allow" if options.limits is not None else ""
        yield f"overrun {space.overrun:g} mm before the first point of every visit, around the volume too{shortened}"
    else:
        yield "no overrun: the axes come to the first point of a visit from where they were"
    yield f"feed {times.feed * MINUTE:g} mm/min, settling {times.settle:g} s, a reading {times.measure:g} s"
    yield "heads stand outside the volume; nothing else is within it and the overrun around it"


def _meaning(options: Options) -> str:
    coordinates = writer_of(options).coordinates
    if options.dialect == "heidenhain":
        return "of the machine's coordinates, M91" if coordinates == "G53" else "of the active preset"
    return "of the machine's coordinates, G53" if coordinates == "G53" else f"of the work offset {coordinates}"


def modes(writer: Writer, trigger: Trigger, options: Options, feed: float) -> list[str]:
    lines = [
        *writer.modes(feed * MINUTE),
        *writer.comment("the mirror is where a tool would be: no spindle, no coolant"),
        "M5",
        "M9",
    ]
    if trigger == "handshake":
        lines += [line.format(timeout=f"{options.timeout:g}") for line in HANDSHAKE]
    return lines


@dataclass(frozen=True)
class Body:
    """Lines for actions."""

    known: Known
    options: Options
    writer: Writer
    trigger: Trigger
    times: Times
    space: Space
    unlike: Mapping[int, str]  # by visit: points that axes do not come to as it says

    def lines(self, action: Action) -> list[str]:
        writer = self.writer
        match action:
            case SetUp(visit):
                return ["", *self._set_up(visit)]
            case Align(visit):
                return writer.stop(f"line {visit.line}: align head and mirror here, then cycle start measures")
            case Begin(visit):
                sides = " ".join(
                    f"{name}{'+' if way > 0 else '-'}" for name, way in zip(AXES, visit.approach, strict=True)
                )
                unlike = self.unlike.get(visit.number)
                return writer.comment(
                    f"visit {visit.number}: line {visit.line} run {visit.run} {visit.direction}, axes come in {sides}"
                    + (f", but {unlike}" if unlike else "")
                )
            case Rapid(axis, position):
                return [writer.move({AXES[axis]: position})]
            case Feed(position):
                words = dict(zip(AXES, map(float, position), strict=True))
                return [writer.move(words, self.times.feed * MINUTE)]
            case Read(visit, point):
                return self._read(visit, point)

    def _read(self, visit: Visit, point: int) -> list[str]:
        settle, measure = self.writer.dwell(self.times.settle), self.writer.dwell(self.times.measure)
        match self.trigger:
            case "handshake":
                return [*settle, f"o<reading> call [{visit.number}] [{point}]"]
            case "pulse":
                return [*settle, "M64 P0", *self.writer.dwell(PULSE), "M65 P0", *measure]
            case "code":
                return [*settle, self.options.trigger_code, *measure]
            case "dwell":
                return self.writer.dwell(self.times.settle + self.times.measure)

    def _set_up(self, visit: Visit) -> list[str]:
        """What to mount, and where.

        The beam starts before the first point, and the mirror faces it."""
        plan, writer = self.known.plan, self.writer
        head = self.known.heads[visit.line]
        towards = plan.frame(visit.line)[:, 2]
        first: Vector = visit.positions[0] + np.asarray(self.known.tool) + self.space.origin
        width, height = np.ptp(plan.lateral_excursion(visit.line), axis=0)
        count = len([*plan.lines, *plan.scale_lines])
        what = "scale line" if visit.is_scale_line else "line"
        details = [
            f"set-up {visit.set_up} of {count}: {what} {visit.line}, head {self._head(visit.line)}",
            f"beam from {_triple(np.round(first - head.standoff * towards, 3))}, {head.standoff:g} mm before "
            f"the mirror, direction {_triple(np.round(towards, 6))}; the mirror faces it",
            f"the steps lead the mirror {width:.4g} mm and {height:.4g} mm across the beam, in local x and y",
        ]
        stop = f"set-up {visit.set_up} of {count}: head and mirror for {what} {visit.line}, then cycle start"
        return [
            *(line for text in details for line in writer.comment(text)),
            *(writer.stop(stop) if self.options.stops else []),
        ]

    def _head(self, line: str) -> str:
        described = self.known.described_heads[line]
        _, dot, name = described.place.partition(".")
        return (f"{name}, " if dot else "") + str(described.keys.description or described.keys.layout)


def _triple(values: Vector | tuple[float, float, float]) -> str:
    return " ".join(f"{float(value) + 0.0:.9g}" for value in values)
