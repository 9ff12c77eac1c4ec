"""Derivatives of traced readings: against differences of the trace, and against closed forms."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from small_heads import OFFSETS, SpotHead, read, three_beams, window

import stepdiag as sd

MIRROR = {"distance": 700.0, "tilt": (2e-4, -3e-4), "lateral": (3.0, -2.0), "environment": sd.Environment()}
AXES = "xyz"
NUMBERS = SpotHead()
AIR = sd.Environment.from_air(temperature=22.0, relative_humidity=0.3)

# Central differences over 2 h: roundings of 2e-13 mm over it, and a third of h^2 of the lever, tan(h) = h + h^3/3. A
# shift acts linearly, so it may be long; a laser's lever is 1.4 m.
STEP = {"mm": 1e-2, "rad": 1e-4}
LIMIT = {"mm": 1e-10, "rad": 1e-5}


def a_head(name: str, pose_errors: dict | None = None) -> sd.Head:
    if name == "spot":
        return NUMBERS.head(pose_errors=pose_errors)
    if name == "beams":
        return three_beams(window(rotation=(0.02, 0.01, 0.0)), pose_errors=pose_errors)
    return sd.Head.from_design(sd.optics.shipped_head(name), pose_errors=pose_errors or {})


def by_name(head: sd.Head, **mirror: object) -> dict[tuple[str, str], sd.optics.Sensitivity]:
    return {(s.component, s.quantity): s for s in sd.optics.head_sensitivities(head, **(MIRROR | mirror))}


def parts(head: sd.Head) -> Iterator[str]:
    assert head.design
    for part in [*head.design.bodies, *head.design.beams, *head.design.sensors]:
        yield part.name


@pytest.mark.parametrize("name", ["spot", "beams", "three_beams", "beam_and_psd"])
def test_derivatives_by_poses_are_the_trace_s_differences(name: str) -> None:
    head = a_head(name)
    derivatives = by_name(head)
    for part in parts(head):
        for kind, unit in (("shift", "mm"), ("rotation", "rad")):
            for axis in range(3):
                h = STEP[unit]
                ends = []
                for sign in (1, -1):
                    error = {"shift": np.zeros(3), "rotation": np.zeros(3)}
                    error[kind][axis] = sign * h
                    moved = a_head(name, {part: (tuple(error["shift"]), tuple(error["rotation"]))})
                    ends.append(read(moved, **MIRROR))
                found = derivatives[part, f"{kind} {AXES[axis]}"]
                assert found.unit == unit
                assert np.max(np.abs((ends[0] - ends[1]) / (2 * h) - found.signals)) <= LIMIT[unit], found.quantity


@pytest.mark.parametrize("name", ["spot", "beams", "three_beams", "beam_and_psd"])
def test_derivatives_are_exact_where_components_are_out_of_place_already(
    name: str,
) -> None:
    """Rotations about the component's own, displaced, origin; on top of a pose error."""
    random = np.random.default_rng(3)
    start = {part: (random.uniform(-0.05, 0.05, 3), random.uniform(-2e-4, 2e-4, 3)) for part in parts(a_head(name))}
    derivatives = by_name(a_head(name, start))
    for part in start:
        for axis in range(3):
            ends = []
            for sign in (1, -1):
                shift = start[part][0] + sign * 1e-2 * np.eye(3)[axis]
                ends.append(read(a_head(name, start | {part: (shift, start[part][1])}), **MIRROR))
            found = derivatives[part, f"shift {AXES[axis]}"].signals
            assert np.max(np.abs((ends[0] - ends[1]) / 2e-2 - found)) <= LIMIT["mm"]


@pytest.mark.parametrize("name", ["spot", "three_beams"])
def test_derivatives_by_the_mirror_are_those_of_its_definition(name: str) -> None:
    """Shifts along z act by (1 + 1/cos 2 phi)/2 on distances. Turned about its own centre: by tilts."""
    head = a_head(name)
    derivatives = by_name(head)
    for axis, key in enumerate(("lateral x", "lateral y", "distance")):
        ends = []
        for sign in (1, -1):
            mirror = {**MIRROR}
            if axis == 2:
                mirror["distance"] = 700.0 + sign * 1e-2
            else:
                mirror["lateral"] = tuple(np.array(MIRROR["lateral"]) + sign * 1e-2 * np.eye(2)[axis])
            ends.append(read(head, **mirror))
        found = derivatives["mirror", f"shift {AXES[axis]}"].signals
        assert np.max(np.abs((ends[0] - ends[1]) / 2e-2 - found)) <= LIMIT["mm"], key


def test_derivatives_by_rotations_of_an_aligned_mirror() -> None:
    """alpha turns about x and beta about y; distances change by -beta u + alpha v, spots by their levers."""
    aligned = {"tilt": (0.0, 0.0), "lateral": (0.0, 0.0)}
    beams = by_name(three_beams(), **aligned)
    about_x, about_y = (beams["mirror", f"rotation {axis}"] for axis in "xy")
    assert np.allclose(about_x.signals, [v for _, v in OFFSETS], rtol=0, atol=1e-12)
    assert np.allclose(about_y.signals, [-u for u, _ in OFFSETS], rtol=0, atol=1e-12)
    assert np.allclose(about_x.reading, [0, 1, 0], rtol=0, atol=1e-12)
    assert np.allclose(about_y.reading, [0, 0, 1], rtol=0, atol=1e-12)
    lever = 2 * (700.0 + NUMBERS.psd_distance)
    spots = by_name(NUMBERS.head(), **aligned)
    # The spot's axes are 1 to 5e-12, and the sensor's lever is 1.4 m.
    assert np.allclose(spots["mirror", "rotation x"].signals, [0, 0, lever], rtol=0, atol=2e-8)
    assert np.allclose(spots["mirror", "rotation y"].signals, [0, -lever, 0], rtol=0, atol=2e-8)
    assert np.allclose(spots["mirror", "rotation x"].reading, [0, 1, 0], rtol=0, atol=2e-11)


def test_derivatives_of_parts_are_the_levers_of_a_drawing() -> None:
    aligned = {"tilt": (0.0, 0.0), "lateral": (0.0, 0.0)}
    spots = by_name(NUMBERS.head(), **aligned)
    lever = NUMBERS.lever
    way = 700.0 - NUMBERS.laser - NUMBERS.edge * (1 - 1 / NUMBERS.index) + 700.0 + NUMBERS.psd_distance
    for (part, quantity), expected in {
        ("psd", "shift z"): (-1, 0),
        ("psd", "shift y"): (0, -1),
        ("psd", "shift x"): (0, 0),
        ("psd", "rotation x"): (0, 0),
        ("laser", "shift x"): (1, 0),
        ("laser", "shift y"): (0, 1),
        ("laser", "shift z"): (0, 0),
        ("laser", "rotation y"): (way, 0),
        ("laser", "rotation x"): (0, -way),
        ("cube", "rotation y"): (2 * lever, 0),
        ("cube", "rotation x"): (0, -lever),
        ("cube", "rotation z"): (0, -lever),
        ("cube", "shift z"): (1, 0),
        ("cube", "shift x"): (-1, 0),
        ("cube", "shift y"): (0, 0),
        ("cube", "index"): (0, 0),
    }.items():
        found = spots[part, quantity].signals
        assert np.allclose(found, [0, *expected], rtol=0, atol=2e-8), (part, quantity)
    beams = by_name(three_beams(window()), **aligned)
    for (part, quantity), expected in {
        ("beam 2", "shift z"): (0, -1, 0),
        ("beam 2", "shift x"): (0, 0, 0),
        ("beam 2", "rotation y"): (0, 0, 0),
        ("window", "shift z"): (0, 0, 0),
        ("window", "rotation x"): (0, 0, 0),
        ("window", "index"): (5, 5, 5),  # its thickness, over an index of 1
    }.items():
        assert np.allclose(beams[part, quantity].signals, expected, rtol=0, atol=1e-9), (part, quantity)


@pytest.mark.parametrize("name", ["spot", "beams"])
def test_derivatives_by_the_index_of_glass_and_air(name: str) -> None:
    """The reading's head constant was taken of the nominal index: what changes is in the light alone."""

    def with_index(index: float) -> sd.Head:
        if name == "spot":
            return SpotHead().head(material=index)
        return three_beams(window(material=index))

    h = 1e-4
    body = "cube" if name == "spot" else "window"
    head = with_index(1.5)
    air = sd.Environment(1.0002)
    derivatives = by_name(head, environment=air)
    # The head's own calibration follows its design's index, so its constants are put back to see the light.
    ends = []
    for index in (1.5 + h, 1.5 - h):
        other = with_index(index)
        signals = read(other, **(MIRROR | {"environment": air}))
        if name == "beams":
            signals += 5.0 * (index - 1.5) / 1.0002
        ends.append(signals)
    found = derivatives[body, "index"].signals
    if name == "beams":
        assert np.max(np.abs((ends[0] - ends[1]) / (2 * h) - found)) <= 1e-8
    else:
        assert np.max(np.abs((ends[0] - ends[1])[1:] / (2 * h) - found[1:])) <= 1e-6
    # Air: what is read with the assumed index as it was.
    ends = [
        read(
            head,
            **(MIRROR | {"environment": sd.Environment(1.0002 + d)}),
            assumed_environment=air,
        )
        for d in (1e-5, -1e-5)
    ]
    change = (ends[0] - ends[1]) / 2e-5
    assert np.max(np.abs(change - derivatives["air", "index"].signals)) <= 1e-6  # roundings of 2e-13 / 2e-5, and more


def test_derivatives_by_the_state_of_the_air_are_the_published_ones() -> None:
    """-0.94 ppm a kelvin, 0.265 ppm a hectopascal, -0.009 ppm a percent, of all of the way in air."""
    head = three_beams(window())
    derivatives = by_name(head, environment=sd.Environment.from_air(), tilt=(0.0, 0.0))
    for quantity, unit, ppm, tolerance in (
        ("temperature", "K", -0.94, 0.02),
        ("pressure", "Pa", 0.00265, 2e-5),
        ("humidity", "1", -0.9, 0.05),
    ):
        found = derivatives["air", quantity]
        assert found.unit == unit
        assert found.signals == pytest.approx(np.full(3, ppm * 1e-6 * 695.0), abs=tolerance * 1e-6 * 695.0)
    # All of the path is divided by the index, that in glass too.
    (wrong,) = (found for (_, quantity), found in derivatives.items() if quantity == "index error")
    wrong = wrong.signals
    ratio = 1.5 / sd.Environment.from_air().refractive_index(1530.0)
    assert np.allclose(wrong, -(695.0 + 5.0 * ratio), rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["three_beams", "beam_and_psd"])
def test_reduced_derivatives_are_those_of_the_evaluation_s_reduction(name: str) -> None:
    """(distance, alpha, beta) of signals that are read; with the tilts of the mirror as they come out."""
    head = a_head(name)
    derivatives = sd.optics.head_sensitivities(head, **MIRROR)
    calibration = head.calibration

    def reduce(signals: np.ndarray) -> np.ndarray:
        if name == "three_beams":
            (u1, v1), (u2, v2), (u3, v3) = calibration.beam_offsets
            matrix = np.array([[1, v1, -u1], [1, v2, -u2], [1, v3, -u3]])
            a, b, c = np.linalg.solve(matrix, signals)  # L, alpha, beta, all over 1 - t
            alpha = beta = 0.0
            for _ in range(20):
                gain = 1 - alpha**2 - beta**2
                alpha, beta = b * gain, c * gain
            return np.array([a, alpha, beta])
        distance, x, y = signals
        alpha = beta = 0.0
        for _ in range(50):
            gain = 1 - alpha**2 - beta**2
            length = distance * gain - beta * calibration.spot_beam[0] + alpha * calibration.spot_beam[1]
            scale = gain / (2 * (length + calibration.psd_distance))
            alpha, beta = y * scale, -x * scale
        return np.array([distance, alpha, beta])

    signals = read(head, **MIRROR)
    for found in derivatives:
        size = np.max(np.abs(found.signals))
        if size == 0.0:
            assert not found.reading.any()
            continue
        step = 1e-3 / size
        change = (reduce(signals + step * found.signals) - reduce(signals - step * found.signals)) / (2 * step)
        # Second differences of 1e-3 mm, and roundings of 2e-13 mm over it, or over it and 20 mm of baseline.
        assert np.max(np.abs(change - found.reading) / [1, 0.05, 0.05]) <= 1e-7 * size, (
            found.component,
            found.quantity,
        )
