"""CSV files of results: leading lines `# key=value`, names of columns, rows."""

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence

from stepdiag._core import InvalidArgument


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


def finite_number(field: str, where: str) -> float:
    """A number of a field; raises InvalidArgument, with where it stands, for any other text."""
    try:
        number = float(field)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InvalidArgument(f"{where}: expected a finite number, got {field!r}")
    return number
