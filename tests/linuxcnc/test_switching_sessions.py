"""Switching, each in a session of its own: slow ramps, off from the start, errors that are large."""

from pathlib import Path

import numpy as np
import pytest
from linuxcnc_machine import CHAIN, KINS, TOOL, VOLUME, distances, make_errors

from stepdiag import Machine
from stepdiag.linuxcnc.session import LinuxcncSession

PERIOD = 1e-3  # s
PROMISED = 1e-9  # mm
POINT = (250.0, 130.0, 90.0)


def test_half_way_of_a_slow_ramp_forward_undoes_inverse(table: Path, truth: Machine) -> None:
    with LinuxcncSession(table=table, chain=CHAIN, options={"ramp": 60}) as session:
        session.mdi("G53 G0 X{} Y{} Z{}".format(*POINT))
        full = np.array(session.joints()) - POINT
        session.set_pin(KINS + "enable", False)
        session.wait_for_pin(KINS + "enable", False)
        worst = 0.0
        for _ in range(40):
            joints = session.joint_commands()
            worst = max(worst, float(distances(np.array(session.state()["actual_position"][:3]) - POINT)[0]))
        assert 0.0 < distances(np.array(joints) - POINT)[0] < distances(full)[0]
        # 5 periods of a ramp whose speed is at most 1.5 correction / ramp; 100 where periods come late.
        assert worst < 100 * PERIOD * 1.5 * distances(full)[0] / 60


@pytest.mark.parametrize("corner", [(0.0, 0.0, 0.0), VOLUME, (0.0, VOLUME[1], 0.0)])
def test_a_ramp_at_the_edge_of_the_volume_is_not_refused(corner: tuple[float, ...], table: Path) -> None:
    with LinuxcncSession(table=table, chain=CHAIN, options={"ramp": 1.5, "outside": "refuse"}) as session:
        session.mdi("G53 G0 X{} Y{} Z{}".format(*corner))
        session.set_pin(KINS + "enable", False)
        session.wait_for_pin(KINS + "applied", 0.0)
        session.joints()
        assert session.pins([KINS + "inside", KINS + "status"]) == [True, 0]
        session.set_pin(KINS + "enable", True)
        session.wait_for_pin(KINS + "applied", 1.0)
        session.joints()
        assert session.pins([KINS + "inside", KINS + "status"]) == [True, 0]
        assert session.state()["on"]
        assert np.abs(np.array(session.position()) - corner).max() < PROMISED


def test_compensation_off_from_the_start(table: Path) -> None:
    with LinuxcncSession(table=table, chain=CHAIN, hal=[f"setp {KINS}enable 0"]) as session:
        session.mdi("G53 G0 X100 Y100 Z100")
        assert np.abs(np.array(session.joints()) - 100.0).max() < PROMISED
        assert session.pin(KINS + "applied") == 0.0


def test_both_directions_agree_for_errors_ten_times_larger(tmp_path: Path) -> None:
    """Of some tenths of a mm, with slopes near those that are refused: the inverse has to iterate."""
    errors = make_errors(scale=10.0)
    path = tmp_path / "large.csv"
    errors.write(path, chain=CHAIN, volume=VOLUME, tool=TOOL)
    machine = Machine(CHAIN, errors, TOOL)
    with LinuxcncSession(
        table=path, chain=CHAIN, options={"largest_correction": 10, "outside": "linear", "margin": 20}
    ) as s:
        for point in ((100.0, 100.0, 100.0), (333.0, 222.0, 111.0)):
            s.mdi("G53 G0 X{} Y{} Z{}".format(*point))
            joints = np.array(s.joints())
            assert distances(joints - point) > 0.05
            assert distances(joints + machine.error([joints]) - point) < PROMISED
            assert np.abs(np.array(s.position()) - point).max() < PROMISED
