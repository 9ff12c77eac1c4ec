"""What loggers write in place of a reading whose beam was lost: 0 0 0 costs its own row; other marks are one line."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import stepdiag as sd
from stepdiag.cli import main

SCENARIO = """
[volume]
x_mm = 800.0
y_mm = 600.0
z_mm = 500.0
[machine]
chain = "[w X' b Y Z t]"
[machine.random]
seed = 7
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
steps = 6
scale_lines = ["p00", "0p0", "00p"]
[head]
layout = "ideal"
[noise]
distance_um = 0.1
tilt_urad = 1.0
seed = 3
"""
LOST = [("ppp", "8"), ("nnp", "0"), ("p00", "1")]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    assert main(["simulate", "scenario.toml", "-o", "good.csv"]) == 0
    return tmp_path


def write(name: str, fields: Sequence[str], places: Sequence[tuple[str, str]] = LOST) -> None:
    """The good run with these fields in place of distance and tilts."""
    rows = list(csv.reader(Path("good.csv").read_text().splitlines()))
    for row in rows[1:]:
        if (row[0], row[1]) in places:
            row[5:8] = fields
    Path(name).write_text("".join(",".join(row) + "\n" for row in rows))


def test_zeros_of_a_lost_beam_cost_no_other_reading(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = {}
    for name, fields in (("empty", ["", "", ""]), ("zeros", ["0", "0", "0"])):
        write(f"{name}.csv", fields)
        capsys.readouterr()
        assert main(["evaluate", "scenario.toml", f"{name}.csv", "-o", f"{name}_calibration.csv"]) == 0
        found[name] = capsys.readouterr().out
    assert "lost: 3 rows without a complete reading" in found["zeros"]
    assert "left out" not in found["zeros"]
    assert found["zeros"].replace("zeros", "empty") == found["empty"]
    one, other = (sd.read_calibration(f"{name}_calibration.csv") for name in ("empty", "zeros"))
    assert all(np.array_equal(one.functions[name][1], other.functions[name][1]) for name in one.functions)


def test_zeros_of_a_netcdf_file_are_lost_too(folder: Path) -> None:
    write("zeros.csv", ["0", "0", "0"])
    good = sd.read_measurement("good.csv")
    dark = np.isnan(sd.read_measurement("zeros.csv").channels["distance"])
    assert dark.sum() == len(LOST)
    channels = {name: np.where(dark, 0.0, values) for name, values in good.channels.items()}
    sd.Measurement(good.line, good.point, good.position, channels).write("zeros.nc")
    for values in sd.read_measurement("zeros.nc").channels.values():
        assert np.array_equal(np.isnan(values), dark)


@pytest.mark.parametrize("mark", ["9999.999", "-999", "5000"])
@pytest.mark.parametrize("command", ["evaluate", "check"])
def test_another_mark_is_told_in_one_sentence(
    mark: str, command: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write("marked.csv", [mark, mark, mark], [("ppp", "8")])
    options = ["-o", "calibration.csv"] if command == "evaluate" else []
    capsys.readouterr()
    assert main([command, "scenario.toml", "marked.csv", *options]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"marked.csv: row 9 (run 0, line ppp, point 8): distance {mark} mm is " in said
    assert said.endswith(" mm from where its neighbours put it; if it marks a lost beam, leave the field empty\n")
    assert not Path("calibration.csv").exists()
