"""The order of visits is that of a simulated run."""

from pathlib import Path

import numpy as np
import pytest

from stepdiag.scenario.description import read_scenario, simulate_scenario
from stepdiag.scenario.order_of_run import visits_of

SCENARIO = """
[volume]
x_mm = 80.0
y_mm = 60.0
z_mm = 50.0
[machine]
chain = "[w X' b Y Z t]"
[plan]
lines = ["ppp", "nnp", "p0p"]
steps = 4
scale_lines = ["00n"]
{plan}
[head]
layout = "ideal"
"""


@pytest.mark.parametrize(
    "plan", ["", "backward = true", 'order = ["XYZ", "ZXY"]\nrepeats = 2', 'order = ["XYZ", "ZXY"]\nbackward = true']
)
def test_visits_go_in_the_order_of_a_simulated_run(tmp_path: Path, plan: str) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO.format(plan=plan))
    scenario = read_scenario(path)
    run = simulate_scenario(scenario)
    visits = list(visits_of(scenario.known))
    assert [visit.number for visit in visits] == list(range(1, len(visits) + 1))
    assert [v.line for v in visits for _ in v.points] == run.line
    assert [v.direction for v in visits for _ in v.points] == run.direction
    assert [v.run for v in visits for _ in v.points] == list(run.run)
    assert [point for v in visits for point in v.points] == list(run.point)
    assert np.array_equal(np.concatenate([v.positions for v in visits]), run.position)


def test_axes_come_to_a_point_as_the_line_travels(tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO.format(plan="backward = true"))
    approach = {(v.line, v.direction): list(v.approach) for v in visits_of(read_scenario(path).known)}
    assert approach["nnp", "forward"] == [-1, -1, 1]
    assert approach["nnp", "backward"] == [1, 1, -1]
    assert approach["00n", "backward"] == [1, 1, 1]
