"""What an interruption (Ctrl-C, SIGTERM) must not cut in two, and what it must not leave behind.

The command line ends the process, at any time (cli/interrupts.py); a program that uses the package
gets Python's KeyboardInterrupt. Both leave files whole because whatever writes them says so here.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Final

from stepdiag.platform import SIGNALS, kill_descendants

# Held while something is done wholly or not at all. What ends the process takes it and keeps it.
_whole: Final = threading.RLock()
_at_end: Final[list[Callable[[], str | None]]] = []


@contextmanager
def at_end(end: Callable[[], str | None]) -> Iterator[None]:
    """Call `end` if an interruption ends the process within the block, from any thread, perhaps twice.

    It removes what must not stay, or returns a text for the user, such as how to continue. It must
    not import anything: the interrupted thread may hold the lock of the import."""
    _at_end.append(end)
    try:
        yield
    finally:
        _at_end.remove(end)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay interruptions to the end of a short block: no exception is raised within it.

    Libraries that hold locks deadlock or stay half-changed after one. An interruption that ends the
    process waits for the block, but not for long."""
    came: list[tuple[int, FrameType | None]] = []
    former: dict[signal.Signals, Any] = {}
    with _whole:
        try:
            if threading.current_thread() is threading.main_thread():  # the only one that signals interrupt
                for kind in SIGNALS:
                    handler = signal.getsignal(kind)
                    if callable(handler):
                        former[kind] = handler
                        signal.signal(kind, lambda number, frame: came.append((number, frame)))
            yield
        finally:
            for kind, handler in reversed(former.items()):
                signal.signal(kind, handler)
    for number, frame in came[:1]:
        former[signal.Signals(number)](number, frame)


def end_of_process(patience: float) -> list[str]:
    """Wait at most so many seconds for what is done wholly, do what is to be done at the end, return what it says.

    Nothing that is written wholly or not at all begins after it: the process has to end."""
    _whole.acquire(timeout=max(patience, 0.0))
    said = []
    for end in reversed(_at_end[:]):
        try:
            text = end()
        except Exception:  # the others still have to be called
            continue
        if text:
            said.append(text)
    kill_descendants()
    return said
