"""The one LinuxCNC that a computer can run: whose turn it is, whether one runs, and ending what is left of one."""

import contextlib
import fcntl
import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

# Keys: messages to and from LinuxCNC's task (linuxcnc.nml), motion, then HAL, RTAPI and their clients.
SHARED_MEMORY = {1001, 1002, 1003, 1004, 1005, 100, 0x48414C32, 0x90280A48, 0x48484C34}
PROCESSES = ("rtapi_app", "milltask", "linuxcncsvr")  # a LinuxCNC that runs has all of these


class LinuxcncError(RuntimeError):
    """LinuxCNC is missing, did not start, refused what was asked, or took too long. Its output is in the text or in
    the session's log."""


_held: list[int] = []  # this process's lock: waiting for oneself would take for ever


@contextlib.contextmanager
def linuxcnc_lock(timeout: float = 1800.0) -> Iterator[None]:
    """Held while LinuxCNC runs, or its modules are being installed: there is one of each on a computer."""
    if _held:
        raise LinuxcncError("this process runs LinuxCNC already; one session at a time can")
    path = Path(tempfile.gettempdir()) / "stepdiag-linuxcnc.lock"
    with contextlib.suppress(FileExistsError):
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)  # somebody else's file may be locked too
    try:
        end = time.monotonic() + timeout
        while True:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() > end:
                    raise LinuxcncError(f"{path}: still held by another run of LinuxCNC after {timeout:g} s") from None
                time.sleep(0.05)
        _held.append(descriptor)
        yield
    finally:
        _held.clear()
        os.close(descriptor)


def refuse_a_running_one(patience: float = 15.0) -> None:
    """Another LinuxCNC, of a user or a real machine, must not be touched. One of a session that has crashed ends by
    itself or is ended here: the lock is held, so that no other session lives."""
    end = time.monotonic() + patience
    while True:
        running = sorted({name for _, name in processes() if name in PROCESSES})
        old = of_sessions("/")  # also the script that clears up last, and would clear away what is begun now
        if not running and not old:
            break
        if time.monotonic() > end:
            raise LinuxcncError(f"another LinuxCNC runs on this computer ({', '.join(running)}); one at a time can")
        if time.monotonic() > end - patience / 2:
            end_processes(old)
        time.sleep(0.1)
    remove_leavings()


def remove_leavings() -> None:
    """What a LinuxCNC that was killed leaves: its lock file, and shared memory that would confuse the next one."""
    with contextlib.suppress(OSError):
        Path("/tmp/linuxcnc.lock").unlink()  # at this place whatever TMPDIR says
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
    """The processes of LinuxCNC that a session with a folder like this has started: it is in their environment."""
    marker = f"STEPDIAG_SESSION_SOCKET={folder}".encode()
    found = []
    for number, _ in processes():
        with contextlib.suppress(OSError):
            if marker in Path(f"/proc/{number}/environ").read_bytes():
                found.append(number)
    return found


def end_processes(numbers: list[int], sign: signal.Signals = signal.SIGKILL) -> None:
    for number in numbers:
        with contextlib.suppress(OSError):
            os.kill(number, sign)


def end_all_of(folder: str, environment: Mapping[str, str]) -> None:
    """Ends what a session has started. The real-time process has left the process group, and hides its environment
    from an ordinary user: halrun asks it to end."""
    with contextlib.suppress(OSError, subprocess.TimeoutExpired):
        if of_sessions(folder) or any(name == "rtapi_app" for _, name in processes()):
            subprocess.run(["halrun", "-U"], env=environment, stdin=subprocess.DEVNULL,
                           capture_output=True, timeout=20, cwd="/")  # fmt: skip
    for sign in (signal.SIGTERM, signal.SIGKILL):
        left = of_sessions(folder)
        end_processes(left, sign)
        if left:
            time.sleep(0.3)
    remove_leavings()
