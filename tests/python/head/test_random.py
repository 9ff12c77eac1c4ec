"""Heads that nobody would build, far out of place, against 40 digits: wedges and plates at odd angles, any glass."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from places import SHIPPED_HEADS
from reference_optics import MP, Component, Description, half_path, read_description, spot, tilted_mirror
from shipped_heads import SHIPPED, Shipped
from small_heads import read

import stepdiag as sd

AIR = sd.Environment(1.00027)


def symmetric(size: float) -> st.SearchStrategy[float]:
    return st.floats(-size, size)


def triples(size: float) -> st.SearchStrategy[tuple[float, float, float]]:
    return st.tuples(*[symmetric(size)] * 3)


glass = st.floats(1.3, 1.9)
tilts = st.tuples(symmetric(2e-3), symmetric(2e-3))
distances = st.floats(200.0, 1000.0)


@settings(max_examples=60)
@given(glass, glass, triples(0.1), triples(0.3), symmetric(0.01), triples(1e-3), tilts, distances)
def test_beams_through_wedge_and_plate_hold_against_forty_digits(
    index: float,
    other: float,
    wedge_turn: tuple[float, float, float],
    plate_turn: tuple[float, float, float],
    angle: float,
    beam_turn: tuple[float, float, float],
    tilt: tuple[float, float],
    distance: float,
) -> None:
    wedge = {"width": 150.0, "height": 150.0, "thickness": 8.0, "angle": angle}
    plate = {"width": 150.0, "height": 150.0, "thickness": 5.0}
    offsets = [(0.0, 0.0), (45.0, 0.0), (0.0, 45.0)]
    beams = [
        sd.optics.HeadBeam.interferometer(f"beam {i}", position=(u, v, 0.0), rotation=beam_turn, aperture=40.0)
        for i, (u, v) in enumerate(offsets)
    ]
    bodies = [
        sd.optics.HeadBody.wedge("wedge", **wedge, material=index, position=(20.0, 20.0, 40.0), rotation=wedge_turn),
        sd.optics.HeadBody.plate("plate", **plate, material=other, position=(20.0, 20.0, 110.0), rotation=plate_turn),
    ]
    head = sd.Head.from_design(sd.optics.HeadDesign("odd", "multi_beam", bodies, beams), standoff=170.0)
    signals = read(head, distance=distance, tilt=tilt, environment=AIR)
    aligned = read(head, distance=170.0, environment=AIR)
    assume(not np.isnan([signals, aligned]).any())

    around = {"position": (20.0, 20.0, 40.0), "rotation": wedge_turn}
    components: dict[str, Any] = {
        "wedge": Component(wedge | {"shape": "wedge", "material": index}, **around),
        "plate": Component(plate | {"material": other}, (20.0, 20.0, 110.0), plate_turn),
    }
    routes = {}
    for i, (u, v) in enumerate(offsets):
        components[f"beam {i}"] = Component({"wavelength": 1530.0}, (u, v, 0.0), beam_turn)
        out = ["wedge -z", "wedge +z", "plate -z", "plate +z"]
        back = ["plate +z", "plate -z", "wedge +z", "wedge -z"]
        routes[f"beam {i}"] = [*out, "mirror", *back, f"beam {i}"]
    exact = Description(components, routes)
    for i, name in enumerate(routes):
        here, there = (
            half_path(exact, name, MP.mpf(1.00027), mirror)
            for mirror in (tilted_mirror(distance, *tilt), tilted_mirror(170.0))
        )
        # The head constant drops out of a difference. Two paths of up to 2 m.
        assert abs(float(here - there) - (signals[i] - aligned[i])) <= 5e-12


@pytest.mark.slow
@pytest.mark.parametrize("shipped", SHIPPED, ids=lambda shipped: shipped.file)
@settings(max_examples=40)
@given(st.integers(0, 2**32), tilts, distances)
def test_shipped_heads_far_out_of_place_hold_against_forty_digits(
    shipped: Shipped, seed: int, tilt: tuple[float, float], distance: float
) -> None:
    """A third of a millimetre and milliradians: nothing is to first order."""
    path = SHIPPED_HEADS / f"{shipped.file}.toml"
    random = np.random.default_rng(seed)
    errors = {
        name: (tuple(random.uniform(-0.3, 0.3, 3)), tuple(random.uniform(-2e-3, 2e-3, 3)))
        for name in read_description(path, shipped.routes).components
    }
    design = sd.optics.shipped_head(shipped.file)
    displaced, sound = sd.Head.from_design(design, pose_errors=errors), sd.Head.from_design(design)
    signals = read(displaced, distance=distance, tilt=tilt, environment=AIR)
    reference = read(sound, distance=distance, environment=AIR)
    assume(not np.isnan(signals).any())
    exact, nominal = read_description(path, shipped.routes, errors), read_description(path, shipped.routes)
    here, aligned = tilted_mirror(distance, *tilt), tilted_mirror(distance)
    air = MP.mpf(1.00027)
    for i, name in enumerate(shipped.interferometers):
        change = half_path(exact, name, air, here) - half_path(nominal, name, air, aligned)
        assert abs(float(change) - (signals[i] - reference[i])) <= 5e-12
    if shipped.laser:
        change = spot(exact, shipped.laser, air, here) - spot(nominal, shipped.laser, air, aligned)
        # The nominal axes of this head's sensor are those of the unfolded beam, 1 to 5e-12; spots of up to 6 mm.
        assert np.max(np.abs(change.astype(float) - (signals[1:] - reference[1:]))) <= 5e-11


# Coatings: where the power goes.


def coated(reflectance: float, absorptance: float = 0.0) -> sd.Head:
    window = sd.optics.HeadBody.plate(
        "window", width=40, height=80, thickness=5, material=1.5, position=(0, 0, 60), reflectance=reflectance
    )
    cube = sd.optics.HeadBody.cube_splitter(
        "cube", edge=20.0, material=1.5, reflectance=0.4, absorptance=absorptance, position=(0, -16, 20)
    )
    device = sd.optics.SpotSensor.lateral_effect(
        "psd", position=(-20, -16, 20), rotation=(0, -math.pi / 2, 0), size=(12, 12)
    )
    beams = [
        sd.optics.HeadBeam.interferometer("distance", position=(0.0, 0.0, 0.0)),
        sd.optics.HeadBeam.spot("laser", sensor="psd", position=(0.0, -16.0, -5.0)),
    ]
    return sd.Head.from_design(
        sd.optics.HeadDesign("coated", "psd", [window, cube], beams, [device], least_power=1e-15)
    )


@pytest.mark.parametrize("reflectance", [0.0, 0.0025, 0.04])
def test_powers_at_the_detectors_are_products_of_shares(reflectance: float) -> None:
    segments = sd.optics.trace_beams(coated(reflectance, 0.1), distance=500.0, tilt=(1e-4, 2e-4))
    arrived = sorted((s.power for s in segments if s.arrives == "psd"), reverse=True)
    through, share = (1 - reflectance) ** 4, 0.5 * 0.4  # goes on at the cube, is sent aside on its return
    # Before the mirror the window's two faces send back what a device sees as straylight, the brighter one.
    straylight = [share * reflectance, share * reflectance * (1 - reflectance) ** 2]
    expected = sorted([share * through, *straylight], reverse=True) if reflectance else [share]
    assert np.allclose(arrived[: len(expected)], expected, rtol=1e-13, atol=0)
    back = [s.power for s in segments if s.arrives == "distance"]
    assert max(back) == pytest.approx(max(through, reflectance), rel=1e-13)


@pytest.mark.parametrize("reflectance", [0.0, 0.0025, 0.04])
def test_power_of_all_leaves_is_that_of_the_source(reflectance: float) -> None:
    segments = sd.optics.trace_beams(coated(reflectance), distance=500.0, tilt=(1e-4, 2e-4))
    for beam in ("distance", "laser"):
        leaves = [s.power for s in segments if s.beam == beam and s.fate != "goes_on"]
        assert abs(math.fsum(leaves) - 1.0) <= 1e-12  # some hundred products of shares
