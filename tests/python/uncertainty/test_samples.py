"""Samples of virtual calibrations made a second time: every draw, every reading, every value that comes of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from philox import philox
from uncertain_cases import SEED, all_inputs, all_noise, calibrations_of, channel_names, scenario_of, table_of
from virtual_runs import head_of, measured, plan_of
from virtual_samples import Air, Sample, drawn

import stepdiag as sd
from stepdiag import _core

# Anywhere in a block of lanes, and beyond what 32 bits count.
SAMPLES = [18, 12_345_678_901]


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


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
@pytest.mark.parametrize("plan", [{}, {"backward": True}, {"backward": True, "scale_points": "steps", "block": 2}])
def test_readings_of_a_sample_are_those_of_the_closed_forms(layout: str, plan: dict[str, Any]) -> None:
    air = Air(21.0, 99_000.0, 0.4)
    scenario, table = scenario_of(layout, 2, **plan)
    channels = channel_names(scenario)
    inputs = _core.UncertainInputs(all_inputs(scenario), all_noise(channels))
    calibrations = calibrations_of(scenario, table, inputs, air=air)
    values = drawn(inputs, SEED, SAMPLES)
    for i, sample in enumerate(SAMPLES):
        sampled = Sample(scenario, table, inputs, values[:, i], air=air, noise_of=(SEED, sample))
        assert_readings_are(np.asarray(calibrations.readings(sample)), sampled.rows(), channels)


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("method", ["enhanced", "adjustment"])
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
@pytest.mark.parametrize("scale_points", ["ends", "steps"])
def test_outputs_are_those_of_an_evaluation_of_the_readings(layout: str, method: str, scale_points: str) -> None:
    scenario, table = scenario_of(layout, 4, scale_points=scale_points)
    channels = channel_names(scenario)
    if method == "enhanced":
        # Linear evaluations weigh all samples as the nominal run. That does not matter as far as their model holds; a
        # zero of the sensor, or milliradians of misalignment, they do not know of.
        aligned = {line: dict.fromkeys(setup, (0.0, 0.0)) for line, setup in scenario.misalignment.items()}
        scenario = replace(scenario, misalignment=aligned)
    # What the evaluation takes for known is known.
    unknown = ("roll", "gain", "lateral", "psd_distance") + (
        ("psd_zero", "beam_constants") if method == "enhanced" else ()
    )
    angles = 5e-5 if method == "enhanced" else 1e-4
    known = [one for one in all_inputs(scenario, False, angles) if one.quantity not in unknown]
    inputs = _core.UncertainInputs(known, all_noise(channels))
    options: dict[str, Any] = {}
    if method == "adjustment":
        # By the tilts of a scale line its laser has more or less effect; a batch takes those of the nominal run.
        # These readings miss the model by five times what is stated: what a drift shares with scales would move.
        known_lasers = {line: sd.methods.SetupPriors(laser="fixed") for line in scenario.scale_lines}
        options = {"outlier_probability": 0.0, "variance_components": False, "setup_by_line": known_lasers}
        options["setup"] = sd.methods.SetupPriors(drift="fixed")
    calibrations = calibrations_of(scenario, table, inputs, method=method, **options)
    block = np.asarray(calibrations.evaluate(0, 32))
    names = [(one.name, one.position) for one in calibrations.outputs]
    assert block.shape == (len(names), 32)
    for sample in (0, 17, 31):
        rows = Sample(scenario, table, inputs, drawn(inputs, SEED, [sample])[:, 0], noise_of=(SEED, sample)).rows()
        told = (measured(rows), plan_of(scenario), head_of(scenario), sd.Chain(scenario.chain), scenario.tool)
        if method == "adjustment":
            calibration = sd.methods.adjust(*told, **options).calibration
        else:
            calibration = sd.methods.evaluate(*told, method=method)
        for (name, position), value in zip(names, block[:, sample], strict=True):
            if name in calibration.squareness:
                expected, u = calibration.squareness[name]
            else:
                nodes, values, uncertainties = calibration.functions[name]
                k = int(np.argmin(np.abs(nodes - position)))
                expected, u = values[k], uncertainties[k]
            # Little of its own uncertainty: weights change by a thousandth, what is weighed by several u.
            assert abs(value - expected) <= 5e-3 * u + 1e-12, (name, position, value, expected, u)
