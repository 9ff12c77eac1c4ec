"""Detectors against independent integrals: coupling of a returned beam, pixels of a spot, centroids and their bound."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from refusal import refused
from scipy import integrate, stats

import stepdiag as sd

NAN, INF = float("nan"), float("inf")
MODE = sd.optics.GaussianMode(1530.0, 0.8)
SPOT = sd.optics.BeamSpot((0.0, 0.0), 0.05)


def returned(
    x: float, y: float, angle_x: float, angle_y: float, optical: float, reduced: float
) -> sd.optics.ReturnedBeam:
    return sd.optics.ReturnedBeam((x, y), (angle_x, angle_y, -math.sqrt(1 - angle_x**2 - angle_y**2)), optical, reduced)


def from_mirror(length: float, phi: float) -> sd.optics.ReturnedBeam:
    """A mirror in vacuum, turned about the point where the axis meets it."""
    path = length + length / math.cos(2 * phi)
    direction = (math.sin(2 * phi), 0.0, -math.cos(2 * phi))
    return sd.optics.ReturnedBeam((length * math.tan(2 * phi), 0.0), direction, path, path)


# --- interferometer ---


def overlap_1d(mode: sd.optics.GaussianMode, d: float, s: float, reduced: float) -> mp.mpc:
    """One dimension of the overlap integral with fields of complex parameter q, to 25 digits."""
    k = 2 * mp.pi / (mp.mpf(mode.wavelength) * mp.mpf("1e-6"))
    q0 = mp.mpc(-mode.waist_position, k * mp.mpf(mode.waist_radius) ** 2 / 2)
    q1 = q0 + mp.mpf(reduced)

    def product(x: mp.mpf) -> mp.mpc:
        out = mp.sqrt(1j * q0.imag / q0) * mp.exp(-1j * k * x**2 / (2 * q0))
        back = mp.sqrt(1j * q1.imag / q1) * mp.exp(-1j * k * ((x - d) ** 2 / (2 * q1) + s * (x - d)))
        return out * back

    reach = 8 * mode.waist_radius * mp.sqrt(1 + (mode.waist_position / q0.imag) ** 2)
    pieces = mp.linspace(-reach, reach, 17)
    return mp.quad(product, pieces) * mp.sqrt(2 / mp.pi) / mode.waist_radius


def test_coupling_is_the_overlap_integral() -> None:
    random = np.random.default_rng(1)
    with mp.workdps(25):
        for _ in range(4):
            mode = sd.optics.GaussianMode(
                random.uniform(600, 1600), random.uniform(0.5, 1.2), random.uniform(-800, 800)
            )
            x, y = random.uniform(-1, 1, 2)
            angles = random.uniform(-4e-4, 4e-4, 2)
            reduced, index = random.uniform(100, 2500), random.uniform(1, 1.3)
            length, efficiency = sd.optics.couple(mode, returned(x, y, *angles, 0.0, reduced), index)
            exact = overlap_1d(mode, x, index * angles[0], reduced) * overlap_1d(mode, y, index * angles[1], reduced)
            aligned = overlap_1d(mode, 0, 0, reduced) ** 2
            assert abs(efficiency - float(abs(exact) ** 2)) < 1e-13  # roundings of exp(-20) and the like
            turns = -mp.arg(exact / aligned) / (2 * mp.pi) - length / (mode.wavelength * 1e-6)
            assert abs(turns - mp.nint(turns)) < 1e-12  # roundings of some 1000 waves


@pytest.mark.parametrize("phi", [50e-6, 300e-6, 600e-6])
def test_turned_mirror_reads_the_second_order_of_each_model(phi: float) -> None:
    chief = sd.optics.read_distance(sd.optics.Interferometer(), MODE, from_mirror(1200.0, phi))
    coupled = sd.optics.read_distance(
        sd.optics.Interferometer(reading_model="coupled_mode"), MODE, from_mirror(1200.0, phi)
    )
    assert chief == pytest.approx(1200 + 1200 * phi**2, abs=1e-9)  # fourth order: 1200 * (6e-4)^4 = 2e-10
    assert coupled == pytest.approx(1200 - 1200 * phi**2 / 2, abs=1e-9)


def test_tilt_of_300_urad_at_1200_mm_leaves_a_fifth_of_the_light() -> None:
    aligned, at_300, at_600 = (sd.optics.couple(MODE, from_mirror(1200.0, phi))[1] for phi in (0.0, 300e-6, 600e-6))
    assert aligned == pytest.approx(1 / (1 + (1200 / MODE.rayleigh_length) ** 2), rel=1e-14)  # 54.5 %: the beam grew
    assert at_300 / aligned == pytest.approx(0.3786, abs=1e-4)
    assert at_300 == pytest.approx(0.2064, abs=1e-4)
    assert at_600 == pytest.approx(0.0112, abs=1e-4)


def test_reading_reduces_by_the_assumed_index() -> None:
    beam = sd.optics.ReturnedBeam((0, 0), (0, 0, -1), 2 * 1000 * 1.00027, 2000 / 1.00027)
    interferometer = sd.optics.Interferometer(dead_path=150.0, index_error=0.5e-6)
    used = 1.00026 * (1 + 0.5e-6)
    expected = 1000 * 1.00027 / used + 150 * (1.00027 / used - 1)
    assert sd.optics.read_distance(
        interferometer, MODE, beam, true_index=1.00027, assumed_index=1.00026
    ) == pytest.approx(expected, abs=1e-12)  # roundings of 1000 mm


def test_beam_outside_the_aperture_is_a_lost_reading() -> None:
    assert sd.optics.read_distance(sd.optics.Interferometer(aperture=2.0), MODE, from_mirror(1200.0, 500e-6)) is None
    weak = sd.optics.Interferometer(reading_model="coupled_mode", least_coupling=0.1)
    assert sd.optics.read_distance(weak, MODE, from_mirror(1200.0, 300e-6)) is not None
    assert sd.optics.read_distance(weak, MODE, from_mirror(1200.0, 600e-6)) is None


# --- spot ---


def irradiance(y: float, x: float, spot: sd.optics.BeamSpot) -> float:
    r2 = (x - spot.centre[0]) ** 2 + (y - spot.centre[1]) ** 2
    return float(2 / (math.pi * spot.radius**2) * math.exp(-2 * r2 / spot.radius**2))


def test_pixels_are_double_integrals_of_the_irradiance() -> None:
    spot = sd.optics.BeamSpot((0.0123, -0.0045), 0.031, 0.7)
    camera = sd.optics.Camera(columns=24, rows=20, electrons=1e5)
    image = sd.optics.expose(camera, [spot])
    assert image.shape == (20, 24)
    for row, column in [(9, 13), (10, 12), (3, 20), (12, 9)]:
        low, high = np.array([column - 12, row - 10]) * 0.01, np.array([column - 11, row - 9]) * 0.01
        exact, _ = integrate.dblquad(
            irradiance, low[0], high[0], low[1], high[1], args=(spot,), epsabs=1e-15, epsrel=1e-13
        )
        assert image[row, column] / 1e5 == pytest.approx(0.7 * exact, rel=1e-11)  # quadrature
        assert sd.optics.power_inside(spot, low, high) == pytest.approx(0.7 * exact, rel=1e-11)
    whole = sd.optics.power_inside(spot, (-0.12, -0.1), (0.12, 0.1))
    assert image.sum() / 1e5 == pytest.approx(whole, rel=1e-14)


def test_far_tails_keep_their_relative_precision() -> None:
    spot = sd.optics.BeamSpot((0.0, 0.0), 0.5)
    with mp.workdps(40):
        for edge in (1.0, 3.0, 6.0):
            exact = mp.erfc(mp.sqrt(2) * edge / mp.mpf("0.5")) / 2
            assert sd.optics.power_inside(spot, (edge, -50), (50, 50)) == pytest.approx(float(exact), rel=1e-13)


@pytest.mark.parametrize("centre", [(0.0, 0.0), (1.7, -0.4), (-2.3, 1.6)])
def test_position_device_reads_the_centroid_of_what_falls_on_it(centre: tuple[float, float]) -> None:
    device, ghost = sd.optics.LateralEffect(size=(4.0, 3.0)), sd.optics.BeamSpot((-0.5, 0.7), 0.9, 0.05)
    total = np.zeros(3)
    for spot in (sd.optics.BeamSpot(centre, 0.6, 0.8), ghost):
        normal = [stats.norm(c, spot.radius / 2) for c in spot.centre]
        power = [n.expect(lambda _: 1.0, lb=-half, ub=half) for n, half in zip(normal, (2.0, 1.5), strict=True)]
        mean = [n.expect(lambda t: t, lb=-half, ub=half) for n, half in zip(normal, (2.0, 1.5), strict=True)]
        total += spot.power * np.array([power[0] * power[1], mean[0] * power[1], mean[1] * power[0]])
    position = sd.optics.locate(device, [sd.optics.BeamSpot(centre, 0.6, 0.8), ghost])
    assert position == pytest.approx(total[1:] / total[0], abs=1e-8)  # quadrature's tolerance


def test_noise_depends_on_seed_and_counter_alone() -> None:
    camera = sd.optics.Camera(columns=40, rows=30, shot_noise=True, read_noise=2.0, background=10.0)
    images = [sd.optics.expose(camera, [SPOT], seed=5, counter=i) for i in range(8)]
    with ThreadPoolExecutor(4) as pool:
        again = list(pool.map(lambda i: sd.optics.expose(camera, [SPOT], seed=5, counter=i), reversed(range(8))))
    for first, second in zip(images, reversed(again), strict=True):
        np.testing.assert_array_equal(first, second)
    assert not np.array_equal(images[0], images[1])
    assert not np.array_equal(images[0], sd.optics.expose(camera, [SPOT], seed=6, counter=0))
    device = sd.optics.LateralEffect(noise=1e-3)
    np.testing.assert_array_equal(*(sd.optics.locate(device, [SPOT], seed=2**64 - 1, counter=7) for _ in range(2)))
    assert not np.array_equal(sd.optics.locate(device, [SPOT], seed=1), sd.optics.locate(device, [SPOT], seed=2))


# --- centroid ---


def camera_for(radius: float, electrons: float, **options: Any) -> sd.optics.Camera:
    """Large enough that a spot near the middle loses no light."""
    size = int(6 * radius) + 16
    return sd.optics.Camera(columns=size, rows=size, electrons=electrons, **options)


def information(mean: float, read_noise: float) -> float:
    """Of a Poisson number plus a Gaussian, about its mean; the sum over k and the integral over z written out."""
    if read_noise == 0.0:
        return 1 / mean
    k = np.arange(int(mean + 12 * math.sqrt(mean) + 30))
    step = min(read_noise, 1.0) / 20
    z = np.arange(-10 * read_noise, k[-1], step)
    poisson = stats.poisson.pmf(k, mean)
    gaussian = stats.norm.pdf(z[:, None], k, read_noise)
    density, slope = gaussian @ poisson, gaussian @ (poisson * (k / mean - 1))
    seen = density > 1e-280
    return float(np.sum(slope[seen] ** 2 / density[seen]) * step)


@pytest.mark.parametrize("read_noise", [0.0, 0.4, 1.5])
def test_cramer_rao_bound_is_the_inverse_of_the_information(read_noise: float) -> None:
    """Fisher information from mpmath's derivatives of the pixels' means, 5 x 5, inverted at 30 digits."""
    camera = sd.optics.Camera(
        columns=14, rows=12, electrons=400.0, background=0.3, read_noise=read_noise, shot_noise=True
    )
    with mp.workdps(30):
        truth = [mp.mpf(v) for v in ("0.0031", "-0.0042", "0.027", "400", "0.3")]
        step = mp.mpf("0.01")

        def shares(centre: mp.mpf, radius: mp.mpf, count: int) -> list[mp.mpf]:
            cdf = [mp.erf(mp.sqrt(2) * ((i - count / 2) * step - centre) / radius) / 2 for i in range(count + 1)]
            return [b - a for a, b in pairwise(cdf)]

        def means(parameters: list[mp.mpf]) -> np.ndarray:
            x, y, radius, electrons, background = parameters
            return np.outer(shares(y, radius, 12), shares(x, radius, 14)) * electrons + background

        def derivative(i: int) -> np.ndarray:
            h = mp.mpf("1e-9")
            up, down = ([v + sign * h * (j == i) for j, v in enumerate(truth)] for sign in (1, -1))
            return (means(up) - means(down)) / (2 * h)

        by = [derivative(i) for i in range(5)]
        weight = np.vectorize(lambda mean: mp.mpf(information(float(mean), read_noise)), otypes=[object])(means(truth))
        total = mp.matrix(5, 5)
        for i in range(5):
            for j in range(5):
                total[i, j] = (by[i] * by[j] * weight).sum()
        exact = mp.sqrt((total**-1)[0, 0])
    bound = sd.optics.cramer_rao_bound(camera, sd.optics.BeamSpot((0.0031, -0.0042), 0.027))
    # A pixel's information is interpolated between 16 means a decade: 1e-4. Without read noise the limit is rounding.
    assert bound == pytest.approx(float(exact), rel=1e-4 if read_noise else 1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [2.0, 3.0, 5.0, 10.0, 20.0])
@pytest.mark.parametrize("electrons", [1e3, 1e4, 1e5, 1e6])
@pytest.mark.parametrize("read_noise", [0.0, 1.5])
def test_gaussian_fit_is_within_a_tenth_of_the_cramer_rao_bound(
    radius: float, electrons: float, read_noise: float
) -> None:
    # 400 images have 800 errors, whose deviation is known to 1/sqrt(1600) = 2.5 %: 1.1 is four of that.
    camera, images = camera_for(radius, electrons, shot_noise=True, read_noise=read_noise), 400
    errors = np.empty((images, 2))
    for i in range(images):
        spot = sd.optics.BeamSpot((0.0013 * (i % 4), 0.0049 - 0.0023 * (i % 4)), 0.01 * radius)
        errors[i] = sd.optics.locate(camera, sd.optics.expose(camera, [spot], seed=3, counter=i)) - spot.centre
    bound = sd.optics.cramer_rao_bound(camera, sd.optics.BeamSpot((0.0013, 0.0026), 0.01 * radius))
    assert 0.9 < math.sqrt(np.mean(errors**2)) / bound < 1.1
    # The mean's own noise, four of its deviations, is allowed beside the 0.01 pixel.
    assert np.abs(errors.mean(axis=0)).max() < 0.01 * camera.pixel + 4 * bound / math.sqrt(images)


@pytest.mark.parametrize("centroid", ["gaussian_fit", "centre_of_gravity"])
@pytest.mark.parametrize("radius", [2.0, 2.7, 6.0, 20.0])
def test_centroid_has_no_bias_away_from_the_edge(centroid: str, radius: float) -> None:
    camera = camera_for(radius, 1e5, shot_noise=True, read_noise=1.5, background=5.0, centroid=centroid)
    quiet = camera_for(radius, 1e5, background=5.0)
    for x, y in np.random.default_rng(4).uniform(-0.005, 0.005, (40, 2)):
        expectation = sd.optics.expose(quiet, [sd.optics.BeamSpot((x, y), 0.01 * radius)])
        bias = np.abs(sd.optics.locate(camera, expectation) - (x, y)).max() / camera.pixel
        assert bias < (1e-5 if centroid == "gaussian_fit" else 0.01)  # the fit's stops short of its last step


def test_nothing_is_located_where_there_is_no_spot() -> None:
    for centroid in ("gaussian_fit", "centre_of_gravity"):
        camera = sd.optics.Camera(
            columns=64, rows=64, read_noise=2.0, background=10.0, shot_noise=True, centroid=centroid
        )
        assert sd.optics.locate(camera, sd.optics.expose(camera, [], seed=1)) is None
    assert sd.optics.locate(sd.optics.LateralEffect(), [sd.optics.BeamSpot((30.0, 0.0), 0.5)]) is None


# --- bad input ---

BAD: list[tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any], str]] = [
    (sd.optics.GaussianMode, (0.0, 0.8), {}, "wavelength"),
    (sd.optics.GaussianMode, (1530.0, NAN), {}, "waist_radius"),
    (sd.optics.GaussianMode, (1530.0, 0.8, INF), {}, "waist_position"),
    (sd.optics.ReturnedBeam, ((0, 0, 0), (0, 0, -1), 1.0, 1.0), {}, "position"),
    (sd.optics.ReturnedBeam, ((0, NAN), (0, 0, -1), 1.0, 1.0), {}, "position"),
    (sd.optics.ReturnedBeam, ((0, 0), (0, 0, 1), 1.0, 1.0), {}, "direction"),
    (sd.optics.ReturnedBeam, ((0, 0), (0, 0.1, -1), 1.0, 1.0), {}, "direction"),
    (sd.optics.ReturnedBeam, ((0, 0), (0, 0, -1), INF, 1.0), {}, "optical_length"),
    (sd.optics.ReturnedBeam, ((0, 0), (0, 0, -1), 1.0, NAN), {}, "reduced_length"),
    (sd.optics.couple, (MODE, from_mirror(10.0, 0.0), 0.0), {}, "index"),
    *((sd.optics.read_distance, (sd.optics.Interferometer(), MODE, from_mirror(10.0, 0.0)), {name: bad}, name)
      for name, bad in [("true_index", NAN), ("assumed_index", -1)]),
    *((sd.optics.Interferometer, (), {key: bad}, f"interferometer {key}") for key, bad in [
        ("aperture", 0.0), ("acceptance", -1.0), ("least_coupling", 2.0), ("resolution", -1e-9),
        ("periodic_amplitude", NAN), ("dead_path", INF), ("index_error", 0.5)]),
    (sd.optics.Interferometer, (), {"reading_model": "fibre"}, "reading_model"),
    (sd.optics.BeamSpot, ((0, INF), 0.1), {}, "spot centre"),
    (sd.optics.BeamSpot, ((0, 0), 0.0), {}, "spot radius"),
    (sd.optics.BeamSpot, ((0, 0), 0.1, -0.1), {}, "spot power"),
    *((sd.optics.Camera, (), {key: bad}, key) for key, bad in [
        ("pixel", 0.0), ("columns", 2), ("rows", 2**40), ("electrons", NAN), ("background", -1.0),
        ("read_noise", -1.0), ("full_well", 0.0), ("bits", 64), ("centroid", "mean"), ("threshold", 1.0)]),
    *((sd.optics.LateralEffect, (), {key: bad}, key) for key, bad in [
        ("size", (0.0, 1.0)), ("noise", -1.0), ("resolution", NAN), ("least_power", 0.0)]),
    (sd.optics.expose, (sd.optics.Camera(), [SPOT]), {"seed": -1}, "seed"),
    (sd.optics.expose, (sd.optics.Camera(), [SPOT]), {"counter": -1}, "counter"),
    (sd.optics.locate, (sd.optics.Camera(), np.zeros((3, 3))), {}, "image"),
    (sd.optics.locate, (sd.optics.Camera(), np.zeros(5)), {}, "image"),
    (sd.optics.locate, (sd.optics.Camera(), "dark"), {}, "image"),
    (sd.optics.locate, (sd.optics.Camera(columns=4, rows=4), np.full((4, 4), NAN)), {}, "image"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "arguments", "options", "names"), BAD)
def test_bad_input_is_refused_by_its_name(
    call: Callable[..., Any], arguments: tuple[Any, ...], options: dict[str, Any], names: str
) -> None:
    refused(call, *arguments, names=names, **options)
