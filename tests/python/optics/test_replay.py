"""Recorded paths that are replayed for all poses of a line: what they see, and what they leave to a verification."""

from __future__ import annotations

import numpy as np
import pytest
import reference
from reference_optics import MP, Plane, mirror_in_sensor_frame
from simulated_runs import table_of
from small_heads import APERTURE, OFFSETS, SpotHead, read, three_beams, window
from truth import Setup
from usual import CHAIN, VOLUME

import stepdiag as sd

STEPS = 20
LINE = "ppp"
TURNED = (0.0, 1e-3)  # reflector: the light comes back at x = -2 mrad x distance, from -0.2 to -2.3 mm


def run_of(head: sd.Head, reflector: tuple[float, float] = TURNED, **options: float) -> sd.Measurement:
    setup = Setup(steps=STEPS, lines=[LINE], scale_lines=[], head=head)
    machine = sd.Machine(sd.Chain(CHAIN), setup.errors(5))
    misalignment = {LINE: sd.Misalignment(reflector=reflector)}
    return sd.simulate(machine, setup.plan, head, misalignment=misalignment, **options)


def mirrors(run: sd.Measurement, reflector: tuple[float, float] = TURNED) -> list[Plane]:
    scenario = reference.Scenario(
        VOLUME, CHAIN, [LINE], STEPS, misalignment={LINE: {"reflector": reflector}} if any(reflector) else {}
    )
    table = table_of(Setup(steps=STEPS).errors(5))
    return [mirror_in_sensor_frame(scenario, table, LINE, position) for position in run.position]


def screen(x: float, width: float, name: str = "screen") -> sd.optics.HeadBody:
    """Before the beams, 40 mm from the reference plane: the light on its way back passes it at x."""
    return sd.optics.HeadBody.screen(name, width=width, height=8.0, position=(x, 0.0, 40.0))


ALL_BUT_ONE_IN_A_MILLION = 1 - 1e-6  # a share of 1 is no verification: everything is traced


@pytest.mark.parametrize("head", [three_beams(window()), SpotHead().head()], ids=["multi_beam", "psd"])
def test_verification_changes_no_bit(head: sd.Head) -> None:
    none, default, verified = (run_of(head, verified_share=share) for share in (0.0, 1e-3, ALL_BUT_ONE_IN_A_MILLION))
    traced = run_of(head, verified_share=1.0)
    for name, values in none.channels.items():
        assert not np.isnan(values).any()
        assert np.array_equal(values, default.channels[name])
        assert np.array_equal(values, verified.channels[name])
        # The same light with other roundings: of paths of 2.4 m.
        assert np.max(np.abs(values - traced.channels[name])) <= 5e-12


@pytest.mark.parametrize("head", [three_beams(window()), SpotHead().head()], ids=["multi_beam", "psd"])
def test_replayed_readings_are_the_traced_ones(head: sd.Head) -> None:
    run = run_of(head)
    for i, mirror in list(enumerate(mirrors(run)))[::6]:
        # The same mirror by its tilts and a point: (alpha, beta) = (-n_y, n_x)/n_z.
        n, (x, y, z) = mirror.normal, (float(c) for c in mirror.point)
        tilt = (float(-n[1] / n[2]), float(n[0] / n[2]))
        traced = read(head, distance=z, tilt=tilt, lateral=(x, y))
        replayed = [run.channels[name][i] for name in head.signals]
        # Tilts rounded to 1e-19 and coordinates to 1e-13 mm, traced with other roundings: spots 2.4 m away.
        assert np.max(np.abs(traced - replayed)) <= 1e-11


def return_of(plane: Plane, offset: tuple[float, float]) -> tuple[float, float, float]:
    """Where a beam from (u, v) comes back to the reference plane, from its start, and the angle it makes with z."""
    n, start = plane.normal, np.array([MP.mpf(offset[0]), MP.mpf(offset[1]), MP.mpf(0)])
    length = ((plane.point - start) @ n) / n[2]
    back = np.array([0, 0, 1]) - 2 * n[2] * n
    at = np.array([0, 0, length]) + back * (length / -back[2])
    return float(at[0]), float(at[1]), float(MP.acos(-back[2]))


@pytest.mark.parametrize("reflector", [(0.0, 6e-3), (-5e-3, 3e-3)])
def test_reading_is_lost_where_the_light_comes_back_beside_the_aperture(reflector: tuple[float, float]) -> None:
    run = run_of(three_beams(window(material=1.0)), reflector, verified_share=1.0)
    lost = []
    for i, mirror in enumerate(mirrors(run, reflector)):
        for name, offset in zip(("d1", "d2", "d3"), OFFSETS, strict=True):
            x, y, _ = return_of(mirror, offset)
            lost.append(max(abs(x), abs(y)) > APERTURE / 2)
            assert np.isnan(run.channels[name][i]) == lost[-1], (name, i, x, y)
    assert 20 <= sum(lost) <= len(lost) - 60, "both sorts"


def test_reading_is_lost_where_the_light_comes_back_too_inclined() -> None:
    head = three_beams(acceptance=2.03e-3)  # the mirror is turned by 1 mrad and what the machine's errors add
    run = run_of(head)
    inclined = [return_of(mirror, (0.0, 0.0))[2] > 2.03e-3 for mirror in mirrors(run)]
    assert np.array_equal(np.isnan(run.channels["d1"]), inclined)
    assert 5 <= sum(inclined) <= len(inclined) - 5


def test_spot_beside_the_device_is_lost_and_the_distance_is_not() -> None:
    reflector = (0.0, 3e-3)
    run = run_of(SpotHead().head(), reflector, verified_share=1.0)
    ideal = Setup(steps=STEPS, lines=[LINE], scale_lines=[], head=sd.Head("psd", psd_distance=SpotHead().psd_distance))
    machine = sd.Machine(sd.Chain(CHAIN), ideal.errors(5))
    defined = sd.simulate(machine, ideal.plan, ideal.head, misalignment={LINE: sd.Misalignment(reflector=reflector)})
    x = defined.channels["spot_x"]  # of a beam from the origin: the spot's own starts 30 mm aside, 3e-3 x 60 mm less
    # The device is 10 mm wide.
    assert np.isnan(run.channels["spot_x"][np.abs(x) > 5.3]).all()
    assert not np.isnan(run.channels["spot_x"][np.abs(x) < 4.7]).any()
    assert np.array_equal(np.isnan(run.channels["spot_x"]), np.isnan(run.channels["spot_y"]))
    assert np.sum(np.abs(x) > 5.3) >= 5
    assert not np.isnan(run.channels["distance"]).any()


def place_on_screen(mirror: Plane) -> float:
    """x of the first beam on its way back, 40 mm before the reference plane."""
    n = mirror.normal
    length = (mirror.point @ n) / n[2]
    back = np.array([0, 0, 1]) - 2 * n[2] * n
    return float(back[0] * (length - 40) / -back[2])


@pytest.mark.parametrize("share", [0.0, 1e-3, ALL_BUT_ONE_IN_A_MILLION, 1.0])
@pytest.mark.parametrize(
    ("x", "width", "which"), [(-1.75, 0.4, "between the recorded poses"), (-3.0, 2.0, "the last pose, and others")]
)
def test_body_in_the_way_of_some_poses_is_found(x: float, width: float, which: str, share: float) -> None:
    """A replay looks for no other faces, so it is not used where one is near the recorded paths."""
    run = run_of(three_beams(screen(x, width)), verified_share=share)
    blocked = [abs(place_on_screen(mirror) - x) <= width / 2 for mirror in mirrors(run)]
    assert 5 <= sum(blocked) <= len(blocked) - 5, which
    assert np.array_equal(np.isnan(run.channels["d1"]), blocked)
    assert not np.isnan(run.channels["d2"]).any()
    clear = run_of(three_beams(), verified_share=share)
    kept = ~np.array(blocked)
    assert np.max(np.abs(run.channels["d1"] - clear.channels["d1"])[kept]) <= 5e-12


@pytest.mark.parametrize("share", [0.0, 1e-3, ALL_BUT_ONE_IN_A_MILLION])
def test_body_that_one_pose_in_between_meets_is_found(share: float) -> None:
    """The mirror leans over between the first pose, the middle one and the last, where it stands upright."""
    travel = VOLUME[0]
    nodes = np.array([0.0, 0.2, 0.25, 0.3, 1.0]) * travel  # of X; the middle of the line is at its half
    # About Z; local x of the line along X is machine -Y, so the light comes back at x = -8 mrad x 300 mm.
    lean = sd.ErrorMap({"ECX": (nodes, np.array([0.0, 0.0, -4e-3, 0.0, 0.0]))})
    head = three_beams(screen(-3.0, 3.0))
    setup = Setup(steps=STEPS, lines=["p00"], scale_lines=[], head=head)
    machine = sd.Machine(sd.Chain(CHAIN), lean)

    def run(share: float) -> sd.Measurement:
        return sd.simulate(machine, setup.plan, head, verified_share=share)

    lost = np.flatnonzero(np.isnan(run(1.0).channels["d1"]))
    assert list(lost) == [5]  # a quarter of the travel
    assert list(np.flatnonzero(np.isnan(run(share).channels["d1"]))) == list(lost)
