"""The index of a book: what lists and searches need, so that they need not read every file.

SQLite by the standard library: two tables and five statements need no object mapper, and Python has it everywhere. The
files are the truth. A file is read again when its size or time has changed; a whole index costs the reading of all
files without a record, and can be deleted at any time.
"""

import os
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from stepdiag._core import InvalidArgument
from stepdiag.book import records
from stepdiag.book.facts import FACTS, Facts, facts_of
from stepdiag.book.layout import BIN, FOLDERS, INDEX, RECORDS, entries_in, main_file
from stepdiag.book.records import Record

VERSION: Final = 1  # of the tables; an index of another version is made again
BATCH: Final = 50  # files between two commits, so that an interrupted indexing goes on where it was
PATIENCE: Final = 10.0  # s for another program that writes the index
_TABLES: Final = f"""
CREATE TABLE entries (
  machine TEXT, file TEXT, size INTEGER, mtime INTEGER, sha256 TEXT, facts TEXT, PRIMARY KEY (machine, file)
) WITHOUT ROWID;
CREATE TABLE records (
  machine TEXT, file TEXT, size INTEGER, mtime INTEGER, content TEXT, PRIMARY KEY (machine, file)
) WITHOUT ROWID;
PRAGMA user_version = {VERSION};
"""

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Indexed:
    """A file (or a folder that is one entry) of a machine."""

    file: str  # in the machine's folder
    sha256: str
    mtime: int  # ns
    facts: Facts


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
            self.only_in_memory = f"{self._path}: cannot be used: {error}; `stepdiag book reindex` makes it again"
            self._database = self._opened(":memory:")

    def close(self) -> None:
        self._database.close()

    def refresh(self, machine: Path, progress: Progress | None = None) -> None:
        """Take in what has changed in the machine's folder."""
        name = machine.name
        self._refresh_records(machine)
        found = dict(_scanned(machine))
        known = {
            file: (size, mtime)
            for file, size, mtime, facts in self._rows(
                "SELECT file, size, mtime, facts FROM entries WHERE machine = ?", name
            )
            if f'"made":{FACTS},' in facts
        }
        gone = [file for file in known if file not in found]
        new = [file for file, state in found.items() if known.get(file) != state]
        if gone:
            self._write("DELETE FROM entries WHERE machine = ? AND file = ?", [(name, file) for file in gone])
        if not new:
            return
        recorded = {
            (output.file, output.sha256): output.facts
            for record in self.records(name).values()
            for output in record.outputs
            if output.facts is not None and output.facts.made == FACTS
        }
        rows: list[tuple[object, ...]] = []
        for done, file in enumerate(new, 1):
            try:
                sha256 = records.fingerprint(machine / file)
            except OSError:
                continue  # removed meanwhile, or not readable: the next refresh tries again
            facts = recorded.get((file, sha256)) or facts_of(machine / file)
            rows.append((name, file, *found[file], sha256, facts.model_dump_json()))
            if len(rows) == BATCH or done == len(new):
                self._write("INSERT OR REPLACE INTO entries VALUES (?, ?, ?, ?, ?, ?)", rows)
                rows = []
            if progress is not None:
                progress(done, len(new))

    def entries(self, machine: str) -> list[Indexed]:
        return [
            Indexed(file, sha256, mtime, Facts.model_validate_json(facts))
            for file, sha256, mtime, facts in self._rows(
                "SELECT file, sha256, mtime, facts FROM entries WHERE machine = ? ORDER BY file", machine
            )
        ]

    def records(self, machine: str) -> dict[str, Record]:
        """By file name, which begins with the time. Records that this program cannot read are left out."""
        found = {}
        for file, content in self._rows("SELECT file, content FROM records WHERE machine = ? ORDER BY file", machine):
            with suppress(InvalidArgument):
                found[str(file)] = records.parse(content, Path(file))
        return found

    # --- the database -----------------------------------------------------------------------------------------------
    def _opened(self, path: str) -> sqlite3.Connection:
        database = sqlite3.connect(path, timeout=PATIENCE)
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
        """One transaction. If book.sqlite cannot be written, an index in memory goes on."""
        try:
            with self._database:
                self._database.executemany(statement, rows)
        except sqlite3.Error as error:
            if self.only_in_memory:
                raise InvalidArgument(f"{self._path}: {error}") from None
            self.only_in_memory = f"{self._path}: cannot be written: {error}"
            in_memory = sqlite3.connect(":memory:")
            self._database.rollback()
            self._database.backup(in_memory)
            self._database.close()
            self._database = in_memory
            self._write(statement, rows)

    def _refresh_records(self, machine: Path) -> None:
        name = machine.name
        found = dict(_states(machine / RECORDS, ".json"))
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

    def _remove(self) -> None:
        for path in (self._path, *(self._path.with_name(f"{INDEX}-{what}") for what in ("journal", "wal", "shm"))):
            path.unlink(missing_ok=True)


def _scanned(machine: Path) -> Iterator[tuple[str, tuple[int, int]]]:
    """Every entry of the machine and of its bin, with the size and the time of its main file."""
    for part in (machine, machine / BIN):
        for folder in FOLDERS:
            for entry in entries_in(part / folder):
                with suppress(OSError):
                    status = main_file(entry).stat()
                    yield entry.relative_to(machine).as_posix(), (status.st_size, status.st_mtime_ns)


def _states(folder: Path, ending: str) -> Iterator[tuple[str, tuple[int, int]]]:
    with suppress(OSError), os.scandir(folder) as found:
        for one in found:
            if one.name.endswith(ending):
                status = one.stat()
                yield one.name, (status.st_size, status.st_mtime_ns)
