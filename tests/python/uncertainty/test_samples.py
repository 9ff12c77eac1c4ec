"""Samples of virtual calibrations made a second time: every draw, every reading, every value that comes of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import reference
from adjusted import error_map
from philox import philox
from virtual_runs import head_of, measured, plan_of, random_scenario, random_table
from virtual_samples import Air, Sample, drawn

import stepdiag as sd
from stepdiag import _core

SEED = 0x1234_5678_9ABC_DEF0
# Anywhere in a block of lanes, and beyond what 32 bits count.
SAMPLES = [18, 12_345_678_901]
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
            add("beam_constant", 1e-2, 3, line)
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
        repeats=scenario.repeats,
        backward=scenario.backward,
        seconds_per_reading=scenario.seconds_per_reading,
    )


def channel_names(scenario: reference.Scenario) -> list[str]:
    return list(head_of(scenario).signals)


def table_of(rows: list[dict[str, Any]], channels: list[str]) -> np.ndarray:
    return np.array([[row[name] for name in channels] for row in rows])


# A reading of 1 m in double precision is 1e-12 mm off; the index of the air, in its change by some kelvin, by 2e-12
# of itself, which is 2e-9 mm of a metre.
TOLERANCE = {"alpha": 1e-13, "beta": 1e-13}
DISTANCE_TOLERANCE = 1e-8


def test_philox_gives_its_published_numbers() -> None:
    """Known answers of Random123 for philox4x32, 10 rounds."""

    def words(*given: int) -> list[np.ndarray]:
        return [np.array([w], dtype=np.uint64) for w in given]

    known = [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ]
    for counter, key, answer in known:
        assert [int(w[0]) for w in philox(words(*counter), key)] == list(answer)


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_inputs_are_drawn_by_their_published_counters(layout: str) -> None:
    scenario, _ = scenario_of(layout, 1)
    inputs = _core.UncertainInputs(all_inputs(scenario))
    expected = drawn(inputs, SEED, SAMPLES)
    for i, sample in enumerate(SAMPLES):
        found = np.asarray(_core.drawn_inputs(inputs, SEED, sample))
        # A few roundings of the number; sizes down to 1e-7.
        assert np.allclose(found, expected[:, i], rtol=1e-12, atol=1e-22)


def test_correlated_inputs_are_drawn_together() -> None:
    names = ["temperature", "pressure", "humidity", "wavelength"]
    sizes = [0.5, 100.0, 0.05, 1e-7]
    parts = [
        _core.UncertainInput(name, _core.Distribution("normal", spread=size, expectation=0.2 * size))
        for name, size in zip(names, sizes, strict=True)
    ]
    correlation = np.array([[1.0, 0.6, -0.3], [0.6, 1.0, 0.2], [-0.3, 0.2, 1.0]])
    inputs = _core.UncertainInputs(parts, correlations=[([3, 0, 1], correlation)])
    found = np.array([_core.drawn_inputs(inputs, SEED, sample) for sample in range(4_000)]).T
    assert np.allclose(found, drawn(inputs, SEED, range(4_000)), rtol=1e-12, atol=1e-22)
    # Four standard deviations of a correlation from 4,000 samples.
    observed = np.corrcoef(found[[3, 0, 1]])
    assert np.max(np.abs(observed - correlation)) < 4.0 / np.sqrt(4_000)
    assert np.max(np.abs(np.corrcoef(found[2], found[3])[0, 1])) < 4.0 / np.sqrt(4_000)


def assert_readings_are(found: np.ndarray, rows: list[dict[str, Any]], channels: list[str]) -> None:
    expected = table_of(rows, channels)
    assert found.shape == expected.shape
    for c, name in enumerate(channels):
        largest = float(np.max(np.abs(found[:, c] - expected[:, c])))
        assert largest <= TOLERANCE.get(name, DISTANCE_TOLERANCE), (name, largest)


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
@pytest.mark.parametrize("backward", [False, True])
def test_readings_of_a_sample_are_those_of_the_closed_forms(layout: str, backward: bool) -> None:
    air = Air(21.0, 99_000.0, 0.4)
    scenario, table = scenario_of(layout, 2)
    if backward:
        scenario = replace(scenario, backward=True)
    channels = channel_names(scenario)
    inputs = _core.UncertainInputs(all_inputs(scenario), all_noise(channels))
    calibrations = calibrations_of(scenario, table, inputs, air=air)
    values = drawn(inputs, SEED, SAMPLES)
    for i, sample in enumerate(SAMPLES):
        sampled = Sample(scenario, table, inputs, values[:, i], air=air, noise_of=(SEED, sample))
        assert_readings_are(np.asarray(calibrations.readings(sample)), sampled.rows(), channels)


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_every_input_acts_by_itself(layout: str) -> None:
    """One uncertain input at a time, so that none hides behind others."""
    air = Air()
    scenario, table = scenario_of(layout, 3)
    scenario = replace(scenario, lines=["ppp", "nnp", "pnp"], steps=2)
    channels = channel_names(scenario)
    for one in all_inputs(scenario):
        if one.line in ("nnp", "pnp", "0p0", "00p"):
            continue  # as the others do
        inputs = _core.UncertainInputs([one])
        calibrations = calibrations_of(scenario, table, inputs, air=air)
        value = drawn(inputs, SEED, [5])[:, 0]
        assert value[0] != 0.0
        rows = Sample(scenario, table, inputs, value, air=air).rows()
        found = np.asarray(calibrations.readings(5))
        assert_readings_are(found, rows, channels)
        nominal = table_of(Sample(scenario, table, inputs, [0.0], air=air).rows(), channels)
        assert np.max(np.abs(found - nominal)) > 1e-9, f"{one.name} does nothing"


@pytest.mark.parametrize("method", ["enhanced", "adjustment"])
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_outputs_are_those_of_an_evaluation_of_the_readings(layout: str, method: str) -> None:
    scenario, table = scenario_of(layout, 4)
    channels = channel_names(scenario)
    if method == "enhanced":
        # Linear evaluations weigh all samples as the nominal run. That does not matter as far as their model holds; a
        # zero of the sensor, or milliradians of misalignment, they do not know of.
        aligned = {line: dict.fromkeys(setup, (0.0, 0.0)) for line, setup in scenario.misalignment.items()}
        scenario = replace(scenario, misalignment=aligned)
    # What the evaluation takes for known is known.
    unknown = ("roll", "gain", "lateral", "psd_distance") + (
        ("psd_zero", "beam_constant") if method == "enhanced" else ()
    )
    angles = 5e-5 if method == "enhanced" else 4e-4
    known = [one for one in all_inputs(scenario, False, angles) if one.quantity not in unknown]
    inputs = _core.UncertainInputs(known, all_noise(channels))
    calibrations = calibrations_of(scenario, table, inputs, method=method)
    block = np.asarray(calibrations.evaluate(0, 32))
    names = [(one.name, one.position) for one in calibrations.outputs]
    assert block.shape == (len(names), 32)
    options = {"outlier_probability": 0.0} if method == "adjustment" else {}
    for sample in (0, 17, 31):
        rows = Sample(scenario, table, inputs, drawn(inputs, SEED, [sample])[:, 0], noise_of=(SEED, sample)).rows()
        told = (measured(rows), plan_of(scenario), head_of(scenario), sd.Chain(scenario.chain), scenario.tool)
        if method == "adjustment":
            calibration = sd.adjust(*told, **options).calibration
        else:
            calibration = sd.evaluate(*told, method=method)
        for (name, position), value in zip(names, block[:, sample], strict=True):
            if name in calibration.squareness:
                expected, u = calibration.squareness[name]
            else:
                nodes, values, uncertainties = calibration.functions[name]
                k = int(np.argmin(np.abs(nodes - position)))
                expected, u = values[k], uncertainties[k]
            # Little of its own uncertainty: weights change by a thousandth, what is weighed by several u.
            assert abs(value - expected) <= 5e-3 * u + 1e-12, (name, position, value, expected, u)
