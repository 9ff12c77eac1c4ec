"""Files of repeated readings: what they may hold, and mistakes by file and line."""

from pathlib import Path

import pytest
from refusal import refused

import stepdiag as sd

HEADER = "target_mm,direction,cycle,deviation_um\n"
ROWS = "0,+,1,0.5\n100,+,1,1.25\n100,-,1,-2\n0,-,1,\n"


def written(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "readings.csv"
    file.write_text(text, encoding="utf-8")
    return file


def read(tmp_path: Path, text: str) -> sd.positions.PositionReadings:
    return sd.positions.read_positions(written(tmp_path, text))


def test_deviations_come_in_mm_and_a_lost_reading_is_data(tmp_path: Path) -> None:
    readings = read(tmp_path, f"# line=X axis at 300 mm\n# operator=N\n{HEADER}{ROWS}\n")
    assert readings.targets == (0.0, 100.0)
    assert readings.deviations == {(0.0, "+", 1): 5e-4, (100.0, "+", 1): 1.25e-3, (100.0, "-", 1): -2e-3}
    assert (readings.line, readings.lost) == ("X axis at 300 mm", 1)
    assert (readings.cycles, readings.directions) == ((1,), ("+", "-"))
    assert (readings.at(100.0, "-"), readings.at(0.0, "-")) == ([-2e-3], [])


def test_positions_and_deviations_say_the_same(tmp_path: Path) -> None:
    one = read(tmp_path, f"{HEADER}0,+,1,0.5\n100,+,1,1.25\n")
    other = read(tmp_path, "position_mm,cycle,direction,target_mm\n0.0005,1,+,0\n100.00125,1,+,100\n")
    assert one.deviations == pytest.approx(other.deviations, abs=2e-14)  # rounding of 100.00125


def test_targets_are_matched_with_a_tolerance(tmp_path: Path) -> None:
    readings = read(tmp_path, f"{HEADER}0,+,1,0\n0.3,+,1,1\n0.30000000000000004,+,2,1\n")
    assert readings.targets == (0.0, 0.3)
    assert readings.at(0.3, "+") == [1e-3, 1e-3]


MALFORMED = [
    ("target_mm,direction,cycle\n0,+,1\n", "line 1: expected the columns target_mm, direction, cycle and one of"),
    (HEADER.replace("\n", ",position_mm\n") + "0,+,1,0,0\n", "line 1: expected the columns"),
    (HEADER.replace("\n", ",more\n") + "0,+,1,0,0\n", "line 1: expected the columns"),
    ("line,point,x_mm,y_mm,z_mm,distance_mm\nppp,0,0,0,0,100\n", "line 1: expected the columns"),
    (f"{HEADER}0,+,1,0,7\n", "line 2: expected 4 fields, got 5"),
    (f"{HEADER}{ROWS}x,+,1,0\n", "line 6: target_mm: expected a finite number, got 'x'"),
    (f"{HEADER}{ROWS}inf,+,1,0\n", "line 6: target_mm: expected a finite number, got 'inf'"),
    (f"{HEADER}{ROWS}0,up,1,0\n", "line 6: direction: expected + or -, got 'up'"),
    (f"{HEADER}{ROWS}0,+,1.5,0\n", "line 6: cycle: expected a whole number, got '1.5'"),
    (f"{HEADER}{ROWS}0,+,2,1 µm\n", "line 6: deviation_um: expected a finite number, got '1 µm'"),
    (f"{HEADER}{ROWS}0,+,2,nan\n", "line 6: deviation_um: expected a finite number, got 'nan'"),
    (f"{HEADER}{ROWS}0,-,1,3\n", "line 6: target 0 mm, direction -, cycle 1 is given twice"),
    (f"{HEADER}0,+,1,0\n", "targets: expected two or more different ones"),
    (f'{HEADER}"0,+,1,0\n', "expected CSV"),
    ("# line=X\n", "the file has no rows"),
    ("", "the file is empty"),
]


@pytest.mark.parametrize(("text", "message"), MALFORMED)
def test_mistakes_are_named_by_file_and_line(text: str, message: str, tmp_path: Path) -> None:
    file = written(tmp_path, text)
    refused(sd.positions.read_positions, file, names=message)
    refused(sd.positions.read_positions, file, names=str(file))


def test_missing_file_is_named(tmp_path: Path) -> None:
    refused(sd.positions.read_positions, tmp_path / "none.csv", names="none.csv: cannot be read")
