"""Where lines come from: a TCP connection, or the standard output of a program; and the thread that reads them."""

import os
import selectors
import signal
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

LONGEST: Final = 2**16  # bytes of a line
PIECE: Final = 2**16  # bytes read at once
PIECES: Final = 16  # in a row, before others have their turn
BEHIND: Final = 2.0  # s for which there may always be more to read: then the sender is too fast
QUOTED: Final = 1000  # characters of a program's standard error
BAUD: Final = 115200  # of a serial port, where none is stated
PATIENCE: Final = 2.0  # s until a program that closed its output has ended
GRACE: Final = 0.5  # s that a program has to end by SIGTERM; below what Ctrl-C gives to the acquisition


class Stream(Protocol):
    """Bytes that come without being asked for; reading does not block."""

    name: str

    def fileno(self) -> int: ...

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

    def fileno(self) -> int:
        return self._socket.fileno()  # with a time limit, sockets do not block

    def send(self, line: bytes) -> None:
        self._socket.sendall(line)

    def ended(self) -> str:
        return "the connection was closed"

    def close(self) -> None:
        self._socket.close()


class SerialPort:
    """A serial port on which lines come. Raises InvalidArgument without pyserial, InstrumentError."""

    def __init__(self, port: str, speed: int) -> None:
        try:
            import termios

            import serial  # type: ignore[import-untyped]
        except ImportError:
            raise InvalidArgument("serial: needs pyserial: pip install 'stepdiag[serial]'") from None
        self.name = f"serial:{port}"
        try:
            self._port = serial.Serial(port, speed, timeout=0, write_timeout=1.0, exclusive=True)
            os.set_blocking(self._port.fileno(), False)
            attributes = termios.tcgetattr(self._port.fileno())
            attributes[6][termios.VMIN] = 1  # a read without bytes is the end of the port, not a pause
            termios.tcsetattr(self._port.fileno(), termios.TCSANOW, attributes)
        except (serial.SerialException, termios.error, OSError, ValueError) as error:
            raise InstrumentError(f"{self.name}: cannot be opened: {error}") from None

    def fileno(self) -> int:
        return int(self._port.fileno())

    def send(self, line: bytes) -> None:
        self._port.write(line)

    def ended(self) -> str:
        return "the port was closed"

    def close(self) -> None:
        self._port.close()


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
                start_new_session=True,  # Ctrl-C is for the acquisition, which ends the program
                env={**os.environ, "PYTHONUNBUFFERED": "1"},  # lines that wait in a buffer are stale
            )
        except (OSError, ValueError) as error:
            told = reason(error) if isinstance(error, OSError) else str(error)
            raise InvalidArgument(f"source: {arguments[0]}: cannot be started: {told}") from None
        self._said = b""
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        for pipe in (self._output, self._input):
            os.set_blocking(pipe.fileno(), False)

    @property
    def _output(self) -> IO[bytes]:
        assert self._process.stdout is not None
        return self._process.stdout

    @property
    def _input(self) -> IO[bytes]:
        assert self._process.stdin is not None
        return self._process.stdin

    def fileno(self) -> int:
        return self._output.fileno()

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
        for number in (signal.SIGTERM, signal.SIGKILL):
            try:
                os.killpg(self._process.pid, number)  # also where it has ended and left children
            except ProcessLookupError:
                break
            except PermissionError:
                self._process.send_signal(number)
            try:
                self._process.wait(GRACE)
            except subprocess.TimeoutExpired:
                continue
        self._process.wait()
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
        self._wake, self._waker = os.pipe()
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and close the stream."""
        os.write(self._waker, b"x")
        self._thread.join()
        os.close(self._wake)
        os.close(self._waker)
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
                piece = os.read(self._stream.fileno(), PIECE)
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
