"""Stands between an acquisition, its instrument and its people: publishes what happens, and takes what they want.

The people are the operator at the terminal, if there is one, and whoever watches through the files of live_state.py and
control.py. A person is asked at both; the first answer counts.
"""

import time
from collections import deque
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from itertools import chain, pairwise
from pathlib import Path
from types import TracebackType
from typing import Final, Protocol, Self, runtime_checkable

from stepdiag.acquisition.control import Control, ControlFile
from stepdiag.acquisition.live_state import Doing, LiveFile, LiveState, control_path, live_path
from stepdiag.acquisition.options import Resume
from stepdiag.acquisition.raw_records import RawReading
from stepdiag.acquisition.triggers import Operator
from stepdiag.instruments.instrument import Instrument, InstrumentError, Number, Row, Sample, mean_distance
from stepdiag.scenario.order_of_run import Visit

BETWEEN_STATES: Final = 0.03  # s
BETWEEN_LOOKS: Final = 0.05  # s at what watchers want
BETWEEN_TRIES: Final = 1.0  # s, of an instrument that does not answer while nothing is to be read
PACE: Final = 12  # readings from which the time that is left is told
_AGAIN: Final[dict[Control, Resume]] = {
    "repeat_point": "point",
    "repeat_line": "line",
    "repeat_set_up": "set-up",
}


class Wanted(Exception):
    """A person wants something read once more."""

    def __init__(self, again: Resume) -> None:
        super().__init__(again)
        self.again = again


@runtime_checkable
class AskingOperator(Operator, Protocol):
    """An operator who can be asked without waiting, so that others may answer too."""

    def ask(self, text: str, answers: list[Control]) -> None:
        """Show a question."""

    def answered(self) -> Control | None:
        """The answer, if it is given by now."""

    def withdraw(self) -> None:
        """The question was answered by somebody else."""

    def show(self, state: LiveState) -> None:
        """Called many times a second with what happens."""


class Conductor:
    """See Operator for `tell`, `confirm` and `repeats`. Watched only inside a `with` block."""

    def __init__(self, instrument: Instrument, operator: Operator, raw: Path | None, sign: int = 1) -> None:
        """raw: the raw file beside which it publishes; None: nobody watches."""
        self.state = LiveState()
        self._instrument, self._operator, self._raw, self._sign = instrument, operator, raw, sign
        self._asking = operator if isinstance(operator, AskingOperator) else None
        self._is_followed = raw is not None or self._asking is not None
        self._live: LiveFile | None = None
        self._control: ControlFile | None = None
        self._waiting: deque[tuple[Control, str]] = deque()  # what people want
        self.remark: Callable[[str], None] = lambda _: None
        self.cross: Callable[[Sample], tuple[float, float] | None] = lambda _: None
        self.source = instrument.read  # of samples
        self.meanwhile: Callable[[], None] = lambda: None  # called while nothing is read
        self._published = self._looked = self._tried = 0.0
        self._asked = 0
        self._nominal = 0.0  # distance at the point that is read or waited for, mm
        self._offset: float | None = None  # of the distances of this set-up
        self._times: list[float] = []  # of the last readings
        self.set_ups, self.set_up_seconds = 0, 0.0  # of the plan, for the time that is left

    def __enter__(self) -> Self:
        if self._raw is not None:
            self._live, self._control = LiveFile(live_path(self._raw)), ControlFile(control_path(self._raw))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.state.question, self.state.answers = "", []
        if error is not None:
            self.state.failure = "stopped" if isinstance(error, KeyboardInterrupt | SystemExit) else str(error)
        self.doing("ended")
        if self._live is not None:
            self._live.close()

    # --- the instrument ---
    def read(self) -> Sample:
        """A sample, which is published."""
        sample = self.source()
        self._publish_sample(sample)
        return sample

    def idle(self) -> float:
        """Called again and again while the acquisition waits: shows what the instrument reads, and does what people
        want. Returns the seconds that it was paused. Raises Wanted, and KeyboardInterrupt where it is to stop."""
        paused = 0.0
        self._show()
        for control in self._wanted():
            if control == "pause":
                began = time.monotonic()
                self._pause()
                paused += time.monotonic() - began
            elif control in _AGAIN:
                raise Wanted(_AGAIN[control])
        return paused

    def _show(self) -> None:
        """Also where nobody reads now: the distance lives on the screen while the machine moves."""
        now = time.monotonic()
        self.meanwhile()
        if not self._is_followed or now - self._published < BETWEEN_STATES or now < self._tried:
            return
        try:
            self._publish_sample(self.source())
        except InstrumentError as error:
            self._tried = now + BETWEEN_TRIES
            self.state.values, self.state.reasons = {}, [str(error)]
            self._publish()

    def _pause(self) -> None:
        self.tell("paused")
        before: Doing = self.state.doing
        self.doing("paused")
        while True:
            self._show()
            for control in self._wanted():
                if control == "go_on":
                    self.tell("going on")
                    self.doing(before)
                    return
                if control in _AGAIN:
                    self.doing(before)
                    raise Wanted(_AGAIN[control])
            time.sleep(BETWEEN_STATES)

    def _wanted(self) -> Iterator[Control]:
        """What people want now; remarks and the end are seen to here."""
        now = time.monotonic()
        if self._control is not None and now - self._looked >= BETWEEN_LOOKS:
            self._looked = now
            self._waiting.extend(self._control.new())
        while self._waiting:  # what comes after an answer waits for who looks next
            control, text = self._waiting.popleft()
            if control == "stop":
                raise KeyboardInterrupt
            if control == "remark":
                self.remark(text)
                self.tell(f"remark: {text}")
            elif control not in ("confirm", "keep") or text in ("", str(self._asked)):
                yield control

    # --- the person ---
    def tell(self, text: str) -> None:
        self._operator.tell(text)
        self.state.tell(text)
        self._publish()

    def confirm(self, text: str) -> None:
        self._answer(text, ["confirm"])

    def repeats(self, text: str) -> bool:
        return self._answer(text, ["repeat_point", "keep"]) == "repeat_point"

    def _answer(self, text: str, answers: list[Control]) -> Control:
        asking = self._asking
        if asking is None:
            if answers == ["confirm"]:
                self._operator.confirm(text)
                return "confirm"
            return "repeat_point" if self._operator.repeats(text) else "keep"
        self._asked += 1
        state = self.state
        state.question, state.answers, state.asked = text, [str(one) for one in answers], self._asked
        before = state.doing
        self.doing("asks")
        asking.ask(text, answers)
        try:
            while True:
                self._show()
                mine = asking.answered()
                for control in chain([mine] if mine else [], self._wanted()):
                    if control in answers:
                        if control != mine:
                            asking.withdraw()
                        return control
                    if control in _AGAIN:
                        asking.withdraw()
                        raise Wanted(_AGAIN[control])
                time.sleep(BETWEEN_STATES / 2.0)
        finally:
            state.question, state.answers = "", []
            self.doing(before)

    # --- what is published ---
    def at(self, visit: Visit, index: int, nominal: float) -> None:
        """From now on this point is read or waited for."""
        state = self.state
        if visit.set_up != state.set_up:
            self._offset = None
        state.visit, state.set_up, state.line, state.run = visit.number, visit.set_up, visit.line, visit.run
        state.direction, state.index, state.points = visit.direction, index, len(visit.points)
        state.point, state.position_mm = int(visit.points[index]), [float(x) for x in visit.positions[index]]
        self._nominal = nominal
        self.doing("waits")

    def stored(self, reading: RawReading, nominal: float, readings: int, lost: int) -> None:
        """A reading is on the disk."""
        state = self.state
        state.readings, state.lost, state.stored = readings, lost, state.stored + 1
        distance = self._distance(tuple(reading.read))
        if distance is not None and self._offset is None:
            self._offset = distance - nominal
        if distance is None or self._offset is None:
            beside = f"lost: {'; '.join(dict.fromkeys(reading.lost.values()))}"
        else:
            beside = f"{distance:.6f} mm, {1e3 * (distance - nominal - self._offset):+.3f} µm from nominal"
        state.last = f"line {reading.line}, point {reading.point}: {beside}"
        times = self._times = [*self._times, time.monotonic()][-PACE:]
        if len(times) > 1:
            # The middle one: the time of a set-up is no pace.
            pace = sorted(b - a for a, b in pairwise(times))[(len(times) - 1) // 2]
            left = pace * (state.planned - readings) + self.set_up_seconds * (self.set_ups - state.set_up)
            state.minutes_left = left / 60.0
        self._publish()

    def doing(self, doing: Doing) -> None:
        self.state.doing = doing
        if doing not in ("waits", "reads") or time.monotonic() - self._published >= BETWEEN_STATES:
            self._publish()

    def _publish_sample(self, sample: Sample) -> None:
        if not self._is_followed or time.monotonic() - self._published < BETWEEN_STATES:
            return
        state = self.state
        state.values = {
            column.name: None if value is None else float(value)
            for column, value in zip(self._instrument.columns, sample.values, strict=True)
        }
        state.reasons = list(dict.fromkeys(reason for reason in sample.reasons if reason))
        state.signal = dict(sample.signal)
        state.at = (sample.time or datetime.now(UTC)).timestamp()
        cross = self.cross(sample)
        state.cross_urad = None if cross is None else list(cross)
        distance = self._distance(sample.values)
        state.distance_mm = distance
        if distance is None or self._offset is None:
            state.from_nominal_um = None
        else:
            state.from_nominal_um = 1e3 * (distance - self._nominal - self._offset)
        self._publish()

    def _distance(self, row: Row | tuple[Number | None, ...]) -> float | None:
        distance = self._sign * mean_distance(self._instrument.columns, row)
        return None if distance != distance else distance

    def _publish(self) -> None:
        self._published = time.monotonic()
        if self._live is not None:
            self._live.publish(self.state)
        if self._asking is not None:
            self._asking.show(self.state)
