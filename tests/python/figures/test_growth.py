"""The figure of how uncertainties grow with the number of steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ink import ink, panel, texts
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.figures.growth import draw_growth, read_steps
from stepdiag.figures.uncertainty import draw_observation
from stepdiag.planning.observation import Prospect, prospects
from stepdiag.presentation.observation import prospect_csv

# u = 0.1 µm √N, 0.2 µm, 1 µrad N; squarenesses are not determined.
TABLE = [
    Prospect(n, (100.0 / n, 80.0 / n), {"positioning": 1e-4 * n**0.5, "straightness": 2e-4, "angle": 1e-6 * n})
    for n in (5, 20, 80)
]


def test_points_are_the_table_and_legends_have_the_exponents() -> None:
    figure = draw_growth(TABLE)
    lengths, angles = panel(figure, "lengths"), panel(figure, "angles")
    assert all(count > 200 for count in ink(figure).values())
    for axes, number, expected in (
        (lengths, 0, 0.1 * np.sqrt([5, 20, 80])),
        (lengths, 1, [0.2] * 3),
        (angles, 0, [5, 20, 80]),
    ):
        np.testing.assert_allclose(
            axes.lines[number].get_xydata(), np.column_stack([[5, 20, 80], expected]), rtol=1e-14
        )
    assert {"positioning ~ steps^0.50", "straightness ~ steps^0.00", "angle ~ steps^1.00", "squareness"} <= {
        *texts(figure)
    }


def test_legends_stay_clear_of_titles() -> None:
    figure = draw_growth(TABLE)
    figure.draw_without_rendering()
    for axes in figure.axes:
        title = axes._left_title.get_window_extent()
        assert axes.get_legend().get_window_extent().x0 > title.x1


def test_file_of_observe_gives_the_same_table(tmp_path: Path) -> None:
    known = sd.parse_scenario(SCENARIO).known
    table = prospects(known, [2, 10])
    (tmp_path / "steps.csv").write_text(prospect_csv(table))
    for read, expected in zip(read_steps(tmp_path / "steps.csv"), table, strict=True):
        assert (read.steps, read.mirror) == (expected.steps, expected.mirror)
        assert read.largest == pytest.approx(expected.largest, rel=1e-15)  # a rounding each way between rad and µrad


def test_nothing_to_draw_is_a_mistake(tmp_path: Path) -> None:
    with pytest.raises(sd.InvalidArgument, match="nothing is determined"):
        draw_growth([Prospect(5, (1.0, 1.0), {}, "no line moves X")])
    text = prospect_csv(TABLE).replace("\n20,", "\n20.5,")
    (tmp_path / "steps.csv").write_text(text)
    with pytest.raises(
        sd.InvalidArgument, match=r"steps.csv, line 3: steps: expected a whole number above 0, got '20.5'"
    ):
        read_steps(tmp_path / "steps.csv")


def test_observation_shows_the_growth_and_marks_its_own_plan() -> None:
    scenario = sd.parse_scenario(SCENARIO)
    run, found = sd.observe(scenario)
    figure = draw_observation(run, found, scenario.known, table=TABLE)
    assert panel(figure, "lengths").lines[-1].get_xdata() == [5, 5]
    assert "this plan: 5 steps" in texts(figure)
