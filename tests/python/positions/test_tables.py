"""Positioning tests as programs and people write them: the same readings as from the file of ours."""

from collections.abc import Callable
from pathlib import Path

import openpyxl
import pytest

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.importing.position_table import is_position_table, read_position_table
from stepdiag.positions.readings import PositionReadings

TARGETS = (0.0, 100.0, 250.0)
# By run: direction and deviations, µm, in the order of the targets.
RUNS = {1: ("+", (0.2, 1.1, 1.7)), 2: ("-", (-1.0, -0.6, 1.2)), 3: ("+", (0.3, 1.0, 1.6)), 4: ("-", (-0.9, -0.4, 1.3))}


def expected() -> dict[tuple[float, str, int], float]:
    return {
        (target, direction, (run + 1) // 2): 1e-3 * um
        for run, (direction, values) in RUNS.items()
        for target, um in zip(TARGETS, values, strict=True)
    }


def check(readings: PositionReadings) -> None:
    assert readings.targets == TARGETS
    assert readings.deviations == pytest.approx(expected(), abs=1e-15)


# --- .rtl, after the programs that read it ---------------------------------------------------------------------------
def rtl(**changes: str) -> str:
    parts = {
        "kind": "Linear",
        "targets": "    0.000000  100.000000\r\n  250.000000\r\n",
        "count": "3",
        "runs": "4",
        "machine": "VMC",
        **changes,
    }
    rows = []
    for run, (direction, values) in RUNS.items():
        numbers = list(enumerate(values, start=1))
        rows += [f"{run}    {k}    {um:.3f}" for k, um in (numbers if direction == "+" else numbers[::-1])]
    return (
        "HEADER::\r\nFile type: RTL\r\nOwner: Renishaw\r\nVersion no: 1\r\n\r\nTARGET DATA::\r\n"
        f"Filetype: {parts['kind']}\r\nTarget-count: {parts['count']}\r\nTargets :\r\n{parts['targets']}"
        "Flags: 0\r\n\r\n"
        f"USER-TEXT::\r\nMachine: {parts['machine']}\r\nSerial No: 12\r\nDate: 28/11/2026\r\nAxis: X\r\n\r\n"
        f"RUNS::\r\nRun-count: {parts['runs']}\r\n\r\nDEVIATIONS::\r\nRun Target Data:\r\n"
        + "\r\n".join(rows)
        + "\r\n\r\nENVIRONMENT::\r\nAir: 20.0\r\n"
    )


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
def test_rtl(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "x.rtl").write_bytes(rtl(machine="Fräse").encode(encoding))
    readings = sd.positions.read_positions(tmp_path / "x.rtl")
    check(readings)
    assert readings.line == "Fräse, 12, X"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (rtl(count="4"), "expected 4 by target-count, got 3; the file is not whole"),
        (rtl(runs="6"), "expected 6 by run-count, got 4; the file is not whole"),
        (rtl(kind="Angular"), "expected a linear positioning test, got Filetype: Angular"),
        (rtl(targets="0 100 x\r\n"), r"line 10: expected a number, got 'x'"),
        (rtl(targets="0 100\r\n", count="2"), r"line \d+: expected a target from 1 to 2, got 3"),
        (rtl().replace("2    2    -0.600", "2    2"), r"line \d+: expected run, target and deviation"),
        (rtl().replace("2    2    -0.600", "2    2    nan"), r"line \d+: expected a number, got 'nan'"),
        (rtl().replace("2    2    -0.600", "2    3    -0.600"), "given twice|upwards or downwards"),
    ],
)
def test_rtl_that_is_damaged(tmp_path: Path, text: str, error: str) -> None:
    (tmp_path / "x.rtl").write_text(text, newline="")
    with pytest.raises(sd.InvalidArgument, match=rf"x\.rtl.*(?:{error})"):
        sd.positions.read_positions(tmp_path / "x.rtl")


# --- targets in rows, runs in columns --------------------------------------------------------------------------------
def table(heads: list[list[str]], separator: str, decimal: str, shown: Callable[[float, float], float]) -> str:
    rows = [
        [f"{target:g}", *(f"{shown(target, values[k]):.4f}".replace(".", decimal) for _, values in RUNS.values())]
        for k, target in enumerate(TARGETS)
    ]
    return "\n".join(separator.join(row) for row in (*heads, *rows)) + "\n"


def deviation(_: float, um: float) -> float:
    return um


ONE_ROW = [["Target [mm]", "Run 1 + [µm]", "Run 1 - [µm]", "Run 2 + [µm]", "Run 2 - [µm]"]]
TABLES = {
    "semicolons, decimal commas": table(ONE_ROW, ";", ",", deviation),
    "tabs": table(ONE_ROW, "\t", ".", deviation),
    "words": table(
        [["Soll [mm]", "1 forward µm", "1 backward µm", "2 forward µm", "2 backward µm"]], ";", ",", deviation
    ),
    "arrows": table([["Target (mm)", "↑1 (µm)", "↓1 (µm)", "↑2 (µm)", "↓2 (µm)"]], ",", ".", deviation),
    "directions and units below": table(
        [["Target [mm]", "Run 1", "", "Run 2", ""], ["", "+", "-", "+", "-"], ["", "µm", "µm", "µm", "µm"]],
        ";",
        ",",
        deviation,
    ),
    "positions": table(
        [["Target [mm]", "Run 1 + [mm]", "Run 1 - [mm]", "Run 2 + [mm]", "Run 2 - [mm]"]],
        ";",
        ",",
        lambda target, um: target + 1e-3 * um,
    ),
    "rows above, other columns": "X axis;;\n\n" + table(ONE_ROW, ";", ",", deviation),
}


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_wide_table(tmp_path: Path, name: str, encoding: str) -> None:
    (tmp_path / "x.csv").write_bytes(TABLES[name].encode(encoding))
    readings, said = read_position_table(tmp_path / "x.csv")
    assert readings.targets == TARGETS
    assert readings.deviations == pytest.approx(expected(), abs=1e-13)
    assert sum("of cycle" in line for line in said) == 4


def test_workbook(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    assert book.active is not None
    book.active.append(ONE_ROW[0])
    for k, target in enumerate(TARGETS):
        book.active.append([target, *(values[k] for _, values in RUNS.values())])
    book.save(tmp_path / "x.xlsx")
    check(read_position_table(tmp_path / "x.xlsx")[0])


def heads(*words: str) -> str:
    return table([list(words)], ";", ",", deviation)


@pytest.mark.parametrize("what", ["row", "column", "format"])
def test_workbook_that_shows_something_else_is_refused(tmp_path: Path, what: str) -> None:
    book = openpyxl.Workbook()
    assert book.active is not None
    book.active.append(ONE_ROW[0])
    for k, target in enumerate(TARGETS):
        book.active.append([target, *(values[k] for _, values in RUNS.values())])
    if what == "row":
        book.active.row_dimensions[3].hidden = True
    elif what == "format":
        book.active["C3"].number_format = '0.0" mm"'
    else:
        book.active.column_dimensions["C"].hidden = True
    book.save(tmp_path / "x.xlsx")
    with pytest.raises(
        sd.InvalidArgument,
        match=r"x\.xlsx.*(?:(?:row|column) 3 is hidden|the cell shows -0.6 mm, but is -0.6 µm by its head)",
    ):
        read_position_table(tmp_path / "x.xlsx")


REFUSED = {
    "no direction": (
        heads("Target [mm]", "Run 1 [µm]", "Run 2 [µm]", "Run 3 [µm]", "Run 4 [µm]"),
        "expected the direction in the head",
    ),
    "no unit": (heads("Target [mm]", "Run 1 +", "Run 1 -", "Run 2 +", "Run 2 -"), "expected a unit in the head"),
    "no unit of targets": (heads("Target", *ONE_ROW[0][1:]), "expected targets with a unit"),
    "run given twice": (heads(*ONE_ROW[0][:3], "Run 1 + [µm]", "Run 2 - [µm]"), "is given twice"),
    "a word": (TABLES["tabs"].replace("1.1000", "good"), "expected a number, or a mark"),
    "neither": (table(ONE_ROW, ";", ",", lambda target, um: 5000.0 + 100.0 * target + um), "neither all near 0 nor"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_wide_table_that_is_refused(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    text, error = REFUSED[name]
    (tmp_path / "x.csv").write_text(text, encoding="utf-8")
    with pytest.raises(sd.InvalidArgument, match=rf"x\.csv.*{error}"):
        read_position_table(tmp_path / "x.csv")
    assert main(["positions", str(tmp_path / "x.csv")]) == 2
    assert error in capsys.readouterr().err


def test_lost_readings_are_data(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text(TABLES["tabs"].replace("1.1000", "-"), encoding="utf-8")
    readings, _ = read_position_table(tmp_path / "x.csv")
    assert readings.lost == 1
    assert len(readings.deviations) == 11


def test_own_file_is_no_table(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("target_mm,direction,cycle,deviation_um\n0,+,1,0.5\n100,+,1,1.2\n")
    assert not is_position_table(tmp_path / "x.csv")


def test_command_says_what_it_took(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.csv").write_text(TABLES["semicolons, decimal commas"], encoding="utf-8")
    (tmp_path / "x.rtl").write_text(rtl(), newline="")
    assert main(["positions", str(tmp_path / "x.csv")]) == 0
    wide = capsys.readouterr()
    assert "Run 2 - [µm]: deviation of cycle 2, direction -, µm" in wide.err
    assert main(["positions", str(tmp_path / "x.rtl")]) == 0
    assert wide.out == capsys.readouterr().out.replace("VMC, 12, X", "").replace("line: \n", "")
