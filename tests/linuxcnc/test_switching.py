"""Enabling, disabling and a change of tool move the joints: by ramps, on which both directions agree."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from linuxcnc_machine import CHAIN, KINS, TOOL, distances

from stepdiag import Machine
from stepdiag.linuxcnc.session import LinuxcncSession

PERIOD = 1e-3  # s
PROMISED = 1e-9  # mm
WRITTEN = 1e-6  # mm: recorded with six decimals
JOINTS = [f"joint.{j}.motor-pos-cmd" for j in range(3)]
POINT = (250.0, 130.0, 90.0)
RAMP = 0.5  # s


@pytest.fixture(scope="module")
def session(table: Path) -> Iterator[LinuxcncSession]:
    with LinuxcncSession(
        table=table, chain=CHAIN, options={"ramp": RAMP}, record=[*JOINTS, KINS + "applied"]
    ) as session:
        yield session


@pytest.fixture(autouse=True)
def begin(session: LinuxcncSession) -> None:
    session.set_pin(KINS + "enable", True)
    session.set_pin(KINS + "use-tool", False)
    session.wait_for_pin(KINS + "applied", 1.0)
    session.wait_for_pin(KINS + "tool-z", TOOL[2])
    session.mdi("G53 G0 X{} Y{} Z{}".format(*POINT))


def test_disabled_the_joints_are_the_world(session: LinuxcncSession) -> None:
    session.set_pin(KINS + "enable", False)
    session.wait_for_pin(KINS + "applied", 0.0)
    assert np.abs(np.array(session.joints()) - POINT).max() < PROMISED
    session.mdi("G53 G0 X10.5 Y20.25 Z30.125")
    assert np.abs(np.array(session.joints()) - (10.5, 20.25, 30.125)).max() < PROMISED
    assert session.position() == session.joints()
    assert session.pins([f"{KINS}correction-{axis}" for axis in "xyz"]) == [0.0, 0.0, 0.0]
    assert session.pin(KINS + "error-x") != 0.0  # what the machine has, it still has


def test_switching_is_a_ramp(session: LinuxcncSession) -> None:
    compensated = np.array(session.joints())
    before = len(session.recorded())
    session.set_pin(KINS + "enable", False)
    session.wait_for_pin(KINS + "applied", 0.0)
    session.set_pin(KINS + "enable", True)
    session.wait_for_pin(KINS + "applied", 1.0)
    session.joints()
    rows = np.array(session.recorded()[before:])
    joints, applied = rows[:, 1:4], rows[:, 4]
    # Periods of a simulated machine may come late, and the ramp goes by the clock: then a step is longer, and there are
    # fewer. Their speed is not asserted, but that there are many, small and in proportion.
    count = np.count_nonzero((applied > 0.0) & (applied < 1.0))
    assert RAMP / PERIOD < count < 2.1 * RAMP / PERIOD  # two ramps
    correction = compensated - POINT
    assert np.abs(joints[-1] - compensated).max() < WRITTEN
    # The interpolator is up to 4 periods behind.
    recent = np.lib.stride_tricks.sliding_window_view(applied, 6)
    low, high = recent.min(axis=1)[:, None], recent.max(axis=1)[:, None]
    shares = (joints[5:] - POINT) / correction
    slack = WRITTEN / np.abs(correction)
    assert np.all(shares > low - slack)
    assert np.all(shares < high + slack)


def test_the_world_stands_still_while_the_joints_are_ramped(session: LinuxcncSession) -> None:
    correction = distances(np.array(session.joints()) - POINT)[0]
    session.set_pin(KINS + "enable", False)
    seen = []
    while float(session.pin(KINS + "applied")) > 0.0:
        seen.append(session.state()["actual_position"][:3])
    # What is reported is made of joints that are some periods old: a hundredth of the correction, unless many periods
    # come late. Without the ramp in both directions it would be all of it.
    assert len(seen) > 10
    assert np.median(distances(np.array(seen) - POINT)) < 0.1 * correction
    session.set_pin(KINS + "enable", True)


def test_a_ramp_that_has_begun_is_finished_first(session: LinuxcncSession) -> None:
    before = len(session.recorded())
    session.set_pin(KINS + "enable", False)
    session.mdi("G4 P0.1")
    session.set_pin(KINS + "enable", True)
    session.wait_for_pin(KINS + "applied", 0.0)
    session.wait_for_pin(KINS + "applied", 1.0)
    applied = np.array(session.recorded()[before:])[:, 4]
    turns = np.count_nonzero(np.diff(np.sign(np.diff(applied[np.append(True, np.diff(applied) != 0)]))))
    assert turns == 1  # down, then up


def test_the_tool_of_the_pins_is_compensated(session: LinuxcncSession, truth: Machine) -> None:
    """The pins take motion.tooloffset, which is what LinuxCNC adds to the tool's point to get its origin."""
    session.set_pin(KINS + "tooloffset-x", 3.0)
    session.set_pin(KINS + "tooloffset-z", 50.0)
    session.set_pin(KINS + "use-tool", True)
    session.wait_for_pin(KINS + "tool-z", -50.0)
    joints = np.array(session.joints())
    assert session.pins([f"{KINS}tool-{axis}" for axis in "xyz"]) == [-3.0, 0.0, -50.0]
    tip = Machine(CHAIN, truth.errors, (-3.0, 0.0, -50.0))
    assert distances(joints + tip.error([joints]) - POINT) < PROMISED
    assert distances(joints + truth.error([joints]) - POINT) > 1e-4  # the calibration's tool is longer
    assert np.abs(np.array(session.position()) - POINT).max() < PROMISED


@pytest.mark.parametrize("length", [1000.5, float("nan"), float("inf")])
def test_a_tool_that_cannot_be_is_not_taken(session: LinuxcncSession, length: float) -> None:
    joints = session.joints()
    session.set_pin(KINS + "tooloffset-z", length)
    session.set_pin(KINS + "use-tool", True)
    session.wait_for_pin(KINS + "status", 8)
    assert session.joints() == joints
    assert session.pin(KINS + "tool-z") == TOOL[2]
    session.set_pin(KINS + "use-tool", False)
    session.wait_for_pin(KINS + "status", 0)
    session.set_pin(KINS + "tooloffset-z", 0.0)
