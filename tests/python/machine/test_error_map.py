"""What an error map keeps and drops of the file it came from."""

from pathlib import Path

import stepdiag as sd

CALIBRATION = (
    "# method=enhanced\n# tool_mm=0.0 0.0 0.0\n# undetermined=C0Y: ...\n# undetermined_slopes=EXX\n# note=kept\n"
    "# volume_mm=80.0 60.0 50.0\n# chain=[w X' b Y Z t]\n"
    "parameter,position_mm,value,unit,standard_uncertainty\nEXX,0,0,um,0.1\nEXX,80,0,um,0.1\n"
)


def test_map_read_from_a_calibration_and_written_does_not_pass_for_one(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_text(CALIBRATION)
    sd.read_error_map(file).write(file)
    lines = file.read_text().splitlines()
    assert lines[:6] + lines[7:8] == [
        "# format=stepdiag error map 1",
        "# chain=[w X' b Y Z t]",
        "# volume_mm=80.0 60.0 50.0",
        "# tool_mm=0.0 0.0 0.0",
        "# note=kept",
        "# unverified=a checksum was absent when this calibration was read",
        "parameter,position_mm,value,unit,standard_uncertainty",
    ]


def test_calibration_needs_no_format_line(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_text(CALIBRATION)
    assert sd.read_calibration(file).undetermined_slopes == ["EXX"]
