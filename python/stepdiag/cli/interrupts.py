"""The end of a command by Ctrl-C (SIGINT), SIGTERM, or Windows's Ctrl-Break: within a second, with one line.

As a rule nothing has to be done but to remove temporary files, so the process just ends: no
exception is raised within a library, which could deadlock, and no long computation is waited for.
A thread does this, because the main one may be inside of the core. Blocks that keep something
(`unwinding`) get an exception, and `PATIENCE` for their way out.
"""

import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Final, NoReturn

from stepdiag.interruption import end_of_process
from stepdiag.platform import CLEARED_LINE, SIGNALS

PATIENCE: Final = 0.8  # s, from the first signal to the end of the process
_NOTHING: Final = 0  # not a number of a signal: the block that unwinds has ended
_CLOSE: Final = 255


class Terminated(SystemExit):
    """SIGTERM."""


class _Interrupts:
    """Signals and their watcher. Only `interruptible` makes one."""

    def __init__(self) -> None:
        self._watching, self._waking = socket.socketpair()
        self._waking.setblocking(False)  # set_wakeup_fd requires it
        self._thread = threading.Thread(target=self._watch, name="interrupts", daemon=True)
        self._unwinding = False
        self._raised = False
        self._chosen: list[signal.Signals] = []
        self._patience = 0.0
        self._announcement: str | None = None

    def start(self) -> None:
        usual = signal.SIG_DFL, signal.default_int_handler  # another disposition stays, such as a shell's for "&"
        self._chosen = [number for number in SIGNALS if signal.getsignal(number) in usual]
        for number in self._chosen:
            signal.signal(number, self._handle)
        signal.set_wakeup_fd(self._waking.fileno(), warn_on_full_buffer=False)
        self._thread.start()

    def stop(self) -> None:
        """The command is done, and its status stands: Python ends without interruption."""
        for number in self._chosen:
            signal.signal(number, signal.SIG_IGN)
        self._wake(_CLOSE)
        self._thread.join()

    @contextmanager
    def unwinding(self, patience: float, announcement: str | None) -> Iterator[None]:
        self._patience, self._announcement = patience, announcement
        self._unwinding = True
        try:
            yield
        finally:
            self._unwinding = False
            if self._raised:
                self._wake(_NOTHING)
                _park()
            self._patience, self._announcement = 0.0, None

    def _wake(self, number: int) -> None:
        with suppress(BlockingIOError):
            self._waking.send(bytes([number]))

    def _handle(self, number: int, frame: FrameType | None) -> None:
        """In the main thread, when it gets there; the watcher knows already."""
        if not self._unwinding or self._raised:
            _park()
        self._raised = True
        raise Terminated(128 + number) if number == signal.SIGTERM else KeyboardInterrupt

    def _next(self, timeout: float | None) -> int | None:
        """The next signal; _NOTHING, _CLOSE; None: none came in time."""
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            if end is not None:
                left = end - time.monotonic()
                if left <= 0:
                    return None
                self._watching.settimeout(left)
            else:
                self._watching.settimeout(None)
            try:
                number = self._watching.recv(1)[0]
            except TimeoutError:
                return None
            if number in (*SIGNALS, _NOTHING, _CLOSE):  # not another signal with a handler, such as SIGWINCH
                return number

    def _watch(self) -> None:
        while (number := self._next(None)) == _NOTHING:
            pass
        if number is None or number == _CLOSE:
            return
        came = time.monotonic()
        patience = self._patience
        if self._announcement is not None:
            _say(number, [self._announcement])
        if patience > 0:
            self._next(patience)  # the block has ended, or a second signal came: its sender is in a hurry
        self._end(number, came + PATIENCE - time.monotonic(), told=self._announcement is not None)

    def _end(self, number: int, patience: float, *, told: bool = False) -> NoReturn:
        said = end_of_process(patience)
        if not told:
            _say(number, said)
        os._exit(128 + number)


_current: _Interrupts | None = None


@contextmanager
def interruptible() -> Iterator[None]:
    """For the program: from here on a signal ends the process. In other threads than the main one it does nothing."""
    global _current
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _current = _Interrupts()
    _current.start()
    try:
        yield
    finally:
        _current.stop()


@contextmanager
def unwinding(patience: float = PATIENCE, announcement: str | None = None) -> Iterator[None]:
    """A signal raises an exception in this block, which keeps what it has; then the process ends.

    It ends after `patience` in any case, and at a second signal. `announcement` is said at once, in
    place of the line at the end: for a block that needs longer."""
    if _current is None:
        yield  # in a program of others, which gets KeyboardInterrupt
        return
    with _current.unwinding(patience, announcement):
        yield


def _park() -> NoReturn:
    """Wait for the end of the process."""
    while True:
        time.sleep(3600)


def _say(number: int, said: list[str]) -> None:
    """One line, not by sys.stderr, whose lock the interrupted thread may hold."""
    what = "terminated" if number == signal.SIGTERM else "interrupted"
    line = f"stepdiag: {': '.join([what, *(['; '.join(said)] if said else [])])}\n"
    with suppress(OSError):
        os.write(2, ((CLEARED_LINE if os.isatty(2) else "") + line).encode(errors="replace"))  # over a progress bar
