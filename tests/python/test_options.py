"""Verbs take their options as one value, or its fields by name."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from refusal import refused
from usual import CHAIN, SMALL_VOLUME, small_plan

import stepdiag as sd

PLAN, HEAD = small_plan(steps=4), sd.Head()
MACHINE = sd.Machine(CHAIN, sd.random_error_map(SMALL_VOLUME, seed=2))
SIMULATION: dict[str, Any] = {
    "misalignment": {"ppp": sd.Misalignment(reflector=(1e-4, 2e-4))},
    "noise": sd.Noise(distance=1e-4, tilt=1e-6, seed=4),
    "repeats": 2,
    "backward": True,
    "seconds_per_reading": 2.0,
}
ADJUSTMENT: dict[str, Any] = {
    "uncertainty": sd.methods.ReadingUncertainty(distance=2e-4),
    "setup": sd.methods.SetupPriors(laser=1e-3),
    "setup_by_line": {"ppp": sd.methods.SetupPriors(reflector="fixed")},
    "rotations": False,
    "outlier_probability": 0.0,
    "slips": "estimate",
    "full_covariance": True,
}


def run(*options: sd.SimulationOptions, **fields: Any) -> sd.Measurement:
    return sd.simulate(MACHINE, PLAN, HEAD, *options, **fields)


def same_readings(one: sd.Measurement, other: sd.Measurement) -> bool:
    return all(one.channels[name].tobytes() == other.channels[name].tobytes() for name in one.channels)


def test_options_and_their_fields_do_the_same() -> None:
    measured = run(**SIMULATION)
    assert same_readings(measured, run(sd.SimulationOptions(**SIMULATION)))
    by_fields, whole = (
        sd.methods.adjust(measured, PLAN, HEAD, CHAIN, (0, 0, 0), *options, **fields).calibration
        for options, fields in (((), ADJUSTMENT), ((sd.methods.AdjustmentOptions(**ADJUSTMENT),), {}))
    )
    assert np.array_equal(by_fields.covariance, whole.covariance)
    assert by_fields.squareness == whole.squareness


def test_virtual_calibrations_take_both_options_or_the_fields_of_both() -> None:
    inputs = sd.montecarlo.UncertainInputs([], [])
    fields = {"misalignment": SIMULATION["misalignment"], "repeats": 2, "uncertainty": ADJUSTMENT["uncertainty"]}
    one = sd.montecarlo.VirtualCalibrations(MACHINE, PLAN, HEAD, inputs, **fields)
    other = sd.montecarlo.VirtualCalibrations(
        MACHINE,
        PLAN,
        HEAD,
        inputs,
        # Noise is among the inputs, and not taken from here.
        simulation=sd.SimulationOptions(misalignment=SIMULATION["misalignment"], repeats=2, noise=SIMULATION["noise"]),
        adjustment=sd.methods.AdjustmentOptions(uncertainty=ADJUSTMENT["uncertainty"]),
    )
    assert same_readings(one.nominal, other.nominal)
    assert one.calibration.squareness == other.calibration.squareness


@pytest.mark.parametrize(
    ("call", "options", "field"),
    [
        (lambda *o, **f: sd.simulate(MACHINE, PLAN, HEAD, *o, **f), sd.SimulationOptions(), {"repeats": 2}),
        (
            lambda *o, **f: sd.methods.adjust(run(), PLAN, HEAD, CHAIN, (0, 0, 0), *o, **f),
            sd.methods.AdjustmentOptions(),
            {"rotations": False},
        ),
    ],
)
def test_options_and_fields_together_are_refused(call: Callable[..., Any], options: Any, field: dict[str, Any]) -> None:
    refused(call, options, names="options: expected options or their fields by name, got both", **field)
    with pytest.raises(TypeError):
        call(no_such_field=1)


@pytest.mark.parametrize("field", [{"outlier_probability": 0.02}, {"scale_uncertainty": True}])
def test_what_many_sets_of_readings_cannot_have_is_refused(field: dict[str, Any]) -> None:
    (name,) = field
    refused(
        sd.montecarlo.BatchEvaluator, run(), PLAN, HEAD, CHAIN, method="adjustment", names=f"{name}: expected", **field
    )


def test_fields_are_those_that_were_given_and_defaults_those_of_the_verbs() -> None:
    options = sd.methods.AdjustmentOptions(**ADJUSTMENT)
    for name in ("rotations", "outlier_probability", "full_covariance"):
        assert getattr(options, name) == ADJUSTMENT[name]
    assert options.uncertainty.distance == 2e-4
    assert set(options.setup_by_line) == {"ppp"}
    simulation = sd.SimulationOptions(**SIMULATION)
    for name in ("repeats", "backward", "seconds_per_reading"):
        assert getattr(simulation, name) == SIMULATION[name]
    assert same_readings(run(), run(sd.SimulationOptions()))
