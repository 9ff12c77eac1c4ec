"""Reading and writing of small text files: whole or not at all."""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stepdiag._core import InvalidArgument

# No scenario is larger; a device that never ends is not read to its end.
LARGEST_TEXT = 16 * 2**20
# The whole covariance of a thousand steps has 2.6 GB.
LARGEST_BINARY = 8 * 2**30


def read_text(path: Path) -> str:
    """The file's text. Raises InvalidArgument where it cannot be read, is empty, or is not UTF-8 text."""
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
    """Enough of the file to tell what it is; what is no text comes as it may."""
    return _read(path, 2**16).decode("utf-8-sig", errors="replace")


def read_bytes(path: Path) -> bytes:
    """The file's bytes. Raises InvalidArgument where it cannot be read, is empty, or is no regular file."""
    try:
        status = path.stat()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        raise InvalidArgument(f"{path}: cannot be read: {reason(error)}") from None
    if not stat.S_ISREG(status.st_mode):
        raise InvalidArgument(f"{path}: expected a file, got a folder or a device")
    if status.st_size > LARGEST_BINARY:
        raise InvalidArgument(f"{path}: larger than {LARGEST_BINARY // 2**30} GiB")
    content = _read(path, status.st_size)
    if not content:
        raise InvalidArgument(f"{path}: the file is empty")
    return content


def _read(path: Path, size: int) -> bytes:
    try:
        with open(path, "rb") as file:
            return file.read(size)
    except IsADirectoryError:
        raise InvalidArgument(f"{path}: expected a file, got a folder") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        raise InvalidArgument(f"{path}: cannot be read: {reason(error)}") from None


def check_input(path: Path) -> None:
    """Raises InvalidArgument for devices: some never end."""
    if path.exists() and not (path.is_file() or path.is_dir() or path.is_fifo()):
        raise InvalidArgument(f"{path}: expected a file, got a device")


def write_whole(path: Path, content: str | bytes) -> None:
    """Writes a file as a whole: `path` is the old file or the whole new one, on the disk when this returns."""
    with whole_file(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` to write, which takes its place when the block ends without an error."""
    check_output(path)
    target = Path(os.path.realpath(path))  # a symbolic link stays one
    try:
        handle, temporary = tempfile.mkstemp(prefix=f"{target.name}.", dir=target.parent)
    except OSError as error:
        raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
    try:
        yield Path(temporary)
        os.fchmod(handle, target.stat().st_mode & 0o7777 if target.exists() else 0o666 & ~_umask())
        os.fsync(handle)
        os.replace(temporary, target)
        sync_folder(target.parent)
    except BaseException as error:
        Path(temporary).unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
        raise
    finally:
        os.close(handle)


def sync_folder(folder: Path) -> None:
    """So that the name of a new file outlasts a power cut, as its content does after fsync."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def check_output(path: Path) -> None:
    """Raises InvalidArgument where `path` cannot become a file: before the work, not after it."""
    folder = path.parent
    if _is_device_name(path):
        raise InvalidArgument(f"{path}: cannot be written: expected the name of a file, got one under /dev")
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
    if not os.access(folder, os.W_OK):
        raise InvalidArgument(f"{path}: cannot be written: no permission to write in {folder}")


def _is_device_name(path: Path) -> bool:
    # Not by what it leads to: /dev/stdout may be a file, which renaming would put in place of the link.
    name = os.path.abspath(path)
    return name.startswith("/dev/") and not name.startswith("/dev/shm/")  # a disk in memory holds files


def make_folder(path: Path) -> None:
    """Makes the folder, and those above it."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidArgument(f"{path}: the folder cannot be made: {reason(error)}") from None


def reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
