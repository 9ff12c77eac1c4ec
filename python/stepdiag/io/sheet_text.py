"""Texts of spreadsheet programs: their encoding, their separator, and what a file looks like that is not ours."""

import csv
import re
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.io.whole_files import read_bytes

SEPARATORS: Final = {"comma": ",", "semicolon": ";", "tab": "\t"}
ARCHIVE: Final = b"PK\x03\x04"  # .xlsx and .ods
OLD_WORKBOOK: Final = b"\xd0\xcf\x11\xe0"  # .xls
_MARKS_OF_UTF16: Final = (b"\xff\xfe", b"\xfe\xff")


def decode(content: bytes) -> tuple[str, str]:
    """The text of a file, and the name of its encoding. Raises InvalidArgument for binary data."""
    if content.startswith(_MARKS_OF_UTF16) or b"\0" in content:
        return _decode_utf16(content), "UTF-16"
    try:
        return content.decode("utf-8-sig"), "UTF-8"
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace"), "Latin-1"


def _decode_utf16(content: bytes) -> str:
    """Without a mark, the zero bytes of Latin letters tell the order of bytes."""
    little = content[1::2].count(0) > content[0::2].count(0)
    try:
        if content.startswith(_MARKS_OF_UTF16):
            return content.decode("utf-16")
        text = content.decode("utf-16-le" if little else "utf-16-be")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        raise InvalidArgument("expected a text file, got binary data")
    return text


def fields_of(text: str, separator: str) -> list[tuple[int, list[str]]]:
    """The number of each line and its fields. Raises InvalidArgument for what is no CSV."""
    reader = csv.reader(text.splitlines(keepends=True), delimiter=separator, strict=True)
    rows = []
    try:
        for fields in reader:
            rows.append((reader.line_num, [field.strip() for field in fields]))
    except csv.Error as error:
        raise InvalidArgument(f"line {reader.line_num}: not valid CSV: {error}") from None
    return rows


def form_of(path: Path) -> str | None:
    """What a file that the strict reader refuses looks like, such as "semicolons with decimal commas"; None if it
    looks like a CSV file of ours."""
    try:
        content = read_bytes(path)
        if content.startswith(ARCHIVE):
            return "a workbook of a spreadsheet program"
        if content.startswith(OLD_WORKBOOK):
            return None  # import reads none
        text, encoding = decode(content)
    except InvalidArgument:
        return None
    lines = [line for line in text.splitlines()[:50] if line.strip() and not line.startswith("#")]
    counts = {name: sum(line.count(mark) for line in lines[:2]) for name, mark in SEPARATORS.items()}
    found = max(("tab", "semicolon"), key=counts.__getitem__)
    forms = [] if encoding == "UTF-8" else [f"{encoding} text"]
    if counts[found] > 1 and _separates(lines, SEPARATORS[found]):
        mark = SEPARATORS[found]
        decimal = any(re.fullmatch(r'"?[-+]?\d+,\d+"?', field.strip()) for line in lines for field in line.split(mark))
        forms.append(f"{found}s" + (" with decimal commas" if decimal else ""))
    return ", ".join(forms) or None


def _separates(lines: list[str], mark: str) -> bool:
    """Whether the head has this separator outside of quotes more often than a comma."""
    head = re.sub(r'"[^"]*"', "", lines[0]) if lines else ""
    return head.count(mark) > head.count(",")
