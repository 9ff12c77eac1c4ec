"""The loop of an acquisition over visits and points."""

from collections import deque
from collections.abc import Callable, Iterator
from datetime import UTC, datetime

import numpy as np

from stepdiag._core import InvalidArgument, __version__
from stepdiag.acquisition.conductor import Conductor, Wanted
from stepdiag.acquisition.cross import cross_of
from stepdiag.acquisition.options import AcquireOptions, Resume
from stepdiag.acquisition.placement import placement
from stepdiag.acquisition.point_check import PointCheck
from stepdiag.acquisition.raw_file import RawContent, RawFile
from stepdiag.acquisition.raw_records import Again, Header, RawReading, Record, Remark, Session, TemperatureRow, Value
from stepdiag.acquisition.run_from_raw import clock_remark
from stepdiag.acquisition.settling import Reading, take_reading
from stepdiag.acquisition.temperature_file import TemperatureFile
from stepdiag.acquisition.triggers import Context, Missed, Trigger, point_text
from stepdiag.instruments.instrument import Instrument, Row, mean_distance
from stepdiag.mistakes.nominal_way import Way, line_remark
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit, visits_of


class Acquisition:
    """State of an acquisition.

    `done`: readings by (visit, point), in order of acquisition. `recorded`: rows of temperatures."""

    def __init__(
        self,
        known: Known,
        header: Header,
        file: RawFile,
        instrument: Instrument,
        trigger: Trigger,
        conductor: Conductor,
        options: AcquireOptions,
        temperatures: TemperatureFile | None = None,
    ) -> None:
        self._known, self._header, self._options = known, header, options
        self._file, self._instrument = file, instrument
        self._trigger, self._operator = trigger, conductor
        conductor.remark = self._remember
        self._temperatures = temperatures
        self._visits = list(visits_of(known))
        self._set_up = 0  # the last set-up for which the instrument was ready
        self._visit = 0  # visit of the last reading
        self._check = PointCheck(known, instrument.columns, header.sign)
        self._lost_points: set[tuple[int, int]] = set()
        self._once_more: set[tuple[int, int]] = set()  # readings that are read again
        self.done: dict[tuple[int, int], RawReading] = {}
        self.recorded: list[TemperatureRow] = []

    def go_on(self, content: RawContent, resume: Resume) -> None:
        """Continue a raw file, except its last line or set-up if that is read again."""
        if content.torn is not None:
            self._operator.tell(content.torn)
        self.done = content.readings()
        self._lost_points = {key for key, reading in self.done.items() if reading.is_lost}
        self.recorded = [record for record in content.records if isinstance(record, TemperatureRow)]
        if self._temperatures is not None:
            self._temperatures.leave_out(self.recorded)
        elif self.recorded:
            self._operator.tell(
                "warning: the readings so far have temperatures; without `temperatures` others have none"
            )
        if resume != "point" and self.done:
            self._leave_out(resume)

    def _leave_out(self, resume: Resume) -> None:
        """The last line or set-up counts no more."""
        last, _ = next(reversed(self.done))
        set_up = self._visits[last - 1].set_up
        first = last if resume == "line" else min(visit.number for visit in self._visits if visit.set_up == set_up)
        self._file.append([Again(time=datetime.now(UTC), visit=first)])
        self.done = {key: reading for key, reading in self.done.items() if key[0] < first}
        self._lost_points &= self.done.keys()
        self._once_more.clear()

    def run(self, source: str, write: Callable[[], None]) -> None:
        """Read the remaining points. Calls `write` after every visit."""
        for number, point in self.done:  # what a set-up that is taken up again is compared with
            visit = self._visits[number - 1]
            self._check.look(visit, visit.points.tolist().index(point), tuple(self.done[number, point].read))
        remaining = deque(self._remaining())
        if not remaining:
            self._operator.tell("all points of the plan have been read")
            return
        known = self._instrument.describe()
        visit, index = remaining[0]
        self._file.append([self._session(source, known, visit, index)])
        if self.done:
            self._operator.tell(f"continuing with {point_text(visit, index)}: move the machine there")
        options = self._options
        last = next(reversed(self.done), None)
        self._trigger.start(
            Context(
                self._operator.read,
                self._instrument.columns,
                options.settling,
                options.wait_timeout,
                options.sign,
                self._operator,
                last,
                self._operator.idle,
            )
        )
        begun = 0
        while remaining:
            visit, index = remaining[0]
            try:
                begun = self._read_next(visit, index, begun)
            except Wanted as wanted:
                if self._go_back(wanted.again):
                    begun = begun if wanted.again == "point" else 0
                    remaining = deque(self._remaining())
                continue
            remaining.popleft()
            if index + 1 == len(visit.points):
                if rows := self._new_temperatures():
                    self._file.append(rows)
                write()
                self._operator.tell(self._summary(visit))
                remark = self._remark(visit)
                if remark is not None:
                    self._operator.tell(f"warning: line {visit.line}: {remark}")

    def _read_next(self, visit: Visit, index: int, begun: int) -> int:
        """Returns the visit that is begun now; `begun`: that before."""
        nominal = self._header.plan[visit.number - 1].nominal_mm
        self._operator.at(visit, index, nominal[index])
        if visit.number != begun:
            head, frame = self._known.heads[visit.line], np.asarray(self._known.plan.frame(visit.line))
            columns, sign = self._instrument.columns, self._header.sign
            self._operator.cross = lambda sample: cross_of(head, frame, columns, sample.values, sign)
            self._instrument.use_line(visit.line)
            self._trigger.begin(visit, index, self._instruction(visit, begun))
        key = (visit.number, int(visit.points[index]))
        try:
            while not self._trigger.wait(visit, index, nominal):
                self._take(*self._last_taken(), once_more=True)
            self._take(visit, index, once_more=key in self._once_more)
        except Missed as missed:
            self._store(visit, index, self._lost(str(missed)), once_more=key in self._once_more)
        self._once_more.discard(key)
        return visit.number

    def _go_back(self, again: Resume) -> bool:
        """A person wants something once more. False: there is nothing, or it cannot be had."""
        if not self.done:
            self._operator.tell("nothing was read yet that could be read once more")
            return False
        try:
            self._trigger.go_back(whole_line=again != "point")
        except InvalidArgument as error:
            self._operator.tell(str(error))
            return False
        visit, index = self._last_taken()
        if again == "point":
            self._once_more.add((visit.number, int(visit.points[index])))
            self._operator.tell(f"once more: {point_text(visit, index)}")
            return True
        self._leave_out(again)
        self._visit = 0  # an instrument that goes to visits goes there again
        self._operator.tell(f"once more: {again} {visit.line if again == 'line' else visit.set_up}, from its beginning")
        return True

    def _remember(self, text: str) -> None:
        """A remark of a person, at the point that is read or waited for."""
        state = self._operator.state
        self._file.append([Remark(time=datetime.now(UTC), visit=state.visit, point=state.point, text=text)])

    def _remaining(self) -> Iterator[tuple[Visit, int]]:
        for visit in self._visits:
            for index, point in enumerate(visit.points):
                key = (visit.number, int(point))
                if key not in self.done or key in self._once_more:
                    yield visit, index

    def _instruction(self, visit: Visit, last: int) -> str:
        if last and self._visits[last - 1].set_up == visit.set_up:
            return f"set-up {visit.set_up} stays as it is: run {visit.run}, {visit.direction}"
        return placement(self._known, visit).words

    def _last_taken(self) -> tuple[Visit, int]:
        number, point = next(reversed(self.done))
        visit = self._visits[number - 1]
        return visit, visit.points.tolist().index(point)

    def _take(self, visit: Visit, index: int, *, once_more: bool = False) -> None:
        """Read a point, and again as long as the reading is odd and the trigger repeats it."""
        while True:
            row = self._store(visit, index, self._reading(visit, index), once_more=once_more)
            odd = self._check.look(visit, index, row)
            if odd is None or not self._trigger.repeats(f"{point_text(visit, index)}: {odd}"):
                break
            once_more = True
        self._trigger.stored(visit, index, row)

    def _lost(self, why: str) -> Reading:
        columns = self._instrument.columns
        return Reading(columns, lost=dict.fromkeys(range(len(columns)), why))

    def _reading(self, visit: Visit, index: int) -> Reading:
        if visit.number != self._visit:
            self._instrument.visit(visit.number, index, self._header.digest)
        self._visit = visit.number
        if visit.set_up != self._set_up:
            is_begun = any(self._visits[number - 1].set_up == visit.set_up for number, _ in self.done)
            self._instrument.make_ready(is_begun, self._operator.tell)
            self._set_up = visit.set_up
        columns = self._instrument.columns
        self._operator.doing("reads")
        reading = take_reading(self._operator.read, columns, self._options.settling)
        doubt = self._trigger.doubt(reading)
        if doubt is not None:
            reading.lost = dict.fromkeys(range(len(columns)), doubt)
        return reading

    def _store(self, visit: Visit, index: int, reading: Reading, *, once_more: bool = False) -> Row:
        """Write a reading. Returns what counts: where one more is lost, that is the earlier one."""
        *values, stored = _records(visit, index, reading, self._header.channels)
        values = [*self._new_temperatures(), *values]
        assert isinstance(stored, RawReading)
        if self._temperatures is not None:
            self._temperatures.warn_of_age(stored.time)
        self._tell_lost(visit, index, stored)
        key = (stored.visit, stored.point)
        before = next(reversed(self.done.values()), None)
        if before is not None and (remark := clock_remark(before, stored)):
            self._operator.tell(f"warning: {remark}")
        if once_more and stored.is_lost and not self.done[key].is_lost:
            self._file.append(values)  # the earlier reading is better
        else:
            self._file.append([*values, stored])
            self.done.pop(key, None)
            self.done[key] = stored
        nominal = self._header.plan[visit.number - 1].nominal_mm[index]
        (self._lost_points.add if self.done[key].is_lost else self._lost_points.discard)(key)
        self._operator.stored(self.done[key], nominal, len(self.done), len(self._lost_points))
        return tuple(self.done[key].read)

    def _new_temperatures(self) -> list[TemperatureRow]:
        rows = [] if self._temperatures is None else self._temperatures.new_rows()
        self.recorded += rows
        if rows:
            known = {name: value for name, value in rows[-1].values.items() if value is not None}
            self._operator.state.conditions |= {str(name): value for name, value in known.items()}
        return rows

    def _tell_lost(self, visit: Visit, index: int, reading: RawReading) -> None:
        for why in dict.fromkeys(reading.lost.values()):
            channels = [channel for channel, own in reading.lost.items() if own == why]
            are = "are" if len(channels) > 1 else "is"
            self._operator.tell(f"{point_text(visit, index)}: {', '.join(channels)} {are} lost: {why}")
        if any("no beam" in why for why in reading.lost.values()):
            self._operator.tell(
                "an interrupted beam may change the constant of this set-up: stop, and use `restart_set_up`"
            )

    def _session(self, source: str, instrument: dict[str, str], visit: Visit, index: int) -> Session:
        return Session(
            time=datetime.now(UTC),
            stepdiag=__version__,
            source=source,
            instrument=instrument,
            options=repr(self._options),
            visit=visit.number,
            point=int(visit.points[index]),
            temperatures=None if self._temperatures is None else str(self._temperatures.path),
        )

    def _summary(self, visit: Visit) -> str:
        readings = [reading for key, reading in self.done.items() if key[0] == visit.number]
        lost = sum(1 for reading in readings if reading.is_lost)
        return (
            f"visit {visit.number} of {len(self._visits)} (line {visit.line}, run {visit.run}, {visit.direction}): "
            f"{len(readings)} readings, {lost} lost"
        )

    def _remark(self, visit: Visit) -> str | None:
        """What its distances say of a line, beside the nominal way."""
        plan = self._known.plan
        travel = {
            line: plan.points(line, visit.run)[visit.points] @ plan.frame(line)[:, 2]
            for line in (*plan.lines, *plan.scale_lines)
            if len(plan.points(line, visit.run)) == len(visit.points)
        }
        columns = self._instrument.columns
        distance = self._header.sign * np.array(
            [mean_distance(columns, self.done[visit.number, int(point)].read) for point in visit.points]
        )
        way = Way(visit.run, visit.line, np.arange(len(visit.points)), travel.pop(visit.line), distance)
        return line_remark(way, travel)


def _records(visit: Visit, index: int, reading: Reading, channels: list[str]) -> Iterator[Record]:
    """Yield the records of the values, then the record of the reading."""
    x, y, z = (float(p) for p in visit.positions[index])
    number, line, run, direction = visit.number, visit.line, visit.run, visit.direction
    point, position = int(visit.points[index]), (x, y, z)
    for value in reading.values:
        yield Value(
            visit=number,
            line=line,
            run=run,
            direction=direction,
            point=point,
            position_mm=position,
            time=value.time,
            kind=value.kind,
            read=list(value.values),
        )
    yield RawReading(
        visit=number,
        line=line,
        run=run,
        direction=direction,
        point=point,
        position_mm=position,
        time=reading.values[-1].time if reading.values else datetime.now(UTC),
        read=list(reading.mean),
        sd=reading.deviation,
        values=len(reading.averaged),
        lost={channels[place]: why for place, why in reading.lost.items()},
    )
