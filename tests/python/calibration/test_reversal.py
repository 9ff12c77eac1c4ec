"""Reversal errors of a calibration: in its file, as an error map, and as a labelled table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stepdiag as sd

# Halves and quarters: differences of them are exact.
FILE = """# format=stepdiag calibration 1
# chain=[w X' b Y Z t]
# volume_mm=800 600 500
# tool_mm=0 0 0
# method=adjustment
# undetermined_reversal_constants=EYX
parameter,position_mm,value,unit,standard_uncertainty,direction
EXX,0,0,um,0,+
EXX,400,500,um,0.5,+
EXX,800,250,um,0.5,+
EXX,0,-750,um,1,-
EXX,400,1000,um,2,-
EXX,800,0,um,,-
EYX,0,0,um,0,+
EYX,800,0,um,0,+
EYX,0,0,um,0,-
EYX,400,250,um,1,-
EAY,0,0,urad,0,
EAY,600,20,urad,1,
C0Y,,10,urad,1,
"""


@pytest.fixture
def calibration(tmp_path: Path) -> sd.Calibration:
    path = tmp_path / "calibration.csv"
    path.write_text(FILE)
    return sd.read_calibration(path)


def test_reversal_is_the_function_less_that_of_the_other_direction(calibration: sd.Calibration) -> None:
    assert calibration.reversal.keys() == {"EXX", "EYX"}
    position, value, uncertainty = calibration.reversal["EXX"]
    assert position.tolist() == [0.0, 400.0, 800.0]
    assert value.tolist() == [0.75, -0.5, 0.25]
    assert np.all(np.isnan(uncertainty)), "it is not that of the two tables"
    # The other direction has nodes of its own: the function between its nodes.
    position, value, _ = calibration.reversal["EYX"]
    assert (position.tolist(), value.tolist()) == ([0.0, 400.0], [0.0, -0.25])
    assert calibration.undetermined_reversal_constants == ["EYX"]
    assert calibration.negative_functions["EXX"][1].tolist() == [-0.75, 1.0, 0.0]
    np.testing.assert_array_equal(calibration.negative_functions["EXX"][2], [1e-3, 2e-3, np.nan])
    assert calibration.functions.keys() == {"EXX", "EYX", "EAY"}


def test_file_written_again_has_the_same_tables(calibration: sd.Calibration, tmp_path: Path) -> None:
    first, second = tmp_path / "first.csv", tmp_path / "second.csv"
    calibration.write(first)
    again = sd.read_calibration(first)
    again.write(second)
    assert first.read_text() == second.read_text()
    for name, (position, value, _) in calibration.reversal.items():
        assert np.array_equal(again.reversal[name][0], position)
        assert np.array_equal(again.reversal[name][1], value)
    assert again.undetermined_reversal_constants == ["EYX"]


def test_error_map_has_both_directions_and_forgets_what_is_said_of_a_calibration(
    calibration: sd.Calibration, tmp_path: Path
) -> None:
    errors = calibration.to_error_map()
    assert errors.function("EXX", [400.0]) == 0.5
    assert errors.function("EXX", [400.0], "-") == 1.0
    assert errors.function("EAY", [600.0], "-") == errors.function("EAY", [600.0]) == 20e-6
    errors.write(tmp_path / "map.csv")
    assert "undetermined" not in (tmp_path / "map.csv").read_text()
    assert sd.read_error_map(tmp_path / "map.csv").negative_functions.keys() == {"EXX", "EYX"}


def test_labelled_table_has_reversal_errors_and_what_is_known_of_them(calibration: sd.Calibration) -> None:
    table = calibration.to_xarray()
    assert table["EXX_reversal"].dims == ("x",)
    assert table["EXX_reversal"].values.tolist() == [0.75, -0.5, 0.25]
    assert table["EXX_reversal"].attrs["units"] == "mm"
    assert table["EXX_reversal"].attrs["constant_determined"] == "true"
    assert table["EYX_reversal"].attrs["constant_determined"] == "false"
    (own,) = table["EYX_reversal"].dims  # its nodes are not those of the others
    assert table[own].values.tolist() == [0.0, 400.0]
    np.testing.assert_array_equal(table["EXX_negative_u"], [1e-3, 2e-3, np.nan])
    assert "EAY_reversal" not in table


@pytest.mark.parametrize(
    ("arguments", "options", "word"),
    [
        (({}, {}), {"negative_functions": {"EXX": ([0.0], [0.0])}}, "EXX: has a table of the - direction"),
        (({"EXX": ([0.0], [0.0])},), {"negative_functions": {"EXX": ([1.0, 0.0], [0.0, 0.0])}}, "EXX in - direction"),
        (({},), {"negative_functions": {"C0Y": ([0.0], [0.0])}}, "negative_functions"),
    ],
)
def test_map_that_makes_no_sense_is_refused(
    arguments: tuple[object, ...], options: dict[str, object], word: str
) -> None:
    with pytest.raises(sd.InvalidArgument, match=word):
        sd.ErrorMap(*arguments, **options)


@pytest.mark.parametrize("approach", ["", "++", "++0", "+ -", "++++", "ppp"])
def test_approach_that_is_none_is_refused(approach: str) -> None:
    machine = sd.Machine("[w b X Y Z t]")
    for verb in (machine.pose, machine.error, machine.first_order_error):
        with pytest.raises(sd.InvalidArgument, match="approach"):
            verb([[0.0, 0.0, 0.0]], approach)
    with pytest.raises(sd.InvalidArgument, match="approach"):
        machine.errors.function("EXX", [0.0], approach)
