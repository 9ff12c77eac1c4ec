"""`stepdiag import`: one measurement in the forms of spreadsheet programs comes back with the same bits, or the file is
refused with words that say why and what decides."""

import csv
import io
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import openpyxl
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.importing.run import import_files

TRUTH = """\
line,point,x_mm,y_mm,z_mm,distance_mm,alpha_urad,beta_urad,u_distance_um,time_s,temperature_c,air_pressure_hpa,run
ppp,0,0,0,0,100.0001234567891,-12.345,7.25,0.1,0.5,20.125,1013.25,0
ppp,1,16,0,0,112.3456789012345,101.5,-3.125,0.1,1.75,20.25,1013.5,0
ppp,2,16,12,0,,,,,3,20.5,1013.75,0
ppp,3,16,12,10.5,1519.615242270663,-0.001,0.5,0.25,4.25,20.75,1014.125,0
npp,0,80,0,0,100.1,0,0,0.1,5.5,21,1014.5,1
p00,0,0,0,0,100.5,1e-3,2.5,0.1,6.75,21.25,1014.75,0
p00,1,80,0,0,180.5000001,3.5,-2e-5,0.1,8,21.5,1015.0625,0
"""
HEADS, *ROWS = list(csv.reader(io.StringIO(TRUTH)))
NUMBERS = range(2, 12)
SHORT = "line,point,x_mm,y_mm,z_mm,distance_mm\nppp,0,0,0,0,100.5\nppp,1,16,0,0,112.25\n"


def heads(**changed: str) -> list[str]:
    return [changed.get(head, head) for head in HEADS]


def shifted(column: str, factor: str) -> Callable[[str, str], str]:
    """Writes a column in another unit, exactly."""
    return lambda name, text: format(Decimal(text) * Decimal(factor), "f") if name == column else text


@dataclass(frozen=True)
class Form:
    """How a sheet is written: text with a separator, or a workbook."""

    separator: str = ","
    decimal: str = "."
    encoding: str = "utf-8"
    heads: list[str] = field(default_factory=lambda: list(HEADS))
    write: Callable[[str, str], str] = lambda name, text: text
    lost: str = ""
    above: str = ""
    tail: str = ""
    end: str = "\n"
    ending: str = ".csv"
    quoted: bool = False
    left: str = ""  # what every line begins with
    options: tuple[str, ...] = ()
    tail_heads: str = ""
    units_row: list[str] | None = None

    def cells(self) -> list[list[str]]:
        def cell(k: int, text: str) -> str:
            if not text:
                return self.lost if HEADS[k] in ("distance_mm", "alpha_urad", "beta_urad") else ""
            text = self.write(HEADS[k], text)
            return text.replace(".", self.decimal) if k in NUMBERS else text

        return [[cell(k, text) for k, text in enumerate(row)] for row in ROWS]

    def make(self, path: Path) -> Path:
        path = path.with_suffix(self.ending)
        if self.ending == ".xlsx":
            book = openpyxl.Workbook()
            page = book.active
            assert page is not None
            for line in filter(None, self.above.split("\n")):
                page.append([line])
            page.append(self.heads)
            for row in self.cells():
                page.append([as_cell(text) for text in row])
            book.create_sheet("notes").append(["made on Monday"])
            book.save(path)
        elif self.ending == ".ods":
            write_ods(path, [self.heads, *self.cells()])
        else:
            text = io.StringIO()
            quoting: Any = csv.QUOTE_ALL if self.quoted else csv.QUOTE_MINIMAL
            writer = csv.writer(text, delimiter=self.separator, lineterminator="\n", quoting=quoting)
            writer.writerows([*([self.units_row] if self.units_row else []), *self.cells()])
            head = io.StringIO()
            csv.writer(head, delimiter=self.separator, lineterminator="\n").writerow(self.heads)
            body = text.getvalue().replace("\n", f"{self.tail}\n")
            whole = self.above + head.getvalue().replace("\n", f"{self.tail_heads or self.tail}\n") + body
            path.write_bytes(whole.replace("\n", self.end).encode(self.encoding))
        return path


def as_cell(text: str) -> str | float | None:
    try:
        return float(text)
    except ValueError:
        return text or None


def write_ods(path: Path, rows: list[list[str]]) -> None:
    """As OpenDocument 1.3 part 3 has it, with no more than a reader needs."""

    def cell(text: str) -> str:
        value = as_cell(text)
        if isinstance(value, float):
            return f'<table:table-cell office:value-type="float" office:value="{text}"/>'
        return f'<table:table-cell office:value-type="string"><text:p>{escape(text)}</text:p></table:table-cell>'

    body = "".join(f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in rows)
    names = "".join(f' xmlns:{n}="urn:oasis:names:tc:opendocument:xmlns:{n}:1.0"' for n in ("office", "table", "text"))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr(
            "META-INF/manifest.xml",
            '<manifest:manifest xmlns:manifest="urn:oasis:names:tc:opendocument:xmlns:manifest:1.0"/>',
        )
        archive.writestr(
            "content.xml",
            f'<?xml version="1.0" encoding="UTF-8"?><office:document-content{names} office:version="1.3"><office:body>'
            f'<office:spreadsheet><table:table table:name="Run">{body}</table:table></office:spreadsheet>'
            f"</office:body></office:document-content>",
        )


GERMAN = {"separator": ";", "decimal": ","}
BRACKETS = heads(x_mm="X [MM]", y_mm="Y [MM]", z_mm="Z [MM]", distance_mm="Distance [MM]", alpha_urad="Alpha (µrad)")
OWN = heads(line="Linie", point="Punkt", distance_mm="Abstand [mm]", alpha_urad="Winkel A")
OWN_OPTIONS = (
    *("--column", "Linie=line", "--column", "punkt=point", "--column", "Abstand [mm]=distance"),
    *("--column", "Winkel A=alpha [µrad]"),
)
FORMS = {
    "as it is": Form(),
    "semicolons": Form(separator=";"),
    "tabs": Form(separator="\t"),
    "semicolons, decimal commas": Form(**GERMAN),
    "tabs, decimal commas": Form(separator="\t", decimal=","),
    "commas, quoted decimal commas": Form(decimal=","),
    "everything quoted": Form(quoted=True),
    "everything quoted, semicolons": Form(**GERMAN, quoted=True),
    "UTF-8 with a mark": Form(encoding="utf-8-sig"),
    "UTF-8 with a mark, semicolons": Form(**GERMAN, encoding="utf-8-sig"),
    "UTF-16": Form(encoding="utf-16"),
    "UTF-16 with tabs, as Excel's Unicode text": Form(separator="\t", decimal=",", encoding="utf-16", end="\r\n"),
    "UTF-16 big-endian without a mark": Form(encoding="utf-16-be"),
    "UTF-16 little-endian without a mark": Form(encoding="utf-16-le"),
    "Latin-1": Form(
        **GERMAN, encoding="latin-1", heads=heads(alpha_urad="Alpha [µrad]", temperature_c="Temperature °C")
    ),
    "CRLF": Form(end="\r\n"),
    "CR alone": Form(end="\r"),
    "upper case": Form(heads=[head.upper() for head in HEADS]),
    "spaces in heads": Form(heads=[head.replace("_", " ").title() for head in HEADS]),
    "hyphens in heads": Form(heads=[head.replace("_", "-") for head in HEADS]),
    "brackets": Form(heads=BRACKETS),
    "units after in": Form(heads=heads(distance_mm="distance in mm", alpha_urad="alpha in µrad")),
    "units after a slash": Form(heads=heads(distance_mm="distance / mm", alpha_urad="alpha / µrad")),
    "Greek mu": Form(heads=heads(alpha_urad="alpha [\u03bcrad]")),
    "row of units": Form(
        heads=[head.rpartition("_")[0] or head for head in HEADS],
        units_row=["", "-", "mm", "mm", "mm", "mm", "µrad", "µrad", "µm", "s", "°C", "hPa", ""],
    ),
    "distance in µm": Form(heads=heads(distance_mm="distance_um"), write=shifted("distance_mm", "1e3")),
    "distance in m": Form(heads=heads(distance_mm="Distance [m]"), write=shifted("distance_mm", "1e-3")),
    "distance in nm": Form(heads=heads(distance_mm="distance nm"), write=shifted("distance_mm", "1e6")),
    "positions in m": Form(heads=heads(x_mm="X (m)"), write=shifted("x_mm", "1e-3")),
    "tilt in mrad": Form(heads=heads(alpha_urad="alpha_mrad"), write=shifted("alpha_urad", "1e-3")),
    "tilt in rad": Form(heads=heads(alpha_urad="alpha_rad"), write=shifted("alpha_urad", "1e-6")),
    "time in h": Form(heads=heads(time_s="time [ms]"), write=shifted("time_s", "1e3")),
    "temperature in K": Form(
        heads=heads(temperature_c="temperature [K]"),
        write=lambda name, text: str(Decimal(text) + Decimal("273.15")) if name == "temperature_c" else text,
    ),
    "pressure in Pa": Form(heads=heads(air_pressure_hpa="air_pressure_pa"), write=shifted("air_pressure_hpa", "100")),
    "pressure in mbar": Form(heads=heads(air_pressure_hpa="Air pressure [mbar]")),
    "#N/A": Form(lost="#N/A"),
    "#NV in German": Form(**GERMAN, lost="#NV"),
    "dashes": Form(lost="-"),
    "long dashes": Form(lost="–"),
    "NaN": Form(lost="NaN"),
    "trailing separators": Form(tail=",,,,"),
    "trailing semicolons": Form(**GERMAN, tail=";;;;"),
    "separator at the ends of rows alone": Form(tail=",", tail_heads=" "),
    "a remark": Form(tail=",warm", tail_heads=",remark"),
    "an operator and a remark": Form(**GERMAN, tail=";Ann;", tail_heads=";operator;Remark"),
    "lines above the heads": Form(**GERMAN, above="Machine 7;;\nMonday 1,5;\n\n"),
    "sep= of Excel": Form(**GERMAN, above="sep=;\n"),
    "comment lines": Form(above="# made by hand\n"),
    "empty rows at the end": Form(end="\n", tail="", above="\n\n"),
    "upper-case lines": Form(write=lambda name, text: text.upper() if name == "line" else text),
    "typographic minus": Form(write=lambda name, text: text.replace("-", "\u2212", 1) if text[0] == "-" else text),
    "thousands": Form(
        **GERMAN, write=lambda name, text: text.replace("1519.", "1~519.") if name == "distance_mm" else text
    ),
    "own heads": Form(heads=OWN, options=OWN_OPTIONS),
    "sign turned": Form(
        heads=heads(alpha_urad="Tilt A [µrad]"),
        write=lambda name, text: str(-Decimal(text)) if name == "alpha_urad" else text,
        options=("--column", "Tilt A [µrad]=-alpha"),
    ),
    "xlsx": Form(ending=".xlsx"),
    "xlsx with brackets": Form(ending=".xlsx", heads=BRACKETS),
    "xlsx with #N/A as text": Form(ending=".xlsx", lost="#N/A"),
    "xlsx with a title": Form(ending=".xlsx", above="Machine 7\n"),
    "xlsx in µm": Form(ending=".xlsx", heads=heads(x_mm="x_um"), write=shifted("x_mm", "1e3")),
    "ods": Form(ending=".ods"),
    "ods with dashes": Form(ending=".ods", lost="-", heads=BRACKETS),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("truth.csv").write_text(TRUTH)
    return tmp_path


def test_there_are_forty_forms_and_twenty_refusals() -> None:
    assert len(FORMS) >= 40
    assert len(REFUSED) >= 20


@pytest.mark.parametrize("name", FORMS)
def test_form_is_read_with_the_same_bits(name: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    form = FORMS[name]
    path = form.make(Path("sheet"))
    if name == "thousands":
        path.write_text(path.read_text().replace("~", "."))
    assert main(["import", str(path), "-o", "run.csv", *form.options]) == 0, capsys.readouterr().err
    same_bits(sd.read_measurement("run.csv"), sd.read_measurement("truth.csv"))
    said = capsys.readouterr().out
    assert "alpha in " in said
    assert ("remark: left out" in said.lower()) == ("remark" in form.tail_heads.lower())


def same_bits(found: sd.Measurement, truth: sd.Measurement) -> None:
    assert (found.line, found.point.tolist(), found.direction) == (truth.line, truth.point.tolist(), truth.direction)
    assert found.run.tolist() == truth.run.tolist()
    np.testing.assert_array_equal(found.position, truth.position)
    assert found.channels.keys() == truth.channels.keys()
    for channel, values in truth.channels.items():
        np.testing.assert_array_equal(found.channels[channel], values)
    for channel, values in truth.standard_uncertainty.items():
        np.testing.assert_array_equal(found.standard_uncertainty[channel], values)


@pytest.mark.parametrize(("unit", "in_rad"), [("°", np.pi / 180), ("deg", np.pi / 180), ("″", np.pi / 648000)])
def test_degrees_and_arc_seconds(unit: str, in_rad: float, folder: Path) -> None:
    sheet = f"line,point,x_mm,y_mm,z_mm,distance_mm,alpha [{unit}],beta_urad\n"
    sheet += "ppp,0,0,0,0,1,0.0105,0\nppp,1,16,0,0,1,-0.0225,0\n"
    Path("s.csv").write_text(sheet, encoding="utf-8")
    assert main(["import", "s.csv", "-o", "run.nc"]) == 0
    # Two roundings of the reference, one of the program.
    np.testing.assert_allclose(
        sd.read_measurement("run.nc").channels["alpha"], np.array([0.0105, -0.0225]) * in_rad, rtol=3e-16
    )


def test_lines_in_files_of_their_own_are_joined(folder: Path) -> None:
    lines = TRUTH.splitlines(keepends=True)
    for name, rows in {"a": lines[1:5], "b": lines[5:6], "c": lines[6:]}.items():
        Path(f"{name}.csv").write_text("".join([lines[0], *rows]).replace(",", ";"))
    assert main(["import", "a.csv", "b.csv", "c.csv", "-o", "run.csv"]) == 0
    same_bits(sd.read_measurement("run.csv"), sd.read_measurement("truth.csv"))


@pytest.mark.parametrize("scale_points", ["ends", "steps"])
def test_scenario_gives_the_positions(folder: Path, scale_points: str) -> None:
    Path("scenario.toml").write_text(SCENARIO.replace("[head]", f'scale_points = "{scale_points}"\n[head]'))
    assert main(["simulate", "scenario.toml", "--overwrite", "-o", "truth.csv"]) == 0
    rows = list(csv.reader(Path("truth.csv").read_text().splitlines()))
    Path("s.csv").write_text("".join(";".join([*row[:2], *row[5:]]) + "\n" for row in rows))
    assert main(["import", "s.csv", "--scenario", "scenario.toml", "-o", "run.csv"]) == 0
    same_bits(sd.read_measurement("run.csv"), sd.read_measurement("truth.csv"))


def changed(*pairs: str) -> bytes:
    text = SHORT
    for old, new in zip(pairs[::2], pairs[1::2], strict=True):
        assert old in text
        text = text.replace(old, new)
    return text.encode()


THOUSANDS = b"line;point;x_mm;y_mm;z_mm;distance_mm\nppp;0;0;0;0;100,500\nppp;1;16;0;0;112,250\n"
REFUSED: dict[str, tuple[bytes, tuple[str, ...], str]] = {
    "decimal or thousands": (
        THOUSANDS,
        (),
        "'100,500' is 100500 with a decimal point and 100.500 with a decimal comma",
    ),
    "two decimal marks": (
        changed(",", ";", "100.5", "100,5"),
        (),
        "line 2: distance_mm: '100,5' has a decimal comma, but '112.25' (s.csv, line 3",
    ),
    "thousands beside decimals": (
        changed(",", ";", "100.5", "100,5", "112.25", "112.250"),
        (),
        "may be a decimal number",
    ),
    "no unit": (changed("distance_mm", "alpha"), (), '"alpha": alpha has no unit: say which (µrad, mrad, rad, °, ″)'),
    "uncertainty in mm": (
        changed("z_mm,distance_mm", "z_mm,distance_mm,u_distance_mm", "100.5", "100.5,1", "112.25", "112.25,1"),
        (),
        '"u_distance_mm": expected a standard uncertainty in µm, got mm',
    ),
    "near miss": (changed("distance_mm", "distanse_mm"), (), '"distanse_mm": looks like distance, but is none'),
    "unknown column with a unit": (
        changed("distance_mm", "dist [mm]"),
        (),
        "has a unit, but is no column that is known",
    ),
    "another quantity": (changed("distance_mm", "alpha_mm"), (), '"alpha_mm": expected alpha in µrad, mrad'),
    "two columns of a channel": (changed("y_mm", "X [mm]"), (), 'both "x_mm" and "X [mm]" are x'),
    "no line": (
        changed("line", "Diagonal"),
        (),
        'expected a row of heads with line and point; heads found: "Diagonal"',
    ),
    "no positions": (changed("x_mm,y_mm,z_mm", "a,b,c"), (), "the commanded positions x, y, z are missing"),
    "no readings": (changed("distance_mm", "remark"), (), "has no column of readings"),
    "word among the readings": (changed("112.25", "beam"), (), "line 3: distance_mm: expected a number, or a mark of"),
    "broken formula": (changed("112.25", "#DIV/0!"), (), "got '#DIV/0!'"),
    "lost position": (changed("16", "-"), (), "expected a commanded position, got '-'"),
    "unknown line": (changed("ppp,1", "diagonal 2,1"), (), "line 3: line: expected a name such as ppp"),
    "half a point": (changed("ppp,1", "ppp,0.5"), (), "point: expected a whole number, got '0.5'"),
    "repeated point": (
        changed("ppp,1", "ppp,0"),
        (),
        "line 3: run 0, line ppp, point 0 is already given in s.csv, line 2",
    ),
    "short row": (changed("0,112.25", "0"), (), "line 3: expected 6 fields, as in the heads, got 5"),
    "decimal commas between commas": (
        changed("100.5", "100,5"),
        (),
        "line 2: expected 6 fields, as in the heads, got 7",
    ),
    "field without a head": (
        changed("distance_mm\n", "distance_mm,,remark\n", "100.5", "100.5,7,warm", "112.25", "112.25,,"),
        (),
        "line 2: has a field in column 7, which has no head",
    ),
    "binary": (bytes(range(256)) * 3, (), "expected a text file, got binary data"),
    "old workbook": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), (), "old workbook (.xls)"),
    "damaged workbook": (b"PK\x03\x04" + bytes(600), (), "not a workbook that can be read"),
    "empty": (b"  \n", (), "the file is empty"),
    "heads alone": (SHORT.splitlines()[0].encode(), (), "has heads but no rows"),
    "mapped head that is not there": (SHORT.encode(), ("--column", "Tilt=alpha"), 'expected one head "Tilt", got 0'),
    "unknown name": (SHORT.encode(), ("--column", "distance_mm=length"), "expected HEAD=NAME"),
    "sign of a time": (
        SHORT.encode(),
        ("--column", "distance_mm=-time [s]"),
        "only readings and positions have a sign",
    ),
    "sheet of a text": (SHORT.encode(), ("--sheet", "Run"), "is no workbook, and has no --sheet"),
    "tilts without distances": (changed("distance_mm", "alpha_urad"), (), "s.csv: channels: expected distance alone"),
    "infinite": (changed("112.25", "inf"), (), "expected a number, or a mark of a lost reading"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusal_says_why(name: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content, options, message = REFUSED[name]
    Path("s.csv").write_bytes(content)
    assert main(["import", "s.csv", "-o", "run.csv", *options]) == 2
    said = capsys.readouterr().err
    assert said.startswith("stepdiag: error: ")
    assert message in said
    assert not Path("run.csv").exists()


@pytest.mark.parametrize(("decimal", "first"), [("point", 100500.0), ("comma", 100.5)])
def test_user_decides_what_the_comma_means(decimal: str, first: float, folder: Path) -> None:
    Path("s.csv").write_bytes(THOUSANDS)
    assert main(["import", "s.csv", "-o", "run.csv", "--decimal", decimal]) == 0
    assert sd.read_measurement("run.csv").channels["distance"][0] == first


def test_plain_commas_leave_no_doubt_about_points(folder: Path) -> None:
    Path("s.csv").write_bytes(changed("100.5", "100.500", "112.25", "112.250"))
    assert main(["import", "s.csv", "-o", "run.csv"]) == 0
    assert sd.read_measurement("run.csv").channels["distance"].tolist() == [100.5, 112.25]


def test_spots_and_air_in_other_units(folder: Path) -> None:
    Path("s.csv").write_text(
        "Line;Point;X [mm];Y [mm];Z [mm];Distance [mm];Spot X [µm];spot_y_um;U Spot X [µm];Air Humidity [%];"
        "Air temperature [K];Air pressure [kPa]\nppp;0;0;0;0;1;12,5;-3;0,5;45;293,15;101,325\n"
    )
    assert main(["import", "s.csv", "-o", "run.nc"]) == 0
    run = sd.read_measurement("run.nc")
    found = {name: values.tolist() for name, values in run.channels.items()}
    assert found == {
        "distance": [1.0],
        "spot_x": [0.0125],
        "spot_y": [-0.003],
        "air_humidity": [0.45],
        "air_temperature": [20.0],
        "air_pressure": [101325.0],
    }
    assert run.standard_uncertainty["spot_x"].tolist() == [0.0005]


def test_user_decides_what_a_column_is(folder: Path) -> None:
    Path("s.csv").write_bytes(
        changed("y_mm", "X [mm]", "z_mm", "Y", "distance_mm", "z_mm,dist [mm]", "100.5", "3,1", "112.25", "4,2")
    )
    options = ["--column", "X [mm]=", "--column", "Y=-y [mm]", "--column", "dist [mm]=-distance [µm]"]
    assert main(["import", "s.csv", "-o", "run.csv", *options]) == 0
    run = sd.read_measurement("run.csv")
    assert run.position.tolist() == [[0, 0, 3], [16, 0, 4]]
    assert run.channels["distance"].tolist() == [-0.001, -0.002]


def test_two_sheets_of_a_workbook(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = Form(ending=".xlsx").make(Path("sheet"))
    book = openpyxl.load_workbook(path)
    book.copy_worksheet(book["Sheet"]).title = "copy"
    book.save(path)
    assert main(["import", "sheet.xlsx", "-o", "run.csv"]) == 2
    assert 'makes sense with sheet "Sheet" and with sheet "copy": --sheet decides' in capsys.readouterr().err
    assert main(["import", "sheet.xlsx", "-o", "run.csv", "--sheet", "copy"]) == 0
    same_bits(sd.read_measurement("run.csv"), sd.read_measurement("truth.csv"))


def test_without_the_library_texts_are_read_and_workbooks_say_what_is_missing(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "python_calamine", None)
    path = Form(ending=".xlsx").make(Path("sheet"))
    assert main(["import", str(path), "-o", "run.csv"]) == 2
    assert "pip install 'stepdiag[import]'" in capsys.readouterr().err
    assert main(["import", "truth.csv", "-o", "run.csv"]) == 0


# --- what the strict readers say -------------------------------------------------------------------------------------
LOOKS = {
    "semicolons with decimal commas": Form(**GERMAN),
    "semicolons": Form(separator=";"),
    "tabs": Form(separator="\t"),
    "tabs with decimal commas": Form(separator="\t", decimal=","),
    "UTF-16 text": Form(encoding="utf-16"),
    "Latin-1 text": Form(encoding="latin-1", heads=heads(alpha_urad="alpha [µrad]")),
    "a workbook of a spreadsheet program": Form(ending=".xlsx"),
}


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("command", ["evaluate", "check"])
def test_strict_reader_says_what_the_file_looks_like(
    look: str, command: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("scenario.toml").write_text(SCENARIO)
    path = LOOKS[look].make(Path("sheet"))
    more = ["-o", "c.csv"] if command == "evaluate" else []
    assert main([command, "scenario.toml", str(path), *more]) == 2
    said = capsys.readouterr().err
    assert f"the file looks like {look}: `stepdiag import {path} -o run.csv` reads such files" in said


@pytest.mark.parametrize(
    "content",
    [changed("distance_mm", "spot_x_um"), changed("distance_mm", "Distance [MM]"), changed("112.25", "#N/A")],
)
def test_strict_reader_names_the_command_for_other_heads_and_marks(content: bytes, folder: Path) -> None:
    Path("s.csv").write_bytes(content)
    with pytest.raises(sd.InvalidArgument, match=r"`stepdiag import s.csv -o run.csv` takes other heads, units and"):
        sd.read_measurement("s.csv")


def test_strict_reader_names_no_command_for_faults_that_import_refuses(folder: Path) -> None:
    for name in ("repeated point", "uncertainty in mm", "half a point"):
        Path("s.csv").write_bytes(REFUSED[name][0])
        with pytest.raises(sd.InvalidArgument) as refused:
            sd.read_measurement("s.csv")
        assert "import" not in str(refused.value)


def test_exchanged_scenario_and_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scenario.toml").write_text(SCENARIO)
    assert main(["evaluate", "truth.csv", "scenario.toml", "-o", "c.csv"]) == 2
    said = capsys.readouterr().err
    assert "truth.csv: expected a scenario, got a measurement: are the files in the wrong order?" in said
    assert main(["evaluate", "scenario.toml", "scenario.toml", "-o", "c.csv"]) == 2
    assert "scenario.toml: expected a measurement, got a TOML file" in capsys.readouterr().err


def test_workbook_without_sheets_is_refused(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    book.save(tmp_path / "whole.xlsx")
    with zipfile.ZipFile(tmp_path / "whole.xlsx") as whole, zipfile.ZipFile(tmp_path / "run.xlsx", "w") as damaged:
        for name in whole.namelist():
            damaged.writestr(name, whole.read(name).replace(b"<sheet ", b"<shoot "))
    with pytest.raises(sd.InvalidArgument, match=r"run\.xlsx: the workbook has no sheets"):
        import_files([tmp_path / "run.xlsx"])
