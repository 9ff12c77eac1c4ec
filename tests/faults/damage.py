"""Damaged files: each is refused with an InvalidArgument, or read as its plain form says."""

import csv
import random
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import stepdiag as sd
from stepdiag import InvalidArgument


def mutated(content: bytes, seed: int) -> bytes:
    """Flipped bits, other bytes, cut, a line or a block twice, gone or elsewhere; sometimes several of these."""
    chance = random.Random(seed)
    data = bytearray(content)
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        if not data:
            break
        what, place = chance.randrange(8), chance.randrange(len(data))
        if what == 0:
            data[place] ^= 1 << chance.randrange(8)
        elif what == 1:
            data[place] = chance.choice(b'0123456789.,;-+eEnN"#=\n\r\t \0\xff')
        elif what == 2:
            del data[place:]
        elif what == 3:
            del data[place : place + chance.choice((1, 2, 7, 64))]
        elif what == 4:
            data[place:place] = data[chance.randrange(len(data)) :][: chance.choice((1, 3, 80))]
        else:
            lines = bytes(data).splitlines(keepends=True)
            one, other = chance.randrange(len(lines)), chance.randrange(len(lines))
            if what == 5:
                del lines[one]
            elif what == 6:
                lines.insert(other, lines[one])
            else:
                lines[one], lines[other] = lines[other], lines[one]
            data = bytearray(b"".join(lines))
    return bytes(data)


def rows_of(path: Path) -> list[tuple[tuple[str, Any], ...]]:
    """The rows of a table in no order, read by Python's csv: numbers as numbers, what is empty left out."""
    text = path.read_text("utf-8-sig")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return sorted(
        (tuple(sorted((key, number(value)) for key, value in row.items() if value)) for row in csv.DictReader(lines)),
        key=repr,
    )


def number(text: str) -> Any:
    try:
        return float(text) + 0.0  # -0 is 0
    except ValueError:
        return text


def measurement_rows(path: Path) -> list[tuple[tuple[str, Any], ...]]:
    """Without what a writer adds or leaves out by its rules: run 0, direction forward."""
    plain = {("run", 0.0), ("direction", "forward")}
    return sorted((tuple(item for item in row if item not in plain) for row in rows_of(path)), key=repr)


def measurement(path: Path, original: Path) -> bool:
    again = path.with_name("again.csv")
    sd.read_measurement(path).write(again)
    given = original if path.suffix == ".nc" else path
    return measurement_rows(again) == measurement_rows(given)


def calibration(path: Path, original: Path) -> bool:
    again = path.with_name("again.csv")
    sd.write_calibration(sd.read_calibration(path), again)
    return rows_of(again) == rows_of(original)


def error_map(path: Path, original: Path) -> bool:
    again = path.with_name("again.csv")
    sd.read_error_map(path).write(again)
    return rows_of(again) == rows_of(original)


def scenario(path: Path, original: Path) -> bool:
    sd.read_scenario(path)
    return isinstance(tomllib.loads(path.read_text("utf-8-sig")), dict)


def head(path: Path, original: Path) -> bool:
    sd.read_head_design(path)
    return isinstance(tomllib.loads(path.read_text("utf-8-sig")), dict)


def sheet(path: Path, original: Path) -> bool:
    from stepdiag.importing.run import import_files

    import_files([path])
    return True


READERS: dict[str, Callable[[Path, Path], bool]] = {
    "measurement.csv": measurement,
    "measurement.nc": measurement,
    "calibration.csv": calibration,
    "calibration.nc": calibration,
    "map.csv": error_map,
    "scenario.toml": scenario,
    "head.toml": head,
    "sheet.csv": sheet,
    "sheet.xlsx": sheet,
}


def try_one(name: str, content: bytes, seed: int, folder: Path, original: Path) -> str:
    """ "refused", "recovered" (read as it says) or "lost" (read as something else, or no InvalidArgument)."""
    changed = mutated(content, seed)
    path = folder / name
    path.write_bytes(changed)
    try:
        same = READERS[name](path, original)
    except InvalidArgument as error:
        return "refused" if str(error).count("\n") == 0 else f"lost: {str(error)[:300]!r}"
    except Exception as error:
        return f"lost: {type(error).__name__}: {str(error)[:300]}"
    return "recovered" if same else "lost: read as something else"
