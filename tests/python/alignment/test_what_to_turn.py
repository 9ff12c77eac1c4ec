"""What to turn, against readings from the definitions of docs/conventions.md written out here: no code is shared."""

import math

import numpy as np
import numpy.typing as npt
import pytest

from stepdiag.alignment.limits import limits_of
from stepdiag.alignment.places import alignment_places
from stepdiag.alignment.what_to_turn import what_to_turn
from stepdiag.scenario.description import parse_scenario
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit, visits_of

FloatArray = npt.NDArray[np.float64]

HEADS = {
    "ideal": ('layout = "ideal"', ["distance", "alpha", "beta"]),
    "psd": ('layout = "psd"\npsd_distance_mm = 150.0', ["distance", "spot_x", "spot_y"]),
    "multi_beam": (
        'layout = "multi_beam"\nbeam_offsets_mm = [[15.0, 0.0], [-7.5, 13.0], [-7.5, -13.0]]',
        ["d1", "d2", "d3"],
    ),
}
SCENARIO = """
[volume]
x_mm = 800.0
y_mm = 600.0
z_mm = 500.0
[machine]
chain = "[w X' b Y Z t]"
tool_mm = [3.0, -2.0, 40.0]
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
scale_lines = ["p00", "0p0", "00p"]
steps = 20
[head]
{head}
"""
STANDOFF = 100.0


def known_of(layout: str) -> Known:
    return parse_scenario(SCENARIO.format(head=HEADS[layout][0])).known


def exp(a: float, b: float) -> FloatArray:
    """Rotation about the local x and y at once, by Rodrigues' formula."""
    angle = math.hypot(a, b)
    if angle == 0.0:
        return np.eye(3)
    k = np.array([[0.0, 0.0, b], [0.0, 0.0, -a], [-b, a, 0.0]]) / angle
    return np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k


def read(
    known: Known, visit: Visit, place: FloatArray, laser: FloatArray, mirror: FloatArray, constant: float
) -> list[float]:
    """A machine without errors: the functional point is where the axes are, plus the tool."""
    frame = np.asarray(known.plan.frame(visit.line))
    tool = np.asarray(known.tool)
    p = place + tool
    o = known.plan.points(visit.line, 0)[0] + tool - STANDOFF * frame[:, 2]
    sensor = frame @ exp(*laser)
    n = frame @ exp(*mirror)[:, 2]
    d = sensor[:, 2]

    def trip(start: FloatArray) -> tuple[float, float, FloatArray]:
        length = float((p - start) @ n / (n @ d))
        r = d - 2.0 * float(n @ d) * n
        return (length + length / -float(r @ d)) / 2.0, length, sensor.T @ r

    half, length, r = trip(o)
    local = sensor.T @ n
    head = known.head
    if head.layout == "ideal":
        return [half + constant, -local[1] / local[2], local[0] / local[2]]
    if head.layout == "psd":
        spot = (length + head.psd_distance) * r[:2] / -r[2]
        return [half + constant, float(spot[0]), float(spot[1])]
    return [trip(o + sensor[:, :2] @ offset)[0] + constant for offset in np.asarray(head.beam_offsets)]


@pytest.mark.parametrize("layout", HEADS)
def test_angles_are_those_of_the_definitions(layout: str) -> None:
    known = known_of(layout)
    for visit in visits_of(known):
        places = alignment_places(known, visit)
        laser, mirror = np.array([1.1e-3, -0.4e-3]), np.array([-0.7e-3, 2.3e-3])
        found = what_to_turn(known, visit, places, [read(known, visit, one, laser, mirror, 0.7) for one in places])
        assert np.allclose(found.laser, laser, rtol=0.0, atol=20e-6), visit.line
        assert np.allclose(found.reflector, mirror, rtol=0.0, atol=20e-6), visit.line


@pytest.mark.parametrize("layout", HEADS)
def test_a_hand_that_does_what_is_said_is_ready_after_three_turns(layout: str) -> None:
    """From up to 5 mrad; a screw turns a tenth too far, and the distance is read with 2 µm of the machine's errors."""
    known, random = known_of(layout), np.random.default_rng(5)
    visits = list(visits_of(known))
    for start in range(200):
        visit = visits[start % len(visits)]
        places, limits = alignment_places(known, visit), limits_of(known, visit)
        laser, mirror = (
            size * np.array([math.cos(way), math.sin(way)])
            for size, way in zip(random.uniform(0.0, 5e-3, 2), random.uniform(0.0, 2.0 * math.pi, 2), strict=True)
        )
        for _ in range(4):  # and three turns between
            rows = [read(known, visit, one, laser, mirror, 0.7) for one in places]
            error = random.normal(0.0, 1e-3, len(rows))
            names = HEADS[layout][1]
            rows = [
                [value + (off if name.startswith("d") else 0.0) for name, value in zip(names, row, strict=True)]
                for row, off in zip(rows, error, strict=True)
            ]
            found = what_to_turn(known, visit, places, rows)
            if found.is_ready:
                break
            laser, mirror = laser - 1.1 * found.laser, mirror - 1.1 * found.reflector
        assert found.is_ready, (layout, visit.line)
        u = max(turn.u for turn in found.turns)
        assert np.hypot(*laser) <= limits.laser + 4.0 * u
        assert np.hypot(*mirror) <= limits.reflector + 4.0 * u


def test_words_say_which_way_a_person_at_the_head_turns() -> None:
    """The beam of 0p0 looks along Y+: its right is X+, its up is Z+."""
    known = known_of("ideal")
    visit = next(one for one in visits_of(known) if one.line == "0p0")
    frame = np.asarray(known.plan.frame("0p0"))
    places = alignment_places(known, visit)
    wanted = np.array([2e-3, 0.0, 1e-3])  # too far to the right, and a little up
    across = frame.T @ wanted
    laser = np.array([-across[1], across[0]])  # Exp(a, b, 0) z is (b, -a, 1)
    found = what_to_turn(known, visit, places, [read(known, visit, one, laser, np.zeros(2), 0.0) for one in places])
    assert found.turns[0].words == "laser: turn it 2.00 mrad left and 1.00 mrad down"
    assert found.turns[1].is_ready
    # A face that looks back along the beam turns to the other side than its normal, which points with the beam.
    found = what_to_turn(known, visit, places, [read(known, visit, one, np.zeros(2), laser, 0.0) for one in places])
    assert found.turns[1].words == "mirror: turn it 2.00 mrad right and 1.00 mrad up"


def test_distances_alone_show_the_mirror_but_not_the_laser() -> None:
    known = known_of("ideal")
    visit = next(iter(visits_of(known)))
    places = alignment_places(known, visit)
    mirror = np.array([1e-3, 2e-3])
    rows = [read(known, visit, one, np.zeros(2), mirror, 0.3)[:1] for one in places]
    found = what_to_turn(known, visit, places, rows)
    assert found.turns[0].words == "laser: these readings do not show it"
    assert np.allclose(found.reflector, mirror, rtol=0.0, atol=0.1e-3)
    assert not found.is_ready
    straight = [read(known, visit, one, np.zeros(2), np.zeros(2), 0.3)[:1] for one in places]
    found = what_to_turn(known, visit, places, straight)
    assert found.turns[1].is_ready
    assert found.is_all_that_is_seen
    assert not found.is_ready  # nobody knows where the laser points


def test_the_beam_on_the_mirror() -> None:
    known = known_of("ideal")
    visit = next(iter(visits_of(known)))
    places = alignment_places(known, visit)
    found = what_to_turn(known, visit, places, [read(known, visit, p, np.zeros(2), np.zeros(2), 0.0) for p in places])
    width, height = known.plan.smallest_mirror()
    assert found.largest_on_mirror == pytest.approx((width / 2.0, height / 2.0), abs=0.5)
    assert found.mirror_words == f"the mirror needs {width:.0f} × {height:.0f} mm, and the beam's diameter"
