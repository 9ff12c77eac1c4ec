"""A trigger for controllers that request a reading over a socket."""

import selectors
import socket
import time
from collections import Counter
from collections.abc import Sequence
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.settling import Reading
from stepdiag.acquisition.triggers import Context, Seldom, Stopped, keeps, of_start, point_text
from stepdiag.instruments.instrument import Row
from stepdiag.io.whole_files import reason
from stepdiag.scenario.order_of_run import Visit


class TcpTrigger:
    """A socket on which a controller requests readings by lines of text.

    READ <visit> <point> is answered by DONE <visit> <point> when the reading is on the disk, or by
    FAIL <reason>. A controller that received no answer may request the last point once more; it is
    still there, so the point is read again. Raises InvalidArgument if it cannot listen; port 0 is
    any free port, see `address`."""

    LONGEST: Final = 256  # bytes per line
    CLIENTS: Final = 4  # at once: one controller, and those that come back before their old connection is gone
    WRONG: Final = 100  # requests in a row, after which a client is hung up on
    IDLE: Final = 0.02  # s between looks at other things while it waits
    NO_FILES: Final = 0.2  # s until the next try to accept, where no more files may be open

    def __init__(self, host: str = "127.0.0.1", port: int = 0) -> None:
        try:
            self._server = socket.create_server((host, port))
        except OSError as error:
            raise InvalidArgument(f"trigger: cannot listen on {host}:{port}: {reason(error)}") from None
        self._server.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._server, selectors.EVENT_READ)
        self._clients: dict[socket.socket, bytes] = {}
        self._wrong: Counter[socket.socket] = Counter()
        self._refusals = Seldom(5)
        self._accepts_at: float | None = None  # when to accept again
        self._asking: socket.socket | None = None
        self._context: Context | None = None
        self._last: tuple[int, int] | None = None
        self._wanted = (0, 0)
        self.address: tuple[str, int] = self._server.getsockname()[:2]

    def start(self, context: Context) -> None:
        self._context, self._last = context, context.last

    def begin(self, visit: Visit, index: int, text: str) -> None:
        of_start(self._context).operator.tell(f"{text}; waiting for {point_text(visit, index)}")

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        context = of_start(self._context)
        expected = (visit.number, int(visit.points[index]))
        deadline = time.monotonic() + context.wait_timeout
        while (left := deadline - time.monotonic()) > 0.0:
            asked = self._next_line(min(left, self.IDLE))
            if asked is None:
                deadline += context.idle()
                continue
            client, line = asked
            wanted = _wanted(line)
            if wanted is not None and wanted in (expected, self._last):
                del self._wrong[client]
                self._asking, self._wanted = client, wanted
                return wanted == expected
            wrong = _expectation(expected, line)
            self._refusals.tell(context.operator, f"refused a request of the controller: {wrong}")
            self._answer(client, f"FAIL {wrong}")
            self._wrong[client] += 1
            if self._wrong[client] >= self.WRONG:
                self._answer(client, f"FAIL {self.WRONG} wrong requests in a row")
                self._drop(client)
        raise Stopped(f"{point_text(visit, index)}: no request within {context.wait_timeout:g} s")

    def go_back(self, *, whole_line: bool) -> None:
        if not whole_line:
            raise InvalidArgument("the controller's program does not go back to a point: repeat the line")
        self._last = None

    def doubt(self, reading: Reading) -> str | None:
        return None  # a controller waits for its answer

    def repeats(self, text: str) -> bool:
        return keeps(self._context, text)

    def stored(self, visit: Visit, index: int, row: Row) -> None:
        if self._asking is not None:
            self._answer(self._asking, f"DONE {self._wanted[0]} {self._wanted[1]}")
        self._asking, self._last = None, self._wanted

    def failed(self, why: str) -> None:
        if self._asking is not None:
            self._answer(self._asking, f"FAIL {' '.join(why.split())}")
        self._asking = None

    def close(self) -> None:
        for client in list(self._clients):
            self._drop(client)
        self._selector.close()
        self._server.close()

    def _next_line(self, timeout: float) -> tuple[socket.socket, bytes] | None:
        """Return a complete line and its sender, waiting up to `timeout` s. Clients take turns."""
        if self._accepts_at is not None:
            timeout = min(timeout, self.NO_FILES)
            if time.monotonic() >= self._accepts_at:
                self._selector.register(self._server, selectors.EVENT_READ)
                self._accepts_at = None
        ready = any(b"\n" in rest for rest in self._clients.values())
        events = self._selector.select(0.0 if ready else timeout)
        for key, _ in sorted(events, key=lambda event: event[0].fileobj is self._server):  # who leaves makes room first
            if key.fileobj is self._server:
                self._accept()
            elif isinstance(key.fileobj, socket.socket) and b"\n" not in self._clients[key.fileobj]:
                self._receive(key.fileobj)
        for client, text in self._clients.items():
            line, end, rest = text.partition(b"\n")
            if end:
                del self._clients[client]
                self._clients[client] = rest  # moves the client to the end of the queue
                return client, line
        return None

    def _accept(self) -> None:
        try:
            client, _ = self._server.accept()
        except OSError:
            if self._accepts_at is None:
                self._selector.unregister(self._server)  # else it would be ready without end
                self._accepts_at = time.monotonic() + self.NO_FILES
            return
        client.settimeout(1.0)  # a client that does not read its answers is dropped
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if len(self._clients) >= self.CLIENTS:
            self._refusals.tell(of_start(self._context).operator, f"refused a client beside {self.CLIENTS} others")
            self._answer(client, f"FAIL {self.CLIENTS} clients already")
            client.close()
            return
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
        del self._wrong[client]
        if self._clients.pop(client, None) is not None:
            self._selector.unregister(client)
            client.close()


def _wanted(line: bytes) -> tuple[int, int] | None:
    words = line.decode("ascii", errors="replace").split()
    if len(words) != 3 or words[0] != "READ" or not all(word.isdigit() and len(word) < 10 for word in words[1:]):
        return None
    return int(words[1]), int(words[2])


def _expectation(expected: tuple[int, int], line: bytes) -> str:
    """Explain why a line is not a request for this visit and point."""
    wanted = _wanted(line)
    if wanted is None:
        words = line.decode("ascii", errors="replace").split()
        return f"expected READ <visit> <point>, got {' '.join(words)[:60]!a}"
    return f"expected visit {expected[0]} point {expected[1]}, got visit {wanted[0]} point {wanted[1]}"
