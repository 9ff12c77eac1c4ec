"""Workbooks for the fuzzing of import: good ones, and their parts spoiled and packed again."""

from __future__ import annotations

import io
import random
import re
import zipfile
from pathlib import Path
from typing import Any

import openpyxl

from stepdiag.importing.run import import_files

ROWS: list[list[Any]] = [
    ["line", "point", "x_mm", "y_mm", "z_mm", "distance_mm", "Remark"],
    ["ppp", 0, 0, 0, 0, 100.5, "cold"],
    ["ppp", 1, 16, 0, 0, 112.25, ""],
    ["ppp", 2, 16, 12, 0, "", " "],
]
NUMBERS = [
    "0",
    "-1",
    "1048576",
    "1048577",
    "4294967295",
    "18446744073709551615",
    "9" * 40,
    "1e308",
    "nan",
    "",
    " ",
    "s",
]
CELLS = ["A1", "XFD1048576", "XFE1", "A4294967295", "ZZZZZZZ1", "a1", "$B$2", "A0", "1", "AAAA99999999999999999999"]
# Attribute values, texts and whole tags.
PIECE = re.compile(rb'(?<==")[^"]*(?=")|(?<=>)[^<]+(?=<)|<[^>]+>')
ODS = (
    '<office:document-content xmlns:office="urn:oasis:names:tc:opendocument:xmlns:office:1.0" '
    'xmlns:table="urn:oasis:names:tc:opendocument:xmlns:table:1.0" '
    'xmlns:text="urn:oasis:names:tc:opendocument:xmlns:text:1.0"><office:body><office:spreadsheet>'
    '<table:table table:name="Run">{}</table:table></office:spreadsheet></office:body></office:document-content>'
)


def read(path: Path) -> None:
    import_files([path])


def ods(rows: str) -> bytes:
    """A workbook of one sheet with these rows."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("META-INF/manifest.xml", "<manifest/>")
        archive.writestr("content.xml", ODS.format(rows))
    return file.getvalue()


def ods_row(cells: list[Any], repeated: int = 1) -> str:
    def cell(value: Any) -> str:
        if value == "":
            return '<table:table-cell table:number-columns-repeated="1"/>'
        kind = "string" if isinstance(value, str) else f'float" office:value="{value}'
        return f'<table:table-cell office:value-type="{kind}"><text:p>{value}</text:p></table:table-cell>'

    body = "".join(map(cell, cells))
    return f'<table:table-row table:number-rows-repeated="{repeated}">{body}</table:table-row>'


def seeds() -> list[bytes]:
    book = openpyxl.Workbook()
    sheet: Any = book.active
    for row in ROWS:
        sheet.append(row)
    sheet["G2"] = "=1/0"
    sheet["G3"].number_format = "yyyy-mm-dd"
    sheet.merge_cells("A9:B10")
    file = io.BytesIO()
    book.save(file)
    return [file.getvalue(), ods("".join(map(ods_row, ROWS)) + ods_row([""], 1048000))]


def spoiled(content: bytes, chance: random.Random) -> bytes:
    """A workbook with one to four pieces of its XML replaced, taken out or doubled."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    for _ in range(chance.randint(1, 4)):
        sheets = [name for name in parts if "sheet" in name or "content" in name]
        name = chance.choice(sheets if chance.random() < 0.7 else list(parts))
        pieces = list(PIECE.finditer(parts[name]))
        if not pieces:
            continue
        start, end = chance.choice(pieces).span()
        piece = parts[name][start:end]
        weird = chance.choice(NUMBERS + CELLS).encode()
        parts[name] = parts[name][:start] + chance.choice([weird, weird, b"", 2 * piece]) + parts[name][end:]
    if chance.random() < 0.05:
        del parts[chance.choice(list(parts))]
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, part in parts.items():
            archive.writestr(name, part)
    return file.getvalue()
