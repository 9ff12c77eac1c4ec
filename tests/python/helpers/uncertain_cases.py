"""Scenarios with every uncertain input and noise that there is, and their virtual calibrations."""

from __future__ import annotations

from typing import Any

import numpy as np
import reference
from adjusted import error_map
from virtual_runs import head_of, plan_of, random_scenario, random_table
from virtual_samples import Air

import stepdiag as sd
from stepdiag import _core

SEED = 0x1234_5678_9ABC_DEF0
DISTRIBUTIONS: list[dict[str, Any]] = [
    {"kind": "normal"},
    {"kind": "rectangular"},
    {"kind": "triangular"},
    {"kind": "arcsine"},
    {"kind": "t", "degrees_of_freedom": 5.5},
    {"kind": "curvilinear_trapezoid", "edge": 0.3},
]
SECONDS = 5.0


def distribution(count: int, size: float) -> _core.Distribution:
    """One kind after the other; `size` is the spread."""
    given = dict(DISTRIBUTIONS[count % len(DISTRIBUTIONS)])
    if "edge" in given:
        given["edge"] *= size
    return _core.Distribution(given.pop("kind"), spread=size, expectation=0.1 * size, **given)


def scenario_of(layout: str, seed: int, **given: Any) -> tuple[reference.Scenario, reference.ErrorTable]:
    rng = np.random.default_rng([seed, len(layout)])
    scenario = random_scenario(
        rng, layout=layout, steps=3, lines=["ppp", "npp", "pnp", "nnp"], seconds_per_reading=SECONDS, **given
    )
    return scenario, random_table(rng, scenario.volume, 3)


def all_inputs(scenario: reference.Scenario, air: bool = True, angles: float = 4e-4) -> list[_core.UncertainInput]:
    """Every quantity that this head and plan have; `angles`: of mirror and laser."""
    found: list[_core.UncertainInput] = []

    def add(quantity: str, size: float, count: int = 1, line: str = "") -> None:
        for component in range(count):
            found.append(_core.UncertainInput(quantity, distribution(len(found), size), line=line, component=component))

    for line in [*scenario.lines, *scenario.scale_lines]:
        add("reflector", angles, 2, line)
        add("laser", 1.2 * angles, 2, line)
        if scenario.layout == "psd":
            add("psd_zero", 0.05, 2, line)
        add("distance_constant", 1e-2, 1, line)
        if scenario.layout == "multi_beam":
            add("beam_constants", 1e-2, 3, line)
        add("lateral", 0.5, 2, line)
        add("roll", 5e-3, 1, line)
        add("gain", 3e-3, 1, line)
        add("drift", 2e-7, 1, line)
        add("scale_length", 3e-4, 1, line)
        add("scale_factor", 1e-6, 1, line)
    if scenario.layout == "psd":
        add("psd_distance", 0.2)
    if scenario.layout == "multi_beam":
        add("beam_offset", 0.02, 6)
    add("reading_model", 1.5)
    if air:
        add("temperature", 0.5)
        add("pressure", 100.0)
        add("humidity", 0.05)
    add("refractive_index", 2e-7)
    add("wavelength", 1e-7)
    add("machine_drift", 1e-7, 3)
    return found


def all_noise(channels: list[str]) -> list[_core.ReadingNoise]:
    def normal(size: float) -> _core.Distribution:
        return _core.Distribution("normal", spread=size)

    sizes = {"alpha": 1e-6, "beta": 1e-6, "spot_x": 1e-3, "spot_y": 1e-3}
    found = [
        _core.ReadingNoise("channel", distribution(i, sizes.get(name, 1e-4)), channel=name)
        for i, name in enumerate(channels)
    ]
    found.append(_core.ReadingNoise("common", distribution(1, 2e-4)))
    found.append(_core.ReadingNoise("head_walk", normal(1e-5)))
    for c in range(3):
        found.append(_core.ReadingNoise("machine_walk", normal(2e-5), component=c))
        found.append(_core.ReadingNoise("position", distribution(3 + c, 5e-4), component=c))
        found.append(_core.ReadingNoise("orientation", distribution(c, 2e-6), component=c))
    return found


def calibrations_of(
    scenario: reference.Scenario,
    table: reference.ErrorTable,
    inputs: _core.UncertainInputs,
    *,
    method: str = "enhanced",
    air: Air | None = None,
    seed: int = SEED,
    **options: Any,
) -> Any:
    environment = None
    if air is not None:
        environment = sd.Environment.from_air(
            temperature=air.temperature, pressure=air.pressure, relative_humidity=air.humidity
        )
    misalignment = {
        line: sd.Misalignment(**setup) for line, setup in scenario.misalignment.items() if line in scenario.lines
    }
    return _core.VirtualCalibrations(
        sd.Machine(scenario.chain, error_map(table), scenario.tool),
        plan_of(scenario),
        head_of(scenario),
        inputs,
        method=method,
        seed=seed,
        misalignment=misalignment,
        environment=environment,
        **options,
        repeats=scenario.repeats,
        backward=scenario.backward,
        seconds_per_reading=scenario.seconds_per_reading,
    )


def channel_names(scenario: reference.Scenario) -> list[str]:
    return list(head_of(scenario).signals)


def table_of(rows: list[dict[str, Any]], channels: list[str]) -> np.ndarray:
    return np.array([[row[name] for name in channels] for row in rows])
