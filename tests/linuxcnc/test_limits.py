"""Outside the calibrated volume, at limits, and with corrections that are cut: what the integrator chose."""

import time
from pathlib import Path

import numpy as np
import pytest
from linuxcnc_machine import CHAIN, KINS, VOLUME, distances

from stepdiag import Compensator
from stepdiag.linuxcnc.session import LinuxcncError, LinuxcncSession

ARITHMETIC = 1e-11  # mm: see test_kinematics.py
OUTSIDE, REFUSED, CAPPED = 1, 4, 2
BEYOND = (-8.0, 100.0, 205.0)
FAR = (-30.0, 100.0, 100.0)


def expected(table: Path, point: tuple[float, ...], **options: object) -> np.ndarray:
    return Compensator(table, CHAIN, **options).command([point])[0]  # type: ignore[arg-type]


def test_hold(table: Path) -> None:
    with LinuxcncSession(table=table, chain=CHAIN) as session:
        for point in (BEYOND, FAR):
            joints = session.visit([point])[0]
            assert np.abs(joints - expected(table, point)).max() < ARITHMETIC
            assert np.abs(np.array(session.position()) - point).max() < 1e-9
            assert session.pins([KINS + "inside", KINS + "status"]) == [False, OUTSIDE]
        session.mdi("G53 G0 X10 Y10 Z10")
        session.joints()
        assert session.pins([KINS + "inside", KINS + "status"]) == [True, 0]


def test_linear_goes_on_up_to_its_margin(table: Path) -> None:
    with LinuxcncSession(table=table, chain=CHAIN, options={"outside": "linear", "margin": 10}) as session:
        joints = session.visit([BEYOND])[0]
        assert np.abs(joints - expected(table, BEYOND, outside="linear", margin=10.0)).max() < ARITHMETIC
        assert distances(joints - expected(table, BEYOND)) > 1e-4  # which is hold
        with pytest.raises(LinuxcncError, match="fails kinematicsInverse"):
            session.mdi("G53 G0 X{} Y{} Z{}".format(*FAR))
        assert np.abs(np.array(session.joints()) - joints).max() < ARITHMETIC  # it has not moved
        assert int(session.pin(KINS + "refusals")) > 0


def test_refuse_says_so_and_does_not_move(table: Path, tmp_path: Path) -> None:
    with LinuxcncSession(table=table, chain=CHAIN, options={"outside": "refuse"}) as session:
        joints = session.visit([VOLUME])[0]  # the very corner is inside
        with pytest.raises(LinuxcncError, match="fails kinematicsInverse"):
            session.mdi("G53 G0 X-0.1")
        program = tmp_path / "outside.ngc"
        program.write_text("G21 G90 F3000\nG53 G1 X100 Y100 Z100\nG53 G1 Z250\nM2\n", encoding="ascii")
        with pytest.raises(LinuxcncError, match="fails kinematicsInverse"):
            session.run_program(program)
        session.abort()
        session.mdi("G53 G0 X{} Y{} Z{}".format(*VOLUME))
        assert np.abs(np.array(session.joints()) - joints).max() < ARITHMETIC


def test_an_arc_that_leaves_the_volume_stops_at_its_edge(table: Path) -> None:
    """Only the end points of a move are checked beforehand: the machine goes off where the volume ends."""
    with LinuxcncSession(table=table, chain=CHAIN, options={"outside": "refuse"}) as session:
        session.mdi("G53 G0 X30 Y100 Z100")
        with pytest.raises(LinuxcncError, match="kinematicsInverse failed"):
            session.mdi("G90 G17 G2 X30 Y200 I0 J50 F3000")
        end = time.monotonic() + 10.0
        while session.state()["on"]:
            assert time.monotonic() < end
        where = session.state()["joint_position"]
        assert -0.1 < where[0] < 1.0
        session.turn_on(home=False)
        session.jog_joint(0, 20.0)  # by its joints it can be moved back in
        session.mdi("G53 G0 X50 Y100 Z100")


def test_a_machine_outside_is_moved_back_by_its_joints(table: Path) -> None:
    with LinuxcncSession(table=table, chain=CHAIN, options={"outside": "refuse"}) as session:
        session.mdi("G53 G0 X10 Y10 Z10")
        session.jog_joint(0, -15.0, world=False)
        assert session.pins([KINS + "inside", KINS + "status"]) == [False, OUTSIDE | REFUSED]
        assert session.position() == session.joints()  # no answer: the world is the joints
        session.jog_joint(0, 20.0)
        session.mdi("G53 G0 X20 Y10 Z10")
        assert np.abs(np.array(session.position()) - (20.0, 10.0, 10.0)).max() < 1e-9


def test_a_correction_is_cut_to_its_largest_length(table: Path) -> None:
    point = (200.0, 150.0, 100.0)
    with LinuxcncSession(table=table, chain=CHAIN, options={"largest_correction": 0.005}) as session:
        joints = np.array(session.visit([point])[0])
        assert abs(distances(joints - point)[0] - 0.005) < ARITHMETIC
        assert np.abs(joints - expected(table, point, largest_correction=0.005)).max() < ARITHMETIC
        assert np.abs(np.array(session.position()) - point).max() < 1e-9
        assert session.pin(KINS + "status") == CAPPED
        assert distances([session.pins([f"{KINS}error-{axis}" for axis in "xyz"])]) > 0.005  # all of it


def test_the_origin_is_where_the_volume_begins(table: Path) -> None:
    with LinuxcncSession(table=table, chain=CHAIN, options={"origin": "-50,-300,-200.5"}) as session:
        point = (-10.0, -200.0, -100.0)
        joints = np.array(session.visit([point])[0])
        assert np.abs(joints - expected(table, point, origin=(-50.0, -300.0, -200.5))).max() < ARITHMETIC
        inside = np.add(point, (50.0, 300.0, 200.5))
        assert np.abs(joints - point - (expected(table, tuple(inside)) - inside)).max() < ARITHMETIC


def test_soft_limits_of_joints_count_for_the_compensated_position(table: Path) -> None:
    limits = {f"JOINT_{j}": {"MIN_LIMIT": -500.0, "MAX_LIMIT": 200.0} for j in range(3)}
    with LinuxcncSession(table=table, chain=CHAIN, ini=limits) as session:
        correction = np.array(session.visit([(199.0, 199.0, 199.0)])[0]) - 199.0
        axis = int(np.argmax(correction))
        assert correction[axis] > 1e-3
        with pytest.raises(LinuxcncError, match=f"would exceed joint {axis}'s positive limit"):
            session.mdi("G53 G0 X200 Y200 Z200")


def test_joints_may_be_two_for_an_axis_and_further_axes_pass(table: Path) -> None:
    more = {
        "KINS": {"JOINTS": 5},
        "TRAJ": {"COORDINATES": "XYYZC"},
        "AXIS_C": {"MIN_LIMIT": -360, "MAX_LIMIT": 360, "MAX_VELOCITY": 1000, "MAX_ACCELERATION": 1e5},
        **{f"JOINT_{j}": dict(LINEAR) for j in (3,)},
        "JOINT_4": {**LINEAR, "TYPE": "ANGULAR"},
    }
    loops = [f"net joint-{j} joint.{j}.motor-pos-cmd => joint.{j}.motor-pos-fb" for j in (3, 4)]
    with LinuxcncSession(table=table, chain=CHAIN, options={"coordinates": "XYYZC"}, ini=more, hal=loops) as session:
        session.mdi("G53 G0 X100 Y110 Z120 C30")
        joints = session.joints()
        x, y, z = expected(table, (100.0, 110.0, 120.0))
        assert np.abs(np.array(joints) - (x, y, y, z, 30.0)).max() < ARITHMETIC
        assert np.abs(np.array(session.position()) - (100.0, 110.0, 120.0)).max() < 1e-9


LINEAR = {
    "TYPE": "LINEAR", "MIN_LIMIT": -10000, "MAX_LIMIT": 10000, "MAX_VELOCITY": 1000, "MAX_ACCELERATION": 1e5,
    "FERROR": 1000, "MIN_FERROR": 1000, "HOME": 0, "HOME_OFFSET": 0, "HOME_SEARCH_VEL": 0, "HOME_LATCH_VEL": 0,
    "HOME_SEQUENCE": 0,
}  # fmt: skip
