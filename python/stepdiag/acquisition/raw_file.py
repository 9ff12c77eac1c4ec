"""The raw file of an acquisition: JSON lines, only ever appended to, on the disk before the next reading begins.

The first line is the header; then every value that the instrument gave, after those of a point what became of them, and
where an acquisition began or was taken up again (raw_records.py).
"""

import fcntl
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.raw_records import Again, Header, RawReading, Record, parse_record
from stepdiag.io.whole_files import check_output, read_bytes, reason, sync_folder


@dataclass(frozen=True)
class RawContent:
    """What a raw file holds. `sound_bytes`: its length without a last line that was torn, of `torn_bytes`."""

    path: Path
    header: Header
    records: tuple[Record, ...]
    sound_bytes: int
    torn_bytes: int

    def readings(self) -> dict[tuple[int, int], RawReading]:
        """The readings by (visit, point), in the order in which they were taken, without those that were repeated."""
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
        """How many readings the plan has."""
        return sum(len(visit.points) for visit in self.header.plan)

    @property
    def torn(self) -> str | None:
        """What there is to say of its end."""
        if not self.torn_bytes:
            return None
        return f"{self.path}: the last line was torn ({self.torn_bytes} bytes without an end) and is left out"


class RawFile:
    """A raw file that is being written. Nobody else writes it at the same time."""

    def __init__(self, path: Path, handle: int) -> None:
        self.path = path
        self._handle = handle

    @classmethod
    def create(cls, path: Path, header: Header) -> Self:
        """A new file. Raises InvalidArgument for one that exists."""
        check_new(path)
        try:
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | os.O_CLOEXEC, 0o666)
        except OSError as error:
            raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
        file = cls(path, handle)
        file._lock()
        file.append([header])
        sync_folder(path.parent)
        return file

    @classmethod
    def resume(cls, path: Path) -> tuple[Self, RawContent]:
        """The file to go on with, and what it holds; a torn last line is cut off."""
        try:
            handle = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CLOEXEC)
        except OSError as error:
            raise InvalidArgument(f"{path}: cannot go on with it: {reason(error)}") from None
        file = cls(path, handle)
        file._lock()
        try:
            content = read_raw(path)
            if content.torn_bytes:
                os.ftruncate(handle, content.sound_bytes)
                os.fsync(handle)
        except BaseException:
            file.close()
            raise
        return file, content

    def append(self, records: Iterable[Record]) -> None:
        """Writes records, and returns when they are on the disk."""
        data = b"".join(record.model_dump_json().encode() + b"\n" for record in records)
        before = os.fstat(self._handle).st_size
        try:
            while data:
                data = data[os.write(self._handle, data) :]
            os.fsync(self._handle)
        except OSError as error:
            os.ftruncate(self._handle, before)  # a disk that is full leaves no half of a line
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
            fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self.close()
            raise InvalidArgument(f"{self.path}: another acquisition is writing it") from None


def check_new(path: Path) -> None:
    """Raises InvalidArgument where `path` cannot become a raw file: nothing is ever written over one."""
    check_output(path)
    if path.exists() or path.is_symlink():
        raise InvalidArgument(
            f"{path}: exists already: `resume` goes on with it, another `output` (or `raw`) begins a new one"
        )


def read_raw(path: Path) -> RawContent:
    """Reads a raw file. A last line without its end is left out: so a power cut leaves it. Raises InvalidArgument for
    any other line that is not sound."""
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
    return RawContent(path, header, tuple(records), sound, len(data) - sound)
