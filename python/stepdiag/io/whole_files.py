"""Reads and writes small files, completely or not at all."""

import errno
import glob
import os
import stat
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

from stepdiag import platform
from stepdiag._core import InvalidArgument
from stepdiag.display import visible
from stepdiag.interruption import at_end, uninterrupted

# No scenario is larger. The limit also ends the reading of an endless device.
LARGEST_TEXT = 16 * 2**20
# The full covariance for a thousand steps has 2.6 GB.
LARGEST_BINARY = 8 * 2**30
# How long to wait for a program that opens a pipe for writing, s. The core has the same (core/text_file.cpp).
PATIENCE = 2.0


def read_text(path: Path) -> str:
    """Read a text file. Raises InvalidArgument if it cannot be read, is empty, or is not UTF-8."""
    content = _read(path, LARGEST_TEXT + 1)
    if len(content) > LARGEST_TEXT:
        raise InvalidArgument(f"{path}: larger than {LARGEST_TEXT // 2**20} MiB")
    if not content.strip():
        raise InvalidArgument(f"{path}: the file is empty")
    if b"\0" in content:
        raise InvalidArgument(f"{path}: expected a text file, got binary data")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InvalidArgument(f"{path}, line {line}: expected UTF-8 text") from None


def read_beginning(path: Path) -> str:
    """The beginning of a file, enough to recognise its kind; invalid UTF-8 is replaced."""
    return _read(path, 2**16).decode("utf-8-sig", errors="replace")


def read_bytes(path: Path) -> bytes:
    """Read a file.

    Raises InvalidArgument if it cannot be read, is empty, or is not a regular file."""
    try:
        status = path.stat()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        raise InvalidArgument(f"{path}: cannot be read: {reason(error)}") from None
    if not stat.S_ISREG(status.st_mode):
        raise InvalidArgument(f"{path}: expected a file, got a folder, a pipe or a device")
    if status.st_size > LARGEST_BINARY:
        raise InvalidArgument(f"{path}: larger than {LARGEST_BINARY // 2**30} GiB")
    content = _read(path, status.st_size)
    if not content:
        raise InvalidArgument(f"{path}: the file is empty")
    return content


def _read(path: Path, size: int) -> bytes:
    """At most so many bytes of a regular file or of a pipe into which a program writes."""
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise InvalidArgument(f"{path}: expected a file, got a folder")
        check_input(path)
        # The opening of a pipe without a writer blocks without O_NONBLOCK.
        with open(platform.open_to_read(path), "rb") as file:
            begun = b""
            if stat.S_ISFIFO(mode):
                begun = _first_byte(file.fileno(), path)
                platform.block(file.fileno())
            return begun + file.read(size - len(begun))
    except InvalidArgument:  # is a ValueError
        raise
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        raise InvalidArgument(f"{path}: cannot be read: {reason(error)}") from None


def _first_byte(pipe: int, path: Path) -> bytes:
    """The first byte of a pipe; none if its writer takes its time, or wrote nothing.

    Raises InvalidArgument if no program opens the pipe for writing within PATIENCE."""
    ready = platform.has_writer(pipe, PATIENCE)
    try:
        first = os.read(pipe, 1)
    except BlockingIOError:
        return b""
    if not ready and not first:
        raise InvalidArgument(f"{path}: expected a file, got a pipe into which no program writes")
    return first


def check_input(path: Path) -> None:
    """Raise InvalidArgument for devices: some never end."""
    if path.exists() and not (path.is_file() or path.is_dir() or path.is_fifo()):
        raise InvalidArgument(f"{path}: expected a file, got a device")


def write_whole(path: Path, content: str | bytes | memoryview) -> None:
    """Write a file: `path` is either the old or the complete new one, on disk when this returns.

    What nobody would see in a text, such as escapes that came from another file, stands escaped (`visible`)."""
    with _whole_file(path) as handle:
        _write_all(handle, content)


def write_set(files: Mapping[Path, str]) -> None:
    """Write files that belong together: all are on the disk under temporary names before the first is renamed.

    Only what ends the process between two renames leaves old ones beside new ones: not Ctrl-C."""
    with uninterrupted(), ExitStack() as stack:
        for path, text in files.items():
            handle = stack.enter_context(_whole_file(path))
            _write_all(handle, text)
            os.fsync(handle)


@contextmanager
def _whole_file(path: Path) -> Iterator[int]:
    """The descriptor of a temporary file beside `path`, which replaces it when the block ends without an error.

    Nothing opens the temporary file by its name: an interruption that has just removed it would find it again."""
    check_output(path)
    target = Path(os.path.realpath(path))  # keeps a symbolic link
    # A name of its own, not mkstemp's: Ctrl-C may come between the making of the file and its return.
    temporary = target.with_name(f"{target.name}.{os.urandom(8).hex()}")
    handle = -1

    def give_up() -> None:
        if handle >= 0:
            platform.let_go(handle)
        _remove(temporary)

    with at_end(give_up):
        try:
            with uninterrupted():
                handle = platform.open_new(temporary)
            yield handle
            with uninterrupted():
                platform.keep_mode(handle, target)
                os.fsync(handle)
                written, handle = handle, -1
                os.close(written)
                platform.replace(temporary, target)
                platform.sync_folder(target.parent)
        except BaseException as error:
            if handle >= 0:
                os.close(handle)
            _remove(temporary)
            if isinstance(error, OSError):
                raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
            raise


def _write_all(handle: int, content: str | bytes | memoryview) -> None:
    rest = memoryview(visible(content, lines=True).encode() if isinstance(content, str) else content)
    while rest:
        rest = rest[os.write(handle, rest) :]


def _remove(path: Path) -> None:
    path.unlink(missing_ok=True)


def write_by_core(path: str | os.PathLike[str], write: Callable[[str | os.PathLike[str]], None]) -> None:
    """Let the core write a file, by the rules of this module. It takes pipes and devices, too.

    Raises InvalidArgument."""
    target = Path(os.path.realpath(path))

    def remove() -> None:
        for temporary in target.parent.glob(f"{glob.escape(target.name)}.{os.getpid()}-*"):  # open_temporary()
            _remove(temporary)

    with at_end(remove), uninterrupted():
        write(path)


def check_output(path: Path) -> None:
    """Raise InvalidArgument if `path` cannot be written. To be called before the work."""
    folder = path.parent
    if platform.is_device_name(path):
        raise InvalidArgument(f"{path}: cannot be written: expected the name of a file, got that of a device")
    if not folder.is_dir():
        raise InvalidArgument(f"{path}: cannot be written: the folder {folder} does not exist")
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        mode = None
    except OSError as error:
        raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
    # Renaming over a device such as /dev/null would replace it.
    if mode is not None and not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "not a regular file"
        raise InvalidArgument(f"{path}: cannot be written: it is {what}")
    _check_not_read_only(path)
    if not os.access(folder, os.W_OK):
        raise InvalidArgument(f"{path}: cannot be written: no permission to write in {folder}")


def _check_not_read_only(path: Path) -> None:
    """Raise InvalidArgument for a file that was made read-only: renaming would replace it all the same.

    So would root, who may write everything: it is the mode that counts."""
    if path.is_file() and not (path.stat().st_mode & 0o222 and os.access(path, os.W_OK)):
        raise InvalidArgument(
            f"{path}: cannot be written: the file is read-only; make it writable, or name another file"
        )


def make_folder(path: Path) -> None:
    """Make a folder and its parents."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidArgument(f"{path}: the folder cannot be made: {reason(error)}") from None


def reason(error: Exception) -> str:
    if isinstance(error, FileNotFoundError):  # in the words that the core has; Windows has its own, in its language
        return os.strerror(errno.ENOENT)
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
