"""The figure of an error map alone shows its values, and names what it leaves at 0."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ink import ink, panel, texts

import stepdiag as sd
from stepdiag.figures.error_map import draw_error_map
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

VOLUME = (800.0, 600.0, 500.0)


def test_curves_and_points_are_the_values() -> None:
    errors = sd.random_error_map(VOLUME, seed=3, intervals=5)
    figure = draw_error_map(errors)
    assert all(count > 100 for name, count in ink(figure).items() if name in FUNCTIONS)
    for name, (position, value) in errors.functions.items():
        expected = np.column_stack([position, value * (1e6 if name[1] in "ABC" else 1e3)])
        np.testing.assert_allclose(panel(figure, name).lines[0].get_xydata(), expected, rtol=1e-15)
    points = panel(figure, "squarenesses").containers
    drawn = [container.lines[0].get_ydata()[0] for container in points]
    np.testing.assert_allclose(drawn, [1e6 * errors.squareness[name] for name in SQUARENESSES], rtol=1e-15)
    assert "not in the map: 0" not in texts(figure)


def test_missing_parameters_are_marked_and_both_directions_are_drawn(tmp_path: Path) -> None:
    forward, backward = ([0.0, 100.0], [0.0, 0.01]), ([0.0, 100.0], [0.001, 0.012])
    errors = sd.ErrorMap({"EXX": forward}, {"C0Y": 1e-5}, negative_functions={"EXX": backward})
    errors.write(tmp_path / "map.csv", volume=VOLUME)
    figure = draw_error_map(sd.read_error_map(tmp_path / "map.csv"))
    assert panel(figure, "EXX").get_xlim() == (0.0, 800.0), "the volume of the file"
    curves = [list(line.get_ydata()) for line in panel(figure, "EXX").lines]
    assert [0.0, 10.0] in curves
    assert [1.0, 12.0] in curves
    marked = [name for name in FUNCTIONS if panel(figure, name).texts]
    assert marked == [name for name in FUNCTIONS if name != "EXX"]
    assert {"2 of 21 parameters, volume 800 x 600 x 500 mm", "not in the map: 0", "approached in - direction"} <= {
        *texts(figure)
    }


def test_travel_that_nothing_states_is_a_mistake() -> None:
    errors = sd.ErrorMap({"EXX": ([0.0, 100.0], [0.0, 0.01]), "EYY": ([0.0, 50.0], [0.0, 0.01])})
    with pytest.raises(sd.InvalidArgument, match="travel of Z is not known: expected a function of Z, or a line"):
        draw_error_map(errors)
