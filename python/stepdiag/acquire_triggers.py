"""When to read: after Enter, or when the distance has come to rest a step further.

tcp_trigger.py: when a controller asks.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

from stepdiag.ids3010 import InstrumentError, Sample
from stepdiag.settling import Settling
from stepdiag.visits import Visit


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

    def stored(self, visit: Visit, index: int, pm: Sequence[int | None]) -> None:
        pass

    def failed(self, why: str) -> None:
        pass

    def close(self) -> None:
        pass


STEP_SHARE: Final = 0.25  # of a step: how far from its end a rest still counts as the next point
SMALLEST_STEP: Final = 0.01  # mm; less is no step that could be told from a machine at rest


@dataclass
class SettleTrigger:
    """Reads when the distance has moved by about a step of the plan and has come to rest. The first reading of every
    visit is the operator's."""

    context: Context | None = None
    _last: tuple[int | None, ...] = ()
    _last_index: int = 0
    _told: float = field(default=0.0)

    def start(self, context: Context) -> None:
        self.context = context

    def begin(self, visit: Visit, index: int, text: str) -> None:
        context = of_start(self.context)
        context.operator.tell(text)
        context.operator.confirm(f"read {point_text(visit, index)}, then move on")
        self._last = ()

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        if not any(value is not None for value in self._last):
            if self._last:  # the last reading was lost on every axis: nothing tells the next rest from it
                of_start(self.context).operator.confirm(f"the last reading was lost: read {point_text(visit, index)}")
            return True
        context = of_start(self.context)
        step = nominal[index] - nominal[self._last_index]
        if abs(step) < SMALLEST_STEP:
            context.operator.confirm(f"the distance does not change to it: read {point_text(visit, index)}")
        else:
            self._await_step(visit, index, step)
        return True

    def _await_step(self, visit: Visit, index: int, step: float) -> None:
        context = of_start(self.context)
        deadline = time.monotonic() + context.wait_timeout
        window: deque[tuple[int | None, ...]] = deque(maxlen=context.settling.count)
        while time.monotonic() < deadline:
            window.append(context.read().pm)
            moved = self._moved(window, context)
            if moved is not None and abs(moved - step) <= STEP_SHARE * abs(step):
                return
            if moved is not None and abs(moved) > STEP_SHARE * abs(step):
                self._complain(visit, index, moved, step)
            time.sleep(max(context.settling.interval, 0.001))
        raise Stopped(f"{point_text(visit, index)}: the mirror did not come there in {context.wait_timeout:g} s")

    def _moved(self, window: Sequence[tuple[int | None, ...]], context: Context) -> float | None:
        """By how much the distance has changed since the last reading, mm; None while it moves."""
        axes = [
            i for i, last in enumerate(self._last) if last is not None and all(row[i] is not None for row in window)
        ]
        if len(window) < context.settling.count or not axes:
            return None
        columns = {i: [row[i] or 0 for row in window] for i in axes}
        if any(max(column) - min(column) > context.settling.limit_pm for column in columns.values()):
            return None
        changes = [columns[i][-1] - (self._last[i] or 0) for i in axes]
        return context.sign * sum(changes) / len(changes) * 1e-9

    def _complain(self, visit: Visit, index: int, moved: float, step: float) -> None:
        now = time.monotonic()
        if now - self._told < 5.0:
            return
        self._told = now
        of_start(self.context).operator.tell(
            f"the mirror rests {moved:+.4f} mm from the last point, but it is {step:+.4f} mm from there "
            f"to {point_text(visit, index)}"
        )

    def stored(self, visit: Visit, index: int, pm: Sequence[int | None]) -> None:
        self._last, self._last_index = tuple(pm), index

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
