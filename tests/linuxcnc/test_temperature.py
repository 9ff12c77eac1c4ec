"""Temperatures of the scales at the pins: the joints follow them slowly, and a sensor that fails moves nothing."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from linuxcnc_machine import CHAIN, EXPANSION, KINS, TOOL, distances

from stepdiag import Compensator, Machine
from stepdiag.linuxcnc.session import LinuxcncSession

ARITHMETIC = 1e-11  # mm: see test_kinematics.py
PROMISED = 1e-9  # mm
PERIOD = 1e-3  # s
RATE = 10.0  # K/s
TEMPERATURE = 16  # flag of the status
POINT = (350.0, 130.0, 90.0)
WARM = (24.5, 23.25, 18.0)
SENSORS = [f"{KINS}temperature-{axis}" for axis in "xyz"]
APPLIED = [f"{KINS}temperature-applied-{axis}" for axis in "xyz"]
JOINTS = [f"joint.{j}.motor-pos-cmd" for j in range(3)]


@pytest.fixture(scope="module")
def session(warm_table: Path) -> Iterator[LinuxcncSession]:
    options = {"temperatures": "10,35", "temperature_rate": RATE, "ramp": 0}
    with LinuxcncSession(table=warm_table, chain=CHAIN, options=options, record=[*JOINTS, APPLIED[0]]) as session:
        yield session


@pytest.fixture(autouse=True)
def begin(request: pytest.FixtureRequest) -> None:
    if "session" in request.fixturenames:
        session = request.getfixturevalue("session")
        state(session, WARM)
        session.set_pin(KINS + "temperature-enable", False)
        wait_for(session, (20.0, 20.0, 20.0))
        session.mdi("G53 G0 X{} Y{} Z{}".format(*POINT))


def state(session: LinuxcncSession, temperature: tuple[float, ...]) -> None:
    for pin, value in zip(SENSORS, temperature, strict=True):
        session.set_pin(pin, value)


def wait_for(session: LinuxcncSession, temperature: tuple[float, ...]) -> None:
    for pin, value in zip(APPLIED, temperature, strict=True):
        session.wait_for_pin(pin, value)


def command(table: Path, temperature: tuple[float, ...] | None) -> np.ndarray:
    return Compensator(table, CHAIN, temperatures=(10.0, 35.0)).command([POINT], temperature=temperature)[0]


def test_off_unless_it_is_turned_on(session: LinuxcncSession, table: Path) -> None:
    assert np.abs(np.array(session.joints()) - Compensator(table, CHAIN).command([POINT])[0]).max() < ARITHMETIC
    assert session.pins(APPLIED) == [20.0, 20.0, 20.0]
    assert session.pins([KINS + "temperature-fault", KINS + "status"]) == [False, 0]


def test_the_tool_of_a_machine_with_warm_scales_is_where_it_was_sent(
    session: LinuxcncSession, warm_table: Path, truth: Machine
) -> None:
    session.set_pin(KINS + "temperature-enable", True)
    wait_for(session, WARM)
    joints = np.array(session.joints())
    assert np.abs(joints - command(warm_table, WARM)).max() < ARITHMETIC
    _, actual = truth.pose([joints], expansion=EXPANSION.shift(joints, WARM))
    assert distances(actual - TOOL - POINT) < PROMISED
    assert distances(joints - command(warm_table, None)) > 0.01  # 10 µm in X alone
    assert np.abs(np.array(session.position()) - POINT).max() < PROMISED
    error = session.pins([f"{KINS}error-{axis}" for axis in "xyz"])
    assert np.abs(error - (actual[0] - TOOL - joints)).max() < PROMISED
    session.set_pin(KINS + "temperature-enable", False)
    wait_for(session, (20.0, 20.0, 20.0))
    assert np.abs(np.array(session.joints()) - command(warm_table, None)).max() < ARITHMETIC


def test_a_sensor_that_jumps_moves_the_joints_slowly(session: LinuxcncSession, warm_table: Path) -> None:
    cold = np.array(session.joints())
    before = len(session.recorded())
    session.set_pin(KINS + "temperature-enable", True)
    wait_for(session, WARM)
    session.set_pin(SENSORS[0], 30.0)
    wait_for(session, (30.0, *WARM[1:]))
    session.joints()
    rows = np.array(session.recorded()[before:])
    joint, applied = rows[:, 1], rows[:, 4]
    # 10 K in 1 s. Periods of a simulated machine may come late: then steps are longer, and there are fewer.
    steps = np.diff(applied)
    assert np.all(steps >= 0.0)
    assert np.count_nonzero(steps) > 0.5 * 10.0 / (RATE * PERIOD)
    assert steps.max() < 1.0  # of 10 K
    end = command(warm_table, (30.0, *WARM[1:]))
    assert abs(joint[-1] - end[0]) < 1e-6
    assert abs(end[0] - cold[0]) > 0.02
    assert np.abs(np.diff(joint)).max() < 0.1 * abs(end[0] - cold[0])


@pytest.mark.parametrize("reading", [float("nan"), float("inf"), 35.01, 9.99, -127.0, 850.0])
def test_a_sensor_that_fails_holds_its_axis(session: LinuxcncSession, warm_table: Path, reading: float) -> None:
    session.set_pin(KINS + "temperature-enable", True)
    wait_for(session, WARM)
    session.set_pin(SENSORS[1], reading)
    session.set_pin(SENSORS[2], 19.0)  # a good sensor goes on
    session.wait_for_pin(KINS + "temperature-fault", True)
    held = (*WARM[:2], 19.0)
    wait_for(session, held)
    assert session.pin(KINS + "status") == TEMPERATURE
    assert np.abs(np.array(session.joints()) - command(warm_table, held)).max() < ARITHMETIC
    session.mdi("G53 G0 X10 Y10 Z10")  # the machine works on
    session.set_pin(SENSORS[1], WARM[1])
    session.wait_for_pin(KINS + "temperature-fault", False)
    assert session.pin(KINS + "status") == 0
