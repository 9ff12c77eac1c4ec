"""Many sets of readings at once: each as if it were evaluated alone, and the gain that one step is made of."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference
from adjusted import adjust, claims, statement
from dense_adjustment import DenseAdjustment
from virtual_runs import head_of, measured, noisy, plan_of, random_scenario, random_table, within

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS

SQUARENESS = ("C0Y", "B0Z", "A0Z")
CONVERGED = 1e-4  # of a standard uncertainty: what is left after the last step is estimated to be below half of it


class Case:
    """A plan and a machine at random; sets of readings that differ in noise and in set-ups up to 1 mrad."""

    def __init__(self, seed: int, layout: str, steps: int = 4, **given: Any) -> None:
        self.rng = np.random.default_rng(seed)
        self.scenario = random_scenario(self.rng, layout=layout, steps=steps, misalignment={}, **given)
        self.table = random_table(self.rng, self.scenario.volume, steps)
        self.pattern = measured(reference.simulate(self.scenario, self.table))

    def evaluator(self, method: str = "adjustment", **options: Any) -> sd.montecarlo.BatchEvaluator:
        s = self.scenario
        return sd.montecarlo.BatchEvaluator(
            self.pattern, plan_of(s), head_of(s), s.chain, s.tool, method=method, **options
        )

    def sample(self, size: float = 1e-3) -> sd.Measurement:
        for line in self.scenario.lines:
            setup = {"reflector": within(self.rng, size), "laser": within(self.rng, size)}
            self.scenario.misalignment[line] = setup
        run = noisy(measured(reference.simulate(self.scenario, self.table)), self.rng)
        self.scenario.misalignment.clear()
        return run


def readings(run: sd.Measurement) -> np.ndarray:
    return np.stack([run.channels[name] for name in run.channels], axis=1)


def tables(calibration: sd.Calibration) -> tuple[np.ndarray, np.ndarray]:
    """Values and standard uncertainties in the order of entries."""
    functions = [calibration.functions[name] for name in FUNCTIONS if name in calibration.functions]
    squareness = [calibration.squareness[name] for name in SQUARENESS if name in calibration.squareness]
    value = np.concatenate([*(v for _, v, _ in functions), [v for v, _ in squareness]])
    u = np.concatenate([*(u for _, _, u in functions), [u for _, u in squareness]])
    return value, u


def in_order(claimed: dict[tuple[str, int], Any]) -> list[tuple[tuple[str, int], Any]]:
    """What a calibration claims, in the order of entries."""
    return sorted(claimed.items(), key=lambda item: [*FUNCTIONS, *SQUARENESS].index(item[0][0]))


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_each_set_is_adjusted_as_if_it_were_alone(layout: str) -> None:
    case = Case(3, layout)
    runs = [case.sample() for _ in range(5)]
    values = case.evaluator().evaluate([readings(run) for run in runs])
    for run, found in zip(runs, values, strict=True):
        expected, u = tables(adjust(run, case.scenario, outlier_probability=0.0).calibration)
        assert np.all(np.abs(found - expected) <= CONVERGED * u)


@pytest.mark.parametrize("method", ["conventional", "enhanced"])
def test_each_set_is_evaluated_as_if_it_were_alone(method: str) -> None:
    case = Case(4, "psd")
    evaluator = case.evaluator(method)
    run = case.sample(1e-4)
    s = case.scenario
    expected, u = tables(sd.methods.evaluate(run, plan_of(s), head_of(s), sd.Chain(s.chain), s.tool, method=method))
    found = evaluator.evaluate([readings(run)])[0]
    # Readings are weighed as those of the pattern, whose tilts are others: 7e-4 at 1e-4 rad, 7e-5 at 1e-5.
    assert np.all(np.abs(found - expected) <= 1e-3 * u)


def test_entries_are_those_of_the_calibration() -> None:
    evaluator = Case(5, "ideal").evaluator()
    calibration = evaluator.calibration
    names = [name for name in FUNCTIONS for _ in calibration.functions[name][0]]
    positions = np.concatenate([calibration.functions[name][0] for name in FUNCTIONS])
    assert [e.parameter for e in evaluator.entries] == [*names, *SQUARENESS]
    assert np.array_equal([e.position for e in evaluator.entries][:-3], positions)
    assert all(np.isnan(e.position) for e in evaluator.entries[-3:])
    assert repr(evaluator.entries[0]) == "CalibrationEntry(EXX, 0.0 mm)"


def test_adjusted_values_are_those_of_the_dense_adjustment() -> None:
    case = Case(6, "psd", steps=3)
    run = case.sample()
    found = case.evaluator().evaluate([readings(run)])[0]
    dense = DenseAdjustment(run, case.scenario).solve()
    calibration = adjust(run, case.scenario, outlier_probability=0.0).calibration
    for value, (key, weights) in zip(found, in_order(claims(calibration, dense)), strict=True):
        assert abs(value - dense.value(weights)) <= CONVERGED * statement(calibration, dense, key)[1] + 1e-15


def test_gain_is_that_of_the_dense_normal_equations() -> None:
    """Of a value w x: w (J^T J)^-1 J^T/u at the solution, where residuals are 0."""
    case = Case(7, "psd", steps=3)
    evaluator = case.evaluator()
    gain = evaluator.gain()
    dense = DenseAdjustment(case.pattern, case.scenario).solve()
    assert list(dense.channels) == evaluator.channels
    jacobian = dense.model.jacobian(dense.x)[:, :, dense.active]  # channels, rows, unknowns
    by_reading = np.where(dense.used[:, :, None], jacobian / dense.u[:, :, None] ** 2, 0.0) @ dense.covariance
    calibration = adjust(case.pattern, case.scenario).calibration
    for row, (key, weights) in zip(gain, in_order(claims(calibration, dense)), strict=True):
        expected = np.moveaxis(by_reading @ dense.vector(weights), 0, 1)
        largest = np.max(np.abs(expected)) or 1e-12
        assert np.max(np.abs(row - expected)) <= 1e-6 * largest, key  # the condition takes ten of sixteen digits


def test_gain_is_the_change_of_the_adjustment() -> None:
    case = Case(8, "ideal")
    gain = case.evaluator().gain()
    _, u = tables(adjust(case.pattern, case.scenario).calibration)
    for row, channel, step in ((0, "distance", 1e-4), (3, "alpha", 1e-6), (20, "beta", 1e-6), (44, "distance", 1e-4)):
        sides = []
        for sign in (1, -1):
            channels = {name: np.array(value) for name, value in case.pattern.channels.items()}
            channels[channel][row] += sign * step
            run = sd.Measurement(case.pattern.line, case.pattern.point, case.pattern.position, channels)
            sides.append(tables(adjust(run, case.scenario, outlier_probability=0.0).calibration)[0])
        change = (sides[0] - sides[1]) / 2
        place = list(case.pattern.channels).index(channel)
        # A step of the reading's own uncertainty moves no value by more than its own; the third order is left.
        assert np.all(np.abs(gain[:, row, place] * step - change) <= 1e-4 * u)


def test_bits_are_the_same_on_any_threads_and_at_any_place() -> None:
    case = Case(9, "multi_beam", steps=3)
    sets = np.array([readings(case.sample(size)) for size in [1e-3, 1e-5, 5e-3] * 13])
    evaluator = case.evaluator()
    alone = evaluator.evaluate(sets, threads=1)
    assert np.all(np.isfinite(alone))
    assert np.array_equal(evaluator.evaluate(sets, threads=3), alone)
    assert np.array_equal(evaluator.evaluate(sets[::-1])[::-1], alone)
    assert np.array_equal(evaluator.evaluate(sets[7:8])[0], alone[7])


def test_a_lost_reading_loses_its_set_only() -> None:
    case = Case(10, "ideal", steps=3)
    sets = np.array([readings(case.sample()) for _ in range(3)])
    for method in ("enhanced", "adjustment", "one_step"):
        evaluator = case.evaluator(method)
        whole = evaluator.evaluate(sets)
        damaged = sets.copy()
        damaged[1, 4, 0] = np.nan
        found = evaluator.evaluate(damaged)
        assert np.all(np.isnan(found[1]))
        assert np.array_equal(found[[0, 2]], whole[[0, 2]])
    assert evaluator.evaluate(np.empty((0, *sets.shape[1:]))).shape == (0, len(evaluator.entries))


def test_one_step_is_off_by_second_order() -> None:
    """Without noise, set-ups half as far from the pattern's leave a quarter."""
    case = Case(11, "psd")
    one, all_steps = case.evaluator("one_step"), case.evaluator()
    _, u = tables(all_steps.calibration)
    whole = readings(case.pattern)
    worst = []
    for size in (4e-4, 2e-4):
        for line, (a, b) in zip(case.scenario.lines, ((1, 0.3), (-0.2, 0.9), (0.7, -0.8), (-1, 0.1)), strict=True):
            setup = {"reflector": (a * size, -b * size), "laser": (b * size, a * size)}
            case.scenario.misalignment[line] = setup
        run = readings(measured(reference.simulate(case.scenario, case.table)))
        difference = (one.evaluate([run]) - all_steps.evaluate([run]))[0][u > 0] / u[u > 0]
        worst.append(np.max(np.abs(difference)))
    assert worst[0] > 0.5  # of a standard uncertainty
    assert worst[1] / worst[0] == pytest.approx(0.25, abs=0.03)  # third order
    assert one.evaluate([whole]) == pytest.approx(all_steps.evaluate([whole]), rel=1e-9, abs=1e-12)


def test_bad_input_is_refused() -> None:
    case = Case(12, "ideal", steps=3)
    evaluator = case.evaluator()
    rows = len(case.pattern)
    for wrong in (np.zeros((1, rows, 2)), np.zeros((rows, 3)), "readings"):
        with pytest.raises(sd.InvalidArgument, match=rf"readings: expected shape \(n, {rows}, 3\)"):
            evaluator.evaluate(wrong)  # type: ignore[arg-type]
    with pytest.raises(sd.InvalidArgument, match="threads"):
        evaluator.evaluate(readings(case.pattern)[None], threads=-1)
    with pytest.raises(sd.InvalidArgument, match='method: expected "conventional"'):
        case.evaluator("exact")
    with pytest.raises(sd.InvalidArgument, match="ppp0"):
        case.evaluator(setup_by_line={"ppp0": sd.methods.SetupPriors(laser="fixed")})
