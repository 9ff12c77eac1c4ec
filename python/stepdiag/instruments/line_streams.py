"""Where lines come from: a TCP connection, or the standard output of a program; and the thread that reads them."""

import os
import select
import selectors
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from typing import IO, Final, Protocol

from stepdiag._core import InvalidArgument
from stepdiag.instruments.ids3010_messages import shown
from stepdiag.instruments.instrument import InstrumentError
from stepdiag.io.whole_files import reason
from stepdiag.platform import OWN_GROUP, end_group, never_blocks, of_pipe, of_port

LONGEST: Final = 2**16  # bytes of a line
PIECE: Final = 2**16  # bytes read at once
PIECES: Final = 16  # in a row, before others have their turn
BEHIND: Final = 2.0  # s for which there may always be more to read: then the sender is too fast
QUOTED: Final = 1000  # characters of a program's standard error
BAUD: Final = 115200  # of a serial port, where none is stated
PATIENCE: Final = 2.0  # s until a program that closed its output has ended
GRACE: Final = 0.5  # s that a program has to end by SIGTERM; below what Ctrl-C gives to the acquisition


class Stream(Protocol):
    """Bytes that come without being asked for."""

    name: str

    def fileno(self) -> int:
        """What a selector waits for."""

    def read(self, size: int) -> bytes:
        """What has come; nothing at the end. Does not block; raises OSError, where nothing has come BlockingIOError."""

    def send(self, line: bytes) -> None:
        """Send a line to the other side. Raises OSError."""

    def ended(self) -> str:
        """Called where nothing more comes: why."""

    def close(self) -> None: ...


class Connection:
    """A TCP connection to an adapter. Raises InstrumentError if it cannot be reached."""

    def __init__(self, name: str, host: str, port: int, timeout: float) -> None:
        self.name = name
        try:
            self._socket = socket.create_connection((host, port), timeout)
        except OSError as error:
            raise InstrumentError(f"{name}: cannot be reached: {reason(error)}") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._timeout = timeout
        self._socket.setblocking(False)

    def fileno(self) -> int:
        return self._socket.fileno()

    def read(self, size: int) -> bytes:
        return self._socket.recv(size)

    def send(self, line: bytes) -> None:
        while line:
            _, free, _ = select.select([], [self._socket], [], self._timeout)
            if not free:
                raise TimeoutError("timed out")
            line = line[self._socket.send(line) :]

    def ended(self) -> str:
        return "the connection was closed"

    def close(self) -> None:
        self._socket.close()


class SerialPort:
    """A serial port on which lines come. Raises InvalidArgument without pyserial, InstrumentError."""

    def __init__(self, port: str, speed: int) -> None:
        try:
            import serial  # type: ignore[import-untyped]
        except ImportError:
            raise InvalidArgument("serial: needs pyserial: pip install 'stepdiag[serial]'") from None
        self.name = f"serial:{port}"
        try:
            self._port = serial.Serial(port, speed, timeout=0, write_timeout=1.0, exclusive=True)
            self._bytes = of_port(self._port)
        except (serial.SerialException, OSError, ValueError) as error:
            raise InstrumentError(f"{self.name}: cannot be opened: {error}") from None

    def fileno(self) -> int:
        return self._bytes.fileno()

    def read(self, size: int) -> bytes:
        return self._bytes.read(size)

    def send(self, line: bytes) -> None:
        self._port.write(line)

    def ended(self) -> str:
        return "the port was closed"

    def close(self) -> None:
        self._port.close()
        self._bytes.close()


class ProgramOutput:
    """A program whose standard output is read. It is ended with its children when the stream is closed."""

    def __init__(self, name: str, arguments: Sequence[str]) -> None:
        """Raises InvalidArgument if it cannot be started."""
        self.name = name
        try:
            self._process = subprocess.Popen(
                arguments,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                bufsize=0,
                **OWN_GROUP,  # Ctrl-C is for the acquisition, which ends the program
                env={**os.environ, "PYTHONUNBUFFERED": "1"},  # lines that wait in a buffer are stale
            )
        except (OSError, ValueError) as error:
            told = reason(error) if isinstance(error, OSError) else str(error)
            raise InvalidArgument(f"source: {arguments[0]}: cannot be started: {told}") from None
        self._said = b""
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self._bytes = of_pipe(self._output)
        never_blocks(self._input)

    @property
    def _output(self) -> IO[bytes]:
        assert self._process.stdout is not None
        return self._process.stdout

    @property
    def _input(self) -> IO[bytes]:
        assert self._process.stdin is not None
        return self._process.stdin

    def fileno(self) -> int:
        return self._bytes.fileno()

    def read(self, size: int) -> bytes:
        return self._bytes.read(size)

    def send(self, line: bytes) -> None:
        if os.write(self._input.fileno(), line) != len(line):
            raise BlockingIOError("it does not read its standard input")

    def ended(self) -> str:
        try:
            status = self._process.wait(PATIENCE)
            how = f"the program was ended by signal {-status}" if status < 0 else f"the program ended, status {status}"
        except subprocess.TimeoutExpired:
            how = "the program closed its standard output"
        self._listener.join(0.5)
        said = self._said.decode("utf-8", errors="replace").strip()
        return how + (f"; it said: {' '.join(said[-QUOTED:].split())}" if said else "")

    def close(self) -> None:
        end_group(self._process, GRACE)
        self._bytes.close()
        self._output.close()
        self._input.close()
        self._listener.join(0.5)  # unless a child of its own keeps the pipe

    def _listen(self) -> None:
        pipe = self._process.stderr
        assert pipe is not None
        with pipe:
            while piece := pipe.read(4096):
                self._said = (self._said + piece)[-8 * QUOTED :]


class LineFeed:
    """Takes every line of a stream as it comes, in a thread of its own, and keeps none.

    So no line waits to be read later, when it says what was long ago."""

    def __init__(self, stream: Stream, take: Callable[[int, bytes], None]) -> None:
        """take: called with the number and the text of each line, without its end; raises ValueError saying what is
        wrong with it, after which no more is read."""
        self._stream, self._take = stream, take
        self._changed = threading.Condition()
        self._rest = b""
        self._lines = 0
        self._failure: str | None = None
        self._behind: float | None = None  # since when there was always more to read
        self._wake, self._waker = socket.socketpair()
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and close the stream."""
        self._waker.send(b"x")
        self._thread.join()
        self._wake.close()
        self._waker.close()
        self._stream.close()

    def wait(self, timeout: float, is_done: Callable[[], bool], missing: Callable[[], str]) -> None:
        """Wait until `is_done`, which is asked after lines that began to arrive after this call.

        Raises InstrumentError with `missing` after `timeout` seconds, and where lines fail or end."""
        deadline = time.monotonic() + timeout
        with self._changed:
            while not self._read():  # what was sent before
                pass
            seen = self._lines + bool(self._rest)
            while True:
                if self._failure is not None:
                    raise InstrumentError(f"{self._stream.name}: {self._failure}")
                if self._lines > seen:
                    seen = self._lines
                    if is_done():
                        return
                left = deadline - time.monotonic()
                if left <= 0.0:
                    raise InstrumentError(f"{self._stream.name}: {missing()}")
                self._changed.wait(left)

    def wait_for_first(self, timeout: float) -> None:
        """Wait for the first line."""
        with self._changed:
            self._changed.wait_for(lambda: self._lines > 0 or self._failure is not None, timeout)
            if self._lines == 0:
                raise InstrumentError(f"{self._stream.name}: {self._failure or f'no line within {timeout:g} s'}")

    def _follow(self) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(self._stream, selectors.EVENT_READ)
            selector.register(self._wake, selectors.EVENT_READ)
            while True:
                ready = selector.select()
                if any(key.fileobj == self._wake for key, _ in ready):
                    return
                with self._changed:
                    self._read()
                    self._changed.notify_all()
                    if self._failure is not None:
                        selector.unregister(self._stream)

    def _read(self) -> bool:
        """Read what has come. False: there may be more. Failures are kept for who waits."""
        for _ in range(PIECES):
            if self._failure is not None:
                return True
            try:
                piece = self._stream.read(PIECE)
            except BlockingIOError:
                self._behind = None
                return True
            except OSError as error:
                self._failure = f"cannot be read: {reason(error)}"
                return True
            if not piece:
                self._failure = self._stream.ended()
                return True
            self._split(piece)
        now = time.monotonic()
        self._behind = self._behind or now
        if now - self._behind > BEHIND:
            self._failure = f"sends faster than it can be read ({self._lines} lines so far): send some 100 a second"
        return False

    def _split(self, piece: bytes) -> None:
        *lines, self._rest = (self._rest + piece).split(b"\n")
        for line in lines:
            self._lines += 1
            try:
                if len(line) > LONGEST:
                    raise ValueError(f"expected at most {LONGEST} bytes, got {shown(line)}")
                self._take(self._lines, line.removesuffix(b"\r"))
            except ValueError as error:
                self._failure = f"line {self._lines}: {error}"
                return
        if len(self._rest) > LONGEST:
            self._failure = f"line {self._lines + 1}: expected at most {LONGEST} bytes, got {shown(self._rest)}"
