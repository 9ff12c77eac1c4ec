"""When to read: after Enter, when the distance has come to rest a step further, or when a controller asks."""

import selectors
import socket
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

from stepdiag._core import InvalidArgument
from stepdiag.files import reason
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


class Trigger(Protocol):
    def start(self, context: Context) -> None: ...

    def begin(self, visit: Visit, index: int, text: str) -> None:
        """Before a visit's first reading; `text` says where head and mirror stand."""

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> None:
        """Returns when the reading at this place of the visit is wanted."""

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
        _of(self.context).operator.tell(text)

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> None:
        _of(self.context).operator.confirm(f"read {point_text(visit, index)}")

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
        context = _of(self.context)
        context.operator.tell(text)
        context.operator.confirm(f"read {point_text(visit, index)}, then move on")
        self._last = ()

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> None:
        if not any(value is not None for value in self._last):
            if self._last:  # the last reading was lost on every axis: nothing tells the next rest from it
                _of(self.context).operator.confirm(f"the last reading was lost: read {point_text(visit, index)}")
            return
        context = _of(self.context)
        step = nominal[index] - nominal[self._last_index]
        if abs(step) < SMALLEST_STEP:
            context.operator.confirm(f"the distance does not change to it: read {point_text(visit, index)}")
            return
        self._await_step(visit, index, step)

    def _await_step(self, visit: Visit, index: int, step: float) -> None:
        context = _of(self.context)
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
        _of(self.context).operator.tell(
            f"the mirror rests {moved:+.4f} mm from the last point, but it is {step:+.4f} mm from there "
            f"to {point_text(visit, index)}"
        )

    def stored(self, visit: Visit, index: int, pm: Sequence[int | None]) -> None:
        self._last, self._last_index = tuple(pm), index

    def failed(self, why: str) -> None:
        pass

    def close(self) -> None:
        pass


class TcpTrigger:
    """A controller asks, by lines of text: READ <visit> <point> is answered by DONE <visit> <point> when the reading is
    on the disk, or by FAIL <reason>."""

    LONGEST: Final = 256  # bytes of a line

    def __init__(self, host: str = "127.0.0.1", port: int = 0) -> None:
        try:
            self._server = socket.create_server((host, port))
        except OSError as error:
            raise InvalidArgument(f"trigger: cannot listen on {host}:{port}: {reason(error)}") from None
        self._server.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._server, selectors.EVENT_READ)
        self._clients: dict[socket.socket, bytes] = {}
        self._asking: socket.socket | None = None
        self._context: Context | None = None
        self.address: tuple[str, int] = self._server.getsockname()[:2]

    def start(self, context: Context) -> None:
        self._context = context

    def begin(self, visit: Visit, index: int, text: str) -> None:
        _of(self._context).operator.tell(f"{text}; waiting for {point_text(visit, index)}")

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> None:
        context = _of(self._context)
        deadline = time.monotonic() + context.wait_timeout
        while (left := deadline - time.monotonic()) > 0.0:
            for client, line in self._lines(left):
                wrong = _wrong(line, visit, index)
                if wrong is None:
                    self._asking = client
                    return
                context.operator.tell(f"the controller asked in vain: {wrong}")
                self._answer(client, f"FAIL {wrong}")
        raise Stopped(f"{point_text(visit, index)}: nobody asked for it in {context.wait_timeout:g} s")

    def stored(self, visit: Visit, index: int, pm: Sequence[int | None]) -> None:
        if self._asking is not None:
            self._answer(self._asking, f"DONE {visit.number} {int(visit.points[index])}")
        self._asking = None

    def failed(self, why: str) -> None:
        if self._asking is not None:
            self._answer(self._asking, f"FAIL {' '.join(why.split())}")
        self._asking = None

    def close(self) -> None:
        for client in list(self._clients):
            self._drop(client)
        self._selector.close()
        self._server.close()

    def _lines(self, timeout: float) -> list[tuple[socket.socket, bytes]]:
        """One line of each client that has sent a whole one, waiting for some if there is none."""
        ready = [client for client, rest in self._clients.items() if b"\n" in rest]
        for key, _ in self._selector.select(0.0 if ready else timeout):
            if key.fileobj is self._server:
                self._accept()
            elif isinstance(key.fileobj, socket.socket):
                self._receive(key.fileobj)
        lines = []
        for client, rest in list(self._clients.items()):
            line, end, rest = rest.partition(b"\n")
            if end:
                self._clients[client] = rest
                lines.append((client, line))
                break  # its answer comes before anybody else's turn
        return lines

    def _accept(self) -> None:
        try:
            client, _ = self._server.accept()
        except OSError:
            return
        client.settimeout(1.0)  # for answers; who does not take them is dropped
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._clients[client] = b""
        self._selector.register(client, selectors.EVENT_READ)

    def _receive(self, client: socket.socket) -> None:
        try:
            data = client.recv(4096)
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        self._clients[client] += data
        if b"\n" not in self._clients[client] and len(self._clients[client]) > self.LONGEST:
            self._answer(client, "FAIL expected READ <visit> <point>, got a line without an end")
            self._drop(client)

    def _answer(self, client: socket.socket, text: str) -> None:
        try:
            client.sendall(text.encode() + b"\n")
        except OSError:
            self._drop(client)

    def _drop(self, client: socket.socket) -> None:
        if self._clients.pop(client, None) is not None:
            self._selector.unregister(client)
            client.close()


def point_text(visit: Visit, index: int) -> str:
    """A point in words: visit, line, run, direction, number and commanded position."""
    x, y, z = (float(p) for p in visit.positions[index])
    return (
        f"visit {visit.number} (line {visit.line}, run {visit.run}, {visit.direction}), "
        f"point {int(visit.points[index])} at X{x:g} Y{y:g} Z{z:g}"
    )


def _wrong(line: bytes, visit: Visit, index: int) -> str | None:
    words = line.decode("ascii", errors="replace").split()
    if len(words) != 3 or words[0] != "READ" or not all(word.isdigit() and len(word) < 10 for word in words[1:]):
        return f"expected READ <visit> <point>, got {' '.join(words)[:60]!a}"
    got = (int(words[1]), int(words[2]))
    expected = (visit.number, int(visit.points[index]))
    if got != expected:
        return f"expected visit {expected[0]} point {expected[1]}, got visit {got[0]} point {got[1]}"
    return None


def _of(context: Context | None) -> Context:
    assert context is not None, "start() comes first"
    return context
