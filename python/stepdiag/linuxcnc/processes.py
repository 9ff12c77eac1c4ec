"""The one LinuxCNC that can run on a computer: a lock, a check for others, and clean-up."""

import contextlib
import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from stepdiag.platform import KILL, lock

# Keys of shared memory: LinuxCNC's task (linuxcnc.nml), motion, HAL, RTAPI and their clients.
SHARED_MEMORY = {1001, 1002, 1003, 1004, 1005, 100, 0x48414C32, 0x90280A48, 0x48484C34}
PROCESSES = ("rtapi_app", "milltask", "linuxcncsvr")  # a running LinuxCNC has all of these


class LinuxcncError(RuntimeError):
    """LinuxCNC is missing, does not start, refuses a request, or takes too long.

    Its output is in the message or in the session's log."""


_held: list[int] = []  # the lock of this process, which must not wait for itself


@contextlib.contextmanager
def linuxcnc_lock(timeout: float = 1800.0) -> Iterator[None]:
    """Lock to hold while LinuxCNC runs or its modules are installed: a computer has one of each."""
    if _held:
        raise LinuxcncError("this process runs LinuxCNC already; only one session can run at a time")
    path = Path(tempfile.gettempdir()) / "stepdiag-linuxcnc.lock"
    with contextlib.suppress(FileExistsError):
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    descriptor = os.open(path, os.O_RDONLY)  # also for another user's file
    try:
        end = time.monotonic() + timeout
        while True:
            try:
                lock(descriptor)
                break
            except OSError:
                if time.monotonic() > end:
                    raise LinuxcncError(f"{path}: still held by another run of LinuxCNC after {timeout:g} s") from None
                time.sleep(0.05)
        _held.append(descriptor)
        yield
    finally:
        _held.clear()
        os.close(descriptor)


def refuse_a_running_one(patience: float = 15.0) -> None:
    """Raise LinuxcncError if another LinuxCNC runs: it may belong to a user or a real machine.

    A LinuxCNC of a crashed session ends by itself or is ended here. No other session can be alive,
    because this process holds the lock."""
    end = time.monotonic() + patience
    while True:
        running = sorted({name for _, name in processes() if name in PROCESSES})
        old = of_sessions("/")  # also a clean-up script, still running
        if not running and not old:
            break
        if time.monotonic() > end:
            raise LinuxcncError(
                f"another LinuxCNC runs on this computer ({', '.join(running)}); only one can run at a time"
            )
        if time.monotonic() > end - patience / 2:
            end_processes(old)
        time.sleep(0.1)
    remove_leavings()


def remove_leavings() -> None:
    """Remove a killed LinuxCNC's lock file and shared memory, which disturb the next one."""
    with contextlib.suppress(OSError):
        Path("/tmp/linuxcnc.lock").unlink()  # this path does not depend on TMPDIR
    with contextlib.suppress(OSError, ValueError):
        _, *segments = Path("/proc/sysvipc/shm").read_text().splitlines()
        for key, number, _, _, _, _, users, *_ in map(str.split, segments):
            if int(key) & 0xFFFFFFFF in SHARED_MEMORY and int(users) == 0:
                subprocess.run(["ipcrm", "-m", number], stdin=subprocess.DEVNULL, capture_output=True, timeout=10)


def processes() -> list[tuple[int, str]]:
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError):
                status = (entry / "stat").read_text(errors="replace")
                name, rest = status[status.index("(") + 1 :].rsplit(")", 1)
                if rest.split()[0] != "Z":
                    found.append((int(entry.name), name))
    return found


def of_sessions(folder: str) -> list[int]:
    """LinuxCNC's processes started by sessions in such a folder, found by their environment."""
    marker = f"STEPDIAG_SESSION_SOCKET={folder}".encode()
    found = []
    for number, _ in processes():
        with contextlib.suppress(OSError):
            if marker in Path(f"/proc/{number}/environ").read_bytes():
                found.append(number)
    return found


def end_processes(numbers: list[int], sign: signal.Signals = KILL) -> None:
    for number in numbers:
        with contextlib.suppress(OSError):
            os.kill(number, sign)


def end_all_of(folder: str, environment: Mapping[str, str]) -> None:
    """End all processes of a session.

    The real-time process has left the process group and hides its environment from ordinary users.
    It ends at halrun's request."""
    with contextlib.suppress(OSError, subprocess.TimeoutExpired):
        if of_sessions(folder) or any(name == "rtapi_app" for _, name in processes()):
            subprocess.run(["halrun", "-U"], env=environment, stdin=subprocess.DEVNULL,
                           capture_output=True, timeout=20, cwd="/")  # fmt: skip
    for sign in (signal.SIGTERM, KILL):
        left = of_sessions(folder)
        end_processes(left, sign)
        if left:
            time.sleep(0.3)
    remove_leavings()
