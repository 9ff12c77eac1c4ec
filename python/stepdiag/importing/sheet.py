"""The cells of a file: a text with its separator, or a workbook (.xlsx, .ods)."""

import datetime
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Final, Literal, Self

from stepdiag._core import InvalidArgument
from stepdiag.importing.columns import Mapped, find_heads, plain, same_unit, split_head
from stepdiag.importing.workbook import Place, Shown, Span, look_at_workbook
from stepdiag.io.sheet_text import ARCHIVE, OLD_WORKBOOK, SEPARATORS, decode, fields_of
from stepdiag.io.whole_files import LARGEST_TEXT, read_bytes

Cell = str | float
Hidden = Literal["take", "leave"]
LAST_HEAD: Final = 50  # rows in which the heads are looked for


@dataclass(frozen=True)
class Sheet:
    """The rows below the heads, each with its place in words; `form` says in words what the file is.

    hidden_columns: indices. repeated: cells that are part of a merged one, which begins further up; they have its
    content. said: what else was done."""

    path: Path
    form: str
    heads: Sequence[str]
    head_place: str
    rows: Sequence[tuple[str, Sequence[Cell]]]
    hidden_columns: frozenset[int] = frozenset()
    repeated: frozenset[tuple[str, int]] = frozenset()  # place and index
    said: tuple[str, ...] = ()

    @property
    def has_commas(self) -> bool:
        """Whether commas separate the fields."""
        return self.form.endswith(", commas")


class Formatted(float):
    """A number of a workbook, and the format in which the workbook shows it."""

    code: str

    def __new__(cls, value: float, code: str) -> Self:
        made = super().__new__(cls, value)
        made.code = code
        return made


Rows = list[tuple[str, list[Cell]]]


@dataclass(frozen=True)
class _Page:
    """Cells, as yet without heads."""

    form: str
    rows: Rows
    is_hidden: bool = False
    hidden_rows: frozenset[str] = frozenset()  # places
    hidden_columns: frozenset[int] = frozenset()
    repeated: frozenset[tuple[str, int]] = frozenset()


def read_sheet(
    path: Path,
    mappings: Sequence[Mapped],
    separator: str | None = None,
    page: str | None = None,
    hidden: Hidden | None = None,
) -> Sheet:
    """Read the sheet of a file.

    `separator`: a key of SEPARATORS; `page`: the name of a workbook's sheet. Both are found if they are None.
    `hidden`: whether hidden rows are taken; None: a sheet that has any is refused. Raises InvalidArgument naming the
    file, and what would decide where two ways of reading make sense."""
    found = _found(path, separator, page)
    seen = [one for one in found if page is not None or not one.is_hidden]
    sheets = [sheet for one in seen if (sheet := _below_heads(path, one, mappings, hidden))]
    if not sheets:
        unseen = [one.form for one in found if one.is_hidden and _heads_of(one, mappings) is not None]
        if unseen:
            raise InvalidArgument(f"{path}: {unseen[0]} has heads, but is hidden: `sheet` takes it by its name")
        raise InvalidArgument(f"{path}: {_no_heads(found)}")
    if len(sheets) > 1:
        option = "sheet" if sheets[0].form.startswith("sheet") else "separator"
        ways = " and with ".join(sheet.form for sheet in sheets)
        raise InvalidArgument(f"{path}: makes sense with {ways}: `{option}` decides")
    return sheets[0]


def pages_of(path: Path) -> list[tuple[str, Rows, list[str]]]:
    """Of each visible sheet, or each way to separate fields: its form, its rows, and in words what is hidden in it.
    Raises InvalidArgument."""
    return [
        (
            page.form,
            page.rows,
            [
                f"{place} is hidden"
                for place, row in page.rows
                if place in page.hidden_rows and any(c != "" for c in row)
            ]
            + [f"{page.form}, column {index + 1} is hidden" for index in sorted(page.hidden_columns)],
        )
        for page in _found(path, None, None)
        if not page.is_hidden
    ]


def _found(path: Path, separator: str | None, page: str | None) -> list[_Page]:
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
    return _pages(path, content, page) if is_workbook else _texts(path, content, separator)


def _texts(path: Path, content: bytes, separator: str | None) -> list[_Page]:
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
    found: list[_Page] = []
    refusals = []
    for name in SEPARATORS if separator is None else (separator,):
        try:
            rows = fields_of(text, SEPARATORS[name])
        except InvalidArgument as error:
            refusals.append(str(error))
            continue
        found.append(_Page(f"{encoding}, {name}s", [(f"line {number}", list(fields)) for number, fields in rows]))
    if not found:
        raise InvalidArgument(f"{path}, {refusals[0]}")
    return found


def _pages(path: Path, content: bytes, page: str | None) -> list[_Page]:
    """All sheets, or the one of this name."""
    try:
        from python_calamine import CalamineWorkbook
    except ImportError:
        raise InvalidArgument(f"{path}: workbooks need python-calamine: pip install 'stepdiag[import]'") from None
    try:
        shown = look_at_workbook(content)
    except InvalidArgument as error:
        raise InvalidArgument(f"{path}: {error}") from None
    try:
        with CalamineWorkbook.from_filelike(BytesIO(content)) as book:
            names = book.sheet_names
            if not names:
                raise InvalidArgument(f"{path}: the workbook has no sheets; it may be damaged")
            if page is not None and page not in names:
                raise InvalidArgument(f'{path}: has no sheet "{page}"; sheets: {", ".join(names)}')
            tables = {
                name: book.get_sheet_by_name(name).to_python(skip_empty_area=False)
                for name in names
                if page in (None, name)
            }
    except InvalidArgument:
        raise
    except Exception as error:  # the library passes on what zip, XML and its buffers say
        raise InvalidArgument(f"{path}: not a workbook that can be read: {error}") from None
    return [_page(name, table, shown.get(name, Shown())) for name, table in tables.items()]


def _page(name: str, table: Sequence[Sequence[object]], shown: Shown) -> _Page:
    def place(row: int) -> str:
        return f'sheet "{name}", row {row}'

    rows = [
        (place(r), [_cell(cell, shown.formats.get((r, c))) for c, cell in enumerate(cells, start=1)])
        for r, cells in enumerate(table, start=1)
    ]
    repeated: list[Place] = []
    for column, (first, last) in shown.merged:
        last = min(last, len(rows))
        if column <= len(rows[0][1] if rows else ()) and first < last:
            for row in range(first + 1, last + 1):
                rows[row - 1][1][column - 1] = rows[first - 1][1][column - 1]
                repeated.append((row, column))
    return _Page(
        f'sheet "{name}"',
        rows,
        shown.is_hidden,
        frozenset(place(row) for row in _numbers(shown.hidden_rows, len(rows))),
        frozenset(
            column - 1 for column in _numbers(shown.hidden_columns, max((len(row) for _, row in rows), default=0))
        ),
        frozenset((place(row), column - 1) for row, column in repeated),
    )


def _numbers(spans: Sequence[Span], most: int) -> Iterator[int]:
    for first, last in spans:
        yield from range(first, min(last, most) + 1)


def _cell(cell: object, code: str | None) -> Cell:
    """Dates and truth values are texts, which no column of readings takes; clock times are those of ISO 8601."""
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        return float(cell) if code is None else Formatted(cell, code)
    if isinstance(cell, datetime.timedelta):
        seconds = round(cell.total_seconds(), 3)
        return f"{int(seconds // 3600)}:{int(seconds % 3600 // 60):02}:{seconds % 60:06.3f}"
    return str(cell).strip()


def _heads_of(page: _Page, mappings: Sequence[Mapped]) -> int | None:
    """Index of the row of heads."""
    first = page.rows[:LAST_HEAD]
    return next((k for k, (_, row) in enumerate(first) if find_heads(_texts_of(row), mappings)), None)


def _below_heads(path: Path, page: _Page, mappings: Sequence[Mapped], hidden: Hidden | None) -> Sheet | None:
    """The sheet if one of its first rows is that of the heads. Raises InvalidArgument for rows of another length, and
    for hidden ones of which nobody has said whether they are taken."""
    rows, start = page.rows, _heads_of(page, mappings)
    if start is None:
        return None
    heads = _texts_of(rows[start][1])
    while heads and not heads[-1]:
        heads.pop()
    body = []
    unseen = []
    for place, row in rows[start + 1 :]:
        cells = list(row)
        if not any(cell != "" for cell in cells) or (isinstance(cells[0], str) and cells[0].startswith("# ")):
            continue
        if place in page.hidden_rows:
            unseen.append(place)
            if hidden == "leave":
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
    if unseen and hidden is None:
        more = f", and {len(unseen) - 1} more" if len(unseen) > 1 else ""
        raise InvalidArgument(
            f"{path}, {unseen[0]}: the row is hidden{more}: `hidden` take or `hidden` leave says what becomes of it"
        )
    what = "left out" if hidden == "leave" else "taken"
    said = tuple(f"  {place}: hidden, {what}" for place in unseen)
    sheet = Sheet(path, page.form, heads, rows[start][0], body, page.hidden_columns, page.repeated, said)
    return _with_units_row(sheet)


def _with_units_row(sheet: Sheet) -> Sheet:
    """Takes a row of units below the heads into them."""
    if not sheet.rows:
        return sheet
    first = _texts_of(sheet.rows[0][1])
    at = {split_head(head)[0]: cell for head, cell in zip(sheet.heads, first, strict=True)}
    if at.get("line") not in ("", "-") or at.get("point") not in ("", "-"):
        return sheet
    heads = []
    for head, cell in zip(sheet.heads, first, strict=True):
        unit, own = cell.strip("[]() "), split_head(head)[1]
        if plain(cell) in ("", "-"):
            heads.append(head)
        elif own is None:
            heads.append(f"{head} [{unit}]")
        elif same_unit(head, own, unit):
            heads.append(head)
        else:
            raise InvalidArgument(
                f'{sheet.path}, {sheet.rows[0][0]}: the unit "{unit}" below the head "{head}" is another one: '
                "make them alike"
            )
    return replace(sheet, heads=heads, rows=sheet.rows[1:])


def _texts_of(row: Sequence[Cell]) -> list[str]:
    return [cell if isinstance(cell, str) else "" for cell in row]


def _no_heads(found: Sequence[_Page]) -> str:
    rows = max((one.rows for one in found), key=lambda rows: max((len(row) for _, row in rows[:LAST_HEAD]), default=0))
    heads = next((_texts_of(row) for _, row in rows if len([cell for cell in row if cell != ""]) > 1), [])
    known = ", ".join(f'"{head}"' for head in heads if head) or "none"
    return (
        "expected a row of heads with line and point; "
        f'heads found: {known}; name others with `column`, such as `column` "Diagonal=line"'
    )
