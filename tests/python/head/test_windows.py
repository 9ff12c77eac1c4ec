"""What plates and wedges of glass do to a traced head, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from reference_optics import glass_index
from small_heads import OFFSETS, SpotHead, definition, read, spot_of, three_beams, window
from truth import MICRORADIAN, Setup
from usual import DIAGONALS

import stepdiag as sd

TILTS = [(0.0, 0.0), (1e-4, 0.0), (0.0, -3e-4), (2e-3, 1e-3), (-1e-3, 3e-3)]
DISTANCES = [100.0, 345.6, 1200.0]
AIR = sd.Environment.from_air()  # of 20 degrees Celsius: what a head is calibrated with
CLOSED = 1e-11  # mm, a figure of the project; what is met is roundings of paths of 2.4 m


def plate_effect(thickness: float, ratio: float, tilt: tuple[float, float]) -> float:
    """What a plate square to a beam adds to half of a path that returns at 2 phi, its effect at phi = 0 taken off.

    The plate takes the place of air over its thickness: half of t (n + n/cos g - 1 - 1/cos 2 phi), g the angle inside,
    sin g = sin(2 phi)/n; less t (n - 1). n is relative to the air.
    """
    phi = math.atan(math.hypot(*tilt))
    sine, cosine = math.sin(2 * phi), math.cos(2 * phi)
    inside = ratio / math.sqrt(ratio**2 - sine**2)  # 1/cos g
    # Differences from 1 written so that they do not cancel.
    more_inside = (sine / ratio) ** 2 * inside**2 / (inside + 1)
    more_outside = sine**2 / cosine**2 / (1 / cosine + 1)
    return thickness * (ratio * more_inside - more_outside) / 2


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("air", [1.0, 1.00027])
def test_plane_window_is_the_closed_form_plate(distance: float, tilt: tuple[float, float], air: float) -> None:
    readings = read(three_beams(window()), distance=distance, tilt=tilt, environment=sd.Environment(air))
    for reading, offset in zip(readings, OFFSETS, strict=True):
        assert abs(reading - definition(distance, tilt, offset) - plate_effect(5.0, 1.5 / air, tilt)) <= CLOSED


def test_two_windows_of_catalogue_glass_in_real_air_add_up() -> None:
    air = sd.Environment.from_air(temperature=23.0, pressure=98000.0, relative_humidity=0.4)
    ratio = float(glass_index("N-BK7", 1530.0)) / air.refractive_index(1530.0)
    second = sd.optics.HeadBody.plate(
        "second", width=60, height=60, thickness=8.0, material="N-BK7", position=(10, 10, 60)
    )
    head = three_beams(window(material="N-BK7"), second)
    for tilt in TILTS:
        readings = read(head, distance=700.0, tilt=tilt, environment=air)
        for reading, offset in zip(readings, OFFSETS, strict=True):
            assert abs(reading - definition(700.0, tilt, offset) - plate_effect(13.0, ratio, tilt)) <= CLOSED


def test_window_adds_its_thickness_times_n_minus_1_to_each_head_constant() -> None:
    calibration = three_beams(window()).calibration
    assert np.max(np.abs(calibration.head_constants - 5.0 * (1.5 / AIR.refractive_index(1530.0) - 1))) <= 5e-13
    # From differences of paths over tilts of +-1 mrad: roundings of 1e-13 mm over 1e-3.
    assert np.max(np.abs(calibration.beam_offsets - OFFSETS)) <= 5e-10


@pytest.mark.parametrize("angle", [1e-3, math.radians(2.0), -0.1])
def test_inclined_window_displaces_all_beams_alike(angle: float) -> None:
    """A beam leaves a plate parallel to itself, by t sin(a) (1 - cos(a)/sqrt(n^2 - sin(a)^2)) to the side."""
    ratio = 1.5 / AIR.refractive_index(1530.0)
    aside = 5.0 * math.sin(angle) * (1 - math.cos(angle) / math.sqrt(ratio**2 - math.sin(angle) ** 2))
    inclined = three_beams(window(rotation=(0.0, angle, 0.0)))
    displaced = [(u + aside, v) for u, v in OFFSETS]
    # Taken from tilts of +-1 mrad: the third order of glass is left, a few 1e-6 of the displacement.
    assert np.max(np.abs(inclined.calibration.beam_offsets - displaced)) <= 5e-10 + 6e-6 * abs(aside)


# Tilts of up to 100 urad: three axes of 30 urad, and the reflector.
def test_plane_window_does_not_change_a_calibration() -> None:
    setup = Setup(steps=25)
    truth = setup.errors(11, rotation=15e-6)
    misalignment = sd.Misalignment(reflector=(40e-6, -30e-6), laser=(10e-6, 10e-6))
    ideal = setup.simulate(truth, misalignment)
    largest = np.nanmax(np.hypot(ideal.channels["alpha"], ideal.channels["beta"]))
    assert 60 * MICRORADIAN <= largest <= 100 * MICRORADIAN
    calibrations = []
    for head in (three_beams(), three_beams(window(material="N-BK7"))):
        on_this = Setup(steps=25, head=head)
        calibrations.append(on_this.evaluate(on_this.simulate(truth, misalignment)))
    without, with_window = calibrations
    for name, (_, value, _) in without.functions.items():
        change = np.max(np.abs(with_window.functions[name][1] - value))
        # t phi^2 (1 - 1/n) = 1.7e-8 mm on a reading; what it is on an angle, over 20 mm and in 75 steps, is rounding.
        assert change <= (1e-7 if name[1] in "XYZ" else 1e-9), name
    for name, (value, _) in without.squareness.items():
        assert abs(with_window.squareness[name][0] - value) * 500.0 <= 1e-7


def intersect(x: float, z: float, angle: float, face_z: float, slope: float) -> tuple[float, float, float]:
    """A line through (x, z) at `angle` from z up to the line z = face_z + slope x: where, and how far away."""
    length = (face_z + slope * x - z) / (math.cos(angle) - slope * math.sin(angle))
    return x + length * math.sin(angle), z + length * math.cos(angle), length


def wedge_path(u: float, distance: float, theta: float, wedge: float, ratio: float) -> tuple[float, float, float]:
    """Half path over n, place and angle of the return of a beam from (u, 0) over a wedge to a mirror turned by theta.

    All in the x-z plane; angles from z towards x, of the reversed direction on the way back. Sines alone.
    """
    low, high, slope = 25.0, 35.0, math.tan(wedge)  # faces: z = 25, and z = 35 + x tan(wedge)
    x1, z1, t1 = intersect(u, 0.0, 0.0, low, 0.0)
    x2, z2, t2 = intersect(x1, z1, 0.0, high, slope)
    out = math.asin(ratio * math.sin(wedge)) - wedge
    x3, z3, t3 = intersect(x2, z2, out, distance, -math.tan(theta))
    back = 2 * theta - out
    x4, z4, t4 = intersect(x3, z3, back, high, slope)
    inside = math.asin(math.sin(back + wedge) / ratio) - wedge
    x5, z5, t5 = intersect(x4, z4, inside, low, 0.0)
    end = math.asin(ratio * math.sin(inside))
    x6, _, t6 = intersect(x5, z5, end, 0.0, 0.0)
    lengths = t1 + ratio * t2 + t3 - t4 - ratio * t5 - t6
    return lengths / 2, x6, end


WEDGE = math.radians(1.0)
FAR_OFFSETS = [(0.0, 0.0), (60.0, 0.0), (0.0, 60.0)]


def wedge_head(angle: float = WEDGE) -> sd.Head:
    glass = sd.optics.HeadBody.wedge(
        "wedge", width=200, height=200, thickness=10, angle=angle, material=1.5, position=(0, 0, 30)
    )
    # The beam that is turned by 9 mrad comes back 18 mm aside from a mirror at 1 m.
    return three_beams(glass, offsets=FAR_OFFSETS, aperture=50.0)


@pytest.mark.parametrize("air", [1.0, 1.00027])
@pytest.mark.parametrize("theta", [0.0, 1e-3, -2e-3, 9e-3])
@pytest.mark.parametrize("distance", [100.0, 400.0, 1000.0])
def test_wedge_of_one_degree_does_what_its_closed_form_says(distance: float, theta: float, air: float) -> None:
    head = wedge_head()
    here = sd.Environment(air)
    readings = read(head, distance=distance, tilt=(0.0, math.tan(theta)), environment=here)
    for reading, (u, _) in zip(readings, FAR_OFFSETS, strict=True):
        path = wedge_path(u, distance, theta, WEDGE, 1.5 / air)[0]
        constant = wedge_path(u, head.standoff, 0.0, WEDGE, 1.5 / air)[0] - head.standoff
        assert abs(reading - (path - constant)) <= CLOSED


def test_wedge_turns_the_beam_by_exact_snell() -> None:
    segments = sd.optics.trace_beams(wedge_head(), distance=500.0, environment=sd.Environment())
    way = [s for s in segments if s.beam == "beam 1"]
    after = way[2]  # to the wedge, in it, and to the mirror
    direction = (after.end - after.start) / np.linalg.norm(after.end - after.start)
    expected = math.asin(1.5 * math.sin(WEDGE)) - WEDGE
    # Coordinates of 0.5 m rounded to 5e-14 mm, over 465 mm.
    assert abs(math.atan2(direction[0], direction[2]) - expected) <= 1e-15
    assert abs(direction[1]) <= 1e-15


def test_beams_behind_a_wedge_see_the_mirror_turned_by_its_deviation() -> None:
    """Between beams the half path changes by -sin(w)/2 times the distance of their returns, w the angle of return.

    A wave leaves the reference plane plane and comes back plane. For a mirror square to z, w is nearly -2 (n - 1) a.
    """
    head = wedge_head()
    vacuum = sd.Environment(1.0)
    # The head's constants take the wedge off where a head is calibrated; here the paths themselves are looked at.
    paths = read(head, distance=800.0, environment=vacuum)
    own = [wedge_path(u, 100.0, 0.0, WEDGE, 1.5)[0] for u, _ in FAR_OFFSETS]
    paths += np.array(own) - own[0]
    (_, x1, angle), (_, x2, _) = (wedge_path(u, 800.0, 0.0, WEDGE, 1.5) for u in (0.0, 60.0))
    assert abs(paths[1] - paths[0] + math.sin(angle) / 2 * (x2 - x1)) <= CLOSED
    # As a tilt: the mirror seems turned by -(n - 1) a against the beam, 0.5 degree; third order is left.
    assert abs(-(paths[1] - paths[0]) / 60.0 + 0.5 * WEDGE) <= WEDGE**3
    assert abs(paths[2] - paths[0]) <= CLOSED


def test_weak_wedge_of_a_window_acts_as_a_turned_laser() -> None:
    """Ten seconds of arc, as windows have: all beams turn by (n - 1) a, which an evaluation takes as a laser angle."""
    wedge = math.radians(10 / 3600)
    setup = Setup(steps=12, lines=DIAGONALS)
    truth = setup.errors(12)
    glass = sd.optics.HeadBody.wedge(
        "window", width=80, height=80, thickness=5, angle=wedge, material=1.5, position=(10, 10, 30)
    )
    wedged = Setup(steps=12, head=three_beams(glass))
    turned = Setup(steps=12, head=three_beams())
    with_wedge = wedged.simulate(truth)
    # The beam turns towards +x, the wedge's thick side: a rotation about +y.
    with_turn = turned.simulate(truth, sd.Misalignment(laser=(0.0, 0.5 * wedge)))
    rows = [i for i, line in enumerate(with_wedge.line) if line in DIAGONALS]
    for line in DIAGONALS:
        one = [i for i in rows if with_wedge.line[i] == line]
        for name in ("d1", "d2", "d3"):
            change = with_wedge.channels[name][one] - with_turn.channels[name][one]
            # A constant of the line is no matter. 24 urad times the mirror's 100 urad over 30 mm, and the turn's
            # second order in the set-up: 24 urad x 24 urad x 1 m.
            assert np.max(np.abs(change - change[0])) <= 1e-6


# Layout b.


def glass_remainder(head: SpotHead, tilt: tuple[float, float]) -> np.ndarray:
    """What is left of the spot against its definition: glass counts as t/n to first order in the angle only.

    In glass of unfolded depth t the beam moves aside by t tan(g) in place of t tan(2 phi)/n, sin(g) = sin(2 phi)/n.
    """
    alpha, beta = tilt
    phi = math.atan(math.hypot(alpha, beta))
    if phi == 0.0:
        return np.zeros(2)
    sine = math.sin(2 * phi)
    # tan(g) - tan(2 phi)/n, with both roots together so that they do not cancel
    inside, outside = math.sqrt(head.index**2 - sine**2), head.index * math.cos(2 * phi)
    difference = sine * (outside**2 - inside**2) / (inside * outside * (inside + outside))
    return head.edge * difference * np.array([-beta, alpha]) / math.hypot(alpha, beta)


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (1e-4, -2e-4), (-3e-4, 3e-4), (1e-3, 1.5e-3)])
@pytest.mark.parametrize("distance", DISTANCES)
def test_spot_is_its_definition_and_the_third_order_of_glass(distance: float, tilt: tuple[float, float]) -> None:
    numbers = SpotHead()
    head = numbers.head()
    vacuum = sd.Environment(1.0)
    alpha, beta = tilt
    squares = alpha**2 + beta**2
    length = distance - beta * 30.0  # of the spot's beam, which starts at u = 30
    defined = 2 * (length + numbers.psd_distance) / (1 - squares) * np.array([-beta, alpha])
    spot = spot_of(head, distance=distance, tilt=tilt, environment=vacuum)
    left = glass_remainder(numbers, tilt)
    # The spot's axes and zero are those of a nominal trace: differences over 1e-5 rad, whose roundings (5e-9 mm over
    # 2 m) are 3e-12 of a spot of 4 mm.
    assert np.max(np.abs(spot - defined - left)) <= 2e-11
    if math.sqrt(squares) <= 300e-6:
        assert np.max(np.abs(left)) <= 3e-9  # 20 mm (2 phi)^3 / 2 (1 - 1/n^2)/n


def test_reduced_psd_distance_counts_glass_as_t_over_n() -> None:
    numbers = SpotHead()
    calibration = numbers.head().calibration
    reduced = numbers.psd_distance + numbers.edge * (AIR.refractive_index(635.0) - 1) / numbers.index
    assert abs(calibration.psd_distance - reduced) <= 2e-8  # slopes over 1e-5 rad, roundings of 1e-13 mm
    assert np.max(np.abs(calibration.spot_beam - [30.0, 0.0])) <= 1e-12
