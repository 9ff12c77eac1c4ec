"""The measuring program of a scenario's plan: G-code that moves the axes and requests the readings.

The program contains the numbers of every point, in the order of order_of_run.py. docs/measuring.md
explains how to run it.
"""

from dataclasses import dataclass, field

import numpy as np

from stepdiag.planning.measuring_time import Times, times_of
from stepdiag.program.approach import approaches, otherwise
from stepdiag.program.blocks import Body, header, modes
from stepdiag.program.gcode import Writer
from stepdiag.program.options import Options, space_of, trigger_of, writer_of
from stepdiag.program.path import Action, Feed, Rapid, Read, SetUp, Space, actions_of
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.units import MINUTE


@dataclass(frozen=True)
class Program:
    """The text of a program, and notes about it."""

    text: str
    readings: int
    seconds: float
    set_up_seconds: float
    rounding: float  # mm, largest
    unapproached: list[str] = field(default_factory=list)  # which points axes do not come to as the plan says

    @property
    def summary(self) -> list[str]:
        """Notes for a terminal and for the program's header."""
        lines = [
            f"{self.readings} readings, about {_minutes(self.seconds)}, "
            f"of these {_minutes(self.set_up_seconds)} for set-ups"
        ]
        if self.rounding > 0.0:
            lines.append(f"positions are rounded, by up to {self.rounding * 1e6:.2g} nm")
        return lines


def measuring_program(known: Known, options: Options) -> Program:
    """The program for a scenario's plan, with feed and times of [plan_by_time].

    Raises InvalidArgument if an option does not suit, or a move would leave the limits."""
    times = times_of(known.keys.plan_by_time, f"{known.path}: plan_by_time")
    writer, trigger = writer_of(options), trigger_of(options)
    space = space_of(known, options)
    visits = list(visits_of(known))
    actions = list(actions_of(visits, space, align=options.align and options.stops))
    unlike = otherwise(approaches(actions, writer), space.overrun, writer)
    seconds, set_up_seconds = _duration(actions, space, times, stops=options.stops)
    program = Program(
        text="",
        readings=sum(len(visit.points) for visit in visits),
        seconds=seconds,
        set_up_seconds=set_up_seconds,
        rounding=_rounding(actions, writer),
        unapproached=[
            f"visit {visit.number}, line {visit.line}: {unlike[visit.number]}"
            for visit in visits
            if visit.number in unlike
        ],
    )
    body = Body(known, options, writer, trigger, times, space, unlike)
    lines: list[str] = []
    for text in [*header(known, options, space, times, visits), *program.summary, *program.unapproached]:
        lines += writer.comment(text)
    lines += modes(writer, trigger, options, times.feed)
    for action in actions:
        lines += body.lines(action)
    lines = writer.whole(lines, line_numbers=options.line_numbers)
    return Program(
        "\n".join(lines) + "\n", *(getattr(program, name) for name in list(program.__dataclass_fields__)[1:])
    )


def _rounding(actions: list[Action], writer: Writer) -> float:
    """Largest difference between the written positions of points and the plan's, mm."""
    positions = np.array([action.position for action in actions if isinstance(action, Feed)])
    written = np.array([float(writer.number(value)) for value in positions.ravel()]).reshape(positions.shape)
    return float(np.max(np.abs(written - positions)))


def _duration(actions: list[Action], space: Space, times: Times, *, stops: bool) -> tuple[float, float]:
    """Total time and time for set-ups, s; all moves at the feed."""
    place, seconds, set_ups = space.safe.copy(), 0.0, 0.0
    for action in actions:
        if isinstance(action, Rapid | Feed):
            there = place.copy()
            if isinstance(action, Rapid):
                there[action.axis] = action.position
            else:
                there = action.position
            seconds += float(times.move(np.asarray(np.linalg.norm(there - place))))
            place = there
        elif isinstance(action, Read):
            seconds += times.settle + times.measure
        elif isinstance(action, SetUp) and stops:
            set_ups += times.scale_line_change if action.visit.is_scale_line else times.line_change
    return seconds + set_ups, set_ups


def _minutes(seconds: float) -> str:
    minutes = round(seconds / MINUTE)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{seconds / MINUTE:.1f} min"
