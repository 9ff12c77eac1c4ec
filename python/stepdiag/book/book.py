"""A book, its machines, and what one can do with their files.

Nothing in a book is replaced or deleted: a file gets a name that is free, and what is removed goes into the bin. Every
change leaves a record. Several programs may use a book at once, because a name is taken by making its file.
"""

import hashlib
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.book import records
from stepdiag.book.facts import Facts, facts_of
from stepdiag.book.index import Index, Indexed, Progress
from stepdiag.book.layout import (
    ABOUT,
    BIN,
    MACHINES,
    MARK,
    README,
    check_name,
    folder_of,
    main_file,
    move,
    reserve,
    safe_name,
)
from stepdiag.book.machine_keys import AboutMachine, toml_of
from stepdiag.book.records import FileRecord, Record, fingerprint, fingerprint_of
from stepdiag.config.toml_text import check_keys, parse_toml
from stepdiag.io.data_files import date_of_today
from stepdiag.io.whole_files import check_input, make_folder, read_bytes, read_text, write_whole

VARIABLE: Final = "STEPDIAG_BOOK"


class Entry:
    """A file of a machine, or a folder that is one.

    file: its name in the machine's folder, such as calibrations/2026-11-27.nc. kind: as in file_kind.py; None for a
    file that is damaged or not recognised. date: ISO 8601, of the measurement if it is known, else of the file."""

    def __init__(self, machine: "MachineFolder", indexed: Indexed) -> None:
        self.machine, self.path = machine.name, machine.folder / indexed.file
        self.file, self.sha256, self.kind, self.date, self._record, self._facts = indexed
        self._index = machine.book.index

    @cached_property
    def facts(self) -> Facts:
        return Facts.model_validate_json(self._facts)

    @cached_property
    def record(self) -> Record | None:
        """Of the command that made it."""
        return None if self._record is None else self._index.record(self.machine, self._record)

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def words(self) -> str:
        """What a search looks at."""
        return " ".join((self.file, self.date, self._facts)).casefold()

    @property
    def folder(self) -> str:
        """Where it is, or was before it was removed."""
        return self.file.split("/")[-2]

    @property
    def removed(self) -> bool:
        return self.file.startswith(f"{BIN}/")


class Book:
    """The folder of all machines."""

    def __init__(self, folder: Path) -> None:
        """Raises InvalidArgument if it is not a book."""
        if not (folder / MARK).is_file():
            raise InvalidArgument(f"{folder}: not a machine book: expected a folder with {MARK}")
        self.folder = folder

    @classmethod
    def make(cls, folder: Path) -> "Book":
        """The book in this folder, which is made if it is missing. Raises InvalidArgument for a folder of others."""
        if not (folder / MARK).exists():
            if folder.is_dir() and any(folder.iterdir()) and not (folder / MACHINES).is_dir():
                raise InvalidArgument(f"{folder}: has other files; expected an empty folder, or a new one, for a book")
            make_folder(folder / MACHINES)
            write_whole(folder / MARK, README)
        return cls(folder)

    @cached_property
    def index(self) -> Index:
        return Index(self.folder)

    def machine(self, name: str) -> "MachineFolder":
        """Raises InvalidArgument naming the machines that there are."""
        for one in self.machines():
            if one.name.casefold() == name.casefold():
                return one
        names = ", ".join(one.name for one in self.machines()) or "none yet"
        raise InvalidArgument(
            f"{name}: no machine of the book {self.folder} (it has: {names}); `stepdiag book new` adds one"
        )

    def machines(self) -> list["MachineFolder"]:
        """In the order of their names."""
        folder = self.folder / MACHINES
        found = sorted(folder.iterdir(), key=lambda one: one.name.casefold()) if folder.is_dir() else []
        return [MachineFolder(self, one) for one in found if one.is_dir() and not one.name.startswith(".")]

    def new_machine(self, name: str, about: AboutMachine) -> "MachineFolder":
        """Raises InvalidArgument if there is one of this name."""
        check_name(name, "machine")
        machine = MachineFolder(self, reserve(self.folder / MACHINES, name, exactly=True, as_folder=True))
        write_whole(machine.folder / ABOUT, toml_of(about))
        return machine

    def reindex(self, progress: Progress | None = None) -> int:
        """Make the index again from the files. Returns the number of entries."""
        self.index.close()
        self.index = Index(self.folder, anew=True)
        machines = self.machines()
        for done, machine in enumerate(machines, 1):
            self.index.refresh(machine.folder)
            if progress is not None:
                progress(done, len(machines))
        return sum(len(self.index.entries(machine.name)) for machine in machines)

    def find(self, words: Sequence[str]) -> Iterator["Entry | MachineFolder"]:
        """Machines and files with all of these words in what is known of them."""
        wanted = [word.casefold() for word in words]
        for machine in self.machines():
            said = machine.words
            if all(word in said for word in wanted):
                yield machine
            for entry in machine.entries(removed=True):
                own = entry.words
                if any(word in own for word in wanted) and all(word in own or word in said for word in wanted):
                    yield entry


class MachineFolder:
    """One machine of a book."""

    def __init__(self, book: Book, folder: Path) -> None:
        self.book, self.folder = book, folder

    @property
    def name(self) -> str:
        return self.folder.name

    @cached_property
    def about(self) -> AboutMachine:
        """Raises InvalidArgument naming file and key."""
        path = self.folder / ABOUT
        if not path.exists():  # copied by hand, or made by a program that was killed
            return AboutMachine()
        return check_keys(parse_toml(read_text(path), str(path)), AboutMachine, str(path))

    @property
    def words(self) -> str:
        """What a search looks at."""
        about = self.about
        said = (about.title, about.serial_number, about.customer, about.place, about.notes)
        return " ".join((self.name, *filter(None, said))).casefold()

    def entries(
        self, folder: str | None = None, *, removed: bool = False, progress: Progress | None = None
    ) -> list[Entry]:
        """Its files, the oldest first; those in the bin only if `removed`."""
        self.book.index.refresh(self.folder, progress)
        return self.listed(folder, removed=removed)

    def listed(self, folder: str | None = None, *, removed: bool = False) -> list[Entry]:
        """The same as at the last call of `entries`."""
        found = [Entry(self, one) for one in self.book.index.entries(self.name)]
        return [one for one in found if (removed or not one.removed) and folder in (None, one.folder)]

    def last(self, kind: str, *, apart_from: Sequence[str] = ()) -> Entry | None:
        """The latest sound file of a kind."""
        of_kind = [
            one
            for one in self.entries()
            if (one.kind, one.folder) == (kind, folder_of(kind)) and one.file not in apart_from
        ]
        return of_kind[-1] if of_kind else None

    def entry(self, name: str, *, removed: bool = False) -> Entry:
        """By its name, with or without folder or ending; of those in the bin if `removed`.

        Raises InvalidArgument if there is none, or several."""
        wanted = name.replace(os.sep, "/").casefold()
        found = [one for one in self.entries(removed=removed) if one.removed == removed and wanted in _names_of(one)]
        found = [one for one in found if wanted in (one.file.casefold(), one.name.casefold())] or found
        if len(found) == 1:
            return found[0]
        if found:
            files = ", ".join(one.file for one in found)
            raise InvalidArgument(f"{name}: {self.name} has several such files: {files}")
        where = " (it is a file outside the book: `stepdiag book add` takes it in)" if Path(name).exists() else ""
        place = "in the bin" if removed else "in the book"
        raise InvalidArgument(f"{name}: no file of {self.name} {place}{where}")

    def origins(self, entry: Entry) -> list[Entry]:
        """The files from which it was made and which are still there, and those from which these were made."""
        by_name = {one.file: one for one in self.entries(removed=True)}
        found: dict[str, Entry] = {}
        left = [entry]
        while left:
            record = left.pop().record
            for given in record.inputs if record else ():
                if given.file in by_name and given.file not in found:
                    found[given.file] = by_name[given.file]
                    left.append(by_name[given.file])
        return list(found.values())

    # --- changes ----------------------------------------------------------------------------------------------------
    def take(self, folder: str, name: str, *, exactly: bool = False, as_folder: bool = False) -> Path:
        """Take a free name for a new file. `release` gives it back."""
        check_name(name, "file")
        return reserve(self.folder / folder, name, exactly=exactly, as_folder=as_folder)

    def add(self, path: Path, *, command: tuple[str, ...], measured: str = "") -> tuple[Entry, bool]:
        """Copy a file into the book, a scenario with the files that it names. Returns it, and whether it is new.

        Raises InvalidArgument for a damaged file."""
        check_input(path)
        if path.is_dir() and not main_file(path).is_file():
            raise InvalidArgument(f"{path}: expected a file, or the folder of an export or a scenario")
        facts = facts_of(path)
        if facts.damaged:
            raise InvalidArgument(f"{path}: {facts.damaged}")
        companions = _named_by(main_file(path)) if facts.kind == "scenario" and not path.is_dir() else {}
        content = {name: read_bytes(file) for file, name in companions.items()}  # before the file that needs them
        content |= _contents(path) if path.is_dir() else {path.name: read_bytes(path)}
        whole = path.is_dir() or bool(companions)
        sha256 = fingerprint_of(content) if whole else hashlib.sha256(content[path.name]).hexdigest()
        twin = next((one for one in self.entries() if one.sha256 == sha256), None)
        if twin is not None:
            return twin, False
        name = safe_name(path.name if path.is_dir() or not whole else path.stem)
        target = self.take(folder_of(facts.kind), name, as_folder=whole)
        try:
            for inside, data in content.items():
                write_whole(target / inside if whole else target, data)
        except BaseException:
            _discard(target)
            raise
        self._came_in(FileRecord(file=self._name(target), sha256=sha256, facts=facts), command, path, measured)
        return self._at(target), True

    def write(self, folder: str, name: str, text: str, *, command: tuple[str, ...]) -> Path:
        """Write a new file. Returns its path."""
        target = self.take(folder, name)
        write_whole(target, text)
        self._came_in(self._file_record(target), command)
        return target

    def remove(self, entry: Entry, *, command: tuple[str, ...]) -> Path:
        """Move a file into the bin. Returns its place there."""
        return self._moved(entry, self.folder / BIN / entry.folder, command)

    def restore(self, entry: Entry, *, command: tuple[str, ...]) -> Path:
        """Move a file back from the bin. Returns its place."""
        return self._moved(entry, self.folder / entry.folder, command)

    def begin(self, command: tuple[str, ...], inputs: Sequence[Path], outputs: Sequence[Path]) -> Path:
        """Record a command before its work. Returns the file of the record, for `finish`."""
        given = tuple(FileRecord(file=self._name(path), sha256=fingerprint(path)) for path in inputs)
        made = tuple(FileRecord(file=self._name(path)) for path in outputs)
        return records.keep(self.folder, Record(command=command, begun=date_of_today(), inputs=given, outputs=made))

    def finish(self, begun: Path, status: int, outputs: Sequence[Path]) -> None:
        """Complete the record of a command that has written its results."""
        made = tuple(self._file_record(path) for path in outputs)
        record = records.read(begun).model_copy(update={"ended": date_of_today(), "status": status, "outputs": made})
        records.write(begun, record)

    def _moved(self, entry: Entry, folder: Path, command: tuple[str, ...]) -> Path:
        target = move(entry.path, folder)
        origin = entry.record
        record = Record(
            command=command,
            begun=date_of_today(),
            ended=date_of_today(),
            status=0,
            inputs=origin.inputs if origin else (),
            outputs=(FileRecord(file=self._name(target), sha256=entry.sha256, facts=entry.facts),),
            taken_from=entry.file,
            measured=origin.measured if origin else "",
        )
        records.keep(self.folder, record)
        return target

    def _came_in(
        self, made: FileRecord, command: tuple[str, ...], source: Path | None = None, measured: str = ""
    ) -> None:
        now, taken_from = date_of_today(), "" if source is None else str(source.absolute())
        record = Record(command=command, begun=now, ended=now, status=0, outputs=(made,))
        records.keep(self.folder, record.model_copy(update={"taken_from": taken_from, "measured": measured}))

    def _file_record(self, path: Path) -> FileRecord:
        return FileRecord(file=self._name(path), sha256=fingerprint(path), facts=facts_of(path))

    def _name(self, path: Path) -> str:
        """In the machine's folder. The main file of a folder stands for the folder."""
        parts = path.relative_to(self.folder).parts
        return "/".join(parts[: 3 if parts[0] == BIN else 2])

    def _at(self, path: Path) -> Entry:
        return next(one for one in self.entries() if one.path == path)


def find_book(given: Path | None) -> Book:
    """The book that is named, or in STEPDIAG_BOOK, or around the working folder. Raises InvalidArgument."""
    if given is not None:
        return Book(given)
    named = os.environ.get(VARIABLE)
    if named:
        return Book(Path(named))
    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / MARK).is_file():
            return Book(folder)
    raise InvalidArgument(
        f"no machine book here: name its folder with `book`, or in the environment variable {VARIABLE}; "
        "`stepdiag book new` with the name of a new folder makes one"
    )


def _names_of(entry: Entry) -> tuple[str, ...]:
    path = Path(entry.file.casefold())
    return (entry.file.casefold(), path.name, path.stem, path.with_suffix("").as_posix())


def _contents(folder: Path) -> dict[str, bytes]:
    return {path.name: read_bytes(path) for path in sorted(folder.iterdir()) if path.is_file()}


def _named_by(scenario: Path) -> dict[Path, str]:
    """The files that a scenario names, by path. Raises InvalidArgument if one is not in the scenario's own folder."""
    from stepdiag.scenario.description import read_scenario

    found = read_scenario(scenario)
    names = [head.keys.description for head in found.known.described.values() if head.keys.description]
    report = found.known.keys.report
    names += [report.logo] if report is not None and report.logo else []
    paths = [scenario.parent / name for name in dict.fromkeys(names)]
    paths += [found.truth.error_map] if found.truth.error_map is not None else []
    own = {path: os.path.relpath(path, scenario.parent) for path in paths if path.is_file()}  # else a shipped head
    for path, name in own.items():
        if os.path.dirname(name):
            raise InvalidArgument(
                f"{scenario}: names {path}; expected a file in the scenario's own folder, so that both can be kept "
                "together: put it there, and name it without a folder"
            )
    return own


def _discard(path: Path) -> None:
    """Remove what was begun and is not in the book yet."""
    with suppress(OSError):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()
