"""A machine book of 50 machines with 100 calibrations each: its index, and how long commands take.

    ./run python benchmarks/machine_book.py [--machines 50] [--calibrations 100] [--plain 20]

The calibrations are those of examples/scenario.toml with 10 steps, of four noises, dated over ten years. Each is kept
as a command keeps it, with its record. `--plain` calibrations are put into the book by hand, without a record: these
have to be read for the index. The exit code is 1 if an index lacks an entry, if two of them differ, or if a search does
not find what it should.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from datetime import date, timedelta
from pathlib import Path

import stepdiag as sd
from stepdiag.book.book import Book
from stepdiag.book.facts import facts_of
from stepdiag.book.machine_keys import AboutMachine
from stepdiag.book.overview import overview
from stepdiag.book.records import FileRecord, Record, fingerprint, keep

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "scenario.toml"
COMMAND = ("stepdiag", "evaluate", "--machine")


def four_calibrations(folder: Path) -> list[Path]:
    before = "tilt_urad = 1.0\nseed = "
    head, _, rest = EXAMPLE.read_text().replace("steps = 50", "steps = 10").partition(before)
    made = []
    for seed in range(4):
        scenario = folder / f"{seed}.toml"
        scenario.write_text(f"{head}{before}{seed + 10}{rest[1:]}")
        described = sd.read_scenario(scenario)
        run = sd.simulate(described)
        made.append(folder / f"{seed}.nc")
        sd.judge(described, run, full_covariance=True).calibration.write(made[-1])
    return made


def filled(folder: Path, machines: int, calibrations: int, sources: list[Path]) -> Book:
    book = Book.make(folder)
    facts = [facts_of(path) for path in sources]
    for number in range(machines):
        machine = book.new_machine(f"machine {number}", AboutMachine(serial_number=f"S{1000 + number}", limit_um=50.0))
        (machine.folder / "calibrations").mkdir()
        for k in range(calibrations):
            which = (number + k) % len(sources)
            path = machine.folder / "calibrations" / f"{k:03}.nc"
            path.write_bytes(sources[which].read_bytes())
            made = FileRecord(file=f"calibrations/{path.name}", sha256=fingerprint(path), facts=facts[which])
            day = date(2016, 1, 1) + timedelta(days=36 * k + number)
            command = (*COMMAND, machine.name)
            began = f"{day}T08:00:00Z"
            keep(machine.folder, Record(command=command, begun=began, ended=began, outputs=(made,), measured=f"{day}"))
    return book


def seconds(work: object) -> float:
    start = time.perf_counter()
    work()  # type: ignore[operator]
    return time.perf_counter() - start


def command(*words: str) -> float:
    return seconds(lambda: subprocess.run([sys.executable, "-m", "stepdiag", *words], check=True, capture_output=True))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=50)
    parser.add_argument("--calibrations", type=int, default=100)
    parser.add_argument("--plain", type=int, default=20)
    given = parser.parse_args()
    count = given.machines * given.calibrations
    with tempfile.TemporaryDirectory(prefix="stepdiag-book-") as name:
        sources = four_calibrations(Path(name))
        book = filled(Path(name) / "book", given.machines, given.calibrations, sources)
        size = sum(path.stat().st_size for path in book.folder.rglob("*.nc"))
        print(f"{given.machines} machines, {count} calibrations of {size / count / 1e3:.0f} kB")
        sound = True

        def opened() -> list[tuple[str, str]]:
            again = Book(book.folder)
            found = [overview(machine) for machine in again.machines()]
            return [(one.name, one.last.file if one.last else "") for one in found]

        print(f"index from nothing     {seconds(lambda: book.reindex()):8.2f} s")
        first = opened()
        index = book.folder / "book.sqlite"
        print(f"size of the index      {index.stat().st_size / 1e6:8.2f} MB")
        print(f"all machines, unchanged{seconds(opened):8.2f} s")
        print(f"one machine, unchanged {seconds(lambda: Book(book.folder).machines()[0].entries()):8.3f} s")
        found: list[object] = []
        print(
            f"search                 {seconds(lambda: found.extend(Book(book.folder).find(['S1003', '2017']))):8.2f} s"
        )
        sound &= len(found) >= min(10, given.calibrations // 10)
        print(f"stepdiag book list     {command('book', 'list', '--book', str(book.folder)):8.2f} s")
        print(f"stepdiag book show     {command('book', 'show', 'machine 3', '--book', str(book.folder)):8.2f} s")
        os.remove(index)
        sound &= opened() == first and len(first) == given.machines
        own = Book(book.folder).machines()[0]
        for k in range(given.plain):
            (own.folder / "calibrations" / f"plain {k}.nc").write_bytes(sources[k % 4].read_bytes())
        if given.plain:
            took = seconds(lambda: own.entries())
            print(f"without a record       {took / given.plain:8.3f} s each")
        sound &= len(own.entries()) == given.calibrations + given.plain
    print("index is complete" if sound else "AN ENTRY IS MISSING")
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
