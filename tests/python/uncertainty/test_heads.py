"""Samples of virtual calibrations with traced heads, every component drawn out of its place, against forty digits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from adjusted import error_map
from places import SHIPPED_HEADS
from reference import commanded_points
from reference_optics import ciddor, mirror_in_sensor_frame
from shipped_heads import ASSUMED_AIR, SHIPPED, Reference, Shipped
from uncertain_cases import SEED, distribution
from virtual_runs import measured, plan_of, random_scenario, random_table
from virtual_samples import Sample, drawn

import stepdiag as sd
from stepdiag import _core

STANDOFF = 110.0


class InOtherAir(Reference):
    """The signals of a head whose components deviate, in air that does."""

    def __init__(self, shipped: Shipped, errors: Any, air: Mapping[str, float], factor: float) -> None:
        self.air, self.factor = air, factor
        super().__init__(shipped, errors, STANDOFF)

    def index(self, beam: str, air: Mapping[str, float]) -> Any:
        wavelength = self.head.components[beam].numbers["wavelength"]
        if air is ASSUMED_AIR:
            return ciddor(wavelength, *air.values())
        return ciddor(wavelength, *self.air.values()) * (1 + self.factor)


def inputs_of(shipped: Shipped, lines: list[str], parts: list[str]) -> list[_core.UncertainInput]:
    found: list[_core.UncertainInput] = []

    def add(quantity: str, size: float, count: int = 1, line: str = "", part: str = "") -> None:
        for component in range(count):
            given = {"line": line, "part": part, "component": component}
            found.append(_core.UncertainInput(quantity, distribution(len(found), size), **given))

    for line in lines:
        add("reflector", 1e-4, 2, line)
        add("laser", 1e-4, 2, line)
        add("lateral", 0.2, 2, line)
        add("roll", 2e-3, 1, line)
        if shipped.laser:
            add("gain", 3e-3, 1, line)
    for part in parts:
        add("part_shift", 0.02, 3, part=part)
        add("part_rotation", 5e-5, 3, part=part)
    add("temperature", 0.5)
    add("pressure", 50.0)
    add("refractive_index", 1e-7)
    return found


@pytest.mark.parametrize("shipped", SHIPPED, ids=lambda shipped: shipped.file)
def test_a_sample_of_a_traced_head_holds_against_forty_digits(shipped: Shipped) -> None:
    rng = np.random.default_rng(31)
    volume = (300.0, 260.0, 240.0)
    given = {"volume": volume, "standoff": STANDOFF, "scale_lines": [], "layout": "psd" if shipped.laser else "ideal"}
    scenario = random_scenario(rng, steps=2, tool=(10.0, -20.0, 30.0), **given)
    nominal = {line: {"reflector": (1e-4, -2e-4), "laser": (3e-5, 1e-4)} for line in scenario.lines}
    scenario = replace(scenario, misalignment=nominal)
    table = random_table(rng, volume, 2)
    design = sd.optics.read_head_design(SHIPPED_HEADS / f"{shipped.file}.toml")
    head = sd.Head.from_design(design, standoff=STANDOFF)
    beams = [*shipped.interferometers, *([shipped.laser, "psd", "splitter"] if shipped.laser else [])]
    inputs = _core.UncertainInputs(inputs_of(shipped, scenario.lines, [*beams, "window"]))
    air = sd.Environment.from_air(**ASSUMED_AIR)
    calibrations = _core.VirtualCalibrations(
        sd.Machine(scenario.chain, error_map(table), scenario.tool),
        plan_of(scenario),
        head,
        inputs,
        method="enhanced",
        seed=SEED,
        misalignment={line: sd.Misalignment(**setup) for line, setup in nominal.items()},
        environment=air,
        assumed_environment=air,
        verified_share=1.0,
    )
    block = np.asarray(calibrations.evaluate(0, 16))
    for sample in (0, 13):
        values = drawn(inputs, SEED, [sample])[:, 0]
        found = np.asarray(calibrations.readings(sample))
        expected = forty_digits(shipped, scenario, table, inputs, values)
        for c, name in enumerate(shipped.signals):
            largest = float(np.max(np.abs(found[:, c] - expected[:, c])))
            # As simulate() and the traces themselves; the air is moist to no one's knowledge better than 3e-14.
            assert largest <= (1e-10 if name.startswith("spot") else 2e-11), (sample, name, largest)
        assert_evaluates_to(block[:, sample], calibrations, head, scenario, expected, shipped)


def forty_digits(
    shipped: Shipped, scenario: Any, table: Any, inputs: _core.UncertainInputs, values: np.ndarray
) -> np.ndarray:
    sampled = Sample(scenario, table, inputs, values)
    moved: dict[str, list[list[float]]] = {}
    for one, value in zip(inputs.inputs, values, strict=True):
        if one.part:
            place = moved.setdefault(one.part, [[0.0] * 3, [0.0] * 3])
            place[one.quantity == "part_rotation"][one.component] = float(value)
    air = dict(ASSUMED_AIR)
    air["temperature"] += sampled._of("temperature")
    air["pressure"] += sampled._of("pressure")
    errors = {name: (tuple(shift), tuple(turn)) for name, (shift, turn) in moved.items()}
    head = InOtherAir(shipped, errors, air, sampled._of("refractive_index"))
    found = []
    for line in scenario.lines:
        gain = np.array(
            [1.0 + sampled._of("gain", line) if name.startswith("spot") else 1.0 for name in shipped.signals]
        )
        for commanded in commanded_points(sampled.scenario, line):
            mirror = mirror_in_sensor_frame(sampled.scenario, table, line, commanded)
            found.append(gain * np.array([float(v) for v in head.signals(mirror)]))
    return np.array(found)


def assert_evaluates_to(
    values: np.ndarray, calibrations: Any, head: sd.Head, scenario: Any, readings: np.ndarray, shipped: Shipped
) -> None:
    """In lanes as by itself."""
    run = calibrations.nominal
    rows = [
        {"line": line, "point": int(point), "position": position, **dict(zip(shipped.signals, row, strict=True))}
        for line, point, position, row in zip(run.line, run.point, run.position, readings, strict=True)
    ]
    calibration = sd.methods.evaluate(
        measured(rows), plan_of(scenario), head, sd.Chain(scenario.chain), scenario.tool, method="enhanced"
    )
    for output, value in zip(calibrations.outputs, values, strict=True):
        if output.name in calibration.squareness:
            expected, u = calibration.squareness[output.name]
        else:
            nodes, found, uncertainties = calibration.functions[output.name]
            k = int(np.argmin(np.abs(nodes - output.position)))
            expected, u = found[k], uncertainties[k]
        # Linear evaluations weigh as the nominal run: see test_truth_uncertainty_samples.
        assert abs(value - expected) <= 5e-3 * u + 1e-12, (output, value, expected, u)
