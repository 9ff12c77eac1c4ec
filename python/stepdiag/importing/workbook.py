"""What a workbook's sheets take to be read, and what they show beside values, from their XML, before a library makes
tables of them.

Libraries allocate a table from A1 to the last cell, however few cells there are, and believe any number that is
written in a file. Of hidden rows and number formats the fast one says nothing."""

import posixpath
import re
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import Final
from xml.parsers import expat
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

from stepdiag._core import InvalidArgument

LARGEST_XML: Final = 64 * 2**20  # of all parts, unpacked: five times as long as the CSV of the same cells
MOST_CELLS: Final = 1_000_000  # from A1 to the last one, of all sheets
MOST_CHARACTERS: Final = 64 * 2**20  # of the texts of all cells
_ROWS: Final = 1_048_576  # XFD1048576 is the last cell that spreadsheet programs have
_COLUMNS: Final = 16_384
_PLACE: Final = re.compile(r"([A-Z]{1,3})([1-9]\d{0,6})")
_PART: Final = 2**16

# Built into .xlsx, by number; others stand in the file or are of dates.
_PERCENT: Final = {"9": "0%", "10": "0.00%"}
_KINDS: Final = {
    "vnd.oasis.opendocument.text": "a text document",
    "vnd.oasis.opendocument.presentation": "a presentation",
    "vnd.oasis.opendocument.graphics": "a drawing",
}

_TRUE: Final = ("1", "true")

Attributes = Mapping[str, str]
Place = tuple[int, int]  # row and column, from 1
Span = tuple[int, int]  # the first and the last


@dataclass
class Shown:
    """What a sheet shows of its cells beside their values. Rows and columns count from 1.

    formats: how numbers are shown, as .xlsx says it ("0.00%", '0.0" mm"'), of cells that have such a format. merged:
    columns and rows of merged cells."""

    title: str = ""
    is_hidden: bool = False
    hidden_rows: list[Span] = field(default_factory=list)
    hidden_columns: list[Span] = field(default_factory=list)
    formats: dict[Place, str] = field(default_factory=dict)
    merged: list[tuple[int, Span]] = field(default_factory=list)  # column, rows


def look_at_workbook(content: bytes) -> dict[str, Shown]:
    """What each sheet shows, by its name. Raises InvalidArgument for what is no .xlsx or .ods file, and for one that
    takes too much memory or time.

    Names the sheet and the cell that are too far away."""
    try:
        with ZipFile(BytesIO(content)) as archive:
            return _look(archive)
    except InvalidArgument:
        raise
    except Exception as error:  # zipfile raises a dozen kinds, by what is damaged
        if isinstance(error, MemoryError):
            raise
        raise InvalidArgument(f"not a workbook that can be read: {error}") from None


def _look(archive: ZipFile) -> dict[str, Shown]:
    members = archive.infolist()
    names = [member.filename.replace("\\", "/").casefold() for member in members]
    if len(set(names)) < len(names):
        raise InvalidArgument("not a workbook that can be read: it has two parts of one name")
    kind = ""
    if "mimetype" in names:
        with archive.open(members[names.index("mimetype")]) as part:
            kind = part.read(100).decode(errors="replace")  # not all of it, which may unpack without end
    if "word/document.xml" in names or kind.removeprefix("application/") in _KINDS:
        what = _KINDS.get(kind.removeprefix("application/"), "a text document")
        raise InvalidArgument(f"is {what}, no workbook: copy its table into a sheet, and save it as .xlsx or .ods")
    if "xl/workbook.bin" in names or not {"xl/workbook.xml", "content.xml"} & set(names):
        raise InvalidArgument("not a workbook that can be read: save it as .xlsx or .ods")
    unpacked = 0
    readers: list[_PartReader] = []
    shared = _Shared()
    # Cells refer to texts and formats, sheets to their names: these come first.
    order = sorted(
        zip(names, members, strict=True), key=lambda item: "worksheets/" in item[0] or item[0] == "content.xml"
    )
    for name, member in order:
        if not name.endswith((".xml", ".rels")):
            continue
        reader = _PartReader(member.filename, shared)
        readers.append(reader)
        unpacked = _parse(archive, member, reader, unpacked)
    paths = {key: path for reader in readers for key, path in reader.targets.items()}
    for key in (key for reader in readers for key in reader.sheets):
        if not paths.get(key, ".xml").casefold().endswith(".xml"):
            raise InvalidArgument(f"not a workbook that can be read: {paths[key]} is no sheet")
    titles = {
        posixpath.normpath(posixpath.join("/xl", paths[key])).lstrip("/"): title
        for reader in readers
        for key, title in reader.sheets.items()
        if key in paths
    }
    hidden = {title for reader in readers for title in reader.hidden}
    cells = characters = 0
    for reader in readers:
        for table in reader.tables:
            shown = table.shown
            shown.title = shown.title or titles.get(reader.name, reader.name)
            shown.is_hidden = shown.is_hidden or shown.title in hidden
            cells += table.check()
            characters += table.characters
            if cells > MOST_CELLS:
                raise InvalidArgument(f"the sheets have {cells:,} cells; at most {MOST_CELLS:,} are read")
    if characters > MOST_CHARACTERS:
        raise InvalidArgument(f"the cells have {characters:,} characters; at most {MOST_CHARACTERS:,} are read")
    return {table.shown.title: table.shown for reader in readers for table in reader.tables}


def _parse(archive: ZipFile, member: ZipInfo, reader: "_PartReader", unpacked: int) -> int:
    """Streams a part through its reader; returns how much is unpacked then."""
    if member.compress_type not in (ZIP_STORED, ZIP_DEFLATED):  # others unpack without a limit
        raise InvalidArgument(f"not a workbook that can be read: {member.filename} is packed in an unusual way")
    # Whatever a part declares: the library reads UTF-8 only.
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    parser.CharacterDataHandler = reader.text
    parser.StartDoctypeDeclHandler = reader.refuse_entities
    with archive.open(member) as part:
        try:
            while data := part.read(_PART):
                unpacked += len(data)
                if unpacked > LARGEST_XML:
                    raise InvalidArgument(f"larger than {LARGEST_XML // 2**20} MiB when it is unpacked")
                parser.Parse(data, False)
            parser.Parse(b"", True)
        except (expat.ExpatError, zlib.error) as error:
            raise InvalidArgument(f"not a workbook that can be read: {member.filename}: {error}") from None
    return unpacked


class _Shared:
    """What the parts of a workbook refer to."""

    def __init__(self) -> None:
        self.lengths: list[int] = []  # of texts
        self.codes: dict[str, str] = dict(_PERCENT)  # of number formats, by number or name
        self.styles: list[str] = []  # of .xlsx: number of the format, by number of the style
        self.named: dict[str, str] = {}  # of .ods: name of the format, by name of the style
        self.unseen: set[str] = set()  # of .ods: names of the styles of hidden tables


class _Table:
    """What a sheet shows, how far the cells reach that are not empty, and how long their texts are."""

    def __init__(self, title: str = "") -> None:
        self.shown = Shown(title)
        self.characters = 0
        self.column_formats: list[tuple[Span, str]] = []  # of .ods
        self._last_row = self._last_column = (0, 0)  # the cells that are furthest down and to the right

    def use(self, row: int, column: int) -> None:
        if row > self._last_row[0]:
            self._last_row = (row, column)
        if column > self._last_column[1]:
            self._last_column = (row, column)

    def check(self) -> int:
        """The number of cells from A1 on. Raises InvalidArgument, naming the last cell, where there are too many."""
        rows, columns = self._last_row[0], self._last_column[1]
        if rows <= _ROWS and columns <= _COLUMNS and rows * columns <= MOST_CELLS:
            return rows * columns
        places = " and ".join(dict.fromkeys(_place(*cell) for cell in (self._last_row, self._last_column)))
        raise InvalidArgument(
            f'sheet "{self.shown.title}" reaches to {places}, {rows:,} rows by {columns:,} columns; '
            f"at most {MOST_CELLS:,} cells are read: clear cells that are far from the readings"
        )


def _place(row: int, column: int) -> str:
    letters = ""
    while column > 0:
        column, letter = divmod(column - 1, 26)
        letters = chr(ord("A") + letter) + letters
    return f"{letters}{row}"


def _extend(spans: list[Span], more: Span) -> None:
    """Adds rows to ascending ones."""
    if spans and spans[-1][1] + 1 >= more[0]:
        spans[-1] = spans[-1][0], max(spans[-1][1], more[1])
    else:
        spans.append(more)


def _count(attributes: Attributes, name: str) -> int:
    text = attributes.get(name, "1")
    if not re.fullmatch(r"\d{1,9}", text, re.ASCII):
        raise InvalidArgument(f"{name}: expected a number of cells, got {text[:30]!r}")
    return int(text)


class _PartReader:
    """The tables of one part of a workbook, whichever it is; of .xlsx also names of sheets and shared texts."""

    def __init__(self, name: str, shared: _Shared) -> None:
        self.name = name
        self.tables: list[_Table] = []
        self.sheets: dict[str, str] = {}  # of the workbook: relation and title
        self.hidden: set[str] = set()  # titles
        self.targets: dict[str, str] = {}  # of relations: path
        self._shared = shared
        self._row = self._column = 0
        self._repeated = self._rows = 1
        self._is_shared = self._is_used = self._has_styles = False
        self._format = self._style = ""
        self._covers = 1  # rows
        self._pieces: list[str] = []
        self._length = 0
        self._starts: dict[str, Callable[[Attributes], None]] = {
            "worksheet": lambda _: self.tables.append(_Table()),
            "row": self._start_row,
            "c": self._start_cell,
            "v": self._use,
            "is": self._use,
            "si": self._start_text,
            "sheet": self._name_sheet,
            "Relationship": self._relate,
            "col": self._start_column,
            "mergeCell": self._merge,
            "numFmt": self._name_format,
            "cellXfs": lambda _: self._set_styles(True),
            "xf": self._add_style,
            "style": self._name_style,
            "table-properties": self._show_table,
            "number-style": self._start_format,
            "percentage-style": self._start_format,
            "table-column": self._start_columns,
            "table": self._start_table,
            "table-row": self._start_rows,
            "table-cell": self._start_cells,
            "covered-table-cell": self._start_cells,
            "p": self._use,
        }
        self._ends: dict[str, Callable[[], None]] = {
            "c": self._end_cell,
            "si": lambda: self._shared.lengths.append(self._length),
            "cellXfs": lambda: self._set_styles(False),
            "number-style": self._end_format,
            "percentage-style": self._end_format,
            "table-cell": self._end_cells,
            "covered-table-cell": self._end_cells,
            "table-row": self._end_rows,
        }

    def start(self, name: str, attributes: Attributes) -> None:
        if (handler := self._starts.get(name.rpartition(":")[2])) is not None:
            handler(attributes)

    def end(self, name: str) -> None:
        if (handler := self._ends.get(name.rpartition(":")[2])) is not None:
            handler()

    def text(self, text: str) -> None:
        self._length += len(text)
        if (self._is_shared or self._format) and len(self._pieces) < 10:
            self._pieces.append(text)

    def refuse_entities(self, *_: object) -> None:
        raise InvalidArgument(f"not a workbook that can be read: {self.name} defines entities")

    def _start_text(self, _: Attributes) -> None:
        self._length = 0

    # --- .xlsx ---
    def _start_row(self, attributes: Attributes) -> None:
        self._row = self._cell_of(f"A{attributes['r']}")[0] if "r" in attributes else self._row + 1
        self._column = 0
        if attributes.get("hidden") in _TRUE and self.tables:
            _extend(self.tables[-1].shown.hidden_rows, (self._row, self._row))

    def _start_cell(self, attributes: Attributes) -> None:
        self._is_used, self._is_shared = False, attributes.get("t") == "s"
        self._length, self._pieces = 0, []
        if "r" in attributes:
            self._row, self._column = self._cell_of(attributes["r"])
        else:
            self._column += 1
        style = attributes.get("s", "")
        if self.tables and re.fullmatch(r"\d{1,6}", style, re.ASCII) and int(style) < len(self._shared.styles):
            self._show(self._row, (self._column, self._column), self._shared.styles[int(style)])

    def _start_column(self, attributes: Attributes) -> None:
        if attributes.get("hidden") in _TRUE and self.tables:
            self.tables[-1].shown.hidden_columns.append((_count(attributes, "min"), _count(attributes, "max")))

    def _merge(self, attributes: Attributes) -> None:
        first, _, last = attributes.get("ref", "").partition(":")
        if last and self.tables:
            (row, column), (bottom, right) = self._cell_of(first), self._cell_of(last)
            if column == right and bottom > row:
                self.tables[-1].shown.merged.append((column, (row, bottom)))

    def _name_format(self, attributes: Attributes) -> None:
        self._shared.codes[attributes.get("numFmtId", "")] = attributes.get("formatCode", "")[:200]

    def _set_styles(self, begin: bool) -> None:
        self._has_styles = begin

    def _add_style(self, attributes: Attributes) -> None:
        if self._has_styles:
            self._shared.styles.append(attributes.get("numFmtId", ""))

    def _show(self, row: int, columns: Span, name: str) -> None:
        """The cells of a row have the format of this name."""
        formats, code = self.tables[-1].shown.formats, self._shared.codes.get(name)
        if not code:
            return
        for column in range(columns[0], columns[1] + 1):
            formats[row, column] = code
        if len(formats) > MOST_CELLS:
            raise InvalidArgument(f"the sheets have more cells than {MOST_CELLS:,}, which is what is read")

    def _use(self, _: Attributes) -> None:
        self._is_used = True

    def _end_cell(self) -> None:
        if not self._is_used or not self.tables:
            return
        self.tables[-1].use(self._row, self._column)
        number = "".join(self._pieces).strip()
        if self._is_shared and re.fullmatch(r"\d{1,9}", number, re.ASCII) and int(number) < len(self._shared.lengths):
            self._length = self._shared.lengths[int(number)]
        self.tables[-1].characters += self._length
        self._is_shared = False

    def _cell_of(self, place: str) -> tuple[int, int]:
        """Row and column from 1. Raises InvalidArgument for what spreadsheet programs do not have."""
        if found := _PLACE.fullmatch(place):
            column = 0
            for letter in found[1]:
                column = 26 * column + ord(letter) - ord("A") + 1
            if int(found[2]) <= _ROWS and column <= _COLUMNS:
                return int(found[2]), column
        raise InvalidArgument(f"{self.name}: expected cells from A1 to {_place(_ROWS, _COLUMNS)}, got {place[:30]!r}")

    def _name_sheet(self, attributes: Attributes) -> None:
        key = next((value for name, value in attributes.items() if name.rpartition(":")[2] == "id"), "")
        self.sheets[key] = attributes.get("name", "")
        if attributes.get("state", "visible") != "visible":
            self.hidden.add(attributes.get("name", ""))

    def _relate(self, attributes: Attributes) -> None:
        if self.name.casefold().endswith("workbook.xml.rels"):
            self.targets[attributes.get("Id", "")] = attributes.get("Target", "")

    # --- .ods: cells and rows are repeated, also empty ones ---
    def _start_table(self, attributes: Attributes) -> None:
        if "table:name" in attributes:
            self.tables.append(_Table(attributes["table:name"]))
            self.tables[-1].shown.is_hidden = attributes.get("table:style-name", "") in self._shared.unseen
            self._row = self._column = 0

    def _name_style(self, attributes: Attributes) -> None:
        self._style = attributes.get("style:name", "")
        if "style:data-style-name" in attributes:
            self._shared.named[self._style] = attributes["style:data-style-name"]

    def _show_table(self, attributes: Attributes) -> None:
        if attributes.get("table:display") == "false":
            self._shared.unseen.add(self._style)

    def _start_format(self, attributes: Attributes) -> None:
        self._format, self._pieces = attributes.get("style:name", ""), []

    def _end_format(self) -> None:
        text = "".join(self._pieces)  # what stands beside the number
        self._shared.codes[self._format] = "0%" if text.strip() == "%" else f'0"{text[:50]}"' if text.strip() else ""
        self._format = ""

    def _start_columns(self, attributes: Attributes) -> None:
        if not self.tables:
            return
        columns = self._column + 1, self._column + _count(attributes, "table:number-columns-repeated")
        self._column = columns[1]
        if attributes.get("table:visibility", "visible") != "visible":
            self.tables[-1].shown.hidden_columns.append(columns)
        name = self._shared.named.get(attributes.get("table:default-cell-style-name", ""))
        if name is not None:
            self.tables[-1].column_formats.append((columns, name))

    def _start_rows(self, attributes: Attributes) -> None:
        self._rows, self._column = _count(attributes, "table:number-rows-repeated"), 0
        if attributes.get("table:visibility", "visible") != "visible" and self.tables:
            _extend(self.tables[-1].shown.hidden_rows, (self._row + 1, self._row + self._rows))

    def _start_cells(self, attributes: Attributes) -> None:
        self._repeated, self._length = _count(attributes, "table:number-columns-repeated"), 0
        self._is_used = "office:value-type" in attributes
        self._covers = _count(attributes, "table:number-rows-spanned")
        if not self._is_used or not self.tables or self._repeated * self._rows > MOST_CELLS:
            return
        first, last = self._column + 1, self._column + self._repeated
        if attributes["office:value-type"] == "percentage":
            formats = [((first, last), "9")]
        elif "table:style-name" in attributes:
            formats = [((first, last), self._shared.named.get(attributes["table:style-name"], ""))]
        else:
            formats = [
                ((max(begin, first), min(end, last)), name)
                for (begin, end), name in self.tables[-1].column_formats
                if begin <= last and end >= first
            ]
        for columns, name in formats:
            if self._shared.codes.get(name):
                for row in range(self._row + 1, self._row + self._rows + 1):
                    self._show(row, columns, name)

    def _end_cells(self) -> None:
        if self._covers > 1 and self.tables:
            rows = self._row + 1, self._row + self._covers
            self.tables[-1].shown.merged.append((self._column + 1, rows))
        self._covers = 1
        self._column += self._repeated
        if self._is_used and self.tables:
            self.tables[-1].use(self._row + self._rows, self._column)
            self.tables[-1].characters += self._length * min(self._repeated * self._rows, MOST_CELLS)
        self._is_used = False

    def _end_rows(self) -> None:
        self._row += self._rows
