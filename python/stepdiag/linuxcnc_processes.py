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

PROCESSES = ("rtapi_app", "milltask", "linuxcncsvr")  # a LinuxCNC that runs has all of these


class LinuxcncError(RuntimeError):
    """LinuxCNC is missing, did not start, refused what was asked, or took too long. Its output is in the text or in
    the session's log."""


@contextlib.contextmanager
def linuxcnc_lock(timeout: float = 1800.0) -> Iterator[None]:
    """Held while LinuxCNC runs, or its modules are being installed: there is one of each on a computer."""
    path = Path(tempfile.gettempdir()) / "stepdiag-linuxcnc.lock"
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
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
        yield
    finally:
        os.close(descriptor)


def refuse_a_running_one() -> None:
    """Another LinuxCNC, of a user or a real machine, must not be touched. A lock file without a process is stale."""
    running = sorted({name for _, name in processes() if name in PROCESSES})
    if running:
        raise LinuxcncError(f"another LinuxCNC runs on this computer ({', '.join(running)}); one at a time can")
    with contextlib.suppress(OSError):
        Path("/tmp/linuxcnc.lock").unlink()  # LinuxCNC's own, at this place whatever TMPDIR says


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


def end_all_of(folder: str, environment: Mapping[str, str]) -> None:
    """Ends the processes that were started with this session's folder in their environment. The real-time process has
    left the process group, and hides its environment from an ordinary user: while the lock is held it is this one's."""
    marker = f"STEPDIAG_SESSION_SOCKET={folder}/".encode()
    for attempt in range(3):
        left = []
        for number, name in processes():
            with contextlib.suppress(OSError):
                try:
                    ours = marker in Path(f"/proc/{number}/environ").read_bytes()
                except PermissionError:
                    ours = name == "rtapi_app"
                if ours:
                    left.append(number)
        if not left:
            break
        if attempt == 0:
            with contextlib.suppress(OSError, subprocess.TimeoutExpired):
                subprocess.run(["halrun", "-U"], env=environment, stdin=subprocess.DEVNULL,
                               capture_output=True, timeout=20, cwd="/")  # fmt: skip
            continue
        for number in left:
            with contextlib.suppress(OSError):
                os.kill(number, signal.SIGTERM if attempt == 1 else signal.SIGKILL)
        time.sleep(0.3)
    with contextlib.suppress(OSError):
        Path("/tmp/linuxcnc.lock").unlink()
