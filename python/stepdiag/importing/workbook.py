"""What a workbook's sheets take to be read, from their XML, before a library makes tables of them.

Libraries allocate a table from A1 to the last cell, however few cells there are, and believe any number that is
written in a file."""

import posixpath
import re
import zlib
from collections.abc import Callable, Mapping
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

Attributes = Mapping[str, str]


def check_workbook(content: bytes) -> None:
    """Raise InvalidArgument for what is no .xlsx or .ods file, and for one that takes too much memory or time.

    Names the sheet and the cell that are too far away."""
    try:
        with ZipFile(BytesIO(content)) as archive:
            _check(archive)
    except InvalidArgument:
        raise
    except Exception as error:  # zipfile raises a dozen kinds, by what is damaged
        if isinstance(error, MemoryError):
            raise
        raise InvalidArgument(f"not a workbook that can be read: {error}") from None


def _check(archive: ZipFile) -> None:
    members = archive.infolist()
    names = [member.filename.replace("\\", "/").casefold() for member in members]
    if len(set(names)) < len(names):
        raise InvalidArgument("not a workbook that can be read: it has two parts of one name")
    if "xl/workbook.bin" in names or not {"xl/workbook.xml", "content.xml"} & set(names):
        raise InvalidArgument("not a workbook that can be read: save it as .xlsx or .ods")
    unpacked = 0
    readers: list[_PartReader] = []
    shared: list[int] = []  # lengths of the texts that cells refer to
    # Cells refer to texts and sheets to their names: these come first.
    for name, member in sorted(zip(names, members, strict=True), key=lambda item: "worksheets/" in item[0]):
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
    cells = characters = 0
    for reader in readers:
        for table in reader.tables:
            table.title = table.title or titles.get(reader.name, reader.name)
            cells += table.check()
            characters += table.characters
            if cells > MOST_CELLS:
                raise InvalidArgument(f"the sheets have {cells:,} cells; at most {MOST_CELLS:,} are read")
    if characters > MOST_CHARACTERS:
        raise InvalidArgument(f"the cells have {characters:,} characters; at most {MOST_CHARACTERS:,} are read")


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


class _Table:
    """How far the cells of a sheet reach that are not empty, and how long their texts are."""

    def __init__(self, title: str = "") -> None:
        self.title = title
        self.characters = 0
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
            f'sheet "{self.title}" reaches to {places}, {rows:,} rows by {columns:,} columns; '
            f"at most {MOST_CELLS:,} cells are read: clear cells that are far from the readings"
        )


def _place(row: int, column: int) -> str:
    letters = ""
    while column > 0:
        column, letter = divmod(column - 1, 26)
        letters = chr(ord("A") + letter) + letters
    return f"{letters}{row}"


def _count(attributes: Attributes, name: str) -> int:
    text = attributes.get(name, "1")
    if not re.fullmatch(r"\d{1,9}", text, re.ASCII):
        raise InvalidArgument(f"{name}: expected a number of cells, got {text[:30]!r}")
    return int(text)


class _PartReader:
    """The tables of one part of a workbook, whichever it is; of .xlsx also names of sheets and shared texts."""

    def __init__(self, name: str, shared: list[int]) -> None:
        self.name = name
        self.tables: list[_Table] = []
        self.sheets: dict[str, str] = {}  # of the workbook: relation and title
        self.targets: dict[str, str] = {}  # of relations: path
        self._shared = shared
        self._row = self._column = 0
        self._repeated = self._rows = 1
        self._is_shared = self._is_used = False
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
            "table": self._start_table,
            "table-row": self._start_rows,
            "table-cell": self._start_cells,
            "covered-table-cell": self._start_cells,
            "p": self._use,
        }
        self._ends: dict[str, Callable[[], None]] = {
            "c": self._end_cell,
            "si": lambda: self._shared.append(self._length),
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
        if self._is_shared and len(self._pieces) < 10:
            self._pieces.append(text)

    def refuse_entities(self, *_: object) -> None:
        raise InvalidArgument(f"not a workbook that can be read: {self.name} defines entities")

    def _start_text(self, _: Attributes) -> None:
        self._length = 0

    # --- .xlsx ---
    def _start_row(self, attributes: Attributes) -> None:
        self._row = self._cell_of(f"A{attributes['r']}")[0] if "r" in attributes else self._row + 1
        self._column = 0

    def _start_cell(self, attributes: Attributes) -> None:
        self._is_used, self._is_shared = False, attributes.get("t") == "s"
        self._length, self._pieces = 0, []
        if "r" in attributes:
            self._row, self._column = self._cell_of(attributes["r"])
        else:
            self._column += 1

    def _use(self, _: Attributes) -> None:
        self._is_used = True

    def _end_cell(self) -> None:
        if not self._is_used or not self.tables:
            return
        self.tables[-1].use(self._row, self._column)
        number = "".join(self._pieces).strip()
        if self._is_shared and re.fullmatch(r"\d{1,9}", number, re.ASCII) and int(number) < len(self._shared):
            self._length = self._shared[int(number)]
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

    def _relate(self, attributes: Attributes) -> None:
        if self.name.casefold().endswith("workbook.xml.rels"):
            self.targets[attributes.get("Id", "")] = attributes.get("Target", "")

    # --- .ods: cells and rows are repeated, also empty ones ---
    def _start_table(self, attributes: Attributes) -> None:
        if "table:name" in attributes:
            self.tables.append(_Table(attributes["table:name"]))
            self._row = 0

    def _start_rows(self, attributes: Attributes) -> None:
        self._rows, self._column = _count(attributes, "table:number-rows-repeated"), 0

    def _start_cells(self, attributes: Attributes) -> None:
        self._repeated, self._length = _count(attributes, "table:number-columns-repeated"), 0
        self._is_used = "office:value-type" in attributes

    def _end_cells(self) -> None:
        self._column += self._repeated
        if self._is_used and self.tables:
            self.tables[-1].use(self._row + self._rows, self._column)
            self.tables[-1].characters += self._length * min(self._repeated * self._rows, MOST_CELLS)
        self._is_used = False

    def _end_rows(self) -> None:
        self._row += self._rows
