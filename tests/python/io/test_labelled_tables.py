"""Labelled tables: names, dimensions, units, and values that are those of the core."""

from pathlib import Path

import numpy as np
import pytest
from usual import CHAIN, DIAGONALS, small_plan
from usual import SMALL_VOLUME as VOLUME

import stepdiag as sd
from stepdiag.parameters import kind_of


def calibrate(plan: sd.Plan) -> sd.Calibration:
    machine = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=3), (1.0, 2.0, 3.0))
    head = sd.Head()
    return sd.methods.evaluate(sd.simulate(machine, plan, head), plan, head, machine.chain, machine.tool)


@pytest.fixture(scope="module")
def calibration() -> sd.Calibration:
    return calibrate(small_plan())


def test_calibration_table_has_all_parameters_over_their_axes(calibration: sd.Calibration) -> None:
    table = calibration.to_xarray()
    for name, (position, value, uncertainty) in calibration.functions.items():
        axis = name[2].lower()
        assert table[name].dims == table[f"{name}_u"].dims == (axis,)
        np.testing.assert_array_equal(table[axis], position)
        np.testing.assert_array_equal(table[name], value)
        np.testing.assert_array_equal(table[f"{name}_u"], uncertainty)
    for name, (angle, uncertainty_of_angle) in calibration.squareness.items():
        assert table[name].dims == ()
        assert (float(table[name]), float(table[f"{name}_u"])) == (angle, uncertainty_of_angle)
    parameters = {name.removesuffix("_u").removesuffix("_functional_point") for name in map(str, table.data_vars)}
    assert parameters == calibration.functions.keys() | calibration.squareness.keys()
    assert len(parameters) == 21


def test_calibration_table_carries_units_and_names(calibration: sd.Calibration) -> None:
    table = calibration.to_xarray()
    assert table["EXY"].attrs["units"] == "mm"
    assert table["EAY"].attrs["units"] == table["EAY_u"].attrs["units"] == table["C0Y"].attrs["units"] == "rad"
    assert table["y"].attrs["units"] == "mm"
    assert table["EAY"].attrs["long_name"] == "rotation about X of axis Y"
    assert table["EAY_u"].attrs["long_name"] == "standard uncertainty of rotation about X of axis Y"
    assert table.attrs["method"] == calibration.method
    assert table.attrs["chain"] == "[w X' b Y Z t]"
    assert list(table.attrs["volume_mm"]) == list(VOLUME)
    assert list(table.attrs["tool_mm"]) == [1.0, 2.0, 3.0]
    assert table.attrs["undetermined"] == ""


def test_calibration_table_says_what_is_not_determined() -> None:
    calibration = calibrate(sd.Plan(VOLUME, DIAGONALS, 5))
    table = calibration.to_xarray()
    assert table["EXX"].attrs["slope_determined"] == "false"
    assert table["EXY"].attrs["slope_determined"] == "true"
    assert table.attrs["undetermined"].splitlines() == calibration.undetermined


def test_function_with_nodes_of_its_own_has_a_dimension_of_its_own(tmp_path: Path) -> None:
    file = tmp_path / "calibration.csv"
    file.write_text(
        "# format=stepdiag calibration 1\n# method=enhanced\n# chain=[w X' b Y Z t]\n"
        "# volume_mm=80.0 60.0 50.0\n# tool_mm=0.0 0.0 0.0\n"
        "parameter,position_mm,value,unit,standard_uncertainty\n"
        "EXX,0,0,um,0.1\nEXX,80,1,um,0.1\nEYX,0,0,um,0.1\nEYX,40,1,um,0.1\nEYX,80,0,um,0.1\n"
    )
    table = sd.read_calibration(file).to_xarray()
    assert table["EXX"].dims == ("x",)
    assert table["EYX"].dims == ("x_EYX",)
    assert table["x_EYX"].values.tolist() == [0.0, 40.0, 80.0]
    assert set(table.data_vars) == {"EXX", "EXX_u", "EYX", "EYX_u"}


def test_measurement_table_has_a_row_for_each_reading() -> None:
    run = sd.Measurement(
        ["ppp", "ppp", "p00"],
        [0, 1, 0],
        [[0.0, 0.0, 0.0], [16.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        {"distance": [100.0, np.nan, 100.0], "temperature": [20.0, 20.1, 20.2]},
        run=[0, 0, 1],
        direction=["forward", "forward", "backward"],
        standard_uncertainty={"distance": [1e-4, np.nan, 2e-4]},
    )
    table = run.to_xarray()
    assert table.sizes == {"reading": 3}
    assert table["line"].values.tolist() == ["ppp", "ppp", "p00"]
    assert table["direction"].values.tolist() == ["forward", "forward", "backward"]
    assert table["run"].values.tolist() == [0, 0, 1]
    assert table["x"].values.tolist() == [0.0, 16.0, 0.0]
    assert table["distance"].attrs["units"] == table["x"].attrs["units"] == "mm"
    assert table["temperature"].attrs["units"] == "degC"
    np.testing.assert_array_equal(table["distance"], [100.0, np.nan, 100.0])
    np.testing.assert_array_equal(table["distance_u"], [1e-4, np.nan, 2e-4])


def test_beams_are_distances() -> None:
    plan = sd.Plan(VOLUME, ["ppp"], 2)
    head = sd.Head("multi_beam", beam_offsets=[(0, 0), (20, 0), (0, 20)])
    table = sd.simulate(sd.Machine("[w b X Y Z t]"), plan, head).to_xarray()
    assert table["d2"].attrs == {"units": "mm", "long_name": "distance of beam 2"}


def test_kinds_of_parameters() -> None:
    kinds = {name: kind_of(name) for name in ("EXX", "EXY", "EAX", "C0Y")}
    assert kinds == {"EXX": "positioning", "EXY": "straightness", "EAX": "angle", "C0Y": "squareness"}


def test_largest_deviation_names_parameter_and_position(calibration: sd.Calibration) -> None:
    largest = sd.largest_deviations(calibration, sd.ErrorMap())  # against a perfect machine: the values themselves
    expected = max(
        (float(np.max(np.abs(value))), name)
        for name, (_, value, _) in calibration.functions.items()
        if name[1] in "ABC"
    )
    assert (abs(largest["angle"].value), largest["angle"].parameter) == expected
    position, value, _ = calibration.functions[largest["angle"].parameter]
    assert value[position == largest["angle"].position] == largest["angle"].value
    assert largest["squareness"].position is None


def test_function_without_a_slope_is_not_compared() -> None:
    largest = sd.largest_deviations(calibrate(sd.Plan(VOLUME, DIAGONALS, 5)), sd.ErrorMap())
    assert "positioning" not in largest
    assert largest["angle"].value != 0.0
