"""Smoothness as knowledge: the dense adjustment with the same rows; what it must not hide; the same bits twice."""

from __future__ import annotations

import numpy as np
import pytest
import reference
from adjusted import adjust, assert_as_dense
from dense_adjustment import DenseAdjustment, Knowledge
from usual import DIAGONALS
from virtual_runs import measured, noisy, random_scenario, random_table

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS


@pytest.mark.slow
@pytest.mark.parametrize(("translation", "rotation"), [(1e-3, 3e-6), (5e-3, 0.0), (0.0, 1e-6)])
def test_smoothness_is_the_dense_adjustment_with_rows_of_second_differences(
    translation: float, rotation: float
) -> None:
    rng = np.random.default_rng(71)
    scenario = random_scenario(rng, steps=5)
    table = random_table(rng, scenario.volume, 5)
    run = noisy(measured(reference.simulate(scenario, table)), rng)
    deviation = {name: rotation if name[1] in "ABC" else translation for name in FUNCTIONS}
    knowledge = Knowledge(smoothness={name: s for name, s in deviation.items() if s > 0})
    dense = DenseAdjustment(run, scenario, knowledge).solve()
    adjustment = adjust(run, scenario, knowledge, outlier_probability=0.0)
    assert_as_dense(adjustment, dense)
    assert adjustment.smoothness == {name: s for name, s in deviation.items() if s > 0}


def smooth_machine(seed: int, steps: int, screw: float) -> tuple[reference.Scenario, reference.ErrorTable, np.ndarray]:
    """Long waves only, and on X a screw's pitch error of 10 mm: 3.2 nodes a period."""
    rng = np.random.default_rng(seed)
    scenario = random_scenario(
        rng, steps=steps, volume=(800.0 * steps / 256, 600.0, 500.0), chain="[w X' b Y Z t]", tool=(0.0, 0.0, 0.0)
    )
    functions = {}
    for axis, edge in zip("XYZ", scenario.volume, strict=True):
        p = np.linspace(0.0, edge, steps + 1)
        for c in "XYZABC":
            amplitude = 0.02 if c in "XYZ" else 60e-6
            value = amplitude * (np.sin(2.2 * p / edge + rng.uniform(0, 6)) + 0.3 * np.sin(5 * p / edge))
            value = value - value[0]
            if c in "XYZ" and c != axis:
                value = value - p / edge * value[-1]
            functions[f"E{c}{axis}"] = ([float(v) for v in p], [float(v) for v in value])
    p, value = functions["EXX"]
    pitch = np.sin(2 * np.pi * np.array(p) / 10.0)
    functions["EXX"] = (p, [float(v) for v in np.array(value) + screw * pitch])
    return scenario, reference.ErrorTable(functions, {"C0Y": 20e-6, "B0Z": -30e-6, "A0Z": 10e-6}), pitch


@pytest.mark.slow
def test_cross_validation_finds_smooth_axes_and_keeps_the_screw() -> None:
    """2 um of a 10 mm pitch at 0.1 um and 1 urad of noise: it stays, and the smooth functions get better."""
    screw = 2e-3
    scenario, table, pitch = smooth_machine(72, 60, screw)
    run = noisy(measured(reference.simulate(scenario, table)), np.random.default_rng(72))
    rough = adjust(run, scenario, outlier_probability=0.0)
    smooth = adjust(run, scenario, outlier_probability=0.0, smoothness=sd.methods.Smoothness(cross_validated=True))
    assert set(smooth.smoothness) <= set(FUNCTIONS)
    position, value, _ = smooth.calibration.functions["EXX"]
    # What is left of the pitch error, by least squares beside a polynomial for the long waves.
    waves = np.polynomial.legendre.legvander(2 * np.asarray(position) / position[-1] - 1, 8)
    amplitude = np.linalg.lstsq(np.column_stack([pitch, waves]), value, rcond=None)[0][0]
    assert amplitude == pytest.approx(screw, rel=0.1)
    # Smoothing takes the short waves of the noise away; what is left adds up from node to node.
    for name in FUNCTIONS:
        assert np.mean(smooth.calibration.functions[name][2]) < np.mean(rough.calibration.functions[name][2]), name


@pytest.mark.slow
def test_cross_validation_claims_no_more_than_it_knows() -> None:
    """Errors in units of the stated uncertainties stay of the size of one."""
    ratios = []
    for seed in range(6):
        scenario, table, _ = smooth_machine(80 + seed, 30, 0.0)
        run = noisy(measured(reference.simulate(scenario, table)), np.random.default_rng(seed))
        smooth = adjust(run, scenario, outlier_probability=0.0, smoothness=sd.methods.Smoothness(cross_validated=True))
        for name, (_, value, u) in smooth.calibration.functions.items():
            error = value - np.array(table.functions[name][1])
            ratios.append(error[u > 0] / u[u > 0])
    assert np.sqrt(np.mean(np.concatenate(ratios) ** 2)) <= 1.5


def bits(adjustment: sd.Adjustment) -> list[bytes]:
    parts = [
        np.asarray(a).tobytes() for _, columns in sorted(adjustment.calibration.functions.items()) for a in columns
    ]
    parts += [np.array(v).tobytes() for _, v in sorted(adjustment.calibration.squareness.items())]
    parts += [adjustment.residuals[c].tobytes() + adjustment.redundancy[c].tobytes() for c in adjustment.residuals]
    return [*parts, adjustment.calibration.covariance.tobytes(), np.array(adjustment.variance_factor).tobytes()]


def test_same_run_gives_the_same_bits() -> None:
    rng = np.random.default_rng(73)
    scenario = random_scenario(rng, steps=12, layout="psd")
    run = noisy(measured(reference.simulate(scenario, random_table(rng, scenario.volume, 12))), rng)
    first, second = (adjust(run, scenario, full_covariance=True) for _ in range(2))
    assert bits(first) == bits(second)


def test_order_of_rows_is_irrelevant() -> None:
    rng = np.random.default_rng(74)
    scenario = random_scenario(rng, steps=6, backward=True, seconds_per_reading=10.0)
    run = noisy(measured(reference.simulate(scenario, random_table(rng, scenario.volume, 6, reversal=0.2))), rng)
    order = rng.permutation(len(run))
    shuffled = sd.Measurement(
        [run.line[i] for i in order],
        np.asarray(run.point)[order],
        np.asarray(run.position)[order],
        {name: value[order] for name, value in run.channels.items()},
        run=np.asarray(run.run)[order],
        direction=[run.direction[i] for i in order],
    )
    knowledge_by_line = {(line, "drift"): 1e-6 for line in DIAGONALS}
    knowledge = Knowledge(knowledge_by_line)
    before, after = adjust(run, scenario, knowledge), adjust(shuffled, scenario, knowledge)
    for name, (_, value, u) in before.calibration.functions.items():
        known = u > 0
        _, found, deviation = after.calibration.functions[name]
        assert np.max(np.abs(found - value)[known] / u[known]) <= 1e-7  # sums in another order
        assert np.allclose(deviation, u, rtol=1e-8)
    for channel, residual in before.residuals.items():
        assert np.allclose(after.residuals[channel], residual[order], atol=1e-9, equal_nan=True)
