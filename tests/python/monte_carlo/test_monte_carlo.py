"""Runs of the Monte Carlo method: published examples, and what a run does when it is interrupted."""

import math
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jcgm import STANDARD, UNIFORM, calibration_line, gauge_block, logarithm, sum_of_four

from stepdiag._core import (
    Bins,
    Distribution,
    FunctionModel,
    Head,
    InvalidArgument,
    Machine,
    MonteCarloResult,
    PartialStatistics,
    Plan,
    ReadingNoise,
    SampleModel,
    StatisticsOptions,
    UncertainInput,
    UncertainInputs,
    VirtualCalibrations,
    make_bins,
    numerical_tolerance,
    random_error_map,
    run_leaves,
)
from stepdiag.uncertainty import monte_carlo
from stepdiag.uncertainty.monte_carlo import LeafRange, plan_ranges, run_monte_carlo

UNIFORM_TILT = Distribution("rectangular", spread=1e-4)

# Of a published number with two decimals, and of a quantile of 400,000 samples: its standard deviation is below 0.009.
TWO_DECIMALS = 0.05


def figures(result: MonteCarloResult) -> list[Any]:
    """All that is found, to compare bit by bit."""
    covariance = b"" if result.covariance is None else result.covariance.tobytes()
    arrays = result.mean, result.standard_uncertainty, result.symmetric, result.shortest, result.lowest, result.highest
    return [result.samples, result.lost, covariance, *(array.tobytes() for array in arrays)]


def curved(seed: int = 1, factor: float = 1.0) -> FunctionModel:
    """Two outputs; some samples are lost."""

    def function(x: Any) -> Any:
        y = np.stack([x[0] + factor * x[1], np.square(x[0])])
        y[:, x[0] > 3.0] = np.nan
        return y

    return FunctionModel(function, [STANDARD, UNIFORM], ["sum", "square"], seed=seed)


def unhurried() -> FunctionModel:
    """Takes its time, so that a run lasts until somebody looks at it."""

    def function(x: Any) -> Any:
        time.sleep(0.004)
        return x.sum(axis=0)

    return FunctionModel(function, [STANDARD] * 4, ["sum"])


# --- published examples -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("each", "end"), [(STANDARD, 3.92), (UNIFORM, 3.88)])
def test_sums_of_four_are_those_of_jcgm_101(each: Distribution, end: float) -> None:
    result = run_monte_carlo(sum_of_four(each), samples=400_000)
    assert result.standard_uncertainty[0] == pytest.approx(2.0, abs=5 * 2.0 / math.sqrt(2 * 400_000))
    assert np.abs(result.symmetric[0] - [-end, end]).max() < TWO_DECIMALS


def test_sum_with_one_large_rectangular_input_is_that_of_jcgm_101() -> None:  # 9.2.4: u = 10.1, 95 %: -17.0 to 17.0
    model = sum_of_four(UNIFORM, Distribution("rectangular", spread=10 * math.sqrt(3.0)))
    result = run_monte_carlo(model, samples=400_000)
    assert result.standard_uncertainty[0] == pytest.approx(math.sqrt(103.0), rel=5 / math.sqrt(2 * 400_000))
    assert np.abs(result.symmetric[0] - [-17.0, 17.0]).max() < 0.1  # one decimal


def test_shortest_interval_of_a_logarithm_ends_at_the_upper_limit() -> None:
    result = run_monte_carlo(logarithm(), samples=400_000)
    assert result.shortest[0] == pytest.approx([math.log(0.15), math.log(1.1)], abs=0.012)
    assert result.symmetric[0] == pytest.approx([math.log(0.125), math.log(1.075)], abs=0.012)


def test_gauge_block_is_that_of_jcgm_101_by_the_adaptive_procedure() -> None:
    # 9.5.4: 838 nm, u = 36 nm, 99 % [745, 932] nm; two digits of u: to 0.5 nm, which takes some 10^6 trials.
    result = run_monte_carlo(
        gauge_block(), samples=5_000_000, adaptive=True, options=StatisticsOptions(coverage=0.99, digits=2)
    )
    assert result.stability is not None
    assert result.stability.stable
    assert 200_000 < result.samples < 3_000_000
    # Rounding of what is published, and the tolerance of the procedure.
    assert result.mean[0] == pytest.approx(838.0, abs=1.0)
    assert result.standard_uncertainty[0] == pytest.approx(36.0, abs=1.0)
    assert result.symmetric[0] == pytest.approx([745.0, 932.0], abs=1.0)


def test_calibration_line_is_that_of_the_gum() -> None:  # H.3: -0.1712(29), 0.00218(67), r = -0.930; -0.1494(41)
    options = StatisticsOptions(covariance=True, joint=[[0, 1]])
    result = run_monte_carlo(calibration_line(), samples=400_000, options=options)
    assert result.mean == pytest.approx([-0.1712, 0.00218, -0.1494], abs=6e-5)  # half a last digit
    assert result.standard_uncertainty == pytest.approx([0.0029, 0.00067, 0.0041], rel=0.02)  # two digits
    u = result.standard_uncertainty
    assert result.covariance is not None
    assert result.covariance[0, 1] / (u[0] * u[1]) == pytest.approx(-0.930, abs=0.001)
    # Normal outputs: k_p^2 is the quantile of chi-square with two degrees of freedom (JCGM 102, 6.5.2).
    assert result.joint[0].ellipsoid_factor == pytest.approx(math.sqrt(-2 * math.log(0.05)), abs=0.02)


# --- the same bits ----------------------------------------------------------------------------------------------------
EVERYTHING = StatisticsOptions(covariance=True, kept=[1], joint=[[0, 1]])


def test_any_number_of_threads_gives_the_same_bits() -> None:
    results = [run_monte_carlo(curved(), samples=60_000, options=EVERYTHING, threads=n) for n in (1, 2, 3)]
    assert figures(results[0]) == figures(results[1]) == figures(results[2])
    assert results[0].samples + results[0].lost == 60_000
    assert np.array_equal(results[0].kept[1], results[2].kept[1], equal_nan=True)


class Shuffled:
    """An executor that computes ranges in an order of its own and sends them as bytes."""

    def __init__(self, model: SampleModel, at_a_time: int) -> None:
        self.model, self.at_a_time, self.computed = model, at_a_time, 0

    def __call__(self, bins: Bins, ranges: Iterable[LeafRange]) -> Iterator[PartialStatistics]:
        held: list[LeafRange] = []
        for each in ranges:
            held.append(each)
            if len(held) == self.at_a_time:
                yield from self.results(bins, held)
        yield from self.results(bins, held)

    def results(self, bins: Bins, held: list[LeafRange]) -> Iterator[PartialStatistics]:
        while held:
            first, end = held.pop(len(held) // 2)
            self.computed += 1
            yield PartialStatistics.from_bytes(run_leaves(self.model, bins, first, end - first, threads=1).to_bytes())


@pytest.mark.parametrize("adaptive", [False, True])
def test_an_executor_elsewhere_gives_the_same_bits(adaptive: bool) -> None:
    options = StatisticsOptions(digits=1)
    here = run_monte_carlo(curved(), samples=200_000, options=options, adaptive=adaptive)
    executor = Shuffled(curved(), 4)
    there = run_monte_carlo(curved(), samples=200_000, options=options, adaptive=adaptive, executor=executor)
    assert executor.computed > 1
    assert figures(here) == figures(there)


class Interrupt:
    """Progress that is interrupted once so many samples are done."""

    def __init__(self, at: int) -> None:
        self.at = at

    def __call__(self, done: int, _total: int) -> None:
        if done >= self.at:
            raise KeyboardInterrupt


@pytest.mark.parametrize("adaptive", [False, True])
def test_an_interrupted_run_goes_on_to_the_same_bits(adaptive: bool, tmp_path: Path) -> None:
    def run(model: FunctionModel, **more: Any) -> MonteCarloResult:
        return run_monte_carlo(model, samples=400_000, adaptive=adaptive, threads=2, **more)

    model = unhurried()
    whole = run(model)
    checkpoint = tmp_path / "run.checkpoint"
    with pytest.raises(KeyboardInterrupt):
        run(model, checkpoint=checkpoint, progress=Interrupt(30_000))
    seen: list[int] = []
    resumed = run(model, checkpoint=checkpoint, resume=True, progress=lambda done, _: seen.append(done))
    assert 0 < seen[0] < whole.samples
    assert figures(resumed) == figures(whole)
    # A finished run is there at once.
    again = run(model, checkpoint=checkpoint, resume=True)
    assert figures(again) == figures(whole)


def test_a_run_goes_on_to_more_samples(tmp_path: Path) -> None:
    checkpoint = tmp_path / "run.checkpoint"
    run_monte_carlo(curved(), samples=30_000, checkpoint=checkpoint)
    more = run_monte_carlo(curved(), samples=50_000, checkpoint=checkpoint, resume=True)
    assert figures(more) == figures(run_monte_carlo(curved(), samples=50_000))
    with pytest.raises(InvalidArgument, match="holds 50000 samples, more than the 30000"):
        run_monte_carlo(curved(), samples=30_000, checkpoint=checkpoint, resume=True)


@pytest.mark.parametrize(
    ("model", "options", "message"),
    [
        (curved(seed=2), StatisticsOptions(), "expected seed 2, got 1"),
        (curved(factor=1.001), StatisticsOptions(), "another model: over the pilot run sum has the mean"),
        (curved(), StatisticsOptions(coverage=0.9), "expected coverage 0.9, got 0.95"),
        (curved(), StatisticsOptions(kept=[0]), r"expected kept outputs \[0\], got \[\]"),
        (sum_of_four(STANDARD), StatisticsOptions(), "expected number of outputs 1, got 2"),
    ],
)
def test_a_checkpoint_of_another_run_is_refused_saying_in_what(
    model: FunctionModel, options: StatisticsOptions, message: str, tmp_path: Path
) -> None:
    checkpoint = tmp_path / "run.checkpoint"
    run_monte_carlo(curved(), samples=20_000, checkpoint=checkpoint)
    before = checkpoint.read_bytes()
    with pytest.raises(InvalidArgument, match=f"run.checkpoint: .*{message}"):
        run_monte_carlo(model, samples=20_000, options=options, checkpoint=checkpoint, resume=True)
    assert checkpoint.read_bytes() == before


def test_a_checkpoint_that_is_none_is_refused(tmp_path: Path) -> None:
    checkpoint = tmp_path / "run.checkpoint"

    def resume(adaptive: bool = False) -> None:
        run_monte_carlo(curved(), samples=20_000, adaptive=adaptive, checkpoint=checkpoint, resume=True)

    with pytest.raises(InvalidArgument, match="cannot be read"):
        resume()
    run_monte_carlo(curved(), samples=20_000, checkpoint=checkpoint)
    with pytest.raises(InvalidArgument, match="with a fixed number of samples, expected one of a run by the adaptive"):
        resume(adaptive=True)
    content = checkpoint.read_bytes()
    for damaged, message in [
        (content[:200], "not all there|damaged"),
        (content[:200] + bytes([content[200] ^ 1]) + content[201:], "damaged"),
        (content + b"!", "1 bytes too many"),
        (b"something else", 'expected "stepdiag checkpoint 1"'),
    ]:
        checkpoint.write_bytes(damaged)
        with pytest.raises(InvalidArgument, match=message):
            resume()
    with pytest.raises(InvalidArgument, match="expected a checkpoint to continue"):
        run_monte_carlo(curved(), samples=20_000, resume=True)


@pytest.mark.parametrize(
    "content", [b"stepdiag checkpoint 1\n...", b"line,point,x_mm,y_mm,z_mm,distance_mm\n", b"mine\n"]
)
def test_a_checkpoint_replaces_nothing_that_is_there(content: bytes, tmp_path: Path) -> None:
    checkpoint = tmp_path / "run.checkpoint"
    checkpoint.write_bytes(content)
    expected = (
        "is the checkpoint of an earlier run: `resume`" if b"check" in content else "is not replaced by a checkpoint"
    )
    with pytest.raises(InvalidArgument, match=f"run.checkpoint: .*{expected}"):
        run_monte_carlo(curved(), samples=20_000, checkpoint=checkpoint)
    assert checkpoint.read_bytes() == content
    checkpoint.write_bytes(b"")  # nothing to lose
    run_monte_carlo(curved(), samples=20_000, checkpoint=checkpoint)


def test_checkpoints_are_written_while_a_run_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(monte_carlo, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
    checkpoint = tmp_path / "run.checkpoint"
    seen = set()

    def look(_done: int, _total: int) -> None:
        if checkpoint.exists():
            seen.add(checkpoint.stat().st_ino)

    result = run_monte_carlo(unhurried(), samples=200_000, checkpoint=checkpoint, progress=look)
    assert seen, "no checkpoint before the end"
    assert figures(result) == figures(run_monte_carlo(unhurried(), samples=200_000))


def virtual(seed: int = 3) -> VirtualCalibrations:
    """A small machine whose distances, tilts and mirrors are uncertain."""
    volume, diagonals = (400.0, 300.0, 250.0), ["ppp", "npp", "pnp", "nnp"]
    machine = Machine("[w X' b Y Z t]", random_error_map(volume, seed=7, intervals=4))
    plan = Plan(volume, diagonals, 4, scale_lines=["p00", "0p0", "00p"])
    noise = [
        ReadingNoise("channel", Distribution(spread=1e-6 if c != "distance" else 1e-4), channel=c)
        for c in ("distance", "alpha", "beta")
    ]
    mirrors = [UncertainInput("reflector", UNIFORM_TILT, line=line, component=c) for line in diagonals for c in (0, 1)]
    return VirtualCalibrations(machine, plan, Head(), UncertainInputs(mirrors, noise), seed=seed)


def test_virtual_calibrations_have_the_same_bits_however_they_are_run(tmp_path: Path) -> None:
    model, checkpoint = virtual(), tmp_path / "run.checkpoint"
    options = StatisticsOptions(covariance=True, kept=[5], joint=[[4, 5]])

    def run(**more: Any) -> MonteCarloResult:
        return run_monte_carlo(model, samples=40_000, options=options, **more)

    one = run(threads=1)
    assert one.lost == 0
    assert one.covariance is not None
    for other in (run(threads=2), run(threads=3), run(executor=Shuffled(model, 3))):
        assert figures(other) == figures(one)
    with pytest.raises(KeyboardInterrupt):
        run(checkpoint=checkpoint, executor=Shuffled(model, 3), progress=Interrupt(10_000))
    assert figures(run(checkpoint=checkpoint, resume=True)) == figures(one)
    # The statistics are those of the samples themselves.
    values = model.evaluate(0, 40_000)
    assert np.array_equal(one.kept[5], values[5])
    assert one.standard_uncertainty == pytest.approx(values.std(axis=1, ddof=1), rel=1e-9, abs=1e-15)
    u = one.standard_uncertainty
    moves = u > 1e-12  # what is 0 by the choice of the frame has roundings
    difference = (one.covariance - np.cov(values))[np.ix_(moves, moves)]
    assert np.abs(difference / np.outer(u[moves], u[moves])).max() < 1e-9
    width = np.array([numerical_tolerance(each, 2) / 5 if each > 1e-12 else 1e-12 for each in u])
    quantiles = np.quantile(values, [0.025, 0.975], axis=1).T  # bins are no wider
    assert (np.abs(one.symmetric - quantiles) <= width[:, None]).all()


def test_statistics_of_no_leaves_are_not_numbers() -> None:
    result = PartialStatistics(make_bins(curved(), EVERYTHING)).result()
    assert (result.samples, result.lost, result.covariance) == (0, 0, None)
    for array in (result.mean, result.standard_uncertainty, result.symmetric, result.shortest, result.lowest):
        assert np.isnan(array).all()
    assert math.isnan(result.joint[0].ellipsoid_factor)


# --- runs -------------------------------------------------------------------------------------------------------------
def test_plan_is_what_is_missing_in_pieces() -> None:
    assert list(plan_ranges(12, [], 5)) == [(0, 5), (5, 10), (10, 12)]
    assert list(plan_ranges(12, [(2, 4), (6, 12)], 5)) == [(0, 2), (4, 6)]
    assert list(plan_ranges(12, [(0, 12)], 5)) == []
    assert list(plan_ranges(3, [(0, 1), (5, 7)], 5)) == [(1, 3)]


def test_an_adaptive_run_says_when_it_is_not_stable() -> None:
    result = run_monte_carlo(gauge_block(), samples=50_000, adaptive=True, options=StatisticsOptions(coverage=0.99))
    assert result.samples == 50_000
    assert result.stability is not None
    assert not result.stability.stable
    assert result.stability.blocks == 5
    assert (result.stability.ratio, result.stability.unstable) > (1.0, 0)
    assert result.stability.figure in ("lower end", "upper end")  # the least certain of the four


def test_an_executor_that_gives_less_than_it_was_asked_for_is_found_out() -> None:
    def lazy(bins: Bins, ranges: Iterable[LeafRange]) -> Iterator[PartialStatistics]:
        first, end = next(iter(ranges))
        yield run_leaves(curved(), bins, first, end - first)

    with pytest.raises(RuntimeError, match=r"no statistics of the leaves \[\(5, 10\)\]"):
        run_monte_carlo(curved(), samples=20_000, executor=lazy)


def test_an_exception_of_the_model_comes_through() -> None:
    def failing(x: Any) -> Any:
        raise ArithmeticError("no more ink")

    with pytest.raises(ArithmeticError, match="no more ink"):
        make_bins(FunctionModel(failing, [STANDARD], ["y"]))
    with pytest.raises(InvalidArgument, match=r"expected an array of shape \(2, 16\) back, got shape \(16,\)"):
        make_bins(FunctionModel(lambda x: x[0], [STANDARD], ["y", "z"]))


def test_inputs_of_a_function_model_have_their_distributions() -> None:
    distributions = [
        Distribution(spread=2.0, expectation=1.0),
        Distribution("rectangular", spread=2.0),
        Distribution("t", spread=2.0, degrees_of_freedom=6),
        Distribution(spread=3.0),
    ]
    correlation = [[1.0, -0.8], [-0.8, 1.0]]
    model = FunctionModel(
        lambda x: x, distributions, ["a", "b", "c", "d"], correlations=[([0, 3], correlation)], seed=8
    )
    result = run_monte_carlo(model, samples=200_000, options=StatisticsOptions(covariance=True))
    expected = np.array([each.standard_uncertainty for each in distributions])
    # Five standard deviations of u: sqrt((kurtosis - 1) / 4 n), kurtosis 6 for six degrees of freedom.
    assert result.standard_uncertainty == pytest.approx(expected, rel=5 * math.sqrt(5 / (4 * 200_000)))
    assert result.mean == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=5 * 3.0 / math.sqrt(200_000))
    assert result.covariance is not None
    found = result.covariance / np.outer(result.standard_uncertainty, result.standard_uncertainty)
    independent = np.eye(4)
    independent[0, 3] = independent[3, 0] = -0.8
    assert np.abs(found - independent).max() < 5 / math.sqrt(200_000)
