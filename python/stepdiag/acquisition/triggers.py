"""When to read: what a trigger is, and the one that is the operator's key.

settle_trigger.py: when the mirror has come to rest a step further; tcp_trigger.py: when a controller asks.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from stepdiag.acquisition.ids3010 import InstrumentError, Sample
from stepdiag.acquisition.settling import Reading, Settling
from stepdiag.scenario.order_of_run import Visit


class Stopped(InstrumentError):
    """Nobody asked for a reading in time: the acquisition stops, and can be resumed."""


class Operator(Protocol):
    """Who stands at the machine."""

    def tell(self, text: str) -> None: ...

    def confirm(self, text: str) -> None:
        """Returns when the operator says so."""


class Silent:
    """An operator who is told nothing, and always ready."""

    def tell(self, text: str) -> None:
        pass

    def confirm(self, text: str) -> None:
        pass


@dataclass(frozen=True)
class Context:
    """What a trigger may ask of the acquisition."""

    read: Callable[[], Sample]
    settling: Settling
    wait_timeout: float  # s
    sign: int
    operator: Operator
    last: tuple[int, int] | None = None  # visit and point of the reading that was taken last


class Trigger(Protocol):
    def start(self, context: Context) -> None: ...

    def begin(self, visit: Visit, index: int, text: str) -> None:
        """Before a visit's first reading; `text` says where head and mirror stand."""

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        """Returns when the reading at this place of the visit is wanted; False where it is the last one once more."""

    def doubt(self, reading: Reading) -> str | None:
        """Why a reading is not of the point, if there is reason to think so."""

    def stored(self, visit: Visit, index: int, pm: Sequence[int | None]) -> None:
        """The reading is on the disk."""

    def failed(self, why: str) -> None:
        """The reading could not be taken; the acquisition stops."""

    def close(self) -> None: ...


@dataclass
class KeyTrigger:
    """The operator asks for every reading."""

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

    def stored(self, visit: Visit, index: int, pm: Sequence[int | None]) -> None:
        pass

    def failed(self, why: str) -> None:
        pass

    def close(self) -> None:
        pass


def point_text(visit: Visit, index: int) -> str:
    """A point in words: visit, line, run, direction, number and commanded position."""
    x, y, z = (float(p) for p in visit.positions[index])
    return (
        f"visit {visit.number} (line {visit.line}, run {visit.run}, {visit.direction}), "
        f"point {int(visit.points[index])} at X{x:g} Y{y:g} Z{z:g}"
    )


def of_start(context: Context | None) -> Context:
    """What start() gave."""
    assert context is not None, "start() comes first"
    return context
