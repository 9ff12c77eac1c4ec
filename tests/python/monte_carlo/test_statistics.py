"""Statistics of Monte Carlo runs against numpy's, of the very samples; coverage regions on fresh ones."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from philox import MONTE_CARLO, normal_pair, uniform_pair

from stepdiag import _core

LEAF = 2_000


def distributions() -> list[_core.Distribution]:
    return [
        _core.Distribution("normal", spread=2.0, expectation=10.0),
        _core.Distribution("rectangular", spread=1.0),
        _core.Distribution("arcsine", spread=3.0, expectation=-1.0),
        _core.Distribution("t", spread=0.5, degrees_of_freedom=6.0),
        _core.Distribution("triangular", spread=0.1),
        _core.Distribution("curvilinear_trapezoid", spread=1.0, edge=0.2),
    ]


NAMES = ["linear", "skew", "far from 0", "two peaks", "certain", "tiny", "tail"]


def several(x: np.ndarray) -> np.ndarray:
    """Of many shapes and sizes."""
    return np.array(
        [
            x[0] + x[1] + x[2],
            np.exp(x[1]) * (1 + 0.1 * x[4]),
            1e9 + x[0] * 1e-3,
            x[2] + 0.1 * x[1],
            np.full_like(x[0], 3.0),
            1e-12 * (x[0] - 10.0) + 1e-13 * x[5],
            x[3],
        ]
    )


def losing(x: np.ndarray) -> np.ndarray:
    """One sample in ten gives nothing."""
    return np.where(x[1] > 0.8, np.nan, several(x))


def model_of(function: Any = several, seed: int = 5) -> Any:
    return _core.FunctionModel(function, distributions(), NAMES, seed=seed)


def run(model: Any, leaves: int, options: Any = None, threads: int = 0) -> Any:
    bins = _core.make_bins(model, options or _core.StatisticsOptions(), threads=threads)
    return _core.run_leaves(model, bins, 0, leaves, threads=threads).result()


def test_inputs_of_a_function_are_drawn_by_their_published_counters() -> None:
    seen: list[np.ndarray] = []

    def first(x: np.ndarray) -> np.ndarray:
        seen.append(np.array(x))
        return x[:1]

    model = _core.FunctionModel(first, distributions(), ["y"], seed=77)
    model.evaluate(16, 32)
    x, at = seen[-1], np.arange(16, 16 + seen[-1].shape[1])
    normal = normal_pair(77, MONTE_CARLO, at, 0, 0)[0]
    assert np.allclose(x[0], 10.0 + 2.0 * normal, rtol=1e-14)
    u, v = uniform_pair(77, MONTE_CARLO, at, 1, 1)
    assert np.allclose(x[1], 2.0 * u - 1.0, rtol=0, atol=1e-15)
    u, v = uniform_pair(77, MONTE_CARLO, at, 2, 1)
    assert np.allclose(x[2], -1.0 + 3.0 * np.sin(2 * np.pi * u), rtol=0, atol=1e-14)
    u, v = uniform_pair(77, MONTE_CARLO, at, 3, 1)
    assert np.allclose(x[3], 0.5 * np.sqrt(6.0 * (u ** (-2.0 / 6.0) - 1.0)) * np.cos(2 * np.pi * v), atol=1e-13)
    u, v = uniform_pair(77, MONTE_CARLO, at, 5, 1)
    low = -1.2 + 0.4 * u
    assert np.allclose(x[5], low - 2.0 * low * v, rtol=0, atol=1e-14)


@pytest.mark.parametrize("function", [several, losing])
@pytest.mark.parametrize("coverage", [0.95, 0.99])
def test_figures_are_numpy_s_of_the_same_samples(function: Any, coverage: float) -> None:
    leaves = 20
    model = model_of(function)
    result = run(model, leaves, _core.StatisticsOptions(coverage=coverage, covariance=True, kept=[1]))
    values = np.asarray(model.evaluate(0, leaves * LEAF))
    there = ~np.isnan(values[0])
    assert result.samples == np.sum(there)
    assert result.lost == np.sum(~there)
    assert np.array_equal(np.asarray(result.kept[1]), values[1], equal_nan=True)
    good = values[:, there]
    # About the first value: numpy's sums of 1e9 are not good to the thousandths that these scatter by.
    moved = good - good[:, :1]
    u, covariance = np.std(moved, axis=1, ddof=1), np.cov(moved)
    scale = np.where(u > 0, u, 1.0)
    # Roundings of 40,000 terms; a value by itself is rounded, too.
    mean = good[:, 0] + moved.mean(axis=1)
    assert np.all(np.abs(result.mean - mean) <= 1e-9 * u + 2e-16 * np.abs(mean))
    assert np.allclose(result.standard_uncertainty, u, rtol=1e-9, atol=0)
    assert np.max(np.abs(np.asarray(result.covariance) - covariance) / np.outer(scale, scale)) <= 1e-9
    assert np.allclose(result.lowest, good.min(axis=1), rtol=1e-15)
    assert np.allclose(result.highest, good.max(axis=1), rtol=1e-15)
    assert_intervals(result, good, u, coverage)


def assert_intervals(result: Any, good: np.ndarray, u: np.ndarray, coverage: float) -> None:
    tails = [(1 - coverage) / 2, (1 + coverage) / 2]
    for i, row in enumerate(good):
        if u[i] == 0.0:
            assert list(result.symmetric[i]) == list(result.shortest[i]) == [row[0], row[0]]
            continue
        bin_width = _core.numerical_tolerance(float(u[i]), 2) / 5
        ranked = np.sort(row)
        for found, share in zip(result.symmetric[i], tails, strict=True):
            # Within a bin, or two neighbours where these lie further apart.
            rank = int(share * (len(ranked) - 1))
            low, high = ranked[rank - 1], ranked[rank + 2]
            assert low - bin_width <= found <= high + bin_width, (i, found, low, high)
        inside = int(np.ceil(coverage * len(ranked)))
        widths = ranked[inside - 1 :] - ranked[: len(ranked) - inside + 1]
        a, b = result.shortest[i]
        held = np.mean((row >= a) & (row <= b))
        # Both ends are interpolated within bins.
        assert b - a <= widths.min() + 2 * bin_width, (i, b - a, widths.min())
        assert abs(held - coverage) <= share_of_bin(ranked, a, b, bin_width), (i, held)


def share_of_bin(ranked: np.ndarray, a: float, b: float, bin_width: float) -> float:
    """Share of the samples in the bins about both ends."""
    near = sum(np.sum(np.abs(ranked - end) <= bin_width) for end in (a, b))
    return float(near + 2) / len(ranked)


def test_shortest_interval_of_a_logarithm() -> None:
    """y = ln x, x rectangular on (0.1, 1.1): the shortest 95 % interval is [ln 0.15, ln 1.1]."""
    model = _core.FunctionModel(
        lambda x: np.log(x), [_core.Distribution("rectangular", spread=0.5, expectation=0.6)], ["y"], seed=8
    )
    result = run(model, 250)
    low, high = result.shortest[0]
    # 500,000 samples: the share below 0.15 is 5 % to 0.03 %, which is 0.0003/0.15 of ln x; four of it, and a bin.
    assert low == pytest.approx(np.log(0.15), abs=0.01)
    assert high == pytest.approx(np.log(1.1), abs=0.002)
    low, high = result.symmetric[0]
    assert low == pytest.approx(np.log(0.125), abs=0.01)
    assert high == pytest.approx(np.log(1.075), abs=0.002)


def test_joint_regions_hold_their_share_of_fresh_samples() -> None:
    def pair(x: np.ndarray) -> np.ndarray:
        first = x[0] + x[1] + x[3]
        return np.array([first, x[2] + 0.3 * first, x[3] - 0.2 * x[2]])

    def model(seed: int) -> Any:
        return _core.FunctionModel(pair, distributions(), ["a", "b", "c"], seed=seed)

    options = _core.StatisticsOptions(joint=[[0, 1], [0, 1, 2], [1]])
    result = run(model(1), 100, options)
    fresh = np.asarray(model(2).evaluate(0, 100_000))
    for region in result.joint:
        y = fresh[list(region.outputs)] - np.asarray(region.centre)[:, None]
        covariance = np.asarray(region.covariance)
        distance = np.einsum("is,ij,js->s", y, np.linalg.inv(covariance), y)
        within = np.max(np.abs(y) / np.sqrt(np.diag(covariance))[:, None], axis=0)
        count = len(region.outputs)
        ball = {1: 2.0, 2: np.pi, 3: 4 / 3 * np.pi}[count]
        size = np.sqrt(np.linalg.det(covariance)) * region.ellipsoid_factor**count * ball
        assert region.ellipsoid_volume == pytest.approx(size, rel=1e-9)
        box = np.prod(2 * region.rectangle_factor * np.sqrt(np.diag(covariance)))
        assert region.rectangle_volume == pytest.approx(box, rel=1e-9)
        # Four binomial deviations of 100,000 fresh samples and of 200,000 that it was made of: 0.34 %.
        assert np.mean(distance <= region.ellipsoid_factor**2) == pytest.approx(0.95, abs=0.0035)
        assert np.mean(within <= region.rectangle_factor) == pytest.approx(0.95, abs=0.0035)
        assert_smallest(region, fresh[list(region.outputs)])


def assert_smallest(region: Any, fresh: np.ndarray) -> None:
    flags = np.asarray(region.smallest)
    cell = np.floor((fresh - np.asarray(region.grid_from)[:, None]) / np.asarray(region.grid_width)[:, None])
    cell = cell.astype(int)
    inside = np.all((cell >= 0) & (cell < np.array(flags.shape)[:, None]), axis=0)
    held = np.zeros(fresh.shape[1], dtype=bool)
    held[inside] = flags[tuple(cell[:, inside])] > 0
    # The fullest cells were chosen by the samples they hold, so that fresh ones fall less often into them.
    assert np.mean(held) == pytest.approx(region.smallest_share, abs=0.02)
    assert region.smallest_share >= 0.95
    volume = np.sum(flags) * np.prod(region.grid_width)
    assert region.smallest_volume == pytest.approx(volume, rel=1e-9)
    # It is the smallest: within what cells at its border make of it.
    assert region.smallest_volume <= 1.1 * min(region.ellipsoid_volume, region.rectangle_volume)


def test_bits_do_not_depend_on_threads_parts_and_order() -> None:
    model = model_of(losing)
    options = _core.StatisticsOptions(covariance=True, kept=[0], joint=[[0, 1]])
    bins = _core.make_bins(model, options, threads=1)
    assert bins.to_bytes() == _core.make_bins(model, options, threads=2).to_bytes()
    whole = _core.run_leaves(model, bins, 0, 13, threads=1)
    for parts in ([(0, 13)], [(5, 8), (0, 5)], [(12, 1), (0, 1), (1, 11)], [(i, 1) for i in (7, 3, 11, 0, 1, 2)]):
        merged = _core.PartialStatistics(_core.Bins.from_bytes(bins.to_bytes()))
        done = set()
        for first, count in parts:
            done |= set(range(first, first + count))
            part = _core.run_leaves(model, bins, first, count, threads=2)
            merged.merge(_core.PartialStatistics.from_bytes(part.to_bytes()))
        for leaf in set(range(13)) - done:
            merged.merge(_core.run_leaves(model, bins, leaf, 1, threads=1))
        assert merged.to_bytes() == whole.to_bytes(), parts
        for one, other in product([whole.result()], [merged.result()]):
            assert np.array_equal(one.covariance, other.covariance)
            assert np.array_equal(one.shortest, other.shortest)


def test_damaged_bytes_are_refused() -> None:
    model = model_of()
    bins = _core.make_bins(model, _core.StatisticsOptions())
    part = _core.run_leaves(model, bins, 0, 2)
    rng = np.random.default_rng(1)
    for kind, sound in ((_core.Bins, bins.to_bytes()), (_core.PartialStatistics, part.to_bytes())):
        for cut in [0, 1, 7, 8, 20, len(sound) // 2, len(sound) - 1]:
            with pytest.raises(_core.InvalidArgument):
                kind.from_bytes(sound[:cut])
        with pytest.raises(_core.InvalidArgument):
            kind.from_bytes(sound + b"\0")
        for place in rng.integers(0, len(sound), 60):
            spoilt = bytearray(sound)
            spoilt[place] ^= 1 << int(rng.integers(0, 8))
            with pytest.raises(_core.InvalidArgument):
                kind.from_bytes(bytes(spoilt))


def test_parts_of_other_runs_do_not_merge() -> None:
    bins = _core.make_bins(model_of(), _core.StatisticsOptions())
    part = _core.run_leaves(model_of(), bins, 0, 1)
    with pytest.raises(_core.InvalidArgument, match="leaf"):
        part.merge(_core.run_leaves(model_of(), bins, 0, 2))
    for options in (_core.StatisticsOptions(coverage=0.9), _core.StatisticsOptions(covariance=True)):
        other = _core.PartialStatistics(_core.make_bins(model_of(), options))
        with pytest.raises(_core.InvalidArgument):
            part.merge(other)
    with pytest.raises(_core.InvalidArgument, match="seed"):
        part.merge(_core.PartialStatistics(_core.make_bins(model_of(seed=6), _core.StatisticsOptions())))
    with pytest.raises(_core.InvalidArgument):
        _core.run_leaves(model_of(seed=6), bins, 0, 1)


@pytest.mark.parametrize("given", [{"coverage": 0.0}, {"coverage": 1.0}, {"coverage": float("nan")}, {"digits": 0},
                                   {"digits": 4}, {"kept": [7]}, {"joint": [[]]}, {"joint": [[0, 0]]},
                                   {"joint": [[0, 1, 2, 3]]}, {"joint": [[9]]}])  # fmt: skip
def test_absurd_options_are_refused(given: dict[str, Any]) -> None:
    with pytest.raises(_core.InvalidArgument):
        _core.make_bins(model_of(), _core.StatisticsOptions(**given))


def test_functions_that_give_nothing_or_fail_say_so() -> None:
    nothing = model_of(lambda x: np.full((len(NAMES), x.shape[1]), np.nan))
    with pytest.raises(_core.InvalidArgument):
        _core.make_bins(nothing, _core.StatisticsOptions())
    with pytest.raises(_core.InvalidArgument, match="shape"):
        _core.make_bins(model_of(lambda x: x[:2]), _core.StatisticsOptions())
    with pytest.raises(ZeroDivisionError):
        _core.make_bins(model_of(lambda x: several(x) * (1 // 0)), _core.StatisticsOptions())
