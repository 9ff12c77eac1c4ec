"""What differs between operating systems, all of it: files and locks, processes and signals, memory, streams.

Linux and Windows. No other module asks which system this is (tests/python/test_platform.py).
"""

import functools
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path, PureWindowsPath
from typing import IO, Any, Final

_RENAMES: Final = 20  # tries on Windows, where a virus scanner holds a new file for a moment
_BETWEEN_RENAMES: Final = 0.05  # s


# --- processes -------------------------------------------------------------------------------------------------------
def exit_code(status: int) -> int:
    """Of a process that ended by itself or by a signal, as a shell has it."""
    return status if status >= 0 else 128 - status


def open_browser(address: str) -> bool:
    """In the person's own browser. False: there is none."""
    import webbrowser  # and half of the standard library

    return webbrowser.open(address)


def quiet_environment() -> dict[str, str]:
    """Of a process whose output is a file: no colours, and what it says comes at once, in UTF-8."""
    return {**os.environ, "NO_COLOR": "1", "PYTHONUNBUFFERED": "1", "PYTHONUTF8": "1"}


def kill_descendants() -> None:
    """Kill the workers, browsers and other programs that this process has started, and theirs."""
    # multiprocessing's tracker was first: processes that miss it start another.
    children = descendants()
    for child in children:
        with suppress(OSError):
            os.kill(child, KILL)
    for child in children:
        _forget(child)


# --- files -----------------------------------------------------------------------------------------------------------
def open_to_read(path: Path) -> int:
    """The descriptor of a file. A pipe without a writer is opened, too, and does not block."""
    return os.open(path, os.O_RDONLY | _READING)


def open_new(path: Path, mode: int = 0o600) -> int:
    """The descriptor of a file that nobody else has made, to write and read."""
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | _OPENING, mode)


def open_to_append(path: Path, *, create: bool = False) -> int:
    return os.open(path, os.O_RDWR | os.O_APPEND | (os.O_CREAT if create else 0) | _OPENING, 0o666)


def open_in_place(path: Path) -> int:
    """The descriptor of a file whose content is written over, not replaced."""
    return os.open(path, os.O_RDWR | os.O_CREAT | _OPENING, 0o666)


if sys.platform == "win32":
    import ctypes
    import msvcrt
    from ctypes import wintypes

    import psutil

    SIGNALS: Final = (signal.SIGINT, signal.SIGBREAK)  # Ctrl-C; Ctrl-Break, and what `interrupt` sends
    KILL: Final = signal.SIGTERM  # ends a process at once
    OWN_GROUP: Final[dict[str, Any]] = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    OPEN_FILES_CAN_GO: Final = False  # whether a file that is open can be removed
    _OPENING: Final = os.O_BINARY | os.O_NOINHERIT
    _READING: Final = _OPENING
    CLEARED_LINE: Final = "\r" + 79 * " " + "\r"  # of a console, which may not know escapes
    # Why there is none.
    NO_LINUXCNC: Final[str | None] = "LinuxCNC runs on Linux alone; everything else of stepdiag works on Windows"
    _KERNEL: Final = ctypes.WinDLL("kernel32", use_last_error=True)
    _KERNEL.LocalFree.argtypes = [ctypes.c_void_p]
    _SPLIT: Final = ctypes.WinDLL("shell32").CommandLineToArgvW
    _SPLIT.argtypes = [wintypes.LPCWSTR, ctypes.POINTER(ctypes.c_int)]
    _SPLIT.restype = ctypes.POINTER(wintypes.LPWSTR)

    class _Memory(ctypes.Structure):
        """MEMORYSTATUSEX."""

        _fields_ = [
            ("dwLength", wintypes.DWORD),
            ("dwMemoryLoad", wintypes.DWORD),
            *((name, ctypes.c_uint64) for name in ("total", "available", "paged", "free_paged", "virtual", "free")),
            ("extended", ctypes.c_uint64),
        ]

    def interrupt(process: int) -> None:
        """As Ctrl-C does, a process of an OWN_GROUP and those that it has started."""
        with suppress(OSError, SystemError):  # the second where Python has ended it, for want of a console
            os.kill(process, signal.CTRL_BREAK_EVENT)

    def is_running(process: int) -> bool:
        return bool(psutil.pid_exists(process))

    def end_group(process: "subprocess.Popen[bytes]", patience: float) -> None:
        """End a process of an OWN_GROUP and its children."""
        subprocess.run(
            ["taskkill", "/T", "/F", "/PID", str(process.pid)], capture_output=True, check=False, timeout=60.0
        )
        with suppress(OSError):
            process.kill()
        process.wait()

    def descendants() -> list[int]:
        """The processes that this one has started, and theirs.

        Windows gives the number of a process that has ended to another one, whose children are not ours: psutil knows
        that a child is younger than its parent. What shows the console is a child of the first program in it, which
        would be ended with it."""

        def shows_console(child: psutil.Process) -> bool:
            with suppress(psutil.Error, OSError, IndexError):
                program = PureWindowsPath(child.cmdline()[0]).name
                return program.lower() in ("conhost.exe", "openconsole.exe")
            return False

        children = psutil.Process().children(recursive=True)
        return [child.pid for child in reversed(children) if not shows_console(child)]

    def _forget(child: int) -> None:
        pass

    @contextmanager
    def deaf_to_interruption() -> Iterator[None]:
        """Windows has no blocked signals: what is started here hears Ctrl-C, too."""
        yield

    def free_memory() -> Iterator[float]:
        """Bytes that this process can still take, by each limit."""
        found = _Memory(dwLength=ctypes.sizeof(_Memory))
        if _KERNEL.GlobalMemoryStatusEx(ctypes.byref(found)):
            yield float(min(found.available, found.free_paged))

    def semaphores_of_this_process() -> list[Path]:
        """None has a name that stays."""
        return []

    def is_administrator() -> bool:
        return False  # nothing differs for one

    def command_line(words: Sequence[str]) -> str:
        """As a person types it."""
        return subprocess.list2cmdline(words)

    def words_of(line: str) -> list[str]:
        """Of a command as a person types it. Raises ValueError for a quotation without an end."""
        if re.sub(r'\\\\|\\"', "", line).count('"') % 2:  # a backslash keeps a backslash or a quotation mark
            raise ValueError("No closing quotation")
        count = ctypes.c_int()
        found = _SPLIT(f"program {line}", ctypes.byref(count))  # the first word has rules of its own
        try:
            return [str(found[place]) for place in range(1, count.value)]
        finally:
            _KERNEL.LocalFree(found)

    def fingerprint_commands(names: Sequence[str]) -> list[str]:
        """What a person types to see the SHA-256 of these files."""
        return [command_line(["certutil", "-hashfile", name, "SHA256"]) for name in names]

    def lock(handle: int) -> None:
        """Lock an open file against other processes, until it is closed. Raises OSError if another one has it."""
        size = os.lseek(handle, 0, os.SEEK_END)
        # Beyond the end, where Windows lets nobody else read what is locked, and within the 31 bits of _locking.
        os.lseek(handle, 2**30, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(handle, size, os.SEEK_SET)

    def keep_mode(handle: int, target: Path) -> None:
        """Windows gives a file the permissions of its folder."""

    def replace(temporary: Path, target: Path) -> None:
        """Rename over another file."""
        for number in range(_RENAMES):
            try:
                os.replace(temporary, target)
                return
            except PermissionError:
                if number == _RENAMES - 1:
                    raise
                time.sleep(_BETWEEN_RENAMES)

    def let_go(handle: int) -> None:
        """Close a file as the process ends, so that it can be removed; its thread may be writing: no long wait."""

        def close() -> None:
            with suppress(OSError):
                os.close(handle)

        closing = threading.Thread(target=close, daemon=True)
        closing.start()
        closing.join(_BETWEEN_RENAMES)

    def sync_folder(folder: Path) -> None:
        """Windows keeps the name with the file."""

    def write_at_begin(handle: int, content: bytes) -> None:
        """Write over the beginning of a file, at once."""
        os.lseek(handle, 0, os.SEEK_SET)
        os.write(handle, content)

    def reserve(handle: int, size: int) -> None:
        """Make a file so large. Raises OSError if there is no room."""
        os.ftruncate(handle, size)

    def is_device_name(path: Path) -> bool:
        return str(path).startswith("\\\\.\\") or PureWindowsPath(path).is_reserved()

    def has_writer(pipe: int, patience: float) -> bool:
        """Whether a program opens a pipe for writing within so many seconds."""
        return True

    def block(handle: int) -> None:
        """Files and pipes always wait."""

    def memory_folder() -> Path | None:
        """A folder in memory."""
        return None

    def of_pipe(pipe: IO[bytes]) -> "Unblocked | DirectPipe":
        return Unblocked(lambda size: os.read(pipe.fileno(), size))

    @functools.cache  # its thread has read what others would wait for
    def of_standard_input(number: int) -> "Unblocked | DirectPipe":
        """What is typed, or comes by a pipe, to be waited for; `number` is its descriptor."""
        return Unblocked(lambda size: os.read(number, size))

    def never_blocks(pipe: IO[bytes]) -> None:
        """Windows's pipes wait for a program that does not read."""

    def of_port(port: Any) -> "Unblocked | DirectPipe":
        """A serial port (pyserial), to be waited for."""
        port.timeout = None

        def read(size: int) -> bytes:
            first: bytes = port.read(1)
            more: bytes = port.read(min(size - 1, port.in_waiting))
            return first + more

        return Unblocked(read)

else:
    import fcntl
    import resource
    import select
    import shlex

    SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)
    KILL: Final = signal.SIGKILL
    # Arguments of a new process, so that Ctrl-C at the program is not one at what it has started.
    OWN_GROUP: Final[dict[str, Any]] = {"start_new_session": True}
    OPEN_FILES_CAN_GO: Final = True  # whether a file that is open can be removed
    CLEARED_LINE: Final = "\r\x1b[K"  # of a terminal
    NO_LINUXCNC: Final[str | None] = None
    _OPENING: Final = os.O_CLOEXEC
    _READING: Final = os.O_NONBLOCK | os.O_CLOEXEC

    def interrupt(process: int) -> None:
        """As Ctrl-C does, a process of an OWN_GROUP and those that it has started."""
        with suppress(ProcessLookupError):
            os.killpg(process, signal.SIGINT)

    def is_running(process: int) -> bool:
        """Whether there is a process of this number that we may ask."""
        try:
            os.kill(process, 0)
        except (ProcessLookupError, PermissionError, OverflowError):
            return False
        return True

    def end_group(process: "subprocess.Popen[bytes]", patience: float) -> None:
        """End a process of an OWN_GROUP and its children; they have so many seconds for it before they are killed."""
        for number in (signal.SIGTERM, signal.SIGKILL):
            try:
                os.killpg(process.pid, number)  # also where it has ended and left children
            except ProcessLookupError:
                break
            except PermissionError:
                process.send_signal(number)
            with suppress(subprocess.TimeoutExpired):
                process.wait(patience)
        process.wait()

    def descendants() -> list[int]:
        """The processes that this one has started, and theirs; what started last is first."""
        parents = dict(_parents())
        ours = {os.getpid()}
        while more := {child for child, parent in parents.items() if parent in ours} - ours:
            ours |= more
        return sorted(ours - {os.getpid()}, reverse=True)

    def _parents() -> Iterator[tuple[int, int]]:
        with suppress(OSError):
            for entry in os.listdir("/proc"):
                if entry.isdigit():
                    with suppress(OSError, ValueError, IndexError):
                        status = Path(f"/proc/{entry}/stat").read_text(errors="replace")
                        yield int(entry), int(status.rsplit(")", 1)[1].split()[1])

    def _forget(child: int) -> None:
        """Take the status of a process, if this one has started it."""
        with suppress(OSError):
            os.waitpid(child, 0)

    @contextmanager
    def deaf_to_interruption() -> Iterator[None]:
        """What is started here does not hear Ctrl-C, from its first instruction on: a process has the blocked signals
        of the thread that starts it, and a thread those of its maker."""
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def free_memory() -> Iterator[float]:
        """Bytes that this process can still take: of the computer, of its control groups, of its limit of addresses."""
        with suppress(OSError, ValueError, IndexError):
            for line in Path("/proc/meminfo").read_text().splitlines():
                if line.startswith("MemAvailable:"):
                    yield 1024.0 * int(line.split()[1])
        yield from _of_groups()
        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit != resource.RLIM_INFINITY:
            with suppress(OSError, ValueError, IndexError):
                pages = int(Path("/proc/self/statm").read_text().split()[0])
                yield max(0.0, float(limit - pages * resource.getpagesize()))

    def _of_groups() -> Iterator[float]:
        """What is left of the limits of this process's control groups, versions 2 and 1, and of those above them."""
        with suppress(OSError, ValueError):
            for line in Path("/proc/self/cgroup").read_text().splitlines():
                _, controllers, path = line.split(":", 2)
                if controllers == "":
                    root, limit, used = Path("/sys/fs/cgroup"), "memory.max", "memory.current"
                elif "memory" in controllers.split(","):
                    root, limit, used = Path("/sys/fs/cgroup/memory"), "memory.limit_in_bytes", "memory.usage_in_bytes"
                else:
                    continue
                group = root / path.lstrip("/")
                for folder in (group, *group.parents):
                    with suppress(OSError, ValueError):  # "max"; or a path of another namespace
                        yield max(0.0, int((folder / limit).read_text()) - _in_use(folder, used))
                    if folder == root:
                        break

    def _in_use(folder: Path, used: str) -> float:
        """Without the pages of files, which make room."""
        files = 0
        for line in (folder / "memory.stat").read_text().splitlines():
            name, value = line.split()
            if name in ("inactive_file", "total_inactive_file"):
                files = max(files, int(value))
        return float(int((folder / used).read_text()) - files)

    def semaphores_of_this_process() -> list[Path]:
        """Those that this process has mapped, which multiprocessing removes where processes end in order."""
        maps = Path("/proc/self/maps").read_text(errors="replace")
        inodes = set(re.findall(r" (\d+) +/dev/shm/sem\.", maps))
        found = []
        for path in Path("/dev/shm").glob("sem.mp-*"):
            with suppress(OSError):
                if str(path.stat().st_ino) in inodes:
                    found.append(path)
        return found

    def is_administrator() -> bool:
        return os.geteuid() == 0

    def command_line(words: Sequence[str]) -> str:
        """As a person types it."""
        return shlex.join(words)

    def words_of(line: str) -> list[str]:
        """Of a command as a person types it. Raises ValueError for a quotation without an end."""
        return shlex.split(line)

    def fingerprint_commands(names: Sequence[str]) -> list[str]:
        """What a person types to see the SHA-256 of these files."""
        return [command_line(["sha256sum", *names])]

    def lock(handle: int) -> None:
        """Lock an open file against other processes, until it is closed. Raises OSError if another one has it."""
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def keep_mode(handle: int, target: Path) -> None:
        """Give a new file the permissions of the one that it replaces, or those that files have."""
        mask = os.umask(0)
        os.umask(mask)
        os.fchmod(handle, target.stat().st_mode & 0o7777 if target.exists() else 0o666 & ~mask)

    def replace(temporary: Path, target: Path) -> None:
        """Rename over another file."""
        os.replace(temporary, target)

    def let_go(handle: int) -> None:
        """An open file can be removed."""

    def sync_folder(folder: Path) -> None:
        """Sync a folder, so that the name of a new file survives a power cut."""
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

    def write_at_begin(handle: int, content: bytes) -> None:
        """Write over the beginning of a file, at once."""
        os.pwrite(handle, content, 0)

    def reserve(handle: int, size: int) -> None:
        """Make a file so large. Raises OSError if there is no room."""
        os.posix_fallocate(handle, 0, size)

    def is_device_name(path: Path) -> bool:
        # Do not resolve: /dev/stdout may lead to a file, and renaming would replace the link.
        name = os.path.abspath(path)
        return name.startswith("/dev/") and not name.startswith("/dev/shm/")  # a file system in memory

    def has_writer(pipe: int, patience: float) -> bool:
        """Whether a program opens a pipe for writing within so many seconds."""
        polled = select.poll()
        polled.register(pipe, select.POLLIN)
        return bool(polled.poll(patience * 1e3))

    def block(handle: int) -> None:
        """Let reading wait for what comes."""
        os.set_blocking(handle, True)

    def memory_folder() -> Path | None:
        """A folder in memory."""
        return Path("/dev/shm")

    def of_pipe(pipe: IO[bytes]) -> "Unblocked | DirectPipe":
        """The output of a program, to be waited for."""
        os.set_blocking(pipe.fileno(), False)
        return DirectPipe(pipe.fileno())

    def of_standard_input(number: int) -> "Unblocked | DirectPipe":
        """What is typed, or comes by a pipe, to be waited for; `number` is its descriptor."""
        return DirectPipe(number)  # blocks, for the terminal is the shell's, too: read it when a selector says so

    def never_blocks(pipe: IO[bytes]) -> None:
        """Writing raises BlockingIOError where a program does not read."""
        os.set_blocking(pipe.fileno(), False)

    def of_port(port: Any) -> "Unblocked | DirectPipe":
        """A serial port (pyserial), to be waited for. Raises OSError."""
        import termios

        os.set_blocking(port.fileno(), False)
        try:
            attributes = termios.tcgetattr(port.fileno())
            attributes[6][termios.VMIN] = 1  # a read without bytes is the end of the port, not a pause
            termios.tcsetattr(port.fileno(), termios.TCSANOW, attributes)
        except termios.error as error:
            raise OSError(*error.args) from None
        return DirectPipe(port.fileno())


# --- streams ---------------------------------------------------------------------------------------------------------
class DirectPipe:
    """A descriptor that a selector takes."""

    def __init__(self, handle: int) -> None:
        self._handle = handle

    def fileno(self) -> int:
        return self._handle

    def read(self, size: int) -> bytes:
        """What has come; nothing at the end. Raises BlockingIOError where there is nothing yet."""
        return os.read(self._handle, size)

    def close(self) -> None:
        pass


class Unblocked:
    """The same of what only blocks: a thread reads it, and what it reads goes through a pair of sockets."""

    def __init__(self, read: Callable[[int], bytes]) -> None:
        self._read = read
        self._here, self._there = socket.socketpair()
        self._here.setblocking(False)
        threading.Thread(target=self._follow, daemon=True).start()

    def fileno(self) -> int:
        return self._here.fileno()

    def read(self, size: int) -> bytes:
        return self._here.recv(size)

    def close(self) -> None:
        self._here.close()

    def _follow(self) -> None:
        with self._there, suppress(Exception):  # whatever a driver raises, or the other end is closed
            while piece := self._read(2**16):
                self._there.sendall(piece)
