"""The order in which a run is measured is a list written by hand; what is simulated, asked for and timed follows it."""

from pathlib import Path

import numpy as np
import pytest

from stepdiag.scenario.description import Scenario, read_scenario, simulate_scenario
from stepdiag.scenario.known import runs_of
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.scenario.planned_readings import empty_sheet

SCENARIO = """
[volume]
x_mm = 2.0
y_mm = 4.0
z_mm = 6.0
[machine]
chain = "[w X' b Y Z t]"
[plan]
lines = ["ppp", "n0p"]
steps = 1
scale_lines = ["0n0"]
{plan}
[head]
layout = "ideal"
"""

# Line, run, direction; point: x y z of each reading.
ONCE = """
ppp 0 forward  0: 0 0 0, 1: 2 0 0, 2: 2 4 0, 3: 2 4 6
n0p 0 forward  0: 2 0 0, 1: 0 0 0, 2: 0 0 6
0n0 0 forward  0: 0 4 0, 1: 0 0 0
"""
BACKWARD = """
ppp 0 forward  0: 0 0 0, 1: 2 0 0, 2: 2 4 0, 3: 2 4 6
ppp 1 backward 3: 2 4 6, 2: 2 4 0, 1: 2 0 0, 0: 0 0 0
n0p 0 forward  0: 2 0 0, 1: 0 0 0, 2: 0 0 6
n0p 1 backward 2: 0 0 6, 1: 0 0 0, 0: 2 0 0
0n0 0 forward  0: 0 4 0, 1: 0 0 0
0n0 1 backward 1: 0 0 0, 0: 0 4 0
"""
TWO_ORDERS_TWICE = """
ppp 0 forward  0: 0 0 0, 1: 2 0 0, 2: 2 4 0, 3: 2 4 6
ppp 1 forward  0: 0 0 0, 1: 0 0 6, 2: 2 0 6, 3: 2 4 6
ppp 2 forward  0: 0 0 0, 1: 2 0 0, 2: 2 4 0, 3: 2 4 6
ppp 3 forward  0: 0 0 0, 1: 0 0 6, 2: 2 0 6, 3: 2 4 6
n0p 0 forward  0: 2 0 0, 1: 0 0 0, 2: 0 0 6
n0p 1 forward  0: 2 0 0, 1: 2 0 6, 2: 0 0 6
n0p 2 forward  0: 2 0 0, 1: 0 0 0, 2: 0 0 6
n0p 3 forward  0: 2 0 0, 1: 2 0 6, 2: 0 0 6
0n0 0 forward  0: 0 4 0, 1: 0 0 0
0n0 1 forward  0: 0 4 0, 1: 0 0 0
0n0 2 forward  0: 0 4 0, 1: 0 0 0
0n0 3 forward  0: 0 4 0, 1: 0 0 0
"""
TWO_ORDERS_BACKWARD = """
ppp 0 forward  0: 0 0 0, 1: 2 0 0, 2: 2 4 0, 3: 2 4 6
ppp 1 backward 3: 2 4 6, 2: 2 4 0, 1: 2 0 0, 0: 0 0 0
ppp 2 forward  0: 0 0 0, 1: 0 0 6, 2: 2 0 6, 3: 2 4 6
ppp 3 backward 3: 2 4 6, 2: 2 0 6, 1: 0 0 6, 0: 0 0 0
n0p 0 forward  0: 2 0 0, 1: 0 0 0, 2: 0 0 6
n0p 1 backward 2: 0 0 6, 1: 0 0 0, 0: 2 0 0
n0p 2 forward  0: 2 0 0, 1: 2 0 6, 2: 0 0 6
n0p 3 backward 2: 0 0 6, 1: 2 0 6, 0: 2 0 0
0n0 0 forward  0: 0 4 0, 1: 0 0 0
0n0 1 backward 1: 0 0 0, 0: 0 4 0
0n0 2 forward  0: 0 4 0, 1: 0 0 0
0n0 3 backward 1: 0 0 0, 0: 0 4 0
"""

Row = tuple[str, int, str, int, tuple[float, float, float]]


def rows_of(text: str) -> list[list[Row]]:
    """The rows of each pass."""
    passes = []
    for pass_text in text.strip().splitlines():
        line, run, direction, points = pass_text.split(maxsplit=3)
        rows: list[Row] = []
        for point in points.split(","):
            number, position = point.split(":")
            x, y, z = map(float, position.split())
            rows.append((line, int(run), direction, int(number), (x, y, z)))
        passes.append(rows)
    return passes


def scenario_of(tmp_path: Path, plan: str) -> Scenario:
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO.format(plan=plan))
    return read_scenario(path)


@pytest.mark.parametrize(
    ("plan", "written"),
    [
        ("", ONCE),
        ("backward = true", BACKWARD),
        ('order = ["XYZ", "ZXY"]\nrepeats = 2', TWO_ORDERS_TWICE),
        ('order = ["XYZ", "ZXY"]\nbackward = true', TWO_ORDERS_BACKWARD),
    ],
)
def test_a_run_goes_in_the_order_of_the_list(tmp_path: Path, plan: str, written: str) -> None:
    scenario = scenario_of(tmp_path, plan)
    expected = rows_of(written)
    visits = list(visits_of(scenario.known))
    assert [visit.number for visit in visits] == list(range(1, len(expected) + 1))
    assert [visit.set_up for visit in visits] == [["ppp", "n0p", "0n0"].index(visit.line) + 1 for visit in visits]
    assert [visit.is_scale_line for visit in visits] == [visit.line == "0n0" for visit in visits]
    found = [
        [
            (visit.line, visit.run, visit.direction, int(point), tuple(map(float, position)))
            for point, position in zip(visit.points, visit.positions, strict=True)
        ]
        for visit in visits
    ]
    assert found == expected

    rows = [row for rows in expected for row in rows]
    known = scenario.known
    keys = known.keys.plan
    sheet = empty_sheet(known.plan, known.signals, repeats=runs_of(keys), backward=keys.backward)
    for run in (simulate_scenario(scenario), sheet):
        assert run.line == [row[0] for row in rows]
        assert list(run.run) == [row[1] for row in rows]
        assert run.direction == [row[2] for row in rows]
        assert list(run.point) == [row[3] for row in rows]
        assert np.array_equal(run.position, [row[4] for row in rows])


def test_axes_come_to_a_point_as_the_line_travels(tmp_path: Path) -> None:
    approach = {
        (v.line, v.direction): list(v.approach) for v in visits_of(scenario_of(tmp_path, "backward = true").known)
    }
    assert approach["n0p", "forward"] == [-1, 1, 1]
    assert approach["n0p", "backward"] == [1, 1, -1]
    assert approach["0n0", "backward"] == [1, 1, 1]
