"""One record a command: what it read and what it wrote, so that every result keeps its inputs, version and command."""

import hashlib
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import Field, ValidationError

from stepdiag._core import InvalidArgument, __version__
from stepdiag.book.facts import Facts
from stepdiag.book.layout import RECORDS
from stepdiag.config.key_types import Section
from stepdiag.io.whole_files import make_folder, read_text, write_whole

FORMAT: Final = "stepdiag record 1"


class FileRecord(Section):
    """A file, or a folder that is one entry."""

    file: str  # in the machine's folder: calibrations/2026-11-27.nc
    sha256: str = ""  # empty while the command runs
    facts: Facts | None = None


class Record(Section):
    """A command that changed the book. Without `ended` it was interrupted, or runs."""

    format: Literal["stepdiag record 1"] = FORMAT
    command: Annotated[tuple[str, ...], Field(min_length=2)]  # stepdiag, evaluate, ...
    version: str = __version__
    begun: Annotated[str, Field(min_length=10)]  # ISO 8601, UTC, as all dates
    ended: str = ""
    status: int | None = None  # exit code: 0, or 3 for a result that must not be used
    inputs: tuple[FileRecord, ...] = ()
    outputs: tuple[FileRecord, ...] = ()
    taken_from: str = ""  # of an added file: its path
    measured: str = ""  # of an added run or calibration: the day of the measurement


def keep(machine: Path, record: Record) -> Path:
    """Write a new record. Returns its file."""
    make_folder(machine / RECORDS)
    now = f"{datetime.now(UTC):%Y-%m-%dT%H%M%S.%fZ}"  # in the order of time, also within a second
    return write(machine / RECORDS / f"{now}-{record.command[1]}-{os.urandom(4).hex()}.json", record)


def write(path: Path, record: Record) -> Path:
    """Write a record, or replace one that was begun."""
    write_whole(path, record.model_dump_json(indent=1, exclude_none=True) + "\n")
    return path


def parse(text: str, path: Path) -> Record:
    """A record from its text. Raises InvalidArgument naming the file."""
    try:
        return Record.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        raise InvalidArgument(f"{path}: {'.'.join(map(str, first['loc']))}: {first['msg']}") from None


def read(path: Path) -> Record:
    """Raises InvalidArgument naming the file."""
    return parse(read_text(path), path)


def fingerprint(entry: Path) -> str:
    """SHA-256 of a file as `sha256sum` prints it; of a folder as `fingerprint_of` its files."""
    if not entry.is_dir():
        with entry.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    return fingerprint_of({path.name: path.read_bytes() for path in entry.iterdir() if path.is_file()})


def fingerprint_of(contents: Mapping[str, bytes]) -> str:
    """SHA-256 of what `sha256sum` prints of these files, in the order of their names."""
    lines = (f"{hashlib.sha256(contents[name]).hexdigest()}  {name}\n" for name in sorted(contents))
    return hashlib.sha256("".join(lines).encode()).hexdigest()
