"""What is known and the truth of a simulated run are two values, and no way leads from the first to the second."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pydantic
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag import _core
from stepdiag.planning.observation import observe
from stepdiag.scenario.description import parse_scenario

PLAIN = SCENARIO.split("[misalignment]")[0].replace("[machine.random]\nseed = 7\n", "")
HEADS = """[head]
description = "beam_and_psd"
[head.far]
standoff_mm = 400.0
[line.npp]
head = "far"
"""
DESIGNED = PLAIN.replace('[head]\nlayout = "ideal"\n', HEADS)
NOISE = "[noise]\ndistance_um = 0.3\ncommon_um = 0.2\n"

# Values that stand nowhere else, for every section that has truth in it.
NUMBERS = {
    "reflector_urad": 123.4375, "laser_urad": 77.8125, "shift_mm": 0.0078125, "rotation_urad": 311.5625,
    "temperature_c": 23.0625, "assumed.temperature_c": 24.1875, "seed": 987654321,
}  # fmt: skip
MAP = "nobody_knows.csv"
TRUTH = f"""
[head.pose_errors.psd]
shift_mm = [0.0, {NUMBERS["shift_mm"]}, 0.0]
[head.far.pose_errors.window]
rotation_urad = [{NUMBERS["rotation_urad"]}, 0.0, 0.0]
[misalignment]
reflector_urad = [{NUMBERS["reflector_urad"]}, 0.0]
[misalignment.npp]
laser_urad = [0.0, {NUMBERS["laser_urad"]}]
[environment]
temperature_c = {NUMBERS["temperature_c"]}
[environment.assumed]
temperature_c = {NUMBERS["assumed.temperature_c"]}
"""
SEED = f"seed = {NUMBERS['seed']}\n"
BLIND = DESIGNED + NOISE
OF_MAP = DESIGNED.replace("[plan]", f'errors = "{MAP}"\n[plan]') + TRUTH + NOISE + SEED
RANDOM = DESIGNED.replace("[plan]", f"[machine.random]\n{SEED}[plan]") + TRUTH + NOISE


def reached(value: Any, seen: dict[int, Any] | None = None) -> Iterator[str | float]:
    """Every text and number that attributes, keys and items lead to from a value, private ones too."""
    seen = {} if seen is None else seen
    if isinstance(value, str | int | float):
        yield value
    elif value is not None and id(value) not in seen:
        seen[id(value)] = value  # kept, for an attribute made by asking for it would leave its address to another
        for item in below(value):
            yield from reached(item, seen)


def below(value: Any) -> Iterator[Any]:
    if isinstance(value, Path):
        yield str(value)
    elif isinstance(value, np.ndarray):
        yield from value.ravel().tolist()
    elif isinstance(value, Mapping):
        yield from (*value.keys(), *value.values())
    elif isinstance(value, list | tuple | set | frozenset):
        yield from value
    elif type(value).__module__.startswith("stepdiag"):
        names = {*dir(value), *getattr(value, "__dict__", {})} - {*dir(pydantic.BaseModel)}
        items = (getattr(value, name) for name in sorted(names) if not name.startswith("__"))
        yield from (item for item in items if not callable(item))


def told(value: Any) -> set[str]:
    """Which of the truth's values can be reached, as the file has them or in native units."""
    found = set()
    for one in reached(value):
        if isinstance(one, str):
            found |= {MAP} if MAP in one else set()
        else:
            found |= {key for key, number in NUMBERS.items() for unit in (1.0, 1e-6) if one == number * unit}
    return found


@pytest.mark.parametrize(("text", "first"), [(OF_MAP, {MAP}), (RANDOM, set())])
def test_no_attribute_of_what_is_known_reaches_the_truth(text: str, first: set[str]) -> None:
    scenario = parse_scenario(text)
    assert told(scenario.truth) == {*NUMBERS} | first  # so that a walk that sees nothing proves nothing
    assert 400.0 in reached(scenario.known)
    assert told(scenario.known) == set()


@pytest.mark.parametrize("text", [OF_MAP, RANDOM])
def test_what_is_known_is_the_same_whatever_the_truth(text: str) -> None:
    seeing, blind = parse_scenario(text).known, parse_scenario(BLIND).known
    assert seeing == blind
    for field in dataclasses.fields(seeing):
        mine, theirs = (list(reached(getattr(known, field.name))) for known in (seeing, blind))
        assert mine == theirs, field.name
    for change in ("steps = 6", "steps = 5\nrepeats = 2"):
        assert parse_scenario(BLIND.replace("steps = 5", change)).known != blind
    assert parse_scenario(BLIND.replace("400.0", "401.0")).known != blind
    assert parse_scenario(BLIND.replace("0.3", "0.4")).known != blind  # the weights


def same_bits(one: _core.Calibration, other: _core.Calibration) -> bool:
    return one.squareness == other.squareness and all(
        mine.tobytes() == theirs.tobytes()
        for name in one.functions.keys() | other.functions.keys()
        for mine, theirs in zip(one.functions[name], other.functions[name], strict=True)
    )


@pytest.mark.parametrize("method", ["enhanced", "adjustment"])
def test_evaluation_needs_what_is_known_and_no_more(method: Any) -> None:
    scenario, blind = parse_scenario(RANDOM), parse_scenario(BLIND).known
    run = sd.simulate(scenario)
    whole = sd.methods.evaluate_scenario(scenario, run, method=method)
    for known in (scenario.known, blind):
        assert same_bits(sd.methods.evaluate_scenario(known, run, method=method), whole)
    (one, found), (other, again) = observe(scenario), observe(blind)
    assert all(one.channels[name].tobytes() == other.channels[name].tobytes() for name in one.channels)
    assert same_bits(found.calibration, again.calibration)


def test_file_that_says_nothing_of_the_truth_is_of_a_perfect_machine() -> None:
    scenario = parse_scenario(PLAIN)
    assert not scenario.machine().error([[80.0, 60.0, 50.0]]).any()
    assert not any(np.any([m.reflector, m.laser, m.lateral]) for m in scenario.truth.misalignment.values())
    assert (scenario.truth.noise.distance, scenario.truth.noise.common, scenario.truth.error_map) == (0.0, 0.0, None)
    assert scenario.truth.environment is scenario.truth.assumed_environment is None
    assert scenario.truth.pose_errors == {"head": {}}
    angles = sd.simulate(scenario).channels["alpha"]
    assert np.max(np.abs(angles)) < 1e-15  # a perfect machine's mirror stands still, to rounding


def test_noise_is_known_by_its_size_alone() -> None:
    scenario = parse_scenario(PLAIN + NOISE + SEED)
    assert scenario.truth.noise.distance == scenario.known.uncertainty.distance == pytest.approx(0.3e-3)
    assert not hasattr(scenario.known.keys.noise, "seed")
