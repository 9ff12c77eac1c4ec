"""LinuxCNC's own interpreter makes of a measuring program the plan's points, from the stated sides.

`rs274 -g` needs no controller. It prints every motion as a canonical command with four decimals, in mm.
"""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from stepdiag.program.gcode import Trigger
from stepdiag.program.measuring_program import measuring_program
from stepdiag.program.options import Options
from stepdiag.scenario.description import parse_scenario
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import visits_of

pytestmark = pytest.mark.skipif(shutil.which("rs274") is None, reason="rs274 is part of linuxcnc-uspace")

SCENARIO = """
[volume]
x_mm = 800.0
y_mm = 600.0
z_mm = 500.0
[machine]
chain = "[w X' b Y Z t]"
[plan]
lines = {lines}
steps = {steps}
scale_lines = {scale_lines}
{plan}
[head]
layout = "ideal"
"""
BODY, FACES = '["ppp", "npp", "pnp", "nnp", "pnn"]', '["pp0", "np0", "p0p", "n0p", "0pp", "0np"]'
PLANS = pytest.mark.parametrize(
    ("lines", "scale_lines", "steps", "plan"),
    [
        (BODY, '["p00", "0p0", "00n"]', 50, ""),
        (FACES, '["p00"]', 7, ""),
        ('["00p", "n00"]', "[]", 9, "repeats = 2"),
        (BODY, '["p00"]', 6, 'order = ["XYZ", "ZXY", "YXZ"]\nbackward = true'),
        (FACES, "[]", 10, 'order = "ZYX"\nbackward = true\nrepeats = 2'),
    ],
)
PRINTED = 0.51e-4  # mm: four decimals


def interpret(program: str, folder: Path) -> list[tuple[str, str]]:
    """Canonical commands: name and arguments."""
    (folder / "run.ngc").write_text(program)
    done = subprocess.run(
        ["rs274", "-g", "run.ngc"], cwd=folder, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    commands = re.findall(r"^ *\d+ N\S+ +([A-Z0-9_]+)\((.*)\)$", done.stdout, re.MULTILINE)
    assert any(name == "PROGRAM_END" for name, _ in commands), done.stdout[-2000:]
    return commands


def scenario_of(lines: str, scale_lines: str, steps: int, plan: str) -> Known:
    return parse_scenario(SCENARIO.format(lines=lines, scale_lines=scale_lines, steps=steps, plan=plan)).known


def readings_of(
    commands: list[tuple[str, str]], reading: str
) -> tuple[list[np.ndarray], list[np.ndarray], list[tuple[int, int]]]:
    """Positions, the sides from which the axes came, and names (visit, point), at each command that is a reading."""
    place, came, name = np.zeros(3), np.zeros(3), [0, 0]
    positions, sides, names = [], [], []
    for command, arguments in commands:
        if command in ("STRAIGHT_FEED", "STRAIGHT_TRAVERSE"):
            there = np.array([float(value) for value in arguments.split(",")[:3]])
            came = np.where(there != place, np.sign(there - place), came)
            place = there
        elif command == "SET_AUX_OUTPUT_VALUE":
            output, value = arguments.split(",")
            name[int(output)] = round(float(value))
        elif command == reading:
            positions.append(place)
            sides.append(came)
            names.append((name[0], name[1]))
    return positions, sides, names


@PLANS
def test_the_interpreter_reads_the_plans_points_in_order(
    tmp_path: Path, lines: str, scale_lines: str, steps: int, plan: str
) -> None:
    scenario = scenario_of(lines, scale_lines, steps, plan)
    commands = interpret(measuring_program(scenario, Options()).text, tmp_path)
    positions, sides, names = readings_of(commands, "SET_AUX_OUTPUT_BIT")
    visits = list(visits_of(scenario))
    expected = np.concatenate([visit.positions for visit in visits])
    np.testing.assert_allclose(positions, expected, rtol=0.0, atol=PRINTED)
    np.testing.assert_array_equal(sides, [visit.approach for visit in visits for _ in visit.points])
    assert names == [(visit.number, int(point)) for visit in visits for point in visit.points]
    assert [name for name, _ in commands].count("PROGRAM_STOP") == 2 * visits[-1].set_up


@PLANS
def test_the_interpreter_takes_iso_programs_too(
    tmp_path: Path, lines: str, scale_lines: str, steps: int, plan: str
) -> None:
    scenario, origin = scenario_of(lines, scale_lines, steps, plan), (-20.0, 5.25, -600.0)
    program = measuring_program(scenario, Options(dialect="iso", origin=origin, line_numbers=True))
    positions, sides, _ = readings_of(interpret(program.text, tmp_path), "DWELL")
    visits = list(visits_of(scenario))
    expected = np.concatenate([visit.positions for visit in visits]) + origin
    np.testing.assert_allclose(positions, expected, rtol=0.0, atol=2 * PRINTED)  # the program has four decimals as well
    np.testing.assert_array_equal(sides, [visit.approach for visit in visits for _ in visit.points])


@pytest.mark.parametrize(("trigger", "reading"), [("pulse", "SET_AUX_OUTPUT_BIT"), ("dwell", "DWELL")])
def test_the_other_triggers_are_at_the_same_points(tmp_path: Path, trigger: Trigger, reading: str) -> None:
    scenario, origin = scenario_of(BODY, '["p00"]', 5, "backward = true"), (10.0, 0.0, -5.0)
    program = measuring_program(scenario, Options(trigger=trigger, coordinates="G55", origin=origin))
    positions, sides, _ = readings_of(interpret(program.text, tmp_path), reading)
    visits = list(visits_of(scenario))
    expected = np.concatenate([visit.positions for visit in visits]) + origin
    np.testing.assert_allclose(positions, expected, rtol=0.0, atol=PRINTED)
    np.testing.assert_array_equal(sides, [visit.approach for visit in visits for _ in visit.points])
