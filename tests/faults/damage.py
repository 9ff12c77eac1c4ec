"""Damaged files: each is refused with an InvalidArgument, or read as its plain form says."""

import csv
import io
import math
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mutation import mutated

import stepdiag as sd
from stepdiag import InvalidArgument


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
    return nearly(measurement_rows(again), measurement_rows(given))


def nearly(rows: list[Any], given: list[Any]) -> bool:
    """Whether rows are the same but for the rounding of a conversion to radians and back."""

    def same(one: Any, other: Any) -> bool:
        if isinstance(one, tuple):
            return len(one) == len(other) and all(map(same, one, other))
        return bool(one == other or (isinstance(one, float) and math.isclose(one, other, rel_tol=1e-15)))

    return len(rows) == len(given) and all(map(same, rows, given))


def with_checksum(path: Path, original: Path) -> list[tuple[tuple[str, Any], ...]]:
    """The rows that a file has to have: those of the original one, unless the line of its checksum is gone."""
    if path.suffix == ".nc" or b"# sha256=" in path.read_bytes():
        return rows_of(original)
    return rows_of(path)


def calibration(path: Path, original: Path) -> bool:
    again = path.with_name("again.csv")
    sd.read_calibration(path).write(again)
    return rows_of(again) == with_checksum(path, original)


def error_map(path: Path, original: Path) -> bool:
    again = path.with_name("again.csv")
    sd.read_error_map(path).write(again)
    return rows_of(again) == with_checksum(path, original)


def agrees(read: Any, given: Any) -> bool:
    """Whether all keys that were read have the value of the file."""
    if isinstance(read, dict) and isinstance(given, dict):
        return all(agrees(value, given[key]) for key, value in read.items() if key in given)
    if isinstance(read, list | tuple) and isinstance(given, list | tuple):
        return len(read) == len(given) and all(map(agrees, read, given))
    return bool(read == given) or not isinstance(given, bool | int | float | str)


def scenario(path: Path, original: Path) -> bool:
    keys = sd.read_scenario(path).known.keys
    return agrees(keys.model_dump(exclude_unset=True), tomllib.loads(path.read_text("utf-8-sig")))


def head(path: Path, original: Path) -> bool:
    sd.optics.read_head_design(path)
    return isinstance(tomllib.loads(path.read_text("utf-8-sig")), dict)


CODECS = {"UTF-8": "utf-8-sig", "UTF-16": "utf-16", "Latin-1": "cp1252"}
MARKS = {"comma": ",", "semicolon": ";", "tab": "\t"}
FACTORS = {"mm": 1.0, "µm": 1e-3, "m": 1e3, "cm": 10.0, "nm": 1e-6, "µrad": 1e-6, "mrad": 1e-3, "rad": 1.0}
LOST = ("", "-", "n/a", "na", "nan", "#n/a", "#nv", "lost")


def sheet(path: Path, original: Path) -> bool:
    """What `import` says that it read, read in the plain way with what it says, is the measurement."""
    from stepdiag.importing.run import import_files

    imported = import_files([path])
    said = imported.text[0].removeprefix(f"{path}: ")
    heads = dict(line.strip().rsplit(": ", 1) for line in imported.text[1:-1])
    form = re.fullmatch(r"(.+?), (\w+)s(?:, decimal (\w+))?; heads in line (\d+)", said)
    if form is None:
        rows, first, decimal = workbook_rows(path, original), 0, "."
    else:
        text = path.read_bytes().decode(CODECS[form[1]], errors="replace")
        mark, decimal = MARKS[form[2]], "," if form[3] == "comma" else "."
        first = int(form[4]) - 1
        rows = list(csv.reader(io.StringIO("\n".join(text.splitlines()[first:])), delimiter=mark))
    cells = [[cell.strip() for cell in row] for row in rows]
    body = [row for row in cells[1:] if any(row) and not row[0].startswith("# ")]
    table = [{head: cell for head, cell in zip(cells[0], row, strict=False) if head} for row in body]
    return plain_rows(table, heads, decimal) == measured_rows(imported.measurement)


def workbook_rows(path: Path, original: Path) -> list[list[str]]:
    """By another reader, of the first sheet; of the original where that one refuses the damaged file."""
    import openpyxl

    try:
        book = openpyxl.load_workbook(path, data_only=True)
    except Exception:
        book = openpyxl.load_workbook(original, data_only=True)
    return [
        ["" if cell is None else str(cell) for cell in row] for row in book.worksheets[0].iter_rows(values_only=True)
    ]


def plain_rows(table: list[dict[str, str]], heads: dict[str, str], decimal: str) -> list[tuple[Any, ...]]:
    rows = []
    for cells in table:
        row: dict[str, Any] = {"run": 0, "direction": "forward"}
        for head, meaning in heads.items():
            name, _, unit = meaning.partition(" in ")
            if meaning == "left out":
                continue
            cell = cells[head].replace(",", ".") if decimal == "," else cells[head].replace(",", "")
            if unit:
                row[name] = None if cell.casefold() in LOST else float(f"{float(cell) * FACTORS[unit]:.12g}")
            elif name in ("point", "run"):
                row[name] = int(float(cell)) if cell else 0
            else:
                row[name] = cells[head].lower() or row.get(name)
        rows.append(tuple(sorted(row.items())))
    return sorted(rows, key=repr)


def measured_rows(run: sd.Measurement) -> list[tuple[Any, ...]]:
    rows = []
    for k, line in enumerate(run.line):
        row: dict[str, Any] = {"line": line, "point": run.point[k], "run": run.run[k], "direction": run.direction[k]}
        row |= {axis: short(run.position[k][a]) for a, axis in enumerate("xyz")}
        row |= {name: short(values[k]) for name, values in run.channels.items()}
        row |= {f"u_{name}": short(values[k]) for name, values in run.standard_uncertainty.items()}
        rows.append(tuple(sorted(row.items())))
    return sorted(rows, key=repr)


def short(value: float) -> float | None:
    return None if value != value else float(f"{value:.12g}") + 0.0


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
