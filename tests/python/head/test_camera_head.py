"""The shipped head with an array sensor, against the one with a position sensing device and the bound of its noise."""

import math
import tomllib
from typing import Any

import numpy as np
from places import SHIPPED_HEADS

import stepdiag as sd


def description(name: str) -> dict[str, Any]:
    return tomllib.loads((SHIPPED_HEADS / f"{name}.toml").read_text(encoding="utf-8"))


def test_both_heads_differ_in_their_sensor_alone() -> None:
    camera, psd = description("beam_and_camera"), description("beam_and_psd")
    place = ("position_mm", "rotation_deg")
    assert [camera["sensor"]["camera"][key] for key in place] == [psd["sensor"]["psd"][key] for key in place]
    for head in (camera, psd):
        del head["name"], head["sensor"], head["beam"]["laser"]["sensor"]
    assert camera == psd


def test_spots_scatter_as_the_bound_says_about_those_of_the_position_sensing_device() -> None:
    """That head's spots hold against forty digits (test_shipped.py)."""
    plan = sd.Plan((400.0, 300.0, 250.0), ["ppp"], 10)
    misalignment = {"ppp": sd.Misalignment(reflector=(300e-6, -200e-6))}  # spots move over the chip by 0.3 mm
    machine = sd.Machine("[w X' b Y Z t]")
    camera, exact = (
        sd.simulate(machine, plan, sd.Head.from_design(sd.optics.shipped_head(name)), misalignment=misalignment)
        for name in ("beam_and_camera", "beam_and_psd")
    )
    sensor = description("beam_and_camera")["sensor"]["camera"]
    pixels = sd.optics.Camera(
        pixel=sensor["pixel_um"] * 1e-3,
        **{key: sensor[key] for key in ("columns", "rows", "electrons", "background", "read_noise", "shot_noise")},
        **{key: sensor[key] for key in ("full_well", "bits", "centroid")},
    )
    assert np.array_equal(camera.channels["distance"], exact.channels["distance"])
    errors = []
    for i, distance in enumerate(exact.channels["distance"]):
        # From laser to mirror and chip in air: 80 mm besides twice the distance, of which 50 mm are glass.
        way = 2.0 * distance + 80.0 - 50.0 * (1.0 - 1.0 / 1.515)
        radius = 0.5 * math.hypot(1.0, (way - 600.0) / (math.pi * 0.5**2 / 635e-6))
        bound = sd.optics.cramer_rao_bound(pixels, sd.optics.BeamSpot((0.0, 0.0), radius, 0.25))
        errors += [(camera.channels[name][i] - exact.channels[name][i]) / bound for name in ("spot_x", "spot_y")]
    # Four standard deviations of the scatter and of the mean of 62 normal numbers.
    assert abs(np.std(errors) - 1.0) < 4.0 / math.sqrt(2 * len(errors))
    assert abs(np.mean(errors)) < 4.0 / math.sqrt(len(errors))


def test_a_calibration_with_the_camera_is_as_good_as_its_noise() -> None:
    volume = (400.0, 300.0, 250.0)
    errors = sd.random_error_map(volume, seed=3)
    machine = sd.Machine("[w X' b Y Z t]", errors)
    plan = sd.Plan(volume, ["ppp", "npp", "pnp", "nnp"], 4, scale_lines=["p00", "0p0", "00p"])
    head = sd.Head.from_design(sd.optics.shipped_head("beam_and_camera"))
    run = sd.simulate(machine, plan, head)
    spot = 60e-6  # mm; the bound is 20 to 60 nm at these distances
    weights = sd.methods.ReadingUncertainty(distance=1e-6, spot=spot)
    calibration = sd.methods.evaluate(run, plan, head, machine.chain, uncertainty=weights)
    agreement = sd.compare(calibration, errors).agreement
    assert agreement is not None
    assert agreement.rms < 1.5  # deviation by stated uncertainty; less, as most spots scatter less than stated
