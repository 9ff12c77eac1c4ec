"""Client of the attocube IDS3010, a three-axis displacement interferometer: JSON-RPC 2.0 over TCP.

docs/acquisition.md names the sources of the protocol and what was not tried on an instrument.
"""

import re
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Final, Self
from urllib.parse import urlsplit

from stepdiag._core import InvalidArgument
from stepdiag.instruments.ids3010_messages import JsonStream, encoded, shown
from stepdiag.instruments.instrument import InstrumentError
from stepdiag.io.whole_files import reason

PORT: Final = 9090
AXES: Final = 3
RUNNING: Final = "measurement running"
IDLE: Final = "system idle"
ALIGNING: Final = "optics alignment running"
STARTING: Final = ("measurement starting", "measurement restarting")
TWIN: Final = "stepdiag twin"  # device type that a twin reports
# Prefix of the functions' names: the first up to firmware 1.8, the second in 1.9.1.
INTERFACES: Final = ("com.attocube.ids", "com.attocube.sen")
LARGEST_POSITION: Final = 2**63  # pm
FOREIGN: Final = 100  # replies with other ids before one; some may be late


class _Refused(InstrumentError):
    """The instrument understood the request and reports an error."""


@dataclass(frozen=True)
class Positions:
    """Simultaneous positions of the requested axes, pm (None: beam lost), and warning numbers."""

    pm: tuple[int | None, ...]
    warnings: tuple[int, ...]


def parse_source(source: str) -> tuple[str, int]:
    """Return host and port of "ids3010://HOST[:PORT]". Raises InvalidArgument."""
    expected = InvalidArgument(f"source: expected ids3010://HOST or ids3010://HOST:PORT, got {source!r}")
    try:
        parts = urlsplit(source)
        host, port = parts.hostname, parts.port
    except ValueError:
        raise expected from None
    if parts.scheme != "ids3010" or not host or parts.path not in ("", "/") or parts.query or parts.fragment:
        raise expected
    if parts.username is not None or port == 0:
        raise expected
    return host, port or PORT


class Ids3010:
    """A connection to an IDS3010. It reconnects after a failure.

    Every request ends within `timeout` seconds. A request that changes nothing is tried up to
    `attempts` times. Raises InstrumentError."""

    def __init__(self, host: str, port: int = PORT, *, timeout: float = 2.0, attempts: int = 3) -> None:
        self.name = f"ids3010://{host}:{port}"
        self._address = (host, port)
        self._timeout = timeout
        self._attempts = attempts
        self._socket: socket.socket | None = None
        self._stream = JsonStream()
        self._id = 0
        self._interface: str | None = None
        self._texts: dict[int, str] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection. The next request opens another one."""
        if self._socket is not None:
            self._socket.close()
        self._socket = None
        self._stream = JsonStream()

    # --- measured values ---

    def read(self, axes: Sequence[int]) -> Positions:
        """Read the absolute positions of these axes (numbered from 0).

        If the common request returns a warning, every axis is read by itself. A position with a
        warning of its own is lost."""
        if len(axes) > 1:
            warning, *positions = self._positions("getAbsolutePositions", (), AXES)
            if warning == 0:
                return Positions(tuple(positions[axis] for axis in axes), (0,) * len(axes))
        read = [self._positions("getAbsolutePosition", (axis,), 1) for axis in axes]
        warnings = tuple(warning for warning, _ in read)
        return Positions(tuple(None if warning else position for warning, position in read), warnings)

    def _positions(self, method: str, params: Sequence[int], count: int) -> list[int]:
        result = self.ask(f"displacement.{method}", params)
        numbers = [_whole(value) for value in result]
        if len(numbers) != 1 + count or any(number is None for number in numbers):
            raise InstrumentError(
                f"{self.name}: {method}: expected a warning number and {count} positions in pm, got {_short(result)}"
            )
        return [number for number in numbers if number is not None]

    # --- state ---

    def mode(self) -> str:
        """Return the mode: "system idle", "measurement starting", "measurement running", ..."""
        mode = self._word("system.getCurrentMode")
        if not re.fullmatch(r"[ -~]{1,60}", mode):
            raise InstrumentError(f"{self.name}: system.getCurrentMode: expected a mode in words, got {_short(mode)}")
        return mode

    def describe(self) -> dict[str, str]:
        """Return type, firmware and serial number, as far as the instrument reports them."""
        found = {}
        for key, method in (
            ("type", "system.getDeviceType"),
            ("firmware", "com.attocube.system.getFirmwareVersion"),
            ("serial", "com.attocube.system.getSerialNumber"),
        ):
            try:
                found[key] = self._word(method)
            except _Refused:
                continue
        return found | {"interface": self._interface or ""}

    def start(self, timeout: float) -> None:
        """Start the measurement, stopping a running one first.

        According to the manual this clears the errors of an interrupted beam."""
        if self.mode() != IDLE:
            self.ask("system.stopMeasurement", attempts=1)
            self.wait_for(IDLE, timeout)
        self.ask("system.startMeasurement", attempts=1)
        self.wait_for(RUNNING, timeout)

    def error_text(self, number: int) -> str:
        """Return the instrument's own text for an error or warning number."""
        if number not in self._texts:
            method = "com.attocube.system.errorNumberToString"
            try:
                result = self._request(method, (0, number), self._attempts)  # ask() calls this
            except InstrumentError:
                result = [1]
            words = [value for value in result if isinstance(value, str)]
            known = f": {words[-1]}" if result[0] == 0 and words else ""
            self._texts[number] = f"number {number}{known}"  # also one without a text is asked for once
        return self._texts[number]

    def wait_for(self, mode: str, timeout: float) -> None:
        """Wait until the instrument reports this mode.

        Raises InstrumentError after `timeout` seconds."""
        deadline = time.monotonic() + timeout
        while (now := self.mode()) != mode:
            if time.monotonic() > deadline:
                error = _whole(self._request(self._full("system.getSystemError"), (), self._attempts)[0])
                told = f"; it reports {self.error_text(error)}" if error else ""
                raise InstrumentError(f"{self.name}: expected the mode {mode!r}, but it stays in {now!r}{told}")
            time.sleep(0.05)

    def _word(self, method: str, params: Sequence[int] = ()) -> str:
        result = self.ask(method, params)
        words = [value for value in result if isinstance(value, str)]
        if not words:
            raise _Refused(f"{self.name}: {method}: expected a text, got {_short(result)}")
        return words[-1]

    # --- requests ---

    def ask(self, method: str, params: Sequence[Any] = (), *, attempts: int | None = None) -> list[Any]:
        """Call a function, named in full or without its interface, and return its result.

        A result begins with a number. For positions it is a warning, which the caller has to check.
        For all other functions a number other than 0 is an error."""
        result = self._request(self._full(method), params, attempts or self._attempts)
        number = _whole(result[0])
        if number and not method.startswith("displacement."):
            raise _Refused(f"{self.name}: {method}: error {self.error_text(number)}")
        return result

    def _full(self, method: str) -> str:
        if method.startswith(("com.", "stepdiag.")):
            return method
        if self._interface is None:
            self._interface = self._find_interface()
        return f"{self._interface}.{method}"

    def _find_interface(self) -> str:
        for interface in INTERFACES:
            try:
                self._request(f"{interface}.system.getCurrentMode", (), self._attempts)
            except _Refused:
                continue
            return interface
        raise InstrumentError(f"{self.name}: answers, but knows neither {INTERFACES[0]} nor {INTERFACES[1]}")

    def _request(self, method: str, params: Sequence[Any], attempts: int) -> list[Any]:
        for attempt in range(attempts):
            try:
                return self._exchange(method, params)
            except _Refused:
                raise
            except (OSError, ValueError) as error:
                self.close()  # a late answer would belong to the old request
                if attempt + 1 == attempts:
                    if isinstance(error, InstrumentError):
                        raise
                    raise InstrumentError(f"{self.name}: {method}: {reason(error)}") from None
                time.sleep(min(0.1 * 2**attempt, 1.0))
        raise AssertionError("attempts: at least 1")

    def _exchange(self, method: str, params: Sequence[Any]) -> list[Any]:
        deadline = time.monotonic() + self._timeout
        connection = self._connected()
        self._id += 1
        request = {"jsonrpc": "2.0", "method": method, "params": list(params), "id": self._id, "api": 2}
        connection.settimeout(self._timeout)
        connection.sendall(encoded(request))
        others = 0
        while True:
            for reply in self._receive(connection, method, deadline, others):
                if reply.get("id") == self._id:
                    return self._result(reply, method)
                others += 1
            if others > FOREIGN:
                raise InstrumentError(f"{self.name}: {method}: more than {FOREIGN} replies with other ids")

    def _connected(self) -> socket.socket:
        if self._socket is None:
            try:
                self._socket = socket.create_connection(self._address, self._timeout)
            except OSError as error:
                raise InstrumentError(f"{self.name}: cannot be reached: {reason(error)}") from None
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return self._socket

    def _receive(self, connection: socket.socket, method: str, deadline: float, others: int) -> list[dict[str, Any]]:
        left = deadline - time.monotonic()
        try:
            if left <= 0.0:
                raise TimeoutError
            connection.settimeout(left)
            data = connection.recv(2**16)
        except TimeoutError:
            told = f", only {others} with other ids" if others else ""
            raise InstrumentError(f"{self.name}: {method}: no answer within {self._timeout:g} s{told}") from None
        if not data:
            raise InstrumentError(f"{self.name}: {method}: the connection was closed")
        try:
            return self._stream.feed(data)
        except ValueError as error:
            raise InstrumentError(f"{self.name}: {method}: expected a JSON-RPC reply, got {error}") from None

    def _result(self, reply: dict[str, Any], method: str) -> list[Any]:
        result = reply.get("result")
        if isinstance(result, list) and result:
            return result
        error = reply.get("error")
        if error is not None:
            told = error.get("message", error) if isinstance(error, dict) else error
            raise _Refused(f"{self.name}: {method}: {_short(told)}")
        raise InstrumentError(f"{self.name}: {method}: expected a reply with a result, got {shown(encoded(reply))}")


def _whole(value: Any) -> int | None:
    """The value as an integer if it is whole (JSON may write 3.0), else None."""
    if isinstance(value, float) and value.is_integer() and abs(value) <= 2.0**53:
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int) or abs(value) >= LARGEST_POSITION:
        return None
    return value


def _short(value: Any) -> str:
    text = ascii(value)
    return text if len(text) <= 100 else text[:100] + "..."
