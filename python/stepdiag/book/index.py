"""The index of a book: what lists and searches need, so that they need not read every file.

SQLite by the standard library: two tables and five statements need no object mapper, and Python has it everywhere. The
files are the truth. A file is read again when its size or time has changed; a whole index costs the reading of all
files without a record, and can be deleted at any time.
"""

import os
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple

from stepdiag._core import InvalidArgument
from stepdiag.book import records
from stepdiag.book.facts import FACTS, facts_of
from stepdiag.book.layout import BIN, FOLDERS, INDEX, RECORDS, counts, main_file
from stepdiag.book.records import Record

VERSION: Final = 1  # of the tables; an index of another version is made again
BATCH: Final = 50  # files between two commits, so that an interrupted indexing goes on where it was
PATIENCE: Final = 10.0  # s for another program that writes the index
_TABLES: Final = f"""
CREATE TABLE entries (
  machine TEXT, file TEXT, size INTEGER, mtime INTEGER, sha256 TEXT, kind TEXT, date TEXT, record TEXT, facts TEXT,
  PRIMARY KEY (machine, file)
) WITHOUT ROWID;
CREATE TABLE records (
  machine TEXT, file TEXT, size INTEGER, mtime INTEGER, content TEXT, PRIMARY KEY (machine, file)
) WITHOUT ROWID;
PRAGMA user_version = {VERSION};
"""

Progress = Callable[[int, int], None]
State = tuple[int, int]  # size and time (ns)


class Indexed(NamedTuple):
    """A file (or a folder that is one entry) of a machine."""

    file: str  # in the machine's folder
    sha256: str
    kind: str | None  # none: not recognised, or damaged
    date: str  # ISO 8601: of the measurement if it is known, else of the file
    record: str | None  # of the command that made it: the record's file
    facts: str  # JSON of Facts


class Index:
    """An open index. Where book.sqlite cannot be used (read-only, damaged, kept by another program), one in memory."""

    def __init__(self, book: Path, *, anew: bool = False) -> None:
        self._path = book / INDEX
        self.only_in_memory = ""  # why
        if anew:
            self._remove()
        try:
            self._database = self._opened(str(self._path))
        except sqlite3.Error as error:
            self._go_without(error)

    def close(self) -> None:
        self._database.close()

    def refresh(self, machine: Path, progress: Progress | None = None) -> None:
        """Take in what has changed in the machine's folder."""
        try:
            self._refresh(machine, progress)
        except sqlite3.Error as error:
            self._database.close()
            self._go_without(error)
            self._refresh(machine, progress)

    def entries(self, machine: str) -> list[Indexed]:
        """The oldest first."""
        rows = self._rows(
            "SELECT file, sha256, kind, date, record, facts FROM entries WHERE machine = ? ORDER BY date, record, file",
            machine,
        )
        try:
            return [Indexed(*row) for row in rows]
        except sqlite3.Error as error:
            raise InvalidArgument(
                f"{self._path}: cannot be read: {error}; `stepdiag book reindex` makes it again"
            ) from None

    def record(self, machine: str, file: str) -> Record | None:
        """None if this program cannot read it."""
        content = next(self._rows("SELECT content FROM records WHERE machine = ? AND file = ?", machine, file), ("",))
        with suppress(InvalidArgument):
            return records.parse(content[0], Path(file))
        return None

    def _refresh(self, machine: Path, progress: Progress | None) -> None:
        name = machine.name
        changed = self._refresh_records(machine)
        found = dict(_scanned(machine))
        known = {
            file: (size, mtime)
            for file, size, mtime in self._rows(
                "SELECT file, size, mtime FROM entries WHERE machine = ? AND instr(facts, ?)", name, f'"made":{FACTS},'
            )
        }
        gone = [(name, file) for file in known if file not in found]
        new = [file for file, state in found.items() if known.get(file) != state]
        if gone:
            self._write("DELETE FROM entries WHERE machine = ? AND file = ?", gone)
        if new:
            self._read(machine, new, found, progress)
        if new or gone or changed:
            self._date(machine)

    def _read(self, machine: Path, new: list[str], found: dict[str, State], progress: Progress | None) -> None:
        """New files: what a record knows of one need not be read."""
        recorded = {
            (output.file, output.sha256): output.facts
            for record in self._records(machine.name).values()
            for output in record.outputs
            if output.facts is not None and output.facts.made == FACTS
        }
        rows: list[tuple[object, ...]] = []
        for done, file in enumerate(new, 1):
            with suppress(OSError):  # removed meanwhile, or not readable: the next refresh tries again
                sha256 = records.fingerprint(machine / file)
                facts = recorded.get((file, sha256)) or facts_of(machine / file)
                kind = None if facts.damaged else facts.kind
                rows.append((machine.name, file, *found[file], sha256, kind, facts.date, None, facts.model_dump_json()))
            if len(rows) == BATCH or done == len(new):
                self._write("INSERT OR REPLACE INTO entries VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", rows)
                rows = []
            if progress is not None:
                progress(done, len(new))

    def _date(self, machine: Path) -> None:
        """Which record belongs to which file, and of which day each file is."""
        name, made = machine.name, dict[str, tuple[str, Record]]()
        for file, by in self._records(name).items():
            made |= {output.file: (file, by) for output in by.outputs}
        rows: list[tuple[object, ...]] = []
        for file, mtime, stated in self._rows(
            "SELECT file, mtime, json_extract(facts, '$.date') FROM entries WHERE machine = ?", name
        ):
            made_by, record = made.get(file, (None, None))
            date = _measured(record, made) or stated or (record.ended or record.begun if record else "")
            date = date or f"{datetime.fromtimestamp(mtime * 1e-9, UTC):%Y-%m-%dT%H:%M:%SZ}"
            rows.append((date, made_by, name, file))
        self._write("UPDATE entries SET date = ?, record = ? WHERE machine = ? AND file = ?", rows)

    def _records(self, machine: str) -> dict[str, Record]:
        """By file name, which begins with the time."""
        files = [file for (file,) in self._rows("SELECT file FROM records WHERE machine = ? ORDER BY file", machine)]
        found = {file: self.record(machine, file) for file in files}
        return {file: record for file, record in found.items() if record is not None}

    # --- the database -----------------------------------------------------------------------------------------------
    def _opened(self, path: str) -> sqlite3.Connection:
        # One request of a server may be served by several threads, one after the other.
        database = sqlite3.connect(path, timeout=PATIENCE, check_same_thread=False)
        try:
            if database.execute("PRAGMA user_version").fetchone()[0] != VERSION:
                with database:
                    database.execute("BEGIN IMMEDIATE")
                    if database.execute("PRAGMA user_version").fetchone()[0] != VERSION:
                        for table in ("entries", "records"):
                            database.execute(f"DROP TABLE IF EXISTS {table}")
                        for statement in _TABLES.split(";"):
                            database.execute(statement)
        except BaseException:
            database.close()
            raise
        return database

    def _rows(self, statement: str, *values: object) -> Iterator[tuple[Any, ...]]:
        yield from self._database.execute(statement, values)

    def _write(self, statement: str, rows: Sequence[tuple[object, ...]]) -> None:
        """In one transaction."""
        with self._database:
            self._database.executemany(statement, rows)

    def _go_without(self, error: sqlite3.Error) -> None:
        """Begin an index in memory."""
        self.only_in_memory = f"{self._path}: cannot be used: {error}; `stepdiag book reindex` makes it again"
        self._database = self._opened(":memory:")

    def _refresh_records(self, machine: Path) -> bool:
        """Whether there was anything new."""
        name = machine.name
        found = {file: state for file, state in _states(machine / RECORDS) if file.endswith(".json")}
        known = {
            file: (size, mtime)
            for file, size, mtime in self._rows("SELECT file, size, mtime FROM records WHERE machine = ?", name)
        }
        gone = [(name, file) for file in known if file not in found]
        if gone:
            self._write("DELETE FROM records WHERE machine = ? AND file = ?", gone)
        rows: list[tuple[object, ...]] = []
        for file, state in found.items():
            if known.get(file) != state:
                with suppress(OSError):
                    text = (machine / RECORDS / file).read_text(encoding="utf-8", errors="replace")
                    rows.append((name, file, *state, text))
        if rows:
            self._write("INSERT OR REPLACE INTO records VALUES (?, ?, ?, ?, ?)", rows)
        return bool(rows or gone)

    def _remove(self) -> None:
        for path in (self._path, *(self._path.with_name(f"{INDEX}-{what}") for what in ("journal", "wal", "shm"))):
            path.unlink(missing_ok=True)


def _scanned(machine: Path) -> Iterator[tuple[str, State]]:
    """Every entry of the machine and of its bin. Empty ones are names that a command has taken."""
    for folder in (*FOLDERS, *(f"{BIN}/{folder}" for folder in FOLDERS)):
        for name, (size, mtime) in _states(machine / folder):
            if size and counts(name):
                yield f"{folder}/{name}", (size, mtime)


def _states(folder: Path) -> Iterator[tuple[str, State]]:
    """Names in a folder, each with the size and the time (ns) of the file, or of a folder's main file."""
    with suppress(OSError), os.scandir(folder) as found:
        for one in found:
            with suppress(OSError):
                status = main_file(Path(one.path)).stat() if one.is_dir() else one.stat()
                yield one.name, (status.st_size, status.st_mtime_ns)


def _measured(record: Record | None, made: Mapping[str, tuple[str, Record]]) -> str:
    """The day of the measurement that a person has stated of this file, or of the run from which it was made."""
    seen: list[Record] = []
    while record is not None and record not in seen:
        if record.measured:
            return record.measured
        seen.append(record)
        runs = [given.file for given in record.inputs if given.file.startswith("runs/")]
        record = made[runs[0]][1] if len(runs) == 1 and runs[0] in made else None
    return ""
