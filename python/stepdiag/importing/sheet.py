"""The cells of a file: a text with its separator, or a workbook (.xlsx, .ods)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.importing.columns import Mapped, find_heads, plain, split_head
from stepdiag.importing.workbook import check_workbook
from stepdiag.io.sheet_text import ARCHIVE, OLD_WORKBOOK, SEPARATORS, decode, fields_of
from stepdiag.io.whole_files import LARGEST_TEXT, read_bytes

Cell = str | float
_LAST_HEAD: Final = 50  # rows in which the heads are looked for


@dataclass(frozen=True)
class Sheet:
    """The rows below the heads, each with its place in words; `form` says in words what the file is."""

    path: Path
    form: str
    heads: Sequence[str]
    head_place: str
    rows: Sequence[tuple[str, Sequence[Cell]]]

    @property
    def has_commas(self) -> bool:
        """Whether commas separate the fields."""
        return self.form.endswith(", commas")


Rows = list[tuple[str, list[Cell]]]


def read_sheet(path: Path, mappings: Sequence[Mapped], separator: str | None = None, page: str | None = None) -> Sheet:
    """Read the sheet of a file.

    `separator`: a key of SEPARATORS; `page`: the name of a workbook's sheet. Both are found if they are None.
    Raises InvalidArgument naming the file, and what would decide where two ways of reading make sense."""
    content = read_bytes(path)
    if len(content) > LARGEST_TEXT:
        raise InvalidArgument(f"{path}: larger than {LARGEST_TEXT // 2**20} MiB")
    if content.startswith(OLD_WORKBOOK):
        raise InvalidArgument(f"{path}: is an old workbook (.xls) or has a password: save it as .xlsx or .ods")
    is_workbook = content.startswith(ARCHIVE)
    if not is_workbook and page is not None:
        raise InvalidArgument(f"{path}: is no workbook, and has no `sheet`")
    if is_workbook and separator is not None:
        raise InvalidArgument(f"{path}: is a workbook, and has no `separator`")
    found = _pages(path, content, page) if is_workbook else _texts(path, content, separator)
    sheets = [sheet for form, rows in found if (sheet := _below_heads(path, form, rows, mappings))]
    if not sheets:
        raise InvalidArgument(f"{path}: {_no_heads(found)}")
    if len(sheets) > 1:
        option = "sheet" if is_workbook else "separator"
        ways = " and with ".join(sheet.form for sheet in sheets)
        raise InvalidArgument(f"{path}: makes sense with {ways}: `{option}` decides")
    return sheets[0]


def _texts(path: Path, content: bytes, separator: str | None) -> list[tuple[str, Rows]]:
    try:
        text, encoding = decode(content)
    except InvalidArgument as error:
        raise InvalidArgument(f"{path}: {error}") from None
    if not text.strip():
        raise InvalidArgument(f"{path}: the file is empty")
    lines = text.split("\n")
    said = lines[0].strip().strip('"')
    if said.lower().startswith("sep=") and said[4:] in SEPARATORS.values():  # as Excel writes and reads it
        text = "\n".join(["", *lines[1:]])
        separator = separator or next(name for name, mark in SEPARATORS.items() if mark == said[4:])
    found: list[tuple[str, Rows]] = []
    refusals = []
    for name in SEPARATORS if separator is None else (separator,):
        try:
            rows = fields_of(text, SEPARATORS[name])
        except InvalidArgument as error:
            refusals.append(str(error))
            continue
        found.append((f"{encoding}, {name}s", [(f"line {number}", list(fields)) for number, fields in rows]))
    if not found:
        raise InvalidArgument(f"{path}, {refusals[0]}")
    return found


def _pages(path: Path, content: bytes, page: str | None) -> list[tuple[str, Rows]]:
    try:
        from python_calamine import CalamineError, CalamineWorkbook
    except ImportError:
        raise InvalidArgument(f"{path}: workbooks need python-calamine: pip install 'stepdiag[import]'") from None
    try:
        check_workbook(content)
    except InvalidArgument as error:
        raise InvalidArgument(f"{path}: {error}") from None
    try:
        with CalamineWorkbook.from_filelike(BytesIO(content)) as book:
            names = book.sheet_names
            if not names:
                raise InvalidArgument(f"{path}: the workbook has no sheets; it may be damaged")
            if page is not None and page not in names:
                raise InvalidArgument(f'{path}: has no sheet "{page}"; sheets: {", ".join(names)}')
            return [
                (
                    f'sheet "{name}"',
                    [
                        (f'sheet "{name}", row {number}', [_cell(cell) for cell in row])
                        for number, row in enumerate(book.get_sheet_by_name(name).to_python(skip_empty_area=False), 1)
                    ],
                )
                for name in names
                if page in (None, name)
            ]
    except CalamineError as error:
        raise InvalidArgument(f"{path}: not a workbook that can be read: {error}") from None


def _cell(cell: object) -> Cell:
    """Dates and truth values are texts, which no column of readings takes."""
    is_number = isinstance(cell, int | float) and not isinstance(cell, bool)
    return float(cell) if is_number else str(cell).strip()  # type: ignore[arg-type]


def _below_heads(path: Path, form: str, rows: Rows, mappings: Sequence[Mapped]) -> Sheet | None:
    """The sheet if one of its first rows is that of the heads. Raises InvalidArgument for rows of another length."""
    start = next((k for k, (_, row) in enumerate(rows[:_LAST_HEAD]) if find_heads(_texts_of(row), mappings)), None)
    if start is None:
        return None
    heads = _texts_of(rows[start][1])
    while heads and not heads[-1]:
        heads.pop()
    body = []
    for place, row in rows[start + 1 :]:
        cells = list(row)
        if not any(cell != "" for cell in cells) or (isinstance(cells[0], str) and cells[0].startswith("# ")):
            continue
        while len(cells) > len(heads) and cells[-1] == "":
            cells.pop()
        if len(cells) != len(heads):
            raise InvalidArgument(f"{path}, {place}: expected {len(heads)} fields, as in the heads, got {len(cells)}")
        body.append((place, cells))
    for index, head in enumerate(heads):
        used = next((place for place, cells in body if not head and cells[index] != ""), None)
        if used is not None:
            raise InvalidArgument(f"{path}, {used}: has a field in column {index + 1}, which has no head")
    sheet = Sheet(path, form, heads, rows[start][0], body)
    return _with_units_row(sheet)


def _with_units_row(sheet: Sheet) -> Sheet:
    """Takes a row of units below the heads into them."""
    if not sheet.rows:
        return sheet
    first = _texts_of(sheet.rows[0][1])
    at = {split_head(head)[0]: cell for head, cell in zip(sheet.heads, first, strict=True)}
    if at.get("line") not in ("", "-") or at.get("point") not in ("", "-"):
        return sheet
    heads = [
        head if plain(cell) in ("", "-") or split_head(head)[1] is not None else f"{head} [{cell.strip('[]()')}]"
        for head, cell in zip(sheet.heads, first, strict=True)
    ]
    return replace(sheet, heads=heads, rows=sheet.rows[1:])


def _texts_of(row: Sequence[Cell]) -> list[str]:
    return [cell if isinstance(cell, str) else "" for cell in row]


def _no_heads(found: Sequence[tuple[str, Rows]]) -> str:
    _, rows = max(found, key=lambda way: max((len(row) for _, row in way[1][:_LAST_HEAD]), default=0))
    heads = next((_texts_of(row) for _, row in rows if len([cell for cell in row if cell != ""]) > 1), [])
    known = ", ".join(f'"{head}"' for head in heads if head) or "none"
    return (
        "expected a row of heads with line and point; "
        f'heads found: {known}; name others with `column`, such as `column` "Diagonal=line"'
    )
