"""CSV files of results: leading lines `# key=value`, names of columns, rows."""

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepdiag._core import InvalidArgument, newer_format
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.io.whole_files import read_text


def csv_text(columns: Sequence[str], rows: Iterable[Iterable[object]], leading: Mapping[str, str] | None = None) -> str:
    """The file. None and NaN are empty fields; a key without value has no line."""
    text = io.StringIO()
    text.writelines(f"# {key}={value}\n" for key, value in (leading or {}).items() if value)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow("" if isinstance(field, float) and math.isnan(field) else field for field in row)
    return text.getvalue()


def lengths(values: Iterable[float]) -> str:
    """Numbers, each read back to the same bits."""
    return " ".join(repr(float(value)) for value in values)


@dataclass(frozen=True)
class CsvTable:
    """A file as texts: its leading lines by key, and for each row its place in words and its fields by column."""

    path: Path
    leading: Mapping[str, str]
    columns: Sequence[str]
    rows: Sequence[tuple[str, Mapping[str, str]]]

    def lengths(self, key: str) -> FloatArray:
        """Three lengths of a leading line. Raises InvalidArgument naming the key."""
        return three_numbers(self.leading.get(key, ""), f"{self.path}: {key}")


def read_csv(path: Path, columns: Sequence[str], format_: str = "") -> CsvTable:
    """Read a file.

    Raises InvalidArgument naming the file for another format than `format_`, for a missing column,
    for a row with another number of fields than the header, and for what is no CSV."""
    lines = read_text(path).split("\n")
    start = next((k for k, line in enumerate(lines) if line.strip() and not line.startswith("#")), len(lines))
    leading = dict(re.findall(r"(?m)^#\s*(\w+)\s*=\s*(.*?)\s*$", "\n".join(lines[:start])))
    given = leading.get("format", "")
    if format_ and given != format_:
        newer = newer_format(format_, given)
        raise InvalidArgument(f'{path}: format: expected "{format_}", got "{given}"{newer}')
    table = csv.DictReader(lines[start:], strict=True)
    try:
        found = table.fieldnames or ()
        for column in columns:
            if column not in found:
                raise InvalidArgument(f"{path}, line {start + 1}: expected the column {column}")
        return CsvTable(path, leading, found, list(_rows(table, f"{path}, line", start)))
    except csv.Error as error:
        raise InvalidArgument(f"{path}, line {start + table.line_num}: not valid CSV: {error}") from None


def _rows(table: "csv.DictReader[str]", place: str, start: int) -> Iterator[tuple[str, Mapping[str, str]]]:
    for row in table:
        where = f"{place} {start + table.line_num}"
        if None in row or None in row.values():
            raise InvalidArgument(f"{where}: expected {len(table.fieldnames or ())} fields, as in the header")
        yield where, row


def three_numbers(text: str, where: str) -> FloatArray:
    """The numbers of a text. Raises InvalidArgument unless there are three."""
    words = text.split()
    if len(words) != 3:
        raise InvalidArgument(f"{where}: expected three numbers, got {text or 'none'}")
    return np.array([finite_number(word, where) for word in words])


def finite_number(field: str, where: str) -> float:
    """A number of a field; raises InvalidArgument, with where it stands, for any other text."""
    try:
        number = float(field)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InvalidArgument(f"{where}: expected a finite number, got {field!r}")
    return number
