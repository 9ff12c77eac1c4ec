"""The same of propagated intervals: set-ups, scales, air, drift, walks and repeatability drawn as uncertain inputs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from coverage_cases import STEPS, Case, Drawn, draw, known_to, labels, log_uniform
from usual import DIAGONALS, SCALE_LINES

import stepdiag as sd
from stepdiag import _core

SECONDS = 5.0


def normal(size: float) -> _core.Distribution:
    return _core.Distribution("normal", spread=size)


def inputs_of(case: Case, drawn: Drawn, rng: np.random.Generator) -> _core.UncertainInputs:
    """Everything that the evaluation is not told, by up to about what noise does."""
    inputs: list[_core.UncertainInput] = []

    def add(quantity: str, size: float, count: int = 1, line: str = "") -> None:
        inputs.extend(
            _core.UncertainInput(quantity, normal(size), line=line, component=c) for c in range(count) if size > 0
        )

    for line in DIAGONALS:
        add("reflector", case.reflector, 2, line)
        add("laser", case.laser, 2, line)
        add("lateral", 0.2, 2, line)
        add("roll", 2e-3, 1, line)
        add("gain", 2e-3, 1, line)
        add("drift", log_uniform(rng, 1e-8, 1e-6), 1, line)
    for line in SCALE_LINES:
        add("scale_length", log_uniform(rng, 5e-5, 5e-4), 1, line)
        add("scale_factor", 2e-7, 1, line)
    add("temperature", 0.3)
    add("pressure", 30.0)
    add("humidity", 0.03)
    add("refractive_index", 1e-7)
    add("wavelength", 5e-8)
    add("machine_drift", log_uniform(rng, 1e-8, 1e-6), 3)
    noise = [_core.ReadingNoise("channel", normal(drawn.noise_of(c)), channel=c) for c in drawn.head.signals]
    noise.append(_core.ReadingNoise("common", normal(log_uniform(rng, 1e-5, 1e-4))))
    noise.append(_core.ReadingNoise("head_walk", normal(log_uniform(rng, 3e-6, 3e-5))))
    for c in range(3):
        noise.append(_core.ReadingNoise("machine_walk", normal(log_uniform(rng, 3e-6, 3e-5)), component=c))
        noise.append(_core.ReadingNoise("position", normal(log_uniform(rng, 3e-5, 3e-4)), component=c))
        noise.append(_core.ReadingNoise("orientation", normal(log_uniform(rng, 1e-7, 1e-6)), component=c))
    return _core.UncertainInputs(inputs, noise)


def outcome(case: Case, seed: int, steps: int = STEPS) -> np.ndarray:
    """As coverage_cases.outcome: one sample of a random machine, by the uncertainties propagated for that machine."""
    still = replace(case, reflector=0.0, laser=0.0, distance_constant=0.0)
    drawn, rng = draw(still, seed, steps)
    calibrations = _core.VirtualCalibrations(
        drawn.machine,
        drawn.plan,
        drawn.head,
        inputs_of(case, drawn, rng),
        method=case.method,
        seed=seed,
        environment=sd.Environment.from_air(),
        seconds_per_reading=SECONDS,
        uncertainty=drawn.uncertainty,
        **case.told,
    )
    propagation = _core.propagate(calibrations, covariance=True)
    value = np.asarray(calibrations.evaluate(0, 1))[:, 0]
    return normalised(calibrations.outputs, value, np.asarray(propagation.covariance), drawn.machine.errors, steps)


def normalised(
    outputs: list[_core.Output], value: np.ndarray, covariance: np.ndarray, truth: sd.ErrorMap, steps: int
) -> np.ndarray:
    place: dict[str, list[int]] = {}
    true = np.empty(len(outputs))
    for i, one in enumerate(outputs):
        place.setdefault(one.name, []).append(i)
        is_angle = np.isnan(one.position)
        true[i] = truth.squareness[one.name] if is_angle else truth.function(one.name, [one.position])[0]
    deviation, variance = value - true, np.diag(covariance)
    found = []
    for family, name, k in labels(steps):
        if name not in place:
            found.append(np.nan)
        elif family == "shapes":
            at, last, share = place[name][k], place[name][-1], k / steps
            u = np.sqrt(variance[at] + share**2 * variance[last] - 2 * share * covariance[at, last])
            found.append((deviation[at] - share * deviation[last]) / u)
        else:
            at = place[name][k]
            found.append(deviation[at] / np.sqrt(variance[at]))
    return np.array(found)


CASES = {
    "propagated, enhanced": Case("enhanced", reflector=1e-4, laser=1e-4),
    "propagated, enhanced, layout b": Case("enhanced", "psd", reflector=1e-4, laser=1e-4),
    "propagated, adjustment": Case("adjustment", reflector=1e-3, laser=1e-3, told=known_to("free")),
}
