"""The raw file of an acquisition: JSON lines, only ever appended to, on the disk before the next reading begins.

The first line is the header; then every value that the instrument gave ("value"), after those of a point what became of
them ("reading"), and where an acquisition began or took up again ("session", "again").
"""

import fcntl
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from stepdiag._core import InvalidArgument
from stepdiag.files import check_output, read_bytes, reason

FORMAT: Final = "stepdiag raw readings"
VERSION: Final = 1
RECORDS: Final = ("header", "session", "again", "value", "reading")

Record = Mapping[str, Any]


@dataclass(frozen=True)
class RawContent:
    """What a raw file holds. `sound_bytes`: its length without a last line that was torn."""

    path: Path
    header: Record
    records: tuple[Record, ...]
    sound_bytes: int
    torn_bytes: int

    def readings(self) -> dict[tuple[int, int], Record]:
        """The readings by (visit, point), in the order in which they were taken. What an "again" repeats is gone."""
        found: dict[tuple[int, int], Record] = {}
        for record in self.records:
            if record["record"] == "again":
                found = {key: reading for key, reading in found.items() if key[0] < record["visit"]}
            elif record["record"] == "reading":
                key = (record["visit"], record["point"])
                found.pop(key, None)
                found[key] = record
        return found


class RawFile:
    """A raw file that is being written. Nobody else writes it at the same time."""

    def __init__(self, path: Path, handle: int) -> None:
        self.path = path
        self._handle = handle

    @classmethod
    def create(cls, path: Path, header: Record) -> Self:
        """A new file. Raises InvalidArgument for one that exists."""
        check_output(path)
        try:
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | os.O_CLOEXEC, 0o666)
        except FileExistsError:
            raise InvalidArgument(
                f"{path}: exists already: --resume goes on with it, another -o (or --raw) begins a new one"
            ) from None
        except OSError as error:
            raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
        file = cls(path, handle)
        file._lock()
        file.append([{"record": "header", "format": FORMAT, "version": VERSION, **header}])
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)  # so that the file's name outlasts a power cut too
        finally:
            os.close(folder)
        return file

    @classmethod
    def resume(cls, path: Path) -> tuple[Self, RawContent]:
        """The file to go on with, and what it holds; a torn last line is cut off."""
        try:
            handle = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CLOEXEC)
        except OSError as error:
            raise InvalidArgument(f"{path}: cannot go on with it: {reason(error)}") from None
        file = cls(path, handle)
        try:
            file._lock()
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
        data = b"".join(json.dumps(dict(record)).encode() + b"\n" for record in records)
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


def read_raw(path: Path) -> RawContent:
    """Reads a raw file. A last line without its end is left out: so a power cut leaves it. Raises InvalidArgument for
    any other line that is not sound."""
    data = read_bytes(path)
    sound = data.rfind(b"\n") + 1
    lines = data[:sound].splitlines()
    records = [_record(path, number, line) for number, line in enumerate(lines, start=1)]
    if not records or records[0]["record"] != "header":
        raise InvalidArgument(f"{path}: expected a raw file of stepdiag acquire, got one that does not begin as such")
    for number, record in enumerate(records[1:], start=2):
        if record["record"] == "header":
            raise InvalidArgument(f"{path}, line {number}: expected one header, got another one")
    return RawContent(path, records[0], tuple(records[1:]), sound, len(data) - sound)


def _record(path: Path, number: int, line: bytes) -> dict[str, Any]:
    place = f"{path}, line {number}"
    try:
        record = json.loads(line)
    except (ValueError, RecursionError):
        raise InvalidArgument(f"{place}: expected a JSON object, got {line[:40].decode(errors='replace')!a}") from None
    if not isinstance(record, dict) or record.get("record") not in RECORDS:
        raise InvalidArgument(f"{place}: expected a record of one of {', '.join(RECORDS)}")
    if record["record"] == "header":
        _check_header(place, record)
    elif record["record"] == "reading":
        _check_reading(place, record)
    elif record["record"] == "again" and not _is_number(record.get("visit")):
        raise InvalidArgument(f"{place}: visit: expected a whole number")
    return record


def _check_header(place: str, record: Record) -> None:
    if record.get("format") != FORMAT:
        raise InvalidArgument(f"{place}: format: expected {FORMAT!r}, got {record.get('format')!r}")
    if record.get("version") != VERSION:
        raise InvalidArgument(f"{place}: version: expected {VERSION}, got {record.get('version')!r}")
    channels, plan = record.get("channels"), record.get("plan")
    if not isinstance(channels, list) or not channels or not all(isinstance(name, str) for name in channels):
        raise InvalidArgument(f"{place}: channels: expected a list of names")
    if not isinstance(plan, list) or not all(isinstance(visit, dict) for visit in plan):
        raise InvalidArgument(f"{place}: plan: expected a list of visits")
    if record.get("sign") not in (1, -1):
        raise InvalidArgument(f"{place}: sign: expected 1 or -1, got {record.get('sign')!r}")


def _check_reading(place: str, record: Record) -> None:
    for key in ("visit", "point"):
        if not _is_number(record.get(key)):
            raise InvalidArgument(f"{place}: {key}: expected a whole number, got {record.get(key)!r}")
    pm, deviations = record.get("pm"), record.get("sd_pm")
    if not isinstance(pm, list) or not all(value is None or _is_number(value) for value in pm):
        raise InvalidArgument(f"{place}: pm: expected whole numbers, or null where a beam was lost")
    if not isinstance(deviations, list) or len(deviations) != len(pm):
        raise InvalidArgument(f"{place}: sd_pm: expected as many values as pm has")
    if not isinstance(record.get("time"), str):
        raise InvalidArgument(f"{place}: time: expected a time")


def _is_number(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)
