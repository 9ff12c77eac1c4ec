"""A twin: a simulated instrument behind a socket, which measures a virtual machine that a controller moves.

It is an IDS3010, or an adapter that sends lines (lines.py). In addition to the functions of the former it has
`stepdiag.twin.moveTo` [x, y, z], `stepdiag.twin.setUp` [number], `stepdiag.twin.visit` [number, place, digest],
`stepdiag.twin.turn` [four angles], `stepdiag.twin.block` [1 or 0] and `stepdiag.twin.state` [];
docs/acquisition.md describes them.
"""

import contextlib
import socketserver
import threading
import time
from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, get_args

from stepdiag._core import InvalidArgument, __version__
from stepdiag.instruments.ids3010 import ALIGNING, AXES, INTERFACES, RUNNING, TWIN
from stepdiag.instruments.ids3010_messages import JsonStream, encoded
from stepdiag.io.whole_files import reason
from stepdiag.scenario.description import Scenario, read_scenario
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.twin.instrument import BASELINE, NOT_MEASURING, TEXTS, WRONG_AXIS, TwinBehaviour, TwinInstrument
from stepdiag.twin.lines import LineSender, send_lines
from stepdiag.twin.temperatures import TwinTemperatures

Params = Sequence[Any]
Protocol = Literal["ids3010", "lines"]
BETWEEN_TEMPERATURES = 1.0  # s
SLOW = 5.0  # s
CLIENTS = 16  # at once
NO_FILES = 0.2  # s
PARSE_ERROR, NO_METHOD, BAD_PARAMS = -32700, -32601, -32602  # JSON-RPC 2.0


class Twin:
    """A twin; inside a `with` block it listens in threads of its own."""

    def __init__(
        self,
        scenario: Scenario | str | PathLike[str],
        *,
        host: str = "127.0.0.1",
        port: int | None = 0,
        behaviour: TwinBehaviour | None = None,
        play: float | None = None,
        temperatures: Path | None = None,
        protocol: Protocol = "ids3010",
    ) -> None:
        """port: 0 takes any free one; None: it does not listen. protocol: "lines" gives the channels of any head.

        play: the twin moves through visits by itself, with this time at every point, s.

        temperatures: the CSV file to which it appends every second what the sensors of the scales show.

        Raises InvalidArgument if the instrument cannot have the head's beams, the port cannot be opened, or the file
        cannot be written."""
        described = scenario if isinstance(scenario, Scenario) else read_scenario(scenario)
        if play is not None and not 0.0 < play < 1e6:
            raise InvalidArgument(f"play: expected seconds above 0, got {play!r}")
        if protocol not in get_args(Protocol):
            raise InvalidArgument(f"protocol: expected {' or '.join(get_args(Protocol))}, got {protocol!r}")
        self._protocol = protocol
        self.instrument = TwinInstrument(described, behaviour, lines=protocol == "lines")
        self.instrument.moves_itself = play is not None
        self._visits = list(visits_of(described.known))
        self._play = play
        self._temperatures = None if temperatures is None else TwinTemperatures(described, temperatures)
        self._ended = threading.Event()
        self._server = None if port is None else self._listening(host, port)
        self._threads: list[threading.Thread] = []

    def _listening(self, host: str, port: int) -> "_Server":
        try:
            server = _Server((host, port), _LineClient if self._protocol == "lines" else _Client)
        except (OSError, OverflowError) as error:
            raise InvalidArgument(f"twin: cannot listen on {host}:{port}: {reason(error)}") from None
        server.answer = Answers(self.instrument).answer
        server.sender = LineSender(self.instrument)
        server.ended = self._ended
        return server

    @property
    def address(self) -> tuple[str, int]:
        assert self._server is not None, "port: None does not listen"
        host, port = self._server.server_address[:2]
        return str(host), int(port)

    @property
    def source(self) -> str:
        """The source that `acquire` takes."""
        host, port = self.address
        return f"{self._protocol}://{host}:{port}"

    def __enter__(self) -> Self:
        targets: list[Callable[[], None]] = []
        if (server := self._server) is not None:
            targets.append(lambda: server.serve_forever(poll_interval=0.05))
        if self._play is not None:
            targets.append(self._move_on)
        if self._temperatures is not None:
            self._temperatures.append(self.instrument.row())  # before a client looks
            targets.append(self._record)
        self._threads = [threading.Thread(target=target, daemon=True) for target in targets]
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self.instrument.visit_begun.set()
        if self._server is not None:
            self._server.shutdown()
            self._server.server_close()
        for thread in self._threads:
            thread.join()

    def _record(self) -> None:
        assert self._temperatures is not None
        while not self._ended.wait(BETWEEN_TEMPERATURES):
            self._temperatures.append(self.instrument.row())

    def _move_on(self) -> None:
        """Move through the points of every visit that a client begins, then to the next visit of the same set-up."""
        begun = self.instrument.visit_begun
        while begun.wait() and not self._ended.is_set():
            begun.clear()
            number, index = self.instrument.where()
            if number is None:
                continue
            visit = self._visits[number - 1]
            following = self._visits[number : number + 1]
            ways = list(visit.positions[index + 1 :])
            ways += [other.positions[0] for other in following if other.set_up == visit.set_up]
            for position in ways:
                if self._ended.wait(self._play) or begun.is_set():
                    break
                self.instrument.move_to(position)


class Answers:
    """Answers requests as the instrument does."""

    def __init__(self, instrument: TwinInstrument) -> None:
        self._instrument = instrument
        own: dict[str, Callable[[Params], list[Any]]] = {
            "displacement.getAbsolutePositions": lambda _: _all(instrument.positions()),
            "displacement.getAbsolutePosition": lambda params: _one(instrument.positions(), params),
            "displacement.getAxesDisplacement": lambda _: _all(instrument.displacements()),
            "displacement.getAxisDisplacement": lambda params: _one(instrument.displacements(), params),
            "displacement.getMeasurementEnabled": lambda _: [0, instrument.mode == RUNNING],
            "system.getCurrentMode": lambda _: [0, instrument.mode],
            "system.getDeviceType": lambda _: [0, f"IDS3010 ({TWIN})"],
            "system.getSystemError": lambda _: [max(instrument.positions()[0])],
            "system.startMeasurement": lambda _: _done(instrument.start),
            "system.restartMeasurement": lambda _: self._restart(),
            "system.stopMeasurement": lambda _: _done(instrument.stop),
            "system.startOpticsAlignment": lambda _: _done(lambda: instrument.align(True)),
            "system.stopOpticsAlignment": lambda _: _done(lambda: instrument.align(False)),
            "adjustment.getAdjustmentEnabled": lambda _: [0, instrument.mode == ALIGNING],
            "adjustment.getContrastInPermille": self._contrast,
            "system.resetError": lambda _: _done(instrument.reset_error),
            "system.resetAxes": lambda _: _done(instrument.reset_displacement),
        }
        self._functions = {f"{interface}.{name}": f for interface in INTERFACES for name, f in own.items()}
        self._functions |= {
            "com.attocube.system.getFirmwareVersion": lambda _: [0, __version__],
            "com.attocube.system.getSerialNumber": lambda _: [0, "twin"],
            "com.attocube.system.getDeviceName": lambda _: [0, TWIN],
            "com.attocube.system.errorNumberToString": _error_text,
            "stepdiag.twin.moveTo": self._move_to,
            "stepdiag.twin.setUp": self._set_up,
            "stepdiag.twin.turn": self._turn,
            "stepdiag.twin.block": self._block,
            "stepdiag.twin.visit": self._visit,
            "stepdiag.twin.state": self._state,
        }

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """The reply to a request."""
        number, method, params = request.get("id"), request.get("method"), request.get("params", [])
        function = self._functions.get(method) if isinstance(method, str) else None
        if function is None:
            return _error(number, NO_METHOD, f"method not found: {ascii(method)[:80]}")
        if not isinstance(params, list):
            return _error(number, BAD_PARAMS, "params: expected a list")
        try:
            result = function(params)
        except (InvalidArgument, OverflowError) as error:
            return _error(number, BAD_PARAMS, str(error))
        return {"jsonrpc": "2.0", "result": result, "id": number}

    def _restart(self) -> list[Any]:
        if self._instrument.mode != RUNNING:
            return [NOT_MEASURING]
        return _done(self._instrument.start)

    def _move_to(self, params: Params) -> list[Any]:
        if len(params) != 3 or not all(_is_number(value) for value in params):
            raise InvalidArgument("moveTo: expected the positions of X, Y and Z in mm")
        self._instrument.move_to([float(value) for value in params])
        return [0]

    def _set_up(self, params: Params) -> list[Any]:
        self._instrument.set_up(*_whole("setUp: expected the number of a set-up", params, 1, 1))
        return [0]

    def _turn(self, params: Params) -> list[Any]:
        if len(params) != 4 or not all(_is_number(value) for value in params):
            raise InvalidArgument("turn: expected two angles of the laser and two of the mirror in urad")
        self._instrument.turn([float(value) for value in params])
        return [0]

    def _block(self, params: Params) -> list[Any]:
        self._instrument.block(bool(_whole("block: expected 1 or 0", params, 1, 1)[0]))
        return [0]

    def _contrast(self, params: Params) -> list[Any]:
        (axis,) = _whole("expected the number of an axis", params, 1, 1)
        if not 0 <= axis < AXES:
            return [WRONG_AXIS, 0, 0, 0]
        if self._instrument.mode != ALIGNING:
            return [NOT_MEASURING, 0, 0, 0]
        return [0, round(self._instrument.contrast()), BASELINE, 0]

    def _visit(self, params: Params) -> list[Any]:
        digest = params[2] if len(params) > 2 else None
        if digest is not None and not isinstance(digest, str):
            raise InvalidArgument("visit: expected a digest as a text")
        numbers = _whole("visit: expected the number of a visit, a place in it, a digest", params[:2], 1, 2)
        self._instrument.visit(numbers[0], numbers[1] if len(numbers) > 1 else 0, digest)
        return [0]

    def _state(self, params: Params) -> list[Any]:
        return [0, self._instrument.state()]


class _Server(socketserver.ThreadingTCPServer):
    allow_reuse_address = True
    daemon_threads = True
    disable_nagle_algorithm = True
    answer: Callable[[dict[str, Any]], dict[str, Any]]
    sender: LineSender
    ended: threading.Event

    def __init__(self, address: tuple[str, int], handler: type[socketserver.BaseRequestHandler]) -> None:
        self._places = threading.BoundedSemaphore(CLIENTS)
        super().__init__(address, handler)

    def get_request(self) -> tuple[Any, Any]:
        try:
            return super().get_request()
        except OSError:
            time.sleep(NO_FILES)  # no more files may be open: the client still waits, and is not asked for without end
            raise

    def process_request(self, request: Any, client_address: Any) -> None:
        if self._places.acquire(blocking=False):
            super().process_request(request, client_address)
            return
        with contextlib.suppress(OSError):
            request.sendall(encoded({"error": f"the twin has {CLIENTS} clients already"}) + b"\r\n")
        self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._places.release()


class _Client(socketserver.BaseRequestHandler):
    def handle(self) -> None:
        assert isinstance(self.server, _Server)
        stream = JsonStream()
        try:
            while data := self.request.recv(2**16):
                for request in stream.feed(data):
                    self._send(self.server.answer(request))
        except ValueError as error:
            self._send(_error(None, PARSE_ERROR, f"expected a JSON-RPC request, got {error}"))
        except OSError:
            return  # the client went away

    def _send(self, reply: dict[str, Any]) -> None:
        self.request.sendall(encoded(reply) + b"\r\n")


class _LineClient(socketserver.BaseRequestHandler):
    def handle(self) -> None:
        assert isinstance(self.server, _Server)
        self.request.settimeout(SLOW)  # a client that does not read is dropped
        with self.request.makefile("rb", buffering=0) as requests:
            send_lines(self.server.sender, requests, self.request.sendall, ended=self.server.ended)


def _done(action: Callable[[], None]) -> list[Any]:
    action()
    return [0]


def _all(values: tuple[list[int], list[int]]) -> list[Any]:
    warnings, positions = values
    return [max(warnings), *positions]


def _one(values: tuple[list[int], list[int]], params: Params) -> list[Any]:
    (axis,) = _whole("expected the number of an axis", params, 1, 1)
    if not 0 <= axis < AXES:
        return [WRONG_AXIS, 0]
    warnings, positions = values
    return [warnings[axis], positions[axis]]


def _error_text(params: Params) -> list[Any]:
    _, number = _whole("errorNumberToString: expected a language and a number", params, 2, 2)
    return [0, TEXTS.get(number, "unknown error")]


def _whole(expected: str, params: Params, least: int, most: int) -> list[int]:
    if not least <= len(params) <= most or not all(
        isinstance(value, int) and not isinstance(value, bool) for value in params
    ):
        raise InvalidArgument(expected)
    return list(params)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _error(number: Any, code: int, message: str) -> dict[str, Any]:
    return {"jsonrpc": "2.0", "error": {"code": code, "message": message}, "id": number}
