"""Components out of their places, reading models and the air: what each does to the signals, in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from reference import turn
from small_heads import OFFSETS, SpotHead, definition, read, spot_of, three_beams, window

import stepdiag as sd

NOWHERE = (0.0, 0.0, 0.0)
TILTS = [(0.0, 0.0), (1e-4, -2e-4), (-3e-4, 3e-4), (1e-3, 0.5e-3)]
NUMBERS = SpotHead()
VACUUM = sd.Environment(1.0)

# Roundings: of paths of 2.4 m, and of spots, where unit vectors rounded to 1e-16 act over 2.4 m.
PATH = 2e-12
SPOT = 5e-12


def two_phi(tilt: tuple[float, float]) -> float:
    return 2 * math.atan(math.hypot(*tilt))


@pytest.mark.parametrize("tilt", TILTS)
def test_displaced_device_reads_the_spot_displaced_the_other_way(tilt: tuple[float, float]) -> None:
    """The paper's zero offset of (1.5, 2) mm, Fig. 5, 3a and 3b: from a component that stands aside."""
    displaced = NUMBERS.head(pose_errors={"psd": ((0.0, 2.0, 1.5), NOWHERE)})  # head z unfolds to x
    for distance in (150.0, 1100.0):
        moved = spot_of(displaced, distance=distance, tilt=tilt) - spot_of(NUMBERS.head(), distance=distance, tilt=tilt)
        # The axes of the spot are a nominal trace's, from differences over 1e-5 rad: 1 to 5e-12.
        assert np.max(np.abs(moved - [-1.5, -2.0])) <= 2e-11


@pytest.mark.parametrize("tilt", TILTS)
def test_device_farther_away_sees_longer_levers(tilt: tuple[float, float]) -> None:
    away = NUMBERS.head(pose_errors={"psd": ((-0.5, 0.0, 0.0), NOWHERE)})
    moved = spot_of(away, distance=700.0, tilt=tilt) - spot_of(NUMBERS.head(), distance=700.0, tilt=tilt)
    alpha, beta = tilt
    expected = 0.5 * 2 / (1 - alpha**2 - beta**2) * np.array([-beta, alpha])  # 0.5 mm x tan(2 phi)
    assert np.max(np.abs(moved - expected)) <= SPOT


def test_device_turned_about_its_normal_turns_the_spot_back() -> None:
    angle, tilt = 0.01, (1e-3, 0.5e-3)
    # The device's normal is head -x.
    turned = NUMBERS.head(pose_errors={"psd": (NOWHERE, (-angle, 0.0, 0.0))})
    x, y = spot_of(NUMBERS.head(), distance=700.0, tilt=tilt)
    expected = [math.cos(angle) * x + math.sin(angle) * y, math.cos(angle) * y - math.sin(angle) * x]
    assert np.max(np.abs(spot_of(turned, distance=700.0, tilt=tilt) - expected)) <= SPOT


@pytest.mark.parametrize(
    ("turn_of_splitter", "direction"),
    [
        # About its axis, y, the cube acts as a mirror does: twice the angle. Its faces, a plate that is turned too,
        # take away (1 - 1/n) of the lever on the way out and give it back behind the splitting face.
        ((0.0, 1.0, 0.0), (2.0, 0.0)),
        # About x and z the light, at 45 degrees to the axis, is turned once.
        ((1.0, 0.0, 0.0), (0.0, -1.0)),
        ((0.0, 0.0, 1.0), (0.0, -1.0)),
    ],
)
@pytest.mark.parametrize("distance", [150.0, 1100.0])
def test_turned_splitter_moves_the_spot_by_the_lever_to_the_device(
    distance: float, turn_of_splitter: tuple[float, float, float], direction: tuple[float, float]
) -> None:
    for angle in (50e-6, -200e-6):
        x, y, z = (angle * c for c in turn_of_splitter)
        turned = NUMBERS.head(pose_errors={"cube": (NOWHERE, (x, y, z))})
        moved = spot_of(turned, distance=distance) - spot_of(NUMBERS.head(), distance=distance)
        # The square of the angle, times lever and edge of 18 and 20 mm, is left.
        assert np.max(np.abs(moved - angle * NUMBERS.lever * np.array(direction))) <= 40 * angle**2


@pytest.mark.parametrize("tilt", TILTS)
def test_displaced_splitter_moves_the_spot_as_its_mirror_does(tilt: tuple[float, float]) -> None:
    """Along y nothing changes. Shifted by s along z the face meets the light s earlier: the spot is s higher.

    Higher is x, unfolded. Shifted along x the face meets the light s later: s lower. The way is as much shorter or
    longer, times tan(2 phi).
    """
    alpha, beta = tilt
    slope = 2 / (1 - alpha**2 - beta**2) * np.array([-beta, alpha])
    mirror = {"distance": 400.0, "tilt": tilt}
    spot, s = spot_of(NUMBERS.head(), **mirror), 0.2
    for shift, expected in (
        ((0.0, s, 0.0), np.zeros(2)),
        ((0.0, 0.0, s), np.array([s, 0.0]) - s * slope),
        ((s, 0.0, 0.0), np.array([-s, 0.0]) + s * slope),
    ):
        moved = spot_of(NUMBERS.head(pose_errors={"cube": (shift, NOWHERE)}), **mirror) - spot
        assert np.max(np.abs(moved - expected)) <= 2e-11, shift


@pytest.mark.parametrize("angle", [20e-6, -100e-6])
def test_turned_laser_moves_the_spot_by_the_whole_unfolded_way(angle: float) -> None:
    head, distance = NUMBERS, 800.0
    turned = head.head(pose_errors={"laser": (NOWHERE, (0.0, angle, 0.0))})
    straight = distance - head.laser  # out; and back as far as the definition's D, with the cube on the way out too
    way = straight - head.edge * (1 - 1 / head.index) + distance + head.psd_distance
    moved = spot_of(turned, distance=distance, environment=VACUUM)
    assert abs(moved[0] - angle * way) <= 2 * abs(angle) ** 3 * way + SPOT
    assert abs(moved[1]) <= SPOT


def test_displaced_laser_displaces_the_spot() -> None:
    displaced = NUMBERS.head(pose_errors={"laser": ((0.1, -0.2, 0.0), NOWHERE)})
    for distance in (150.0, 1100.0):
        moved = spot_of(displaced, distance=distance) - spot_of(NUMBERS.head(), distance=distance)
        assert np.max(np.abs(moved - [0.1, -0.2])) <= SPOT


@pytest.mark.parametrize("tilt", TILTS)
def test_displaced_plane_window_changes_nothing(tilt: tuple[float, float]) -> None:
    moved = three_beams(window(), pose_errors={"window": ((1.5, -2.0, 3.0), NOWHERE)})
    turned = three_beams(window(), pose_errors={"window": (NOWHERE, (0.0, 0.0, 0.1))})  # about the beam
    mirror = {"distance": 900.0, "tilt": tilt}
    for other in (moved, turned):
        assert np.max(np.abs(read(other, **mirror) - read(three_beams(window()), **mirror))) <= PATH


@pytest.mark.parametrize("tilt", TILTS)
def test_collimator_farther_forward_shortens_the_half_path_once(tilt: tuple[float, float]) -> None:
    """Twice the shift is missing, out and back over cos 2 phi; a distance is half of that."""
    shift = 0.05
    forward = three_beams(pose_errors={"beam 2": ((0.0, 0.0, shift), NOWHERE)})
    change = read(forward, distance=900.0, tilt=tilt) - read(three_beams(), distance=900.0, tilt=tilt)
    expected = -shift * (1 + 1 / math.cos(two_phi(tilt))) / 2
    assert np.max(np.abs(change - [0.0, expected, 0.0])) <= PATH


@pytest.mark.parametrize("tilt", TILTS)
def test_collimator_aside_reads_the_mirror_there(tilt: tuple[float, float]) -> None:
    aside = three_beams(pose_errors={"beam 3": ((0.2, -0.1, 0.0), NOWHERE)})
    u, v = OFFSETS[2]
    assert abs(read(aside, distance=900.0, tilt=tilt)[2] - definition(900.0, tilt, (u + 0.2, v - 0.1))) <= PATH


@pytest.mark.parametrize("turned", [(1e-4, 0.0, 0.0), (-2e-4, 5e-4, 0.0), (1e-3, 1e-3, 2e-3)])
@pytest.mark.parametrize("tilt", TILTS)
def test_turned_collimator_measures_along_its_own_beam(
    tilt: tuple[float, float], turned: tuple[float, float, float]
) -> None:
    """Half the way from its origin along the turned beam to the mirror and back to its own, turned, plane."""
    head = three_beams(pose_errors={"beam 2": (NOWHERE, turned)})
    alpha, beta = tilt
    normal = np.array([beta, -alpha, 1.0]) / math.sqrt(1 + alpha**2 + beta**2)
    beam = turn(turned)[:, 2]
    way = np.array([0.0, 0.0, 600.0]) - [*OFFSETS[1], 0.0]
    length = (way @ normal) / (beam @ normal)
    expected = length * (1 + 1 / (2 * (normal @ beam) ** 2 - 1)) / 2
    assert abs(read(head, distance=600.0, tilt=tilt)[1] - expected) <= PATH


# Reading models.


def half_path_of_phase(
    waist_radius: float, wavelength: float, reduced_length: float, aside: float, slope: float
) -> tuple[float, float]:
    """(half path that the returned beam's fibre phase adds to its axis', share that couples), by numerical integration.

    Across the tilt, the field of a Gaussian beam of radius w and wave-front radius R, displaced and inclined, times the
    mode that runs out of the fibre; against the same of an aligned beam. In the other direction nothing changes. The
    sums converge faster than any power of the step, as sums over Gaussians do.
    """
    k = 2 * math.pi / (wavelength * 1e-6)
    rayleigh = k * waist_radius**2 / 2
    x = np.linspace(-12.0, 12.0, 60001)

    def field(length: float, centre: float, inclination: float) -> np.ndarray:
        radius = waist_radius * math.sqrt(1 + (length / rayleigh) ** 2)
        curvature = length / (length**2 + rayleigh**2)
        at = x - centre
        return np.exp(-((at / radius) ** 2) + 1j * k * (curvature * at**2 / 2 + inclination * at)) / math.sqrt(radius)

    mode = field(0.0, 0.0, 0.0)
    norm = float(np.sum(np.abs(mode) ** 2))
    aligned = np.sum(field(reduced_length, 0.0, 0.0) * mode) / norm
    here = np.sum(field(reduced_length, aside, slope) * mode) / norm
    return float(np.angle(here / aligned)) / (2 * k), float(abs(here * aligned) ** 2)


@pytest.mark.parametrize("phi", [0.0, 50e-6, 300e-6, 450e-6])
def test_coupled_mode_reads_what_the_fibre_s_mode_sees(phi: float) -> None:
    distance = 1200.0
    chief, coupled = (
        read(three_beams(reading_model=model), distance=distance, tilt=(0.0, phi), environment=VACUUM)[0]
        for model in ("chief_ray", "coupled_mode")
    )
    assert abs(chief - definition(distance, (0.0, phi))) <= PATH
    # The mirror turned towards +x sends the light to -x: it arrives at -L tan 2 phi, with a slope of -sin 2 phi.
    angle = 2 * math.atan(phi)
    aside, slope = -distance * math.tan(angle), -math.sin(angle)
    length = distance * (1 + 1 / math.cos(angle))
    added, _ = half_path_of_phase(0.8, 1530.0, length, aside, slope)
    # A paraxial field: the fourth order of the angle is another matter. (450 urad)^4 x 1.2 m = 5e-11 mm.
    assert abs(coupled - chief - added) <= 2e-10


def test_coupled_mode_falls_short_where_the_chief_ray_goes_too_far() -> None:
    """The figures of the facts: at 300 urad and 1.2 m, -L phi^2/2 = -54 nm of half path against +L phi^2 = 108 nm."""
    distance, phi = 1200.0, 300e-6
    tilt = (phi / math.sqrt(2), phi / math.sqrt(2))
    chief, coupled = (
        read(three_beams(reading_model=model), distance=distance, tilt=tilt, environment=VACUUM)[0] - distance
        for model in ("chief_ray", "coupled_mode")
    )
    assert abs(chief - distance * phi**2) <= 1e-10
    assert abs(coupled + distance * phi**2 / 2) <= 1e-10


def test_coupling_below_the_least_is_a_lost_reading() -> None:
    """At 300 urad and 1.2 m 21 % couple: 38 % of the 54 % of an aligned beam, which spreads in two directions.

    In one direction alone the two would make 28 %, sqrt(0.54) x 0.38.
    """
    _, share = half_path_of_phase(0.8, 1530.0, 2400.0, -2400.0 * 300e-6, -600e-6)
    assert share == pytest.approx(0.206, abs=5e-4)
    mirror = {"distance": 1200.0, "tilt": (0.0, 300e-6), "environment": VACUUM}
    for least, is_lost in ((share - 0.002, False), (share + 0.002, True)):
        head = three_beams(reading_model="coupled_mode", least_coupling=least)
        assert np.isnan(read(head, **mirror)).all() == is_lost


# The air.


@pytest.mark.parametrize("tilt", TILTS)
def test_distance_scales_with_the_true_index_over_the_assumed_one(tilt: tuple[float, float]) -> None:
    true, assumed = sd.Environment(1.00027), sd.Environment(1.000268)
    scale = 1.00027 / 1.000268
    known = {"distance": 1000.0, "tilt": tilt, "environment": true}
    plain = read(three_beams(), **known, assumed_environment=assumed)
    expected = np.array([definition(1000.0, tilt, offset) for offset in OFFSETS]) * scale
    assert np.max(np.abs(plain - expected)) <= PATH
    # A window's glass is no air: only the way outside it scales. Its constant is one of the assumed air.
    glass = read(three_beams(window()), distance=1000.0, environment=true, assumed_environment=assumed)
    assert np.max(np.abs(glass - ((1000.0 - 5.0) * scale + 5.0))) <= PATH


def test_dead_path_and_index_error() -> None:
    true, assumed = 1.00027, 1.000268
    air = {"environment": sd.Environment(true), "assumed_environment": sd.Environment(assumed)}
    plain = read(three_beams(), distance=800.0, **air)
    dead = read(three_beams(dead_path=150.0), distance=800.0, **air)
    assert np.max(np.abs(dead - plain - 150.0 * (true / assumed - 1))) <= PATH
    # The dead path was zeroed in the same air: nothing where the air is known.
    known = {"distance": 800.0, "environment": sd.Environment(true)}
    assert np.max(np.abs(read(three_beams(dead_path=150.0), **known) - 800.0)) <= PATH
    wrong = read(three_beams(index_error=0.5e-6), **known)
    assert np.max(np.abs(wrong - 800.0 / (1 + 0.5e-6))) <= PATH


def test_air_changes_a_reading_by_the_published_sensitivities() -> None:
    """At 1530 nm -0.94 ppm a kelvin, 0.265 ppm a hectopascal, -0.009 ppm a percent of humidity."""
    laboratory = sd.Environment.from_air()

    def ppm(**air: float) -> float:
        here = sd.Environment.from_air(**air)
        reading = read(three_beams(), distance=1000.0, environment=here, assumed_environment=laboratory)[0]
        return (reading - 1000.0) / 1000.0 * 1e6

    assert (ppm(temperature=20.5) - ppm(temperature=19.5)) == pytest.approx(-0.94, abs=0.01)
    assert (ppm(pressure=101375.0) - ppm(pressure=101275.0)) == pytest.approx(0.265, abs=0.001)
    assert (ppm(relative_humidity=0.505) - ppm(relative_humidity=0.495)) == pytest.approx(-0.009, abs=0.0005)


def test_spot_does_not_know_the_air() -> None:
    """Angles in air are those in vacuum; the glass alone is seen at another ratio."""
    mirror = {"distance": 900.0, "tilt": (1e-4, 2e-4)}
    air, vacuum = (spot_of(NUMBERS.head(), **mirror, environment=sd.Environment(n)) for n in (1.00027, 1.0))
    # 20 mm of glass count as t n_air/n: 3.6e-6 m more of lever, times the tilts.
    change = 20.0 / 1.5 * 0.00027 * 2 * np.array([-2e-4, 1e-4])
    assert np.max(np.abs(air - vacuum - change)) <= 1e-11
