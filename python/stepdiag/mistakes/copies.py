"""Changed copies of a run and of the known half of its scenario, as the entries of the catalogue make them."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag.scenario.known import Known
from stepdiag.scenario.planned_readings import RECORDS, with_channels

Rows = npt.NDArray[np.int_]
Values = npt.NDArray[np.float64]
Fields = Mapping[str, Values]  # by channel


@dataclass(frozen=True)
class Copy:
    """What an adjustment is given: a run, and what is known of it."""

    known: Known
    run: _core.Measurement


Change = Callable[[Copy], Copy]


@dataclass(frozen=True)
class Hypothesis:
    """A mistake that may have been made: its sentence and an edit to offer, both without a full stop, and the change
    that undoes it.

    `free`: what chi-square falls by for nothing: numbers that were chosen for the fit, and the noise of readings that
    the change makes smaller. `last_resort`: says where, not what; named only
    where nothing else is."""

    entry: str  # name in the catalogue
    text: str
    edit: str
    change: Change
    free: float = 0.0
    last_resort: bool = False


@dataclass(frozen=True)
class Family:
    """Hypotheses by one number that the readings choose, 0 being no mistake.

    `near`: a change over which the fit changes as a parabola. `far`: where else the search begins if the run fits badly
    as it is. `limit`: of the number, either way. `fault`: the line of whose distances the adjustment itself looks for a
    factor."""

    make: Callable[[float], Hypothesis]
    near: float
    limit: float
    far: tuple[float, ...] = ()
    fault: str | None = None


def all_lines(known: Known) -> list[str]:
    return [*known.plan.lines, *known.plan.scale_lines]


def passes_of(run: _core.Measurement) -> dict[tuple[int, str], Rows]:
    """The rows of each line of each run, in the order in which they stand."""
    rows: dict[tuple[int, str], list[int]] = {}
    for row, key in enumerate(zip(run.run.tolist(), run.line, strict=True)):
        rows.setdefault(key, []).append(row)
    return {key: np.array(own) for key, own in rows.items()}


def of_rows(run: _core.Measurement, rows: Rows) -> _core.Measurement:
    """These rows of a run alone."""
    line, direction = run.line, run.direction
    return _core.Measurement(
        [line[row] for row in rows],
        run.point[rows].tolist(),
        run.position[rows],
        {name: values[rows] for name, values in run.channels.items()},
        run=run.run[rows].tolist(),
        direction=[direction[row] for row in rows],
        standard_uncertainty={name: values[rows] for name, values in run.standard_uncertainty.items()},
    )


def rows_of(run: _core.Measurement, lines: Iterable[str]) -> Rows:
    named = set(lines)
    return np.flatnonzero([line in named for line in run.line])


def tilts_of(known: Known) -> tuple[str, str] | None:
    """The two channels that tilts are read from; none of beams, which have neither."""
    for pair in (("alpha", "beta"), ("spot_x", "spot_y")):
        if set(pair) <= set(known.signals):
            return pair
    return None


def distances_of(known: Known) -> list[str]:
    """The channels that are lengths of beams."""
    return [name for name in known.signals if name.startswith("d")]


def scaled(channels: Sequence[str], factor: float, lines: Sequence[str] | None = None) -> Change:
    """These channels times a factor, on these lines or on all."""

    def change(copy: Copy) -> Copy:
        run = copy.run
        factors = np.ones(len(run))
        factors[rows_of(run, lines) if lines is not None else slice(None)] = factor
        stated = run.standard_uncertainty
        return replace(
            copy,
            run=with_channels(
                run,
                {name: run.channels[name] * factors for name in channels},
                {name: stated[name] * np.abs(factors) for name in channels if name in stated},
            ),
        )

    return change


def permuted(order: Mapping[str, str], lines: Sequence[str] | None = None) -> Change:
    """Each channel takes the readings of another one, on these lines or on all."""

    def change(copy: Copy) -> Copy:
        run = copy.run
        rows = rows_of(run, lines) if lines is not None else np.arange(len(run))

        def taken(fields: Fields) -> dict[str, Values]:
            result = {to: fields[to].copy() for to in order if to in fields}
            for to, source in order.items():
                if to in fields and source in fields:
                    result[to][rows] = fields[source][rows]
            return result

        return replace(copy, run=with_channels(run, taken(run.channels), taken(run.standard_uncertainty)))

    return change


def moved_rows(source: Rows) -> Change:
    """Each row takes the readings of another one; -1: of none."""

    def change(copy: Copy) -> Copy:
        run = copy.run

        def taken(fields: Fields) -> dict[str, Values]:
            # Times, temperatures and air stay: they belong to the order of the rows.
            return {
                name: np.where(source >= 0, values[source], np.nan) if name not in RECORDS else values
                for name, values in fields.items()
            }

        return replace(copy, run=with_channels(run, taken(run.channels), taken(run.standard_uncertainty)))

    return change


def without(rows: Rows, channels: Sequence[str]) -> Change:
    """These readings are lost."""

    def change(copy: Copy) -> Copy:
        emptied = {}
        for name in channels:
            emptied[name] = copy.run.channels[name].copy()
            emptied[name][rows] = np.nan
        return replace(copy, run=with_channels(copy.run, emptied))

    return change


def in_turn(first: Change, second: Change) -> Change:
    return lambda copy: second(first(copy))


def with_plan(
    *,
    volume: Sequence[float] | None = None,
    order: Sequence[str] | None = None,
    names: Mapping[str, str] | None = None,
) -> Change:
    """Another plan, in which each point of the run has its number still: of another volume, with other orders of steps,
    or lines by other names."""
    renamed = names or {}

    def change(copy: Copy) -> Copy:
        known, run = copy.known, copy.run
        old = known.plan
        plan = _core.Plan(
            old.volume if volume is None else volume,
            [renamed.get(line, line) for line in old.lines],
            old.steps,
            order=old.orders if order is None else list(order),
            scale_lines=[renamed.get(line, line) for line in old.scale_lines],
            check_points=old.check_points,
            scale_points=old.scale_points,
            block=old.block,
        )
        lines = [renamed.get(line, line) for line in run.line]
        position = np.array(run.position)
        for (number, line), rows in passes_of(run).items():
            position[rows] = plan.points(renamed.get(line, line), number)[run.point[rows]]
        moved = _core.Measurement(
            lines,
            run.point.tolist(),
            position,
            dict(run.channels),
            run=run.run.tolist(),
            direction=run.direction,
            standard_uncertainty=run.standard_uncertainty,
        )
        return Copy(
            replace(
                known,
                plan=plan,
                heads={renamed.get(line, line): head for line, head in known.heads.items()},
                setup_by_line={renamed.get(line, line): own for line, own in known.setup_by_line.items()},
            ),
            moved,
        )

    return change


def with_heads(make: Callable[[_core.Head], _core.Head], lines: Sequence[str] | None = None) -> Change:
    """Other heads, on these lines or on all; one object for each."""

    def change(copy: Copy) -> Copy:
        made: dict[int, _core.Head] = {}
        heads = dict(copy.known.heads)
        for line, head in heads.items():
            if lines is None or line in lines:
                heads[line] = made.setdefault(id(head), make(head))
        return replace(copy, known=replace(copy.known, heads=heads))

    return change


def head_like(head: _core.Head, *, psd_distance: float | None = None, beam_offsets: Values | None = None) -> _core.Head:
    """A head of a layout with another place of its detector, or other beams."""
    return _core.Head(
        head.layout,
        standoff=head.standoff,
        psd_distance=head.psd_distance if psd_distance is None else psd_distance,
        beam_offsets=list(head.beam_offsets if beam_offsets is None else beam_offsets),
        wavelength=head.wavelength,
        aperture=head.aperture,
        mirror=head.mirror,
    )


def places(known: Known, *, scale_lines: bool = False) -> Iterator[tuple[list[str] | None, str]]:
    """All lines together, then each; with the words that follow what is wrong there. Of tilts scale lines are no
    place: they act at second order only there, so that nothing shows them."""
    yield None, "on all lines"
    for line in all_lines(known) if scale_lines else known.plan.lines:
        yield [line], f"on line {line}"
