"""Virtual calibrations: what is drawn acts on readings by its definition, and samples are evaluated as runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from small_heads import three_beams, window
from usual import CHAIN, VOLUME

import stepdiag as sd
from stepdiag import _core

TOOL = (5.0, -3.0, 70.0)
SECONDS = 2.0
# Readings are traced over some metres: 1e-12 mm, 1e-15 rad; differences of two of them.
ROUNDING = 5e-12


def machine() -> sd.Machine:
    return sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=4), TOOL)


def plan() -> sd.Plan:
    return sd.Plan(VOLUME, ["ppp", "npp"], 3, scale_lines=["p00"])


def heads() -> dict[str, sd.Head]:
    return {
        "ideal": sd.Head(),
        "psd": sd.Head("psd", psd_distance=50.0),
        "multi_beam": sd.Head("multi_beam", beam_offsets=[(0, 0), (20, 0), (0, 20)]),
        "multi_beam traced": three_beams(window()),
    }


def virtual(
    inputs: list[_core.UncertainInput],
    noise: list[_core.ReadingNoise] | None = None,
    *,
    head: str = "ideal",
    **keys: Any,
) -> _core.VirtualCalibrations:
    uncertain = _core.UncertainInputs(inputs, noise or [])
    keys.setdefault("environment", sd.Environment.from_air())
    return _core.VirtualCalibrations(machine(), plan(), heads()[head], uncertain, seconds_per_reading=SECONDS, **keys)


def normal(quantity: str, spread: float, **where: Any) -> _core.UncertainInput:
    return _core.UncertainInput(quantity, _core.Distribution(spread=spread), **where)


def sample_and_nominal(model: _core.VirtualCalibrations, sample: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Readings of a sample and of the nominal run, (rows, channels)."""
    nominal = model.nominal
    channels = [nominal.channels[name] for name in nominal.channels if name != "time"]
    return model.readings(sample), np.stack(channels, axis=1)


def rows_of(line: str) -> np.ndarray:
    return np.array([name == line for name in virtual([]).nominal.line])


@pytest.mark.parametrize("head", heads())
def test_scale_errors_act_on_the_distances_of_their_line(head: str) -> None:
    inputs = [normal("scale_length", 1e-3, line="p00"), normal("scale_factor", 1e-6, line="ppp")]
    model = virtual(inputs, head=head)
    readings, nominal = sample_and_nominal(model)
    length, factor = _core.drawn_inputs(_core.UncertainInputs(inputs), 0, 3)
    of_line, of_scale = rows_of("ppp"), np.flatnonzero(rows_of("p00"))
    direction = np.array(VOLUME) / np.linalg.norm(VOLUME)
    expected = np.zeros(len(nominal))
    expected[of_line] = factor * (np.asarray(model.nominal.position)[of_line] @ direction)
    expected[of_scale[-1]] = length
    difference = readings - nominal
    for k, name in enumerate(name for name in model.nominal.channels if name != "time"):
        is_distance = name.startswith("d")
        np.testing.assert_allclose(difference[:, k], expected if is_distance else 0.0, atol=ROUNDING)


def test_index_and_wavelength_scale_distances() -> None:
    for quantity in ("refractive_index", "wavelength"):
        inputs = [normal(quantity, 1e-6)]
        readings, nominal = sample_and_nominal(virtual(inputs))
        deviation = _core.drawn_inputs(_core.UncertainInputs(inputs), 0, 3)[0]
        scale = 1 + deviation if quantity == "refractive_index" else 1 / (1 + deviation)
        np.testing.assert_allclose(readings[:, 0], nominal[:, 0] * scale, atol=ROUNDING)
        np.testing.assert_allclose(readings[:, 1:], nominal[:, 1:], atol=1e-15)


def test_reading_model_adds_its_share_of_length_times_tilt_squared() -> None:
    inputs = [normal("reading_model", 1.5)]
    model = virtual(inputs, misalignment={"ppp": sd.Misalignment(reflector=(1e-3, -2e-3))})
    readings, nominal = sample_and_nominal(model)
    deviation = _core.drawn_inputs(_core.UncertainInputs(inputs), 0, 3)[0]
    tilt2 = nominal[:, 1] ** 2 + nominal[:, 2] ** 2
    # L = d (1 - t)
    np.testing.assert_allclose(
        readings[:, 0] - nominal[:, 0], deviation * nominal[:, 0] * (1 - tilt2) * tilt2, atol=1e-11
    )


def test_machine_drift_moves_the_functional_point_from_the_first_reading() -> None:
    inputs = [normal("machine_drift", 1e-5, component=k) for k in range(3)]
    readings, nominal = sample_and_nominal(virtual(inputs))
    drift = _core.drawn_inputs(_core.UncertainInputs(inputs), 0, 3)
    rows = rows_of("ppp")
    time = SECONDS * np.flatnonzero(rows)
    direction = np.array(VOLUME) / np.linalg.norm(VOLUME)
    # Along the mirror's normal, which the machine turns by 1e-4: of 1e-4 mm that leaves 1e-8.
    np.testing.assert_allclose((readings - nominal)[rows, 0], time * (direction @ drift), atol=3e-8)


def test_walks_start_at_zero_and_have_steps_of_their_spread() -> None:
    walk = _core.ReadingNoise("head_walk", _core.Distribution(spread=1e-4))
    model = virtual([], [walk])
    nominal = sample_and_nominal(model)[1]
    walks = np.stack([model.readings(sample)[:, 0] for sample in range(200)]) - nominal[:, 0]
    rows = np.flatnonzero(rows_of("ppp"))
    assert np.all(np.abs(walks[:, rows[0]]) < ROUNDING)
    steps = np.diff(walks[:, rows], axis=1)
    # 1,800 steps: the standard deviation of a standard deviation is 1.7 %; five of them.
    assert np.std(steps) == pytest.approx(1e-4 * np.sqrt(SECONDS), rel=0.085)
    assert np.all(np.abs(walks[:, np.flatnonzero(rows_of("npp"))[0]]) < ROUNDING)


def test_common_noise_is_the_same_in_all_beams() -> None:
    common = _core.ReadingNoise("common", _core.Distribution(spread=1e-3))
    readings, nominal = sample_and_nominal(virtual([], [common], head="multi_beam"))
    noise = readings - nominal
    np.testing.assert_allclose(noise, noise[:, :1] * np.ones(3), atol=ROUNDING)
    assert np.std(noise[:, 0]) > 1e-4


def test_repeatability_moves_and_turns_the_tool_of_every_reading() -> None:
    # 2,200 numbers a channel: 1.5 % of a standard deviation; five of them.
    for quantity, spread, channels in (("position", 1e-3, [0]), ("orientation", 1e-5, [1, 2])):
        distribution = _core.Distribution(spread=spread)
        noise = [_core.ReadingNoise(quantity, distribution, component=k) for k in range(3)]
        model = virtual([], noise)
        nominal = sample_and_nominal(model)[1]
        difference = np.stack([model.readings(sample) for sample in range(100)]) - nominal
        for channel in channels:
            assert np.std(difference[..., channel]) == pytest.approx(spread, rel=0.08)


@pytest.mark.parametrize("head", heads())
def test_samples_are_runs_evaluated(head: str) -> None:
    inputs = [
        normal(quantity, 1e-4, line=line, component=k)
        for quantity in ("reflector", "laser")
        for line in ("ppp", "npp")
        for k in (0, 1)
    ]
    channel = heads()[head].signals[0]
    noise = [_core.ReadingNoise("channel", _core.Distribution(spread=1e-4), channel=channel)]
    model = virtual(inputs, noise, head=head)
    outputs = model.evaluate(5, 3)
    assert outputs.shape == (len(model.outputs), 3)
    nominal = model.nominal
    readings = model.readings(6)
    names = [name for name in nominal.channels if name != "time"]
    run = sd.Measurement(
        nominal.line,
        nominal.point,
        nominal.position,
        {name: readings[:, k] for k, name in enumerate(names)},
    )
    calibration = sd.methods.evaluate(run, plan(), heads()[head], machine().chain, TOOL, method="enhanced")
    for output, value in zip(model.outputs, outputs[:, 1], strict=True):
        if np.isnan(output.position):
            expected, u = calibration.squareness[output.name]
        else:
            position, values, uncertainties = calibration.functions[output.name]
            k = int(np.argmin(np.abs(position - output.position)))
            expected, u = values[k], uncertainties[k]
        # All samples have the weights of the nominal run: a thousandth of the uncertainty.
        assert value == pytest.approx(expected, abs=1e-3 * u + 1e-12), output.name


def test_samples_do_not_depend_on_where_a_range_begins() -> None:
    model = virtual([normal("laser", 1e-4, line="ppp")], head="multi_beam traced")
    np.testing.assert_array_equal(model.evaluate(0, 40)[:, 13:21], model.evaluate(13, 8))


def test_bad_input_is_refused() -> None:
    with pytest.raises(sd.InvalidArgument, match="method"):
        virtual([], method="best")
    with pytest.raises(sd.InvalidArgument, match="deviations"):
        virtual([normal("laser", 1e-4, line="ppp")]).evaluate_at([[1.0], [2.0]])
    with pytest.raises(sd.InvalidArgument, match="pp0"):
        virtual([normal("laser", 1e-4, line="pp0")])
    with pytest.raises(sd.InvalidArgument, match="first_sample"):
        virtual([]).evaluate(-1, 16)
    with pytest.raises(sd.InvalidArgument, match="sample"):
        virtual([]).readings(-1)
