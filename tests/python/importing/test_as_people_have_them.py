"""The same run in sheets as people have them, each kind in ten forms: read right, or refused with the right words."""

import datetime
import io
import re
import tracemalloc
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import openpyxl
import pytest

import stepdiag as sd
from stepdiag.importing.run import import_files

Row = list[Any]
HEADS = ["Line", "Point", "X [mm]", "Y [mm]", "Z [mm]", "Distance [mm]", "Alpha [µrad]", "Beta [µrad]"]
PLAN = sd.Plan((400.0, 300.0, 250.0), steps=1, lines=["ppp", "npp"])
LINES = ("ppp", "npp")
PLACES = {line: np.asarray(PLAN.points(line)) for line in LINES}
DISTANCES = (100.25, 420.5, 601.125, 702.75, 99.875, 421.0, 600.5, 703.25)


def run() -> list[Row]:
    keys = [(line, point) for line in LINES for point in range(4)]
    return [
        [line, point, *(float(x) for x in PLACES[line][point]), distance, 1.5 * k - 3.0, 2.25 - 0.5 * k]
        for k, ((line, point), distance) in enumerate(zip(keys, DISTANCES, strict=True))
    ]


@dataclass
class Table:
    """What is written, and what is shown beside the values. Rows and columns from 0, below the heads."""

    heads: list[str] = field(default_factory=lambda: list(HEADS))
    rows: list[Row] = field(default_factory=run)
    hidden_row: int | None = None
    hidden_column: int | None = None
    is_hidden: bool = False
    formats: dict[int, str] = field(default_factory=dict)  # of columns
    merged: list[tuple[int, int, int]] = field(default_factory=list)  # column, first and last row

    def with_column(self, head: str, values: Sequence[Any]) -> "Table":
        rows = [[*row, value] for row, value in zip(self.rows, values, strict=True)]
        return replace(self, heads=[*self.heads, head], rows=rows)


# --- forms -----------------------------------------------------------------------------------------------------------
def text(separator: str, decimal: str, encoding: str, above: Sequence[str] = ()) -> Callable[[Path, Table], Path]:
    def write(path: Path, table: Table) -> Path:
        def words(cell: Any) -> str:
            shown = repr(cell).replace(".", decimal) if isinstance(cell, float) else str(cell)
            return '"' + shown.replace('"', '""') + '"' if separator in shown or '"' in shown else shown

        lines = [*above, *(separator.join(map(words, row)) for row in (table.heads, *table.rows))]
        path.write_bytes(("\r\n".join(lines) + "\r\n").encode(encoding))
        return path.rename(path.with_suffix(".csv"))

    return write


def xlsx(above: int = 0, more: bool = False) -> Callable[[Path, Table], Path]:
    def write(path: Path, table: Table) -> Path:
        book = openpyxl.Workbook()
        sheet = book.active
        assert sheet is not None
        if more:
            book.create_sheet("Notes").append(["Machine", "VMC"])
        for _ in range(above):
            sheet.append(["Machine VMC"])
        for row in (table.heads, *table.rows):
            sheet.append(row)
        first = above + 2
        if table.hidden_row is not None:
            sheet.row_dimensions[first + table.hidden_row].hidden = True
        if table.hidden_column is not None:
            sheet.column_dimensions[openpyxl.utils.get_column_letter(table.hidden_column + 1)].hidden = True
        if table.is_hidden:
            if not more:
                book.create_sheet("Notes").append(["Machine", "VMC"])
            sheet.sheet_state = "hidden"
            book.active = 1
        for column, code in table.formats.items():
            for k in range(len(table.rows)):
                sheet.cell(first + k, column + 1).number_format = code
        for column, begin, end in table.merged:
            sheet.merge_cells(
                start_row=first + begin, end_row=first + end, start_column=column + 1, end_column=column + 1
            )
        book.save(path.with_suffix(".xlsx"))
        return path.with_suffix(".xlsx")

    return write


NAMESPACES = " ".join(
    f'xmlns:{short}="urn:oasis:names:tc:opendocument:xmlns:{long}:1.0"'
    for short, long in {
        "office": "office",
        "table": "table",
        "text": "text",
        "style": "style",
        "number": "datastyle",
    }.items()
)


def ods(above: int = 0) -> Callable[[Path, Table], Path]:
    """As LibreOffice writes it: formats and hidden tables by styles, merged cells by spans and covered ones."""

    def write(path: Path, table: Table) -> Path:
        styles = []
        for column, code in table.formats.items():
            words = "".join(re.findall(r'"(.*?)"', code))
            kind, beside = ("percentage", "%") if "%" in code else ("number", words)
            styles.append(
                f'<number:{kind}-style style:name="N{column}"><number:number number:decimal-places="2"/>'
                f"<number:text>{escape(beside)}</number:text></number:{kind}-style>"
                f'<style:style style:name="ce{column}" style:family="table-cell" style:data-style-name="N{column}"/>'
            )
        collapsed = ' table:visibility="collapse"'
        visible = "false" if table.is_hidden else "true"
        styles.append(
            '<style:style style:name="ta1" style:family="table">'
            f'<style:table-properties table:display="{visible}"/></style:style>'
        )

        def cell(value: Any, column: int, row: int) -> str:
            if any(column == c and begin < row <= end for c, begin, end in table.merged):
                return "<table:covered-table-cell/>"
            more = ""
            for c, begin, end in table.merged:
                if (column, row) == (c, begin):
                    more = f' table:number-columns-spanned="1" table:number-rows-spanned="{end - begin + 1}"'
            if row >= 0 and column in table.formats:
                more += f' table:style-name="ce{column}"'
            if value == "":
                return f"<table:table-cell{more}/>"
            if isinstance(value, str):
                words = f"<text:p>{escape(value)}</text:p>"
                return f'<table:table-cell{more} office:value-type="string">{words}</table:table-cell>'
            kind = "percentage" if row >= 0 and "%" in table.formats.get(column, "") else "float"
            return (
                f'<table:table-cell{more} office:value-type="{kind}" office:value="{value}">'
                f"<text:p>{value}</text:p></table:table-cell>"
            )

        columns = "".join(
            f"<table:table-column{collapsed if c == table.hidden_column else ''}/>" for c in range(len(table.heads))
        )
        body = f"<table:table-row>{cell('VMC', 0, -1)}</table:table-row>" * above
        for k, row in enumerate([table.heads, *table.rows], start=-1):
            hidden = ' table:visibility="filter"' if k >= 0 and k == table.hidden_row else ""
            body += f"<table:table-row{hidden}>{''.join(cell(v, c, k) for c, v in enumerate(row))}</table:table-row>"
        notes = (
            '<table:table table:name="Notes"><table:table-row><table:table-cell office:value-type="string">'
            "<text:p>Machine</text:p></table:table-cell></table:table-row></table:table>"
        )
        content = (
            f"<office:document-content {NAMESPACES}>"
            f"<office:automatic-styles>{''.join(styles)}</office:automatic-styles>"
            f'<office:body><office:spreadsheet><table:table table:name="Run" table:style-name="ta1">{columns}{body}'
            f"</table:table>{notes if table.is_hidden else ''}"
            "</office:spreadsheet></office:body></office:document-content>"
        )
        with zipfile.ZipFile(path.with_suffix(".ods"), "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
            archive.writestr("META-INF/manifest.xml", "<manifest/>")
            archive.writestr("content.xml", content)
        return path.with_suffix(".ods")

    return write


TEXTS = {
    "commas, UTF-8": text(",", ".", "utf-8"),
    "commas, UTF-8 with a mark": text(",", ".", "utf-8-sig"),
    "semicolons and decimal commas, Latin-1": text(";", ",", "cp1252", ["Maschine;VMC", ""]),
    "tabs, UTF-16": text("\t", ".", "utf-16"),
    "semicolons, sep=": text(";", ",", "utf-8-sig", ["sep=;"]),
}
WORKBOOKS = {
    "xlsx": xlsx(),
    "xlsx, rows above": xlsx(above=3),
    "xlsx, another sheet": xlsx(more=True),
    "ods": ods(),
    "ods, rows above": ods(above=2),
}


# --- kinds -----------------------------------------------------------------------------------------------------------
@dataclass
class Kind:
    table: Callable[[], Table]
    options: dict[str, Any] = field(default_factory=dict)
    error: str = ""
    channels: dict[str, list[float]] = field(default_factory=dict)  # beside those of the run
    left_out: int | None = None  # row
    only: str = ""  # "workbooks" or "texts"


def changed(change: Callable[[Row], Row]) -> Table:
    return Table(rows=[change(list(row)) for row in run()])


def scaled(column: int, head: str, factor: float) -> Table:
    table = Table(rows=[[*row[:column], row[column] / factor, *row[column + 1 :]] for row in run()])
    table.heads[column] = head
    return table


def once_a_line() -> Table:
    return changed(lambda row: row if row[1] == 0 else ["", *row[1:]])


def air(head: str, value: float) -> Table:
    return Table().with_column(head, [value] * 8)


def units_row(units: Sequence[str], heads: Sequence[str]) -> Table:
    return Table(heads=list(heads), rows=[list(units), *run()])


BARE = ["Line", "Point", "X [mm]", "Y [mm]", "Z [mm]", "Distance [mm]", "Alpha", "Beta"]
PRESSURE = 1009.0
CLOCKS = ["23:59:50", "23:59:54", "0:00:10", "0:00:14.5", "0:01:00", "0:01:10", "0:02:00", "0:03:00"]
SECONDS = [0.0, 4.0, 20.0, 24.5, 70.0, 80.0, 130.0, 190.0]
DATES = ["28.11.2026 23:59:50", *(f"29.11.2026 {clock}" for clock in CLOCKS[2:]), "29.11.2026 00:04:00"]

KINDS: dict[str, Kind] = {
    "lines as + and -": Kind(lambda: changed(lambda row: [{"ppp": "+++", "npp": "-++"}[row[0]], *row[1:]])),
    "line written once": Kind(once_a_line),
    "merged cells of the line": Kind(lambda: replace(once_a_line(), merged=[(0, 0, 3), (0, 4, 7)]), only="workbooks"),
    "merged cells of readings": Kind(
        lambda: replace(Table(), merged=[(5, 2, 3)]), error="Distance .*merged: split", only="workbooks"
    ),
    "points from 1, with a plan": Kind(lambda: changed(lambda row: [row[0], row[1] + 1, *row[2:]]), {"plan": PLAN}),
    "points from 1, said": Kind(lambda: changed(lambda row: [row[0], row[1] + 1, *row[2:]]), {"first_point": 1}),
    "points from 1, not said": Kind(
        lambda: changed(lambda row: [row[0], row[1] + 1, *row[2:]]),
        error="all lines begin with point 1: `first_point` 1 .* `first_point` 0",
    ),
    "machine coordinates": Kind(
        lambda: changed(lambda row: [*row[:2], row[2] - 500.0, row[3] + 12.5, row[4] - 900.0, *row[5:]]),
        {"origin": (-500.0, 12.5, -900.0)},
    ),
    "inches": Kind(lambda: scaled(5, "Distance [in]", 25.4)),
    "inches in words": Kind(lambda: scaled(5, "Distance in inch", 25.4)),
    "mmHg": Kind(
        lambda: air("Air pressure [mmHg]", PRESSURE / 1.33322387415), channels={"air_pressure": [1e2 * PRESSURE] * 8}
    ),
    "inHg": Kind(
        lambda: air("Air pressure [inHg]", PRESSURE / 33.86388640341), channels={"air_pressure": [1e2 * PRESSURE] * 8}
    ),
    "Torr": Kind(
        lambda: air("Air pressure [Torr]", PRESSURE * 760.0 / 1013.25), channels={"air_pressure": [1e2 * PRESSURE] * 8}
    ),
    "°F": Kind(lambda: air("Air temperature [°F]", 70.7), channels={"air_temperature": [21.5] * 8}),
    "clock times over midnight": Kind(lambda: Table().with_column("Time", CLOCKS), channels={"time": SECONDS}),
    "dates and times": Kind(
        lambda: Table().with_column("Time", DATES), channels={"time": [0.0, *(s for s in SECONDS[2:]), 250.0]}
    ),
    "times that are no times": Kind(
        lambda: Table().with_column("Time", [f"{k} o'clock" for k in range(8)]), error="expected a clock time"
    ),
    "percent in the cell": Kind(
        lambda: Table().with_column("Air humidity [%]", ["62 %"] * 8), channels={"air_humidity": [0.62] * 8}
    ),
    "another unit in the cell": Kind(
        lambda: Table().with_column("Air pressure [hPa]", ["1009 mbar"] * 7 + ["757 mmHg"]),
        error="'757 mmHg' is not in hPa, as the head says",
    ),
    "percent by the format": Kind(
        lambda: replace(air("Air humidity [%]", 0.62), formats={8: "0%"}),
        channels={"air_humidity": [0.62] * 8},
        only="workbooks",
    ),
    "unit of the format": Kind(lambda: replace(Table(), formats={5: '0.000" mm"'}), only="workbooks"),
    "another unit of the format": Kind(
        lambda: replace(Table(), formats={5: '0.0" µm"'}),
        error="Distance .*: the cell shows 100.25 µm, but is 100.25 mm by its head",
        only="workbooks",
    ),
    "percent of a distance": Kind(
        lambda: replace(Table(), formats={5: "0.00%"}),
        error="the cell shows 10025 %, but is 100.25 mm",
        only="workbooks",
    ),
    "hidden row": Kind(
        lambda: replace(Table(), hidden_row=5), error="the row is hidden: `hidden` take or", only="workbooks"
    ),
    "hidden row, left": Kind(lambda: replace(Table(), hidden_row=5), {"hidden": "leave"}, left_out=5, only="workbooks"),
    "hidden row, taken": Kind(lambda: replace(Table(), hidden_row=5), {"hidden": "take"}, only="workbooks"),
    "hidden column": Kind(
        lambda: replace(air("Air temperature [°C]", 21.5), hidden_column=8),
        error='column "Air temperature .*" is hidden: `hidden` take or',
        only="workbooks",
    ),
    "hidden column, left": Kind(
        lambda: replace(air("Air temperature [°C]", 21.5), hidden_column=8), {"hidden": "leave"}, only="workbooks"
    ),
    "hidden sheet": Kind(
        lambda: replace(Table(), is_hidden=True), error="has heads, but is hidden: `sheet` takes it", only="workbooks"
    ),
    "row of units that agrees": Kind(lambda: units_row(["", "", "mm", "mm", "mm", "MM", "urad", "µrad"], BARE)),
    "row of units that does not": Kind(
        lambda: units_row(["", "", "mm", "mm", "mm", "µm", "urad", "µrad"], BARE),
        error='the unit "µm" below the head "Distance \\[mm\\]" is another one',
    ),
}
FORMS = {**TEXTS, **WORKBOOKS}
SHEETS = [
    (kind, form)
    for kind, about in KINDS.items()
    for form in FORMS
    if not about.only or (about.only == "workbooks") == (form in WORKBOOKS)
]


@pytest.mark.parametrize(("kind", "form"), SHEETS)
def test_sheet_is_read_right_or_refused(kind: str, form: str, tmp_path: Path) -> None:
    about = KINDS[kind]
    path = FORMS[form](tmp_path / "sheet", about.table())
    if about.error:
        with pytest.raises(sd.InvalidArgument, match=f"sheet\\.[a-z]+.*{about.error}"):
            import_files([path], **about.options)
        return
    found = import_files([path], **about.options).measurement
    rows = [row for k, row in enumerate(run()) if k != about.left_out]
    assert found.line == [row[0] for row in rows]
    assert found.point.tolist() == [row[1] for row in rows]
    np.testing.assert_allclose(found.position, [row[2:5] for row in rows], rtol=0, atol=1e-12)
    channels = {
        "distance": [row[5] for row in rows],
        "alpha": [1e-6 * row[6] for row in rows],
        "beta": [1e-6 * row[7] for row in rows],
        **about.channels,
    }
    assert set(found.channels) == set(channels)
    for name, expected in channels.items():
        np.testing.assert_allclose(found.channels[name], expected, rtol=1e-14, atol=1e-18)


def test_origin_goes_with_positions_of_the_sheet(tmp_path: Path) -> None:
    table = Table(heads=[*HEADS[:2], *HEADS[5:]], rows=[[*row[:2], *row[5:]] for row in run()])
    path = FORMS["xlsx"](tmp_path / "sheet", table)
    assert len(import_files([path], plan=PLAN).measurement) == 8
    with pytest.raises(sd.InvalidArgument, match="`origin` goes with a sheet's own"):
        import_files([path], plan=PLAN, origin=(1.0, 0.0, 0.0))


def test_durations_of_a_workbook_are_clock_times(tmp_path: Path) -> None:
    table = Table().with_column("Time", [datetime.timedelta(hours=30, seconds=1.5 * k) for k in range(8)])
    path = xlsx()(tmp_path / "sheet", replace(table, formats={8: "[h]:mm:ss"}))
    np.testing.assert_allclose(import_files([path]).measurement.channels["time"], 1.5 * np.arange(8), atol=1e-9)


def test_kind_of_a_document_that_unpacks_without_end_is_not_unpacked(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "bomb.ods", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mimetype", b"x" * 2**28)
        archive.writestr("content.xml", "<office:document-content/>")
    tracemalloc.start()
    try:
        with pytest.raises(sd.InvalidArgument, match=r"bomb\.ods"):
            import_files([tmp_path / "bomb.ods"])
        assert tracemalloc.get_traced_memory()[1] < 2**25
    finally:
        tracemalloc.stop()


def test_there_are_as_many_sheets_as_were_asked_for() -> None:
    assert len(SHEETS) >= 200


@pytest.mark.parametrize(
    ("member", "content", "words"),
    [
        ("mimetype", "application/vnd.oasis.opendocument.text", "is a text document, no workbook"),
        ("word/document.xml", "<w/>", "is a text document, no workbook"),
        ("mimetype", "application/vnd.oasis.opendocument.presentation", "is a presentation, no workbook"),
        ("a.txt", "words", "save it as .xlsx or .ods"),
    ],
)
def test_what_is_no_workbook_is_named(member: str, content: str, words: str, tmp_path: Path) -> None:
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w") as archive:
        archive.writestr(member, content)
        if member == "mimetype":
            archive.writestr("content.xml", "<office:document-content/>")
    (tmp_path / "table.odt").write_bytes(whole.getvalue())
    with pytest.raises(sd.InvalidArgument, match=rf"table\.odt: .*{words}"):
        import_files([tmp_path / "table.odt"])
