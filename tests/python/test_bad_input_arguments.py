"""Malformed arguments: each public function refuses them and names the culprit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from refusal import refused
from truth import Setup
from usual import CHAIN, DIAGONALS, VOLUME

import stepdiag as sd

NAN, INF = float("nan"), float("inf")
SETUP = Setup(steps=4)
ERRORS = SETUP.errors(1)
RUN = SETUP.simulate(ERRORS)
ONES = np.ones(len(RUN))


@pytest.mark.parametrize(
    "text",
    ["", "[]", "X Y Z", "[w X b Y Z t]", "[w X' b Y' Z t]", "[w X' Y' b t]", "[w X' b Y Y t]", "[w X' b Y Z A t]",
     "[t X' b Y Z w]", "[w X' b Y Z t", "[w x' b y z t]", "[w b b X Y t]", "[w X' b Y Z t] [w X' b Y Z t]", "\n", "é"],
)  # fmt: skip
def test_what_is_no_chain_is_refused(text: str) -> None:
    refused(sd.Chain, text, names="chain")
    refused(sd.Machine, text, names="chain")


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (((0.0, 600.0, 500.0), DIAGONALS, 5), "volume"),
        (((800.0, -600.0, 500.0), DIAGONALS, 5), "volume"),
        (((800.0, 600.0, NAN), DIAGONALS, 5), "volume"),
        (((INF, 600.0, 500.0), DIAGONALS, 5), "volume"),
        (((800.0, 600.0), DIAGONALS, 5), "volume"),
        (((800.0, 600.0, 1e-250), DIAGONALS, 5), "volume"),
        (("wide", DIAGONALS, 5), "volume"),
        ((None, DIAGONALS, 5), "volume"),
        (([[800.0, 600.0, 500.0]], DIAGONALS, 5), "volume"),
        ((VOLUME, [], 5), "lines"),
        ((VOLUME, ["ppp", "ppp"], 5), "ppp"),
        ((VOLUME, ["000"], 5), "000"),
        ((VOLUME, ["pp"], 5), "pp"),
        ((VOLUME, ["PPP"], 5), "PPP"),
        ((VOLUME, DIAGONALS, 0), "steps"),
        ((VOLUME, DIAGONALS, -4), "steps"),
        ((VOLUME, DIAGONALS, 10**9), "steps"),
        ((VOLUME, DIAGONALS, 2**40), "steps"),
        ((VOLUME, DIAGONALS, -(2**70)), "steps"),
        ((VOLUME, DIAGONALS, 2**70), "got 1180591620717411303424"),
        ((VOLUME, DIAGONALS, True), "steps"),
        ((VOLUME, DIAGONALS, 5, "XY"), "order"),
        ((VOLUME, DIAGONALS, 5, "XYX"), "order"),
        ((VOLUME, DIAGONALS, 5, "XYZ", ["pp0"]), "scale_lines"),
        ((VOLUME, DIAGONALS, 5, "XYZ", ["p00", "p00"]), "p00"),
        ((VOLUME, ["p00"], 5, "XYZ", ["p00"]), "p00"),
    ],
)
def test_what_makes_no_plan_is_refused(arguments: tuple[Any, ...], names: str) -> None:
    refused(sd.Plan, *arguments, names=names)


def test_plan_is_not_asked_for_what_it_does_not_hold() -> None:
    plan = SETUP.plan
    refused(plan.points, "ppn", names="ppn")
    refused(plan.points, "what", names="what")
    refused(plan.frame, "000", names="000")
    refused(plan.lateral_excursion, "", names="line")
    refused(plan.nodes, "W", names="W")
    refused(plan.nodes, "", names="axis")


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ({"layout": "laser"}, "layout"),
        ({"layout": ""}, "layout"),
        ({"standoff": 0.0}, "standoff"),
        ({"standoff": NAN}, "standoff"),
        ({"standoff": -INF}, "standoff"),
        ({"wavelength": -1.0}, "wavelength"),
        ({"aperture": 0.0}, "aperture"),
        ({"mirror": (0.0, 50.0)}, "mirror"),
        ({"mirror": (50.0, NAN)}, "mirror"),
        ({"mirror": 50.0}, "mirror"),
        ({"mirror": (50.0, 50.0, 50.0)}, "mirror"),
        ({"layout": "psd", "psd_distance": NAN}, "psd_distance"),
        ({"layout": "psd", "psd_distance": -100.0}, "psd_distance"),
        ({"layout": "multi_beam"}, "beam_offsets"),
        ({"layout": "multi_beam", "beam_offsets": [(0, 0), (1, 0)]}, "beam_offsets"),
        ({"layout": "multi_beam", "beam_offsets": [(0, 0), (1, 1), (2, 2)]}, "beam_offsets"),
        ({"layout": "multi_beam", "beam_offsets": [(0, 0), (1, 0), (0, INF)]}, "beam_offsets"),
        ({"layout": "multi_beam", "beam_offsets": [(0, 0), (1, 0), (0, 1, 2)]}, "beam_offsets"),
        ({"layout": "multi_beam", "beam_offsets": ["a", "b", "c"]}, "beam_offsets"),
    ],
)
def test_what_makes_no_head_is_refused(options: dict[str, Any], names: str) -> None:
    refused(sd.Head, names=names, **options)


@pytest.mark.parametrize(
    ("functions", "squareness", "names"),
    [
        ({"EXQ": ([0, 1], [0, 1])}, {}, "EXQ"),
        ({"C0Y": ([0, 1], [0, 1])}, {}, "C0Y"),
        ({"EXX": ([], [])}, {}, "EXX"),
        ({"EXX": ([0, 1], [0])}, {}, "EXX"),
        ({"EXX": ([0, 0], [0, 1])}, {}, "EXX"),
        ({"EXX": ([1, 0], [0, 1])}, {}, "EXX"),
        ({"EXX": ([0, NAN], [0, 1])}, {}, "EXX"),
        ({"EXX": ([0, 1], [0, INF])}, {}, "EXX"),
        ({"EXX": ([[0, 1]], [[0, 1]])}, {}, "EXX"),
        ({"EXX": ("ab", [0, 1])}, {}, "EXX"),
        ({}, {"EXX": 1.0}, "EXX"),
        ({}, {"A0Z": NAN}, "A0Z"),
        ({}, {"B0Z": -INF}, "B0Z"),
    ],
)
def test_what_makes_no_error_map_is_refused(functions: Any, squareness: Any, names: str) -> None:
    refused(sd.ErrorMap, functions, squareness, names=names)


def test_error_map_is_not_asked_for_what_makes_no_sense() -> None:
    refused(ERRORS.function, "EXQ", [0.0], names="EXQ")
    refused(ERRORS.function, "EXX", [[0.0]], names="position")
    refused(ERRORS.function, "EXX", "far", names="position")
    refused(ERRORS.function, "EXX", [0.0, NAN], names="position")
    refused(ERRORS.function, "EXX", [INF], names="position")
    refused(ERRORS.frame_deviations, (1.0, 2.0), names="volume")
    refused(ERRORS.frame_deviations, (1.0, 2.0, NAN), names="volume")


@pytest.mark.parametrize(
    ("volume", "options", "names"),
    [
        ((0.0, 1.0, 1.0), {}, "volume"),
        ((1.0, 1.0), {}, "volume"),
        ((1.0, 1.0, NAN), {}, "volume"),
        (VOLUME, {"intervals": 1}, "intervals"),
        (VOLUME, {"intervals": -1}, "intervals"),
        (VOLUME, {"intervals": 10**9}, "intervals"),
        (VOLUME, {"intervals": 2**70}, "intervals"),
        (VOLUME, {"intervals": True}, "intervals"),
        (VOLUME, {"translation": -1e-3}, "translation"),
        (VOLUME, {"rotation": NAN}, "rotation"),
        (VOLUME, {"squareness": INF}, "squareness"),
        (VOLUME, {"screw_pitch": -1.0}, "screw_pitch"),
        (VOLUME, {"screw_amplitude": 1e-3}, "screw_pitch"),
    ],
)
def test_random_error_map_of_nonsense_is_refused(volume: Any, options: dict[str, Any], names: str) -> None:
    refused(sd.random_error_map, volume, seed=1, names=names, **options)


@pytest.mark.parametrize("seed", [-1, 2**64, 2**70, -(2**70), True])
def test_seed_that_is_none_is_refused(seed: Any) -> None:
    refused(sd.Noise, seed=seed, names="seed")
    refused(sd.random_error_map, VOLUME, seed=seed, names="seed")


def test_seed_of_any_integer_type_is_taken() -> None:
    assert sd.Noise(seed=2**64 - 1).seed == 2**64 - 1
    assert sd.Noise(seed=np.uint64(5)).seed == sd.Noise(seed=np.int8(5)).seed == 5


def test_machine_refuses_tools_and_positions_that_make_no_sense() -> None:
    for tool in [(0.0, 0.0), (0.0, NAN, 0.0), (0.0, 0.0, INF), "long", [[0.0, 0.0, 0.0]], None, 5.0, ()]:
        refused(sd.Machine, CHAIN, ERRORS, tool, names="tool")
    machine = sd.Machine(CHAIN, ERRORS)
    for method in (machine.pose, machine.error, machine.first_order_error):
        for commanded in [5.0, "here", (1.0, 2.0), [[1.0, 2.0]], [[[1.0, 2.0, 3.0]]], None, [[1.0, 2.0, 3.0, 4.0]]]:
            refused(method, commanded, names="commanded")
        for commanded in [[[0.0, NAN, 0.0]], [[INF, 0.0, 0.0]]]:
            refused(method, commanded, names="commanded")


@pytest.mark.parametrize(
    ("change", "names"),
    [
        ({"point": RUN.point[:-1]}, "point"),
        ({"position": RUN.position[:-1]}, "position"),
        ({"position": RUN.position[:, :2]}, "position"),
        ({"position": np.full_like(RUN.position, NAN)}, "row 1"),
        ({"position": "everywhere"}, "position"),
        ({"line": ["ppp"] * len(RUN)}, "row"),
        ({"line": ["diagonal"] * len(RUN)}, "diagonal"),
        ({"line": [], "point": [], "position": np.zeros((0, 3)), "channels": {"distance": []}}, "measurement"),
        ({"point": -np.ones(len(RUN), dtype=int)}, "row 1"),
        ({"point": [2**31] * len(RUN)}, "point"),
        ({"point": [2**70] * len(RUN)}, "point"),
        ({"point": [True] * len(RUN)}, "point"),
        ({"run": [-(2**31) - 1] * len(RUN)}, "run"),
        ({"channels": {}}, "channels"),
        ({"channels": {"distance": ONES[:-1]}}, "distance"),
        ({"channels": {"distance": [ONES]}}, "distance"),
        ({"channels": {"distance": "far"}}, "distance"),
        ({"channels": {"distance": ONES * INF}}, "row 1"),
        ({"channels": {"length": ONES}}, "length"),
        ({"channels": {"alpha": ONES, "beta": ONES}}, "channels"),
        ({"channels": {"distance": ONES, "alpha": ONES}}, "channels"),
        ({"channels": {"distance": ONES, "d1": ONES, "d2": ONES, "d3": ONES}}, "channels"),
        ({"channels": {"d1": ONES, "d2": ONES}}, "channels"),
        ({"run": [0]}, "run"),
        ({"direction": ["forward"]}, "direction"),
        ({"direction": ["up"] * len(RUN)}, "direction"),
        ({"standard_uncertainty": {"gamma": ONES}}, "gamma"),
        ({"standard_uncertainty": {"distance": ONES[:-1]}}, "distance"),
        ({"standard_uncertainty": {"distance": 0 * ONES}}, "row 1"),
        ({"standard_uncertainty": {"alpha": -ONES}}, "row 1"),
        ({"standard_uncertainty": {"alpha": INF * ONES}}, "row 1"),
        ({"standard_uncertainty": {"alpha": 1e-300 * ONES}}, "uncertainty of alpha"),
        ({"standard_uncertainty": {"beta": 1e300 * ONES}}, "uncertainty of beta"),
    ],
)
def test_what_makes_no_measurement_is_refused(change: dict[str, Any], names: str) -> None:
    good = {"line": RUN.line, "point": RUN.point, "position": RUN.position, "channels": RUN.channels}
    refused(sd.Measurement, names=names, **{**good, **change})


@pytest.mark.parametrize(
    ("call", "arguments"),
    [
        (sd.Chain, (5,)),
        (sd.Plan, (VOLUME, DIAGONALS, 2.5)),
        (sd.Plan, (VOLUME, DIAGONALS, "five")),
        (sd.Plan, (VOLUME, DIAGONALS, 10**30)),
        (sd.Plan, (VOLUME, DIAGONALS, np.bool_(True))),
        (sd.Plan, (VOLUME, 5, 5)),
        (sd.Machine, (CHAIN, "errors")),
        (sd.simulate, (1, 2, 3)),
        (sd.methods.evaluate, (RUN, None, None, None)),
        (sd.read_measurement, (5,)),
    ],
)
def test_wrong_types_are_a_type_error_or_refused(call: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    with pytest.raises((TypeError, ValueError)):
        call(*arguments)
