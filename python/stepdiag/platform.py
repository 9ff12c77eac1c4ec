"""What the application asks of the operating system, in one place: processes that can be interrupted, a browser.

Linux alone, at present."""

import os
import signal
import webbrowser
from contextlib import suppress
from typing import Any, Final

# Arguments of a new process, so that Ctrl-C at the program is not one at what it has started.
OWN_GROUP: Final[dict[str, Any]] = {"start_new_session": True}


def interrupt(process: int) -> None:
    """As Ctrl-C does, a process of an OWN_GROUP and those that it has started."""
    with suppress(ProcessLookupError):
        os.killpg(process, signal.SIGINT)


def exit_code(status: int) -> int:
    """Of a process that ended by itself or by a signal, as a shell has it."""
    return status if status >= 0 else 128 - status


def open_browser(address: str) -> bool:
    """In the person's own browser. False: there is none."""
    return webbrowser.open(address)


def is_running(process: int) -> bool:
    """Whether there is a process of this number that we may ask."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, PermissionError, OverflowError):
        return False
    return True


def quiet_environment() -> dict[str, str]:
    """Of a process whose output is a file: no colours, and what it says comes at once."""
    return {**os.environ, "NO_COLOR": "1", "PYTHONUNBUFFERED": "1"}
