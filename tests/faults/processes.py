"""Runs a function in a forked child of this process, which has everything imported: a case takes its own time only."""

import ctypes
import faulthandler
import os
import selectors
import signal
import struct
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

LONGEST = 30.0  # s, after which a case hangs


@dataclass(frozen=True)
class Outcome:
    status: int  # negative: the signal that ended it
    said: str  # standard error
    hung: bool
    seconds: float  # after the interruption, if there was one
    interrupted: bool = False

    @property
    def crashed(self) -> bool:
        return self.status in (-signal.SIGSEGV, -signal.SIGABRT, -signal.SIGBUS, -signal.SIGFPE, -signal.SIGILL)

    @property
    def is_one_line(self) -> bool:
        said = [line for line in self.said.splitlines() if not line.startswith(("warning:", "stepdiag: note:"))]
        return len(said) == 1 and said[0].startswith("stepdiag: ")


def in_child(
    work: Callable[[], int], errors: Path, *, patience: float = LONGEST, interrupt: float | None = None
) -> Outcome:
    """Run `work` and return how it ended. `interrupt`: send SIGINT so many seconds after its beginning."""
    start = time.monotonic()
    begun, begins = os.pipe2(os.O_CLOEXEC)
    child = os.fork()
    if child == 0:
        status = 70
        try:
            handle = os.open(errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
            nothing = os.open(os.devnull, os.O_RDWR)
            os.dup2(nothing, 0)
            os.dup2(nothing, 1)
            os.dup2(handle, 2)
            signal.signal(signal.SIGINT, signal.default_int_handler)
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            faulthandler.enable()
            os.close(begins)
            status = work()
        except BaseException:
            sys.excepthook(*sys.exc_info())
        finally:
            sys.stderr.flush()
            os._exit(status)
    watch = os.pidfd_open(child)
    hung = sent = False
    with selectors.DefaultSelector() as selector:
        selector.register(watch, selectors.EVENT_READ)
        os.close(begins)
        os.read(begun, 1)  # its end: the child is there
        os.close(begun)
        if interrupt is not None and not selector.select(interrupt):
            start, sent = time.monotonic(), True
            os.kill(child, signal.SIGINT)
        if not selector.select(patience):
            hung = True
            os.kill(child, signal.SIGKILL)
    os.close(watch)
    _, code = os.waitpid(child, 0)
    said = errors.read_text(errors="replace") if errors.exists() else ""
    return Outcome(os.waitstatus_to_exitcode(code), said, hung, time.monotonic() - start, sent)


def give_up_privileges() -> None:
    """Root without capabilities may write as little as the owner of a folder."""
    header, nothing = struct.pack("<Ii", 0x20080522, 0), bytes(24)  # version 3 of capset(2), this process
    if ctypes.CDLL(None, use_errno=True).capset(header, nothing) != 0:
        raise OSError(ctypes.get_errno(), "capset")
