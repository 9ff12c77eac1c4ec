"""When to read: the interface of a trigger, and the one that waits for the operator's key.

Others: settle_trigger.py (the mirror has come to rest), tcp_trigger.py (a controller requests).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from stepdiag.acquisition.instrument import InstrumentError, ReadColumn, Row, Sample, change_of_distance
from stepdiag.acquisition.settling import Reading, Settling
from stepdiag.scenario.order_of_run import Visit


class Stopped(InstrumentError):
    """No reading was requested in time. The acquisition stops and can be resumed."""


class Operator(Protocol):
    """The person at the machine."""

    def tell(self, text: str) -> None: ...

    def confirm(self, text: str) -> None:
        """Show the text; return when the operator confirms."""


class Silent:
    """No operator: ignores messages and confirms everything."""

    def tell(self, text: str) -> None:
        pass

    def confirm(self, text: str) -> None:
        pass


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

    def change(self, row: Row, last: Row) -> float | None:
        """Change of the distance, mm: mean over the beams present in both rows."""
        change = change_of_distance(self.columns, row, last)
        return None if change is None else self.sign * change


class Trigger(Protocol):
    def start(self, context: Context) -> None: ...

    def begin(self, visit: Visit, index: int, text: str) -> None:
        """Called before the first reading of a visit. `text` says where head and mirror stand."""

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        """Wait until a reading is wanted. True: of this point. False: of the last one once more."""

    def doubt(self, reading: Reading) -> str | None:
        """Reason to doubt that the reading was taken at its point, or None."""

    def stored(self, visit: Visit, index: int, row: Row) -> None:
        """Called when the reading is on the disk."""

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

    def doubt(self, reading: Reading) -> str | None:
        return None

    def stored(self, visit: Visit, index: int, row: Row) -> None:
        pass

    def failed(self, why: str) -> None:
        pass

    def close(self) -> None:
        pass


def point_text(visit: Visit, index: int) -> str:
    """Text for a point: visit, line, run, direction, number and commanded position."""
    x, y, z = (float(p) for p in visit.positions[index])
    return (
        f"visit {visit.number} (line {visit.line}, run {visit.run}, {visit.direction}), "
        f"point {int(visit.points[index])} at X{x:g} Y{y:g} Z{z:g}"
    )


def of_start(context: Context | None) -> Context:
    """The context that start() received."""
    assert context is not None, "start() comes first"
    return context
