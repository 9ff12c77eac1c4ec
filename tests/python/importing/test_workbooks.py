"""Workbooks that are damaged or hostile: their readings or one clear line, in little memory and time."""

import io
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import openpyxl
import pytest

import stepdiag as sd
from stepdiag.importing import workbook
from stepdiag.importing.run import import_files

SHEET = "xl/worksheets/sheet1.xml"
END = b"</sheetData>"
FAR = b'<row r="1048576"><c r="XFD1048576"%s</c></row>'
GIGABYTE = 2**30

ODS = (
    '<office:document-content xmlns:office="urn:oasis:names:tc:opendocument:xmlns:office:1.0" '
    'xmlns:table="urn:oasis:names:tc:opendocument:xmlns:table:1.0" '
    'xmlns:text="urn:oasis:names:tc:opendocument:xmlns:text:1.0"><office:body><office:spreadsheet>'
    '<table:table table:name="Run">{}</table:table></office:spreadsheet></office:body></office:document-content>'
)
HEADS = ("line", "point", "x_mm", "y_mm", "z_mm", "distance_mm")
READINGS = (("ppp", 0, 0, 0, 0, 100.5), ("ppp", 1, 16, 0, 0, 112.25))


def xlsx(path: Path, change: Callable[[bytes], bytes] = bytes, **more: bytes) -> Path:
    """A run of two points whose sheet is changed; `more`: other parts."""
    book = openpyxl.Workbook()
    for row in (HEADS, *READINGS):
        book.active.append(row)
    whole = io.BytesIO()
    book.save(whole)
    with zipfile.ZipFile(whole) as parts, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as changed:
        for name in parts.namelist():
            changed.writestr(name, change(parts.read(name)) if name == SHEET else parts.read(name))
        for name, part in more.items():
            changed.writestr(f"xl/{name}.xml", part)
    return path


def ods(path: Path, rows: str) -> Path:
    """The same run with more rows."""

    def cell(value: object) -> str:
        kind = "string" if isinstance(value, str) else f'float" office:value="{value}'
        return f'<table:table-cell office:value-type="{kind}"><text:p>{value}</text:p></table:table-cell>'

    body = "".join(f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in (HEADS, *READINGS))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("META-INF/manifest.xml", "<manifest/>")
        archive.writestr("content.xml", ODS.format(body + rows))
    return path


def with_end(more: bytes) -> Callable[[bytes], bytes]:
    return lambda sheet: sheet.replace(END, more + END)


def repeated(rows: str, columns: str, number: str = "1") -> str:
    """Rows of an .ods sheet; a cell without a number is empty."""
    value = f'office:value-type="float" office:value="{number}"' if number else ""
    cell = f'<table:table-cell table:number-columns-repeated="{columns}" {value}/>'
    return f'<table:table-row table:number-rows-repeated="{rows}">{cell}</table:table-row>'


SOUND: dict[str, Callable[[Path], Path]] = {
    "empty cell with a style far away": lambda path: xlsx(path, with_end(FAR % b' s="0">')),
    "dimension of the whole sheet": lambda path: xlsx(
        path, lambda s: s.replace(b'ref="A1:F3"', b'ref="A1:XFD1048576"')
    ),
    "rest of an .ods sheet": lambda path: ods(path, repeated("1048573", "16384", "")),
    "absurd rest of an .ods sheet": lambda path: ods(path, repeated("900000000", "900000000", "")),
}


@pytest.mark.parametrize("name", SOUND)
def test_what_is_empty_costs_nothing(name: str, tmp_path: Path) -> None:
    assert import_files([SOUND[name](tmp_path / "run.xlsx")]).measurement.channels["distance"].tolist() == [
        100.5,
        112.25,
    ]


FAR_AWAY = 'sheet "Sheet" reaches to XFD1048576, 1,048,576 rows by 16,384 columns'
REFUSED: dict[str, tuple[Callable[[Path], Path], str]] = {
    "a number far away": (lambda path: xlsx(path, with_end(FAR % b"><v>1</v>")), FAR_AWAY),
    "a space far away": (lambda path: xlsx(path, with_end(FAR % b' t="inlineStr"><is><t> </t></is>')), FAR_AWAY),
    "two cells far away": (
        lambda path: xlsx(path, with_end(b'<row r="200000"><c r="B200000"><v>1</v></c><c r="XFD2"><v>1</v></c></row>')),
        'sheet "Sheet" reaches to B200000 and XFD2, 200,000 rows by 16,384 columns',
    ),
    "row number beyond all": (
        lambda path: xlsx(path, with_end(b'<row r="4294967295"><c r="ZZZZZZZ4294967295"><v>1</v></c></row>')),
        f"{SHEET}: expected cells from A1 to XFD1048576, got 'A4294967295'",
    ),
    "column beyond all": (
        lambda path: xlsx(path, with_end(b'<row r="4"><c r="XFE4"><v>1</v></c></row>')),
        "got 'XFE4'",
    ),
    "repeated cell of .ods": (lambda path: ods(path, repeated("1", "900000000")), "4 rows by 900,000,000 columns"),
    "repeated rows of .ods": (lambda path: ods(path, repeated("900000000", "1")), "900,000,003 rows by 6 columns"),
    "number of repetitions beyond all": (
        lambda path: ods(path, repeated("9" * 30, "1")),
        "table:number-rows-repeated: expected a number of cells, got",
    ),
    "bomb": (
        lambda path: xlsx(path, bomb=b"<a>" + b" " * (65 * 2**20) + b"</a>"),
        "larger than 64 MiB when it is unpacked",
    ),
    "entities": (
        lambda path: xlsx(path, lambda s: b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">]>' + s),
        f"{SHEET} defines entities",
    ),
    "torn sheet": (lambda path: xlsx(path, lambda s: s[:200]), f"not a workbook that can be read: {SHEET}: "),
    "two parts of one name": (lambda path: xlsx(path, **{"WORKBOOK": b"<a/>"}), "two parts of one name"),
    "another archive": (lambda path: archive(path, "letter.txt"), "not a workbook that can be read: save it as .xlsx"),
    "binary workbook": (
        lambda path: archive(path, "xl/workbook.bin"),
        "not a workbook that can be read: save it as .xlsx",
    ),
}


def archive(path: Path, name: str) -> Path:
    with zipfile.ZipFile(path, "w") as parts:
        parts.writestr(name, "text")
    return path


@pytest.mark.parametrize("name", REFUSED)
def test_what_no_sheet_can_be_is_refused(name: str, tmp_path: Path) -> None:
    make, message = REFUSED[name]
    path = make(tmp_path / "run.xlsx")
    with pytest.raises(sd.InvalidArgument) as refused:
        import_files([path])
    assert str(refused.value).startswith(f"{path}: ")
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_long_text_that_every_cell_repeats_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workbook, "MOST_CHARACTERS", 10_000)
    cells = b"".join(b'<row r="%d"><c r="H%d" t="s"><v>0</v></c></row>' % (row, row) for row in range(4, 24))
    shared = b"<sst><si><t>" + b"x" * 1000 + b"</t></si></sst>"
    path = xlsx(tmp_path / "run.xlsx", with_end(cells), sharedStrings=shared)
    with pytest.raises(sd.InvalidArgument, match=r"the cells have 2\d,\d{3} characters; at most 10,000 are read"):
        import_files([path])


def test_sheets_count_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workbook, "MOST_CELLS", 30)
    book = openpyxl.Workbook()
    for sheet in (book.active, book.create_sheet("two")):
        for row in (HEADS, *READINGS):
            sheet.append(row)
    book.save(tmp_path / "run.xlsx")
    with pytest.raises(sd.InvalidArgument, match="the sheets have 36 cells; at most 30 are read"):
        import_files([tmp_path / "run.xlsx"])


@pytest.mark.parametrize("name", ["a number far away", "row number beyond all", "repeated cell of .ods"])
def test_command_ends_with_one_line_in_a_gigabyte(name: str, tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    path = REFUSED[name][0](tmp_path / "run.xlsx")
    ended = subprocess.run(
        [sys.executable, "-m", "stepdiag", "import", str(path), "-o", str(tmp_path / "run.csv")],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (GIGABYTE, GIGABYTE)),  # libraries map 0.5 of them
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith(f"stepdiag: error: {path}: ")
    assert ended.stderr.count("\n") == 1
