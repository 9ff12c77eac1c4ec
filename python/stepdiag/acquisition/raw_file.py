"""The raw file of an acquisition: JSON lines, append-only, synced to disk before the next reading.

The first line is the header. Then follow all values of the instrument, after the values of a point
its reading, and the places where an acquisition began or was resumed (raw_records.py).
"""

import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.raw_records import Again, Header, RawReading, Record, Value, parse_record
from stepdiag.instruments.instrument import Number
from stepdiag.io.whole_files import check_output, read_bytes, reason
from stepdiag.platform import lock, open_to_append, sync_folder

_BEGINNING: Final = b'{"record":"header"'


@dataclass(frozen=True)
class RawContent:
    """Content of a raw file. `sound_bytes`: length without a torn last line of `torn_bytes`."""

    path: Path
    header: Header
    records: tuple[Record, ...]
    sound_bytes: int
    torn_bytes: int

    def readings(self) -> dict[tuple[int, int], RawReading]:
        """The last reading by (visit, point), in the order of acquisition."""
        found: dict[tuple[int, int], RawReading] = {}
        for record in self.records:
            if isinstance(record, Again):
                found = {key: reading for key, reading in found.items() if key[0] < record.visit}
            elif isinstance(record, RawReading):
                found.pop((record.visit, record.point), None)
                found[record.visit, record.point] = record
        return found

    @property
    def planned(self) -> int:
        """Number of readings in the plan."""
        return sum(len(visit.points) for visit in self.header.plan)

    @property
    def torn(self) -> str | None:
        """A message about the torn last line; None if there is none."""
        if not self.torn_bytes:
            return None
        return f"{self.path}: the last line was torn ({self.torn_bytes} bytes without an end) and is left out"


class RawFile:
    """A raw file open for writing, locked against other processes."""

    def __init__(self, path: Path, handle: int) -> None:
        self.path = path
        self._handle = handle

    @classmethod
    def create(cls, path: Path, header: Header) -> Self:
        """Create a file. Raises InvalidArgument if it exists and is begun."""
        check_new(path)
        try:
            handle = open_to_append(path, create=True)
        except OSError as error:
            raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
        file = cls(path, handle)
        file._lock()
        try:
            check_new(path)  # another process may have begun it
            os.ftruncate(handle, 0)
            file.append([header])
            sync_folder(path.parent)
        except BaseException as error:
            file.close()
            if isinstance(error, OSError):
                raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
            raise
        return file

    @classmethod
    def resume(cls, path: Path) -> tuple[Self, RawContent]:
        """Open a file to continue it, cutting off a torn last line.

        Returns the file and its content."""
        try:
            handle = open_to_append(path)
        except OSError as error:
            raise InvalidArgument(f"{path}: cannot be continued: {reason(error)}") from None
        file = cls(path, handle)
        file._lock()
        try:
            if not is_begun(path):
                raise InvalidArgument(f"{path}: nothing was read yet: begin without `resume`")
            content = read_raw(path)
            if content.torn_bytes:
                os.ftruncate(handle, content.sound_bytes)
                os.fsync(handle)
        except BaseException:
            file.close()
            raise
        return file, content

    def append(self, records: Iterable[Record]) -> None:
        """Write records. When this returns they are on the disk."""
        data = b"".join(record.model_dump_json().encode() + b"\n" for record in records)
        before = os.fstat(self._handle).st_size
        try:
            while data:
                data = data[os.write(self._handle, data) :]
            os.fsync(self._handle)
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self._handle, before)  # a full disk must not leave half a line
            raise InvalidArgument(f"{self.path}: cannot be written: {reason(error)}") from None

    def close(self) -> None:
        os.close(self._handle)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _lock(self) -> None:
        try:
            lock(self._handle)
        except OSError:
            self.close()
            raise InvalidArgument(f"{self.path}: another acquisition is writing it") from None


def is_begun(path: Path) -> bool:
    """Whether there is more than the beginning of a header: a power cut or a full disk may come at the first line."""
    if not path.exists() or (path.is_file() and path.stat().st_size == 0):
        return False
    content = read_bytes(path)
    return b"\n" in content or not _BEGINNING.startswith(content[: len(_BEGINNING)])


def check_new(path: Path) -> None:
    """Raise InvalidArgument if a raw file cannot be begun at `path`.

    Existing files are never replaced, unless they are not begun."""
    check_output(path)
    if path.is_symlink() or is_begun(path):
        raise InvalidArgument(
            f"{path}: exists already: `resume` continues it, another `output` (or `raw`) begins a new one"
        )


def read_raw(path: Path) -> RawContent:
    """Read a raw file, ignoring a last line that a power cut has torn.

    Raises InvalidArgument naming the file and line for any other invalid line."""
    data = read_bytes(path)
    sound = data.rfind(b"\n") + 1
    lines = data[:sound].split(b"\n")[:-1]
    if not lines:
        raise InvalidArgument(f"{path}: expected a raw file of stepdiag acquire, got {data[:20]!a}...")
    header, *records = [parse_record(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1)]
    if not isinstance(header, Header):
        raise InvalidArgument(f"{path}, line 1: expected the header of a raw file, got a {header.record}")
    for number, record in enumerate(records, start=2):
        if isinstance(record, Header):
            raise InvalidArgument(f"{path}, line {number}: expected one header, got another one")
        if isinstance(record, Value | RawReading):
            _check_whole(record.read, header, f"{path}, line {number}")
    return RawContent(path, header, tuple(records), sound, len(data) - sound)


def _check_whole(row: Sequence[Number | None], header: Header, place: str) -> None:
    for column, value in zip(header.read_columns, row, strict=False):
        if column.unit == "pm" and isinstance(value, float):
            raise InvalidArgument(f"{place}: read: {column.name}: expected whole picometres, got {value!r}")
