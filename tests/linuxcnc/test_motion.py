"""Programs of lines and arcs run as they do without compensation, on the path that they describe."""

from pathlib import Path

import numpy as np
import pytest
from linuxcnc_machine import CHAIN, KINS, Points, distances

from stepdiag import Machine
from stepdiag.linuxcnc.session import LinuxcncSession

PERIOD = 1e-3  # s
SPEED, ACCELERATION = 100.0, 1000.0  # mm/s, mm/s²
# LinuxCNC's interpolator is a cubic spline that takes of three points in a row 1/6, 4/6 and 1/6: on a curved or
# accelerated path it cuts the corner by up to a T²/6.
SMOOTHING = ACCELERATION * PERIOD**2 / 6
PROGRAM = """\
G21 G90 G17 G61 F6000
G53 G0 X100 Y100 Z50
(MSG, first)
M0
G1 X150 Y130 Z80
G2 X150 Y130 I40 J0
G3 X250 Y130 I50 J0 Z120
(MSG, second)
M0
G1 X300 Y250 Z150
M2
"""


def session_of(table: Path | None, **more: object) -> LinuxcncSession:
    tight = {f"JOINT_{j}": {"FERROR": 1.05 * SPEED * PERIOD, "MIN_FERROR": 1.05 * SPEED * PERIOD} for j in range(3)}
    pins = ["joint.0.motor-pos-cmd", "joint.1.motor-pos-cmd", "joint.2.motor-pos-cmd"]
    return LinuxcncSession(
        table=table, chain=CHAIN if table else None, speed=SPEED, acceleration=ACCELERATION, record=pins, ini=tight
    )


def run(session: LinuxcncSession, folder: Path) -> tuple[Points, list[tuple[int, list[str]]]]:
    """The joints in every servo period of the program, and its stops."""
    program = folder / "program.ngc"
    program.write_text(PROGRAM, encoding="ascii")
    stops: list[tuple[int, list[str]]] = []
    session.mdi("G53 G0 X100 Y100 Z50")
    session.joints()
    before = len(session.recorded())
    session.run_program(program, lambda _, line, messages: stops.append((line, messages)))
    session.joints()
    recorded = np.array(session.recorded()[before - 2 :])
    assert np.all(np.diff(recorded[:, 0]) == 1)  # no servo period is missing
    return recorded[:, 1:], stops


def from_line(points: Points, begin: tuple[float, ...], end: tuple[float, ...]) -> Points:
    a, along = np.array(begin, float), np.array(end, float) - begin
    share = np.clip((points - a) @ along / (along @ along), 0.0, 1.0)
    return distances(points - a - share[:, None] * along)


def from_arc(points: Points, centre: tuple[float, float], radius: float, heights: tuple[float, float]) -> Points:
    """A turn that begins at the angle pi; the height goes with the angle, evenly."""
    x, y = (points[:, :2] - centre).T
    share = (np.arctan2(-y, -x) % (2 * np.pi)) / np.pi  # anticlockwise from the angle pi
    height = heights[0] + (heights[1] - heights[0]) * np.where(share > 1.5, share - 2.0, share)
    return np.hypot(np.hypot(x, y) - radius, points[:, 2] - height)


def distance_from_path(points: Points) -> Points:
    return np.min(
        [
            from_line(points, (100, 100, 50), (150, 130, 80)),
            from_arc(points, (190, 130), 40.0, (80, 80)),
            from_arc(points, (200, 130), 50.0, (80, 120)),
            from_line(points, (250, 130, 120), (300, 250, 150)),
        ],
        axis=0,
    )


@pytest.fixture(scope="module")
def runs(
    table: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, tuple[Points, list[tuple[int, list[str]]]]]:
    folder = tmp_path_factory.mktemp("program")
    found = {}
    for name, used in (("compensated", table), ("plain", None)):
        with session_of(used) as session:
            found[name] = run(session, folder)
            # One motion error, a following error say, would have turned the machine off and raised LinuxcncError.
            assert session.state()["on"]
    return found


def test_a_program_stops_where_it_says_and_goes_on(runs: dict[str, tuple[Points, list[tuple[int, list[str]]]]]) -> None:
    for _, stops in runs.values():
        assert [messages for _, messages in stops] == [["message: first"], ["message: second"]]


def test_the_tool_goes_along_the_lines_and_arcs(
    runs: dict[str, tuple[Points, list[tuple[int, list[str]]]]], truth: Machine
) -> None:
    joints = runs["compensated"][0]
    world = joints + truth.error(joints)
    written = 1e-6  # mm: recorded with six decimals
    assert distance_from_path(joints).max() > 0.01
    assert distance_from_path(world).max() < SMOOTHING + written


def test_joints_move_as_smoothly_as_without_compensation(
    runs: dict[str, tuple[Points, list[tuple[int, list[str]]]]],
) -> None:
    steps, accelerations = {}, {}
    for name, (joints, _) in runs.items():
        velocity = np.diff(joints, axis=0)
        steps[name] = np.abs(velocity).max()
        accelerations[name] = np.abs(np.diff(velocity, axis=0)).max()
    # The slopes of these errors are below 1e-3, and change by less than that at a node.
    assert abs(steps["compensated"] - steps["plain"]) < 1e-3 * SPEED * PERIOD
    assert abs(accelerations["compensated"] - accelerations["plain"]) < 1e-3 * SPEED * PERIOD


def test_enabling_on_the_way_leaves_the_path_smooth(table: Path, truth: Machine, tmp_path: Path) -> None:
    """The machine moves slowly through a volume while the compensation is turned off and on again."""
    with session_of(table) as session:
        session.mdi("G53 G0 X100 Y100 Z100")
        session.joints()
        before = len(session.recorded())
        session.start_mdi("G53 G1 F3000 X250 Y200 Z150")  # 187 mm at 50 mm/s
        session.set_pin(KINS + "enable", False)
        session.wait_for_pin(KINS + "applied", 0.0)
        session.set_pin(KINS + "enable", True)
        session.finish_mdi()
        session.wait_for_pin(KINS + "applied", 1.0)
        joints = np.array(session.recorded()[before - 2 :])[:, 1:]
        end = np.array(session.joints())
    assert distances(end + truth.error([end]) - (250, 200, 150)) < 1e-9
    second = np.abs(np.diff(joints, n=2, axis=0)).max() / PERIOD**2
    assert second < 1.05 * ACCELERATION + 6 * 0.1 / 1.0**2  # a ramp adds 6 e/T² for an error e below 0.1 mm
