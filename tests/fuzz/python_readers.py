"""The readers that are written in Python against spoiled files: what they do not read they refuse with InvalidArgument.

    python tests/fuzz/python_readers.py READER SECONDS FAILURES    (tests/fuzz/run calls it)

Starts from good files, changes bytes, lines and values. An input that makes a reader raise anything else, take longer
than 10 s, or end the process is left in the folder FAILURES.
"""

from __future__ import annotations

import faulthandler
import random
import re
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import acquisition_readers as acquisition
import table_reader
import workbooks

import stepdiag as sd
from stepdiag.head.description import read_head_design
from stepdiag.scenario.description import read_scenario

ROOT = Path(__file__).parents[2]
WEIRD = [
    *(
        "nan",
        "inf",
        "-1",
        "0",
        "-0.0",
        "1e308",
        "-1e-320",
        "9" * 30,
        "true",
        '""',
        '"ppp"',
        "[]",
        "[[]]",
        "{}",
        '"\\u0000"',
    ),
    *(
        "[1.0, 2.0]",
        '["ppp", "ppp"]',
        '"../../etc/passwd"',
        "1979-05-27",
        "[nan, nan, nan]",
        '"[w X\' b Y Z t]"',
        "1000000000",
    ),
]
# What stands behind = or :, or between commas.
VALUE = re.compile(rb"(?:[=:,\[] *)(\"[^\"]*\"|\[[^\]]*\]|[^,\]\[}]+)")


@dataclass(frozen=True)
class Reader:
    read: Callable[[Path], Any]
    seeds: Callable[[], list[bytes]]
    ending: str
    is_text: bool = True
    spoil: Callable[[bytes, random.Random], bytes] | None = None  # other than below


def scenarios() -> list[bytes]:
    files = [*ROOT.glob("python/stepdiag/selftest/known/runs/*/scenario.toml"), *ROOT.glob("examples/*.toml")]
    # The map lies where the scenario did.
    return [path.read_bytes().replace(b'"truth.csv"', f'"{path.parent}/truth.csv"'.encode()) for path in sorted(files)]


def heads() -> list[bytes]:
    return [path.read_bytes() for path in sorted((ROOT / "python/stepdiag/head/shipped").glob("*.toml"))]


READERS = {
    "scenario": Reader(read_scenario, scenarios, ".toml"),
    "head": Reader(read_head_design, heads, ".toml"),
    "raw": Reader(acquisition.read_raw_file, acquisition.raw_files, ".jsonl"),
    "requests": Reader(acquisition.answer_requests, acquisition.requests, ".json"),
    "replies": Reader(acquisition.read_replies, acquisition.replies, ".json"),
    "lines": Reader(acquisition.read_lines, acquisition.lines, ".jsonl"),
    "wishes": Reader(acquisition.read_wishes, acquisition.wishes, ".txt"),
    "table": Reader(table_reader.read, table_reader.seeds, ".txt"),
    "workbook": Reader(workbooks.read, workbooks.seeds, ".xlsx", False, workbooks.spoiled),
}


def spoiled(content: bytes, chance: random.Random, is_text: bool) -> bytes:
    for _ in range(chance.randint(1, 4)):
        content = spoil_line(content, chance) if is_text and chance.random() < 0.7 else spoil_bytes(content, chance)
    return content


def spoil_line(content: bytes, chance: random.Random) -> bytes:
    """Of TOML or JSON: takes a line out, doubles it, moves it, or puts another value into it."""
    lines = content.split(b"\n")
    i, j = chance.randrange(len(lines)), chance.randrange(len(lines))
    values = list(VALUE.finditer(lines[i]))
    match chance.randrange(5):
        case 0:
            del lines[i]
        case 1:
            lines.insert(j, lines[i])
        case 2:
            lines[i], lines[j] = lines[j], lines[i]
        case 3 | 4 if values:
            start, end = chance.choice(values).span(1)
            lines[i] = lines[i][:start] + chance.choice(WEIRD).encode() + lines[i][end:]
    return b"\n".join(lines)


def spoil_bytes(content: bytes, chance: random.Random) -> bytes:
    changed = bytearray(content)
    start, length = chance.randrange(len(content) + 1), chance.randint(1, 30)
    match chance.randrange(5):
        case 0:
            changed[start : start + 1] = chance.randbytes(1)
        case 1:
            changed[start : start + length] = chance.randbytes(chance.randint(0, 8))
        case 2:
            del changed[start : start + length]
        case 3:
            changed[start:start] = changed[start : start + length]
        case 4:
            del changed[start:]
    return bytes(changed)


def main(name: str, seconds: float, failures: Path) -> int:
    reader = READERS[name]
    chance = random.Random()
    seeds = reader.seeds()
    path = failures / f"last{reader.ending}"  # which stays where the process ends within a reader
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
    signal.signal(signal.SIGALRM, too_slow)
    inputs = read = 0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        seed = chance.choice(seeds)
        path.write_bytes(reader.spoil(seed, chance) if reader.spoil else spoiled(seed, chance, reader.is_text))
        faulthandler.dump_traceback_later(30.0, exit=True)
        signal.alarm(10)
        try:
            reader.read(path)
            read += 1
        except sd.InvalidArgument:
            pass
        except BaseException:
            kept = path.rename(failures / f"failure-{inputs}{reader.ending}")
            traceback.print_exc()
            print(f"stat::number_of_executed_units: {inputs}\n{kept} is not refused as it should", flush=True)
            return 1
        finally:
            signal.alarm(0)
        inputs += 1
    faulthandler.cancel_dump_traceback_later()
    path.unlink()
    print(f"stat::number_of_executed_units: {inputs}\nstat::new_units_added: {read}")
    print(f"stat::peak_rss_mb: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024}")
    return 0


def too_slow(*_: Any) -> None:
    raise TimeoutError("more than 10 s")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], float(sys.argv[2]), Path(sys.argv[3])))
