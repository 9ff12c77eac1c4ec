"""Quantities derived from a calibration: against the machine, the reference's exact pose, and brute force in numpy."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
import usual
from reference import DOUBLE, ErrorTable, pose
from truth import Setup

import stepdiag as sd
from stepdiag import _core as core

CHAINS = ["[w X' b Y Z t]", "[w b X Y Z t]", "[w Y' X' b Z t]"]
TOOL = (20.0, -30.0, -150.0)
VOLUME = np.array(usual.VOLUME)


def calibration_of(chain: str, seed: int = 1, steps: int = 5, method: str = "enhanced") -> sd.Calibration:
    setup = Setup(steps=steps, chain=chain, tool=TOOL)
    return setup.evaluate(setup.simulate(setup.errors(seed)), method=method, full_covariance=True)


def error_map(calibration: sd.Calibration) -> sd.ErrorMap:
    functions = {name: (position, value) for name, (position, value, _) in calibration.functions.items()}
    return sd.ErrorMap(functions, {name: value for name, (value, _) in calibration.squareness.items()})


def with_values(calibration: sd.Calibration, values: np.ndarray, covariance: np.ndarray | None) -> sd.Calibration:
    """The same tables with other values."""
    functions, at = {}, 0
    uncertainty = np.zeros(len(values)) if covariance is None else np.sqrt(np.diag(covariance))
    for name in dict.fromkeys(name for name, _ in calibration.covariance_labels):
        if name in calibration.functions:
            position, old, _ = calibration.functions[name]
            here = slice(at, at + len(old))
            functions[name] = (position, values[here], uncertainty[here])
            at += len(old)
    squareness = {n: (values[at + i], uncertainty[at + i]) for i, n in enumerate(("C0Y", "B0Z", "A0Z"))}
    return sd.Calibration(
        "test", calibration.chain, VOLUME, calibration.tool, functions, squareness, covariance=covariance
    )


def values_of(calibration: sd.Calibration) -> np.ndarray:
    names = dict.fromkeys(name for name, _ in calibration.covariance_labels)
    parts = [
        calibration.functions[n][1] if n in calibration.functions else [calibration.squareness[n][0]] for n in names
    ]
    return np.concatenate(parts)


def random_points(count: int) -> Iterable[np.ndarray]:
    return np.random.default_rng(5).uniform(-0.1, 1.1, (count, 3)) * VOLUME


@pytest.mark.parametrize("chain", CHAINS)
def test_error_at_a_point_is_the_machines(chain: str) -> None:
    calibration = calibration_of(chain)
    errors = error_map(calibration)
    machine = sd.Machine(chain, errors, (5.0, 6.0, -70.0))
    table = ErrorTable(errors.functions, errors.squareness)
    for point in random_points(20):
        found = core.error_at_point(calibration, point, tool=(5.0, 6.0, -70.0))
        assert found.missing == {}
        # Second order: (60 urad)^2 over 1.5 m is 5 nm; three axes and 60 urad over 0.05 mm come to it.
        assert np.max(np.abs(found.value[:3] - machine.error([point])[0])) < 2e-5
        rotation, place = pose(sd.Chain(chain).name, table, (5.0, 6.0, -70.0), tuple(point), DOUBLE)
        assert np.max(np.abs(found.value[:3] - (np.asarray(place, float) - point - (5.0, 6.0, -70.0)))) < 2e-5
        turn = np.array(
            [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
        )
        assert np.max(np.abs(found.value[3:] - np.asarray(turn, float) / 2)) < 4e-8  # products of three 100 urad


@pytest.mark.parametrize("chain", CHAINS)
def test_covariance_at_a_point_is_that_of_moved_tables(chain: str) -> None:
    """The derivative by each entry from a calibration with that entry moved."""
    calibration = calibration_of(chain, steps=3)
    values, covariance = values_of(calibration), calibration.covariance
    assert covariance is not None
    point = (310.0, 420.0, 130.0)
    gain = []
    for entry in range(len(values)):
        moved = values.copy()
        moved[entry] += 1.0
        here = core.error_at_point(with_values(calibration, moved, None), point).value
        gain.append(here - core.error_at_point(calibration, point).value)
    expected = np.array(gain).T @ covariance @ np.array(gain)
    found = core.error_at_point(calibration, point)
    # Levers of 1e3 against values of 1: rounding 1e-13.
    assert np.allclose(found.covariance, expected, rtol=1e-9, atol=1e-10 * np.max(np.diag(expected)[3:]))
    assert np.allclose(found.standard_uncertainty**2, np.diag(found.covariance))
    rows = np.array([d.row for d in core.derived_at_point(calibration, point)])
    assert np.allclose(rows @ values, found.value, rtol=0, atol=1e-15)


def test_missing_parameters_are_named_and_make_what_they_act_on_nan() -> None:
    calibration = calibration_of("[w X' b Y Z t]", method="conventional")
    found = core.error_at_point(calibration, (100.0, 200.0, 300.0))
    assert set(found.missing) == set("XYZABC")
    assert {"EAX", "EAY", "EAZ"} <= set(found.missing["A"])
    assert np.all(np.isnan(found.value))
    assert core.derived_at_point(calibration, (100.0, 200.0, 300.0)) == []
    assert np.all(np.isnan(core.volumetric_accuracy(calibration, samples=2000).value))
    assert core.RangeModel(calibration).outputs == []


def brute_ranges(calibration: sd.Calibration, between: int) -> np.ndarray:
    """On a grid of the nodes with so many points between, by the machine's first order: errors a millionth in size."""
    scale = 1e-6
    small = sd.ErrorMap(
        {n: (p, scale * v) for n, (p, v, _) in calibration.functions.items()},
        {n: scale * v for n, (v, _) in calibration.squareness.items()},
    )
    nodes = len(calibration.functions["EXX"][0]) - 1
    axes = [np.linspace(0, edge, nodes * between + 1) for edge in VOLUME]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    error = sd.Machine(calibration.chain, small, calibration.tool).error(grid) / scale
    turn = np.zeros((len(grid), 3))
    for c in range(3):
        for a in range(3):
            turn[:, c] += small.function(f"E{'ABC'[c]}{'XYZ'[a]}", grid[:, a]) / scale
    return np.concatenate([np.ptp(error, axis=0), np.ptp(turn, axis=0)])


@pytest.mark.parametrize("chain", CHAINS)
def test_volumetric_accuracy_is_the_range_of_a_fine_grid(chain: str) -> None:
    calibration = calibration_of(chain, steps=4)
    found = core.volumetric_accuracy(calibration, samples=2000)
    expected = brute_ranges(calibration, 12)
    # The small machine's rounding is 1e-13/1e-6 of a metre; the grid misses a 144th of what parabolas rise by (6 um
    # within 200 mm), on either side; finer grids of the second axis miss a 256th.
    assert np.all(found.value[:3] >= expected[:3] - 1e-6 - 2 * found.resolution)
    assert np.all(found.value[:3] <= expected[:3] + 1e-4)
    assert np.allclose(found.value[3:6], expected[3:], rtol=0, atol=1e-9)
    for k, (line, diagonal) in enumerate(sorted(core.diagonal_errors(calibration).items(), key=lambda d: d[0][::-1])):
        assert f"E_D {line}" in found.names
        assert found.value[found.names.index(f"E_D {line}")] == pytest.approx(diagonal.range, abs=1e-15)
        assert k < 4


@pytest.mark.parametrize("chain", CHAINS)
def test_diagonals_are_those_of_the_machine(chain: str) -> None:
    calibration = calibration_of(chain)
    machine = sd.Machine(chain, error_map(calibration), calibration.tool)
    for line, diagonal in core.diagonal_errors(calibration).items():
        sign = np.array([1.0 if s == "p" else -1.0 for s in line])
        direction = sign * VOLUME / np.linalg.norm(VOLUME)
        start = np.where(sign > 0, 0.0, VOLUME)
        points = start + np.linspace(0, 1, 6)[:, None] * sign * VOLUME
        assert np.allclose(diagonal.point, points, atol=1e-10)
        error = machine.error(points)
        assert np.max(np.abs(diagonal.value - (error - error[0]) @ direction)) < 2e-5  # second order, as above
        assert diagonal.range == np.ptp(diagonal.value)
        rows = np.array([d.row for d in core.derived_on_diagonals(calibration) if d.name.startswith(f"E_D {line}")])
        covariance = rows @ calibration.covariance @ rows.T
        assert np.allclose(diagonal.covariance, covariance, rtol=1e-9, atol=1e-12 * np.max(covariance))


def test_ranges_drawn_by_the_monte_carlo_engine_are_those_drawn_here() -> None:
    calibration = calibration_of("[w X' b Y Z t]", steps=4)
    found = core.volumetric_accuracy(calibration, samples=10_000, seed=3)
    model = core.RangeModel(calibration, seed=3)
    drawn = model.evaluate(0, 10_000)
    assert [o.name for o in model.outputs] == list(found.names)
    assert np.allclose(found.mean, np.mean(drawn, axis=1), rtol=1e-12)
    assert np.allclose(found.standard_uncertainty, np.std(drawn, axis=1, ddof=1), rtol=1e-9)
    # One order statistic beside the next.
    ends = np.quantile(drawn, [0.025, 0.975], axis=1).T
    assert np.allclose(found.drawn_interval, ends, rtol=0, atol=0.02 * np.max(found.standard_uncertainty))
    # Draws about the values with the covariance of numpy's own generator.
    rng = np.random.default_rng(1)
    samples = rng.multivariate_normal(values_of(calibration), calibration.covariance, 300, method="eigh")
    mine = np.array([brute_ranges(with_values(calibration, s, None), 1) for s in samples[:300]])[:, 3:]
    u = found.standard_uncertainty[3:6]
    # Of 300: a mean is uncertain by u/17, a standard deviation by 4 %: four of these.
    assert np.all(np.abs(np.mean(mine, axis=0) - found.mean[3:6]) < 4 / 17 * u)
    assert np.all(np.abs(np.std(mine, axis=0) / u - 1) < 0.17)


@pytest.mark.parametrize(("noise", "covered"), [(1.0, 50), (10.0, 45)])
def test_intervals_of_ranges_cover_the_truth_and_draws_are_too_large(noise: float, covered: int) -> None:
    """Tables with noise of their covariance, of 0.1 um and 1 urad a reading and of ten times that: how often
    is the true range within the intervals?"""
    exact = calibration_of("[w X' b Y Z t]", steps=3)
    covariance = noise**2 * exact.covariance
    truth = core.volumetric_accuracy(core.with_covariance(exact, covariance), samples=2000).value
    samples = np.random.default_rng(8).multivariate_normal(values_of(exact), covariance, 60, method="eigh")
    inside, bounded, bias = np.zeros(10), np.zeros(10), np.zeros(10)
    for seed, sample in enumerate(samples):
        found = core.volumetric_accuracy(with_values(exact, sample, covariance), samples=2000, seed=seed)
        inside += (found.interval[:, 0] <= truth) & (truth <= found.interval[:, 1])
        bounded += np.abs(found.value - truth) <= found.bound
        bias += found.bias / found.standard_uncertainty / 60
    # 95 % of 60 is 57 +- 1.7: four of these. `interval` takes the bias off to first order, and covers less where noise
    # is as large as the errors; `bound` holds whatever the errors are.
    assert np.all(inside >= covered), inside
    assert np.all(bounded >= 50), bounded
    assert np.all(bias > -0.1)  # 2,000 draws know it to 0.02
    assert np.max(bias) > 0.02 * noise


def test_another_covariance_takes_the_place_of_the_calibrations_own() -> None:
    calibration = calibration_of("[w X' b Y Z t]", steps=3)
    other = core.with_covariance(calibration, 4.0 * calibration.covariance)
    assert np.array_equal(other.covariance, 4.0 * calibration.covariance)
    for name, (_, value, u) in calibration.functions.items():
        assert np.array_equal(other.functions[name][1], value)
        assert np.allclose(other.functions[name][2], 2 * u, rtol=1e-7, atol=1e-15)  # a root of sums in another order
    assert np.isclose(other.squareness["B0Z"][1], 2 * calibration.squareness["B0Z"][1])
    with pytest.raises(sd.InvalidArgument, match="covariance"):
        core.with_covariance(calibration, np.eye(3))


def test_volumetric_accuracy_refuses_what_it_cannot_do() -> None:
    calibration = calibration_of("[w X' b Y Z t]", steps=3)
    with pytest.raises(sd.InvalidArgument, match="samples"):
        core.volumetric_accuracy(calibration, samples=1000)
    with pytest.raises(sd.InvalidArgument, match="full covariance"):
        core.volumetric_accuracy(with_values(calibration, values_of(calibration), None))
    with pytest.raises(sd.InvalidArgument, match="point"):
        core.error_at_point(calibration, (np.nan, 0.0, 0.0))
    with pytest.raises(sd.InvalidArgument, match="tool"):
        core.diagonal_errors(calibration, tool=(0.0, np.inf, 0.0))
