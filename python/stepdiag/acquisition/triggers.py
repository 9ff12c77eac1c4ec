"""When to read: the interface of a trigger, and the one that waits for the operator's key.

Others: settle_trigger.py (the mirror has come to rest), tcp_trigger.py (a controller requests).
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from stepdiag.acquisition.settling import Reading, Settling
from stepdiag.instruments.instrument import InstrumentError, ReadColumn, Row, Sample, change_of_distance
from stepdiag.scenario.order_of_run import Visit

AXES: Final = "XYZ"
SELDOM: Final = 5.0  # s


class Missed(Exception):
    """The machine has passed the point before it could be read. The reading is lost, and the next one is waited for."""


class Stopped(InstrumentError):
    """No reading was requested in time. The acquisition stops and can be resumed."""


class Operator(Protocol):
    """The person at the machine."""

    def tell(self, text: str) -> None: ...

    def confirm(self, text: str) -> None:
        """Show the text; return when the operator confirms."""

    def repeats(self, text: str) -> bool:
        """Show what is odd about a reading; return whether the operator wants it once more, else it is kept."""


class Silent:
    """No operator: ignores messages and confirms everything."""

    def tell(self, text: str) -> None:
        pass

    def confirm(self, text: str) -> None:
        pass

    def repeats(self, text: str) -> bool:
        return False


class Seldom:
    """Tells an operator at most `most` messages in five seconds, and how many others there were."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._since = float("-inf")
        self._told = self._left_out = 0

    def tell(self, operator: Operator, text: str) -> None:
        now = time.monotonic()
        if now - self._since > SELDOM:
            more = f" (and {self._left_out} more before)" if self._left_out else ""
            self._since, self._told, self._left_out = now, 0, 0
            text += more
        if self._told < self._most:
            self._told += 1
            operator.tell(text)
        else:
            self._left_out += 1


@dataclass(frozen=True)
class Context:
    """What an acquisition offers to its trigger."""

    read: Callable[[], Sample]
    columns: Sequence[ReadColumn]
    settling: Settling
    wait_timeout: float  # s
    sign: int
    operator: Operator
    last: tuple[int, int] | None = None  # visit and point of the last reading
    # Called again and again while a trigger waits; returns seconds for which the acquisition was paused.
    idle: Callable[[], float] = lambda: 0.0

    def change(self, row: Row, last: Row) -> float | None:
        """Change of the distance, mm: mean over the beams present in both rows."""
        change = change_of_distance(self.columns, row, last)
        return None if change is None else self.sign * change


class Trigger(Protocol):
    def start(self, context: Context) -> None: ...

    def begin(self, visit: Visit, index: int, text: str) -> None:
        """Called before the first reading of a visit. `text` says where head and mirror stand."""

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        """Wait until a reading is wanted. True: of this point. False: of the last one once more.

        Raises Missed where this point has been passed."""

    def doubt(self, reading: Reading) -> str | None:
        """Reason to doubt that the reading was taken at its point, or None."""

    def repeats(self, text: str) -> bool:
        """Whether a reading that is not what the plan says is taken once more. `text` says what is odd."""

    def stored(self, visit: Visit, index: int, row: Row) -> None:
        """Called when the reading is on the disk."""

    def go_back(self, *, whole_line: bool) -> None:
        """Called where the last point, or a whole line, is to be read once more. Raises InvalidArgument where whoever
        moves the machine does not go back."""

    def failed(self, why: str) -> None:
        """Called when the reading failed and the acquisition stops."""

    def close(self) -> None: ...


@dataclass
class KeyTrigger:
    """The operator confirms every reading."""

    context: Context | None = None

    def start(self, context: Context) -> None:
        self.context = context

    def begin(self, visit: Visit, index: int, text: str) -> None:
        of_start(self.context).operator.tell(text)

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        of_start(self.context).operator.confirm(f"read {point_text(visit, index)}")
        return True

    def go_back(self, *, whole_line: bool) -> None:
        pass

    def doubt(self, reading: Reading) -> str | None:
        return None

    def repeats(self, text: str) -> bool:
        return of_start(self.context).operator.repeats(text)

    def stored(self, visit: Visit, index: int, row: Row) -> None:
        pass

    def failed(self, why: str) -> None:
        pass

    def close(self) -> None:
        pass


def keeps(context: Context | None, text: str) -> bool:
    """Warn of an odd reading and keep it: the machine will not wait for an answer."""
    of_start(context).operator.tell(f"warning: {text}")
    return False


def point_text(visit: Visit, index: int) -> str:
    """Text for a point: visit, line, run, direction, number and commanded position."""
    return f"visit {visit.number} (line {visit.line}, run {visit.run}, {visit.direction}), {place_text(visit, index)}"


def place_text(visit: Visit, index: int) -> str:
    """Text for a place of the axes: the point's number and commanded position."""
    x, y, z = (float(p) for p in visit.positions[index])
    return f"point {int(visit.points[index])} at X{x:g} Y{y:g} Z{z:g}"


def of_start(context: Context | None) -> Context:
    """The context that start() received."""
    assert context is not None, "start() comes first"
    return context
