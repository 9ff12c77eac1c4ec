"""Malformed arguments of the verbs, simulate and evaluate: refused by name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from refusal import refused
from truth import Setup, changed
from usual import CHAIN, DIAGONALS, VOLUME

import stepdiag as sd

NAN, INF = float("nan"), float("inf")
SETUP = Setup(steps=4)
ERRORS = SETUP.errors(1)
RUN = SETUP.simulate(ERRORS)
ONES = np.ones(len(RUN))


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ({"misalignment": {"ppn": sd.Misalignment()}}, "ppn"),
        ({"misalignment": {"": sd.Misalignment()}}, "line"),
        ({"misalignment": {"ppp": sd.Misalignment(reflector=(0.1, 0.0))}}, "ppp"),
        ({"misalignment": {"ppp": sd.Misalignment(laser=(0.0, -0.5))}}, "ppp"),
        ({"misalignment": {"ppp": sd.Misalignment(distance_constant=NAN)}}, "ppp"),
        ({"misalignment": {"ppp": sd.Misalignment(beam_constants=[0.0, INF])}}, "ppp"),
        ({"verified_share": 1.5}, "verified_share"),
        ({"verified_share": NAN}, "verified_share"),
    ],
)
def test_simulation_of_nonsense_is_refused(options: dict[str, Any], names: str) -> None:
    refused(sd.simulate, sd.Machine(CHAIN, ERRORS), SETUP.plan, sd.Head(), names=names, **options)


@pytest.mark.parametrize("index", [0.5, NAN, INF])
def test_air_that_is_none_is_refused(index: float) -> None:
    refused(sd.Environment, index, names="refractive_index")


@pytest.mark.parametrize("pair", [(NAN, NAN), (NAN, 0.0), (0.0, NAN), (INF, 0.0), (0.0,), (0.0, 0.0, 0.0), "ab", 1.0])
@pytest.mark.parametrize("key", ["reflector", "laser", "psd_zero"])
def test_misalignment_that_is_no_pair_of_numbers_is_refused(key: str, pair: Any) -> None:
    refused(sd.Misalignment, **{key: pair}, names=key)


@pytest.mark.parametrize("value", [-1.0, NAN, INF, -INF])
@pytest.mark.parametrize("key", ["distance", "tilt", "spot"])
def test_noise_and_weights_that_make_no_sense_are_refused(key: str, value: float) -> None:
    refused(sd.Noise, **{key: value}, names=f"noise {key}")
    refused(sd.methods.ReadingUncertainty, **{key: value}, names=f"uncertainty {key}")


@pytest.mark.parametrize("value", [0.0, 1e-300, 1e-13, 1e7, 1e300])
def test_weight_that_no_reading_has_is_refused(value: float) -> None:
    refused(sd.methods.ReadingUncertainty, distance=value, names="uncertainty distance")


@pytest.mark.parametrize("mirror", [(10.0, 500.0), (500.0, 10.0), (1e-9, 1e-9)])
def test_mirror_too_small_for_the_plan_is_refused(mirror: tuple[float, float]) -> None:
    head = sd.Head(mirror=mirror)
    refused(sd.simulate, sd.Machine(CHAIN, ERRORS), SETUP.plan, head, names="mirror")


def alien(**change: Any) -> sd.Measurement:
    good: dict[str, Any] = {"line": RUN.line, "point": RUN.point, "position": RUN.position, "channels": RUN.channels}
    return sd.Measurement(**{**good, **change})


BEAMS = {f"d{i}": 100.0 * ONES for i in (1, 2, 3)}


@pytest.mark.parametrize(
    ("run", "options", "names"),
    [
        (RUN, {"method": "exact"}, "method"),
        (RUN, {"method": ""}, "method"),
        (RUN, {"tool": (0.0, 0.0)}, "tool"),
        (RUN, {"tool": (0.0, 0.0, NAN)}, "tool"),
        (RUN, {"chain": "[w X Y Z t]"}, "chain"),
        (RUN, {"plan": sd.Plan(VOLUME, DIAGONALS, 5)}, "row"),
        (RUN, {"plan": sd.Plan(VOLUME, DIAGONALS[:2], 4)}, "row"),
        (RUN, {"plan": sd.Plan((801.0, 600.0, 500.0), DIAGONALS, 4, scale_lines=SETUP.scale_lines)}, "row"),
        (alien(position=RUN.position + 0.01), {}, "row"),
        (alien(point=RUN.point + 1), {}, "row"),
        (alien(channels=BEAMS), {}, "d1"),
        (alien(channels={"distance": ONES, "spot_x": ONES, "spot_y": ONES}), {}, "psd_distance"),
        (
            alien(channels={"distance": -100.0 * ONES, "spot_x": ONES, "spot_y": ONES}),
            {"head": sd.Head("psd", psd_distance=50.0)},
            "row",
        ),
        (alien(channels={"distance": 100.0 * ONES, "alpha": 2.0 * ONES, "beta": 0 * ONES}), {}, "row"),
        (alien(channels={"distance": NAN * ONES, "alpha": NAN * ONES, "beta": NAN * ONES}), {}, "determined"),
        (changed(RUN, rows=[0]), {}, "determined"),
    ],
)
@pytest.mark.parametrize("method", ["enhanced", "adjustment"])
def test_evaluation_of_nonsense_is_refused(
    run: sd.Measurement, options: dict[str, Any], names: str, method: str
) -> None:
    if method == "adjustment" and "head" in options:
        pytest.skip("an adjustment takes a spot that no mirror gives for a reading that does not fit")

    def evaluate() -> None:
        given = {"plan": SETUP.plan, "head": sd.Head(), "chain": CHAIN, "tool": (0.0, 0.0, 0.0), "method": method}
        sd.methods.evaluate(run, **(given | options))

    refused(evaluate, names=names)


@pytest.mark.parametrize("lines", [["ppp"], ["ppp", "nnp"], ["pp0", "np0", "p0p"], ["p00", "0p0", "00p"]])
def test_conventional_evaluation_of_too_few_diagonals_is_refused(lines: list[str]) -> None:
    setup = Setup(steps=4, lines=lines, scale_lines=[])
    refused(setup.evaluate, setup.simulate(ERRORS), method="conventional", names="body diagonals")


def test_enhanced_evaluation_without_tilts_is_refused() -> None:
    refused(SETUP.evaluate, alien(channels={"distance": RUN.channels["distance"]}), names="determined")


def test_beams_of_another_head_are_refused() -> None:
    head = sd.Head("multi_beam", beam_offsets=[[0, 0], [20, 0], [0, 20], [9, 9]])
    refused(sd.methods.evaluate, alien(channels=BEAMS), SETUP.plan, head, CHAIN, names="beam")
