"""LinuxCNC with stepdiagkins sends the joints where the tool is then right, and says where the tool is."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from linuxcnc_machine import CHAIN, KINS, TOOL, VOLUME, distances, random_points

from stepdiag import Compensator, Machine
from stepdiag.linuxcnc.session import LinuxcncSession

# Numbers of some hundred mm have 6e-14 mm between neighbours; LinuxCNC's planner and interpolation add a few of these.
ARITHMETIC = 1e-11
PROMISED = 1e-9  # mm: issue 6, item 2


@pytest.fixture(scope="module")
def session(table: Path) -> Iterator[LinuxcncSession]:
    with LinuxcncSession(table=table, chain=CHAIN) as session:
        yield session


def test_joints_are_the_commands_of_the_compensator(session: LinuxcncSession, table: Path) -> None:
    points = random_points(20)
    joints = session.visit(points)
    assert np.abs(joints - Compensator(table, CHAIN).command(points)).max() < ARITHMETIC


def test_the_tool_of_a_machine_with_these_errors_is_where_it_was_sent(session: LinuxcncSession, truth: Machine) -> None:
    points = random_points(20, seed=2)
    joints = np.array(session.visit(points))
    assert distances(joints - points).max() > 0.01  # uncompensated it would not be
    assert distances(joints + truth.error(joints) - points).max() < PROMISED


@pytest.mark.parametrize("point", [(0, 0, 0), VOLUME, (0, 300, 200), (123.456, 1e-3, 199.999)])
def test_the_position_reported_is_the_position_commanded(session: LinuxcncSession, point: tuple[float, ...]) -> None:
    session.mdi("G53 G0 X{} Y{} Z{}".format(*point))
    assert np.abs(np.array(session.position()) - point).max() < PROMISED


def test_a_machine_turned_off_and_on_is_where_it_was(session: LinuxcncSession) -> None:
    session.mdi("G53 G0 X10 Y20 Z30")
    joints = session.joints()
    session.turn_off()
    session.turn_on()
    assert session.joints() == joints
    assert np.abs(np.array(session.position()) - (10, 20, 30)).max() < PROMISED


def test_pins_say_the_error_and_the_correction_where_the_machine_stands(
    session: LinuxcncSession, truth: Machine
) -> None:
    session.mdi("G53 G0 X200 Y100 Z150")
    joints = np.array(session.joints())
    error = np.array(session.pins([f"{KINS}error-{axis}" for axis in "xyz"]))
    correction = np.array(session.pins([f"{KINS}correction-{axis}" for axis in "xyz"]))
    assert np.abs(error - truth.error([joints])).max() < PROMISED
    assert np.abs(correction - (joints - (200, 100, 150))).max() < PROMISED
    assert session.pins([KINS + name for name in ("enable", "inside", "status", "applied")]) == [True, True, 0, 1.0]
    assert session.pins([f"{KINS}tool-{axis}" for axis in "xyz"]) == list(TOOL)


def test_the_table_id_is_the_fingerprint(session: LinuxcncSession, table: Path) -> None:
    low, high = session.pins([KINS + "table-id-low", KINS + "table-id-high"])
    assert int(high) << 32 | int(low) == Compensator(table, CHAIN).fingerprint != 0


def test_a_target_that_is_only_checked_does_not_show_at_the_pins(session: LinuxcncSession) -> None:
    session.mdi("G53 G0 X50 Y60 Z70")
    session.joints()
    names = [f"{KINS}{what}-{axis}" for what in ("error", "correction") for axis in "xyz"]
    before = session.pins(names)
    with pytest.raises(Exception, match="would exceed"):
        session.mdi("G53 G0 X20000")
    session.joints()
    assert session.pins(names) == before


def test_a_jog_in_joint_mode_moves_one_joint_alone(session: LinuxcncSession, truth: Machine) -> None:
    session.mdi("G53 G0 X100 Y100 Z100")
    before = np.array(session.joints())
    session.jog_joint(1, 25.0)
    after = np.array(session.joints())
    assert np.abs(after - before - (0, 25, 0)).max() < 1e-5  # where LinuxCNC's planner for single joints stops
    assert np.abs(after - before)[[0, 2]].max() < ARITHMETIC
    assert np.abs(np.array(session.position()) - after - truth.error([after])).max() < PROMISED
    session.mdi("G53 G0 X100 Y100 Z100")  # and back in world coordinates
    assert np.abs(np.array(session.joints()) - before).max() < ARITHMETIC
