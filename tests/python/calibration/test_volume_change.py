"""The error of the tool before and after: its change, with verdict, and which parameters make it."""

import math

import numpy as np
import pytest
from calibrations import TOOL, VOLUME, calibrate, parts_of
from usual import CHAIN, small_plan

import stepdiag as sd
from stepdiag.calibration.volume_change import difference_interval


def scaled(calibration: sd.Calibration, factor: float, *names: str) -> sd.Calibration:
    """The same calibration with these functions, or all of them, times a factor."""
    parts = parts_of(calibration)
    parts["functions"] = {
        name: (position, value * (factor if name in names or not names else 1.0), u)
        for name, (position, value, u) in parts["functions"].items()
    }
    return sd.Calibration(**parts)


def test_figures_are_those_of_both_volumes_at_the_tool_of_a() -> None:
    a, b = calibrate(1), calibrate(2)
    parts = parts_of(b)
    parts["tool"] = (0.0, 0.0, 0.0)
    change = sd.volume_change(sd.compare(a, sd.Calibration(**parts)))
    one, other = (sd.volume(each, tool=TOOL, between_nodes=0.0, ranking=False) for each in (a, b))
    assert (change.largest.a, change.largest.b) == (one.largest, other.largest)
    assert (change.rms.a, change.rms.b) == (one.rms, other.rms)
    assert change.largest.change == other.largest - one.largest
    np.testing.assert_array_equal(change.tool, TOOL)


def test_what_lies_between_the_nodes_is_in_the_volumes_and_not_in_the_change() -> None:
    a, b = (calibrate(seed, full_covariance=True) for seed in (1, 2))
    change = sd.volume_change(sd.compare(a, b))
    for own, interval, calibration in (
        (change.a, change.largest.a_interval, a),
        (change.b, change.largest.b_interval, b),
    ):
        alone = sd.volume(calibration, ranking=False)
        assert own.largest_interval == alone.largest_interval
        assert own.between_nodes == alone.between_nodes > 0.0
        assert interval == sd.volume(calibration, between_nodes=0.0, ranking=False).largest_interval


@pytest.mark.parametrize("name", ["EXX", "EZY", "EBX", "ECX", "EAZ", "C0Y", "A0Z"])
def test_effect_of_a_parameter_is_that_of_the_exact_machine_with_it_alone(name: str) -> None:
    """By brute force: errors on a fine grid of a machine whose only error is the difference."""
    a = calibrate(1)
    if name in a.squareness:
        parts = parts_of(a)
        parts["squareness"] = parts["squareness"] | {name: (a.squareness[name][0] + 40e-6, a.squareness[name][1])}
        b = sd.Calibration(**parts)
        errors = sd.ErrorMap({}, {name: 40e-6})
    else:
        b = scaled(a, 1.5, name)
        position, value, _ = a.functions[name]
        errors = sd.ErrorMap({name: (position, 0.5 * value)})
    (effect,) = sd.volume_change(sd.compare(a, b)).effects
    axes = [np.linspace(0.0, edge, 41) for edge in VOLUME]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    size = np.linalg.norm(sd.Machine(CHAIN, errors, TOOL).error(points), axis=1)
    weights = np.prod(np.meshgrid(*[[0.5, *[1.0] * 39, 0.5]] * 3, indexing="ij"), axis=0).ravel()
    assert effect.parameter == name
    # Nodes are on this grid: 41 positions contain those of 5 steps.
    assert effect.largest == pytest.approx(size.max(), rel=1e-9)
    # Trapezoids of a quarter and an eighth of the parabolas between rough nodes differ by less than 1 %.
    assert effect.rms == pytest.approx(math.sqrt(np.sum(weights * size**2) / weights.sum()), rel=1e-2)


def test_effects_are_ordered_and_marked_as_in_the_comparison() -> None:
    comparison = sd.compare(calibrate(1), scaled(calibrate(2), 0.2, "EXX"))
    effects = sd.volume_change(comparison).effects
    assert effects[0].parameter == "EXX"
    assert [effect.largest for effect in effects] == sorted((e.largest for e in effects), reverse=True)
    marked = {d.parameter for d in comparison.differences if comparison.is_significant(d)}
    assert {effect.parameter for effect in effects if effect.significant} == marked == {"EXX"}


def test_calibration_compared_with_itself_has_no_effects() -> None:
    change = sd.volume_change(sd.compare(calibrate(1), calibrate(1)))
    assert change.effects == ()
    assert change.largest.change == change.rms.change == 0.0


# --- verdicts --------------------------------------------------------------------------------------------------------
def test_interval_of_a_difference_of_normal_figures_is_that_of_the_gum() -> None:
    low, high = difference_interval(
        10.0, 8.0, (10.0 - 1.96 * 0.3, 10.0 + 1.96 * 0.3), (8.0 - 1.96 * 0.4, 8.0 + 1.96 * 0.4)
    )
    assert (low, high) == (pytest.approx(-2.0 - 1.96 * 0.5), pytest.approx(-2.0 + 1.96 * 0.5))


def test_interval_of_a_difference_of_skewed_figures_covers_it() -> None:
    """Variances of 10 normal readings, whose exact intervals are far from symmetric; 10,000 pairs."""
    random = np.random.default_rng(2)
    quantiles = np.quantile(random.chisquare(9, 400_000), [0.025, 0.975])
    truth_a, truth_b = 1.0, 1.7
    covered = 0
    for s_a, s_b in random.chisquare(9, (10_000, 2)) / 9.0:
        a, b = truth_a * s_a, truth_b * s_b
        of_a, of_b = ((9.0 * s / quantiles[1], 9.0 * s / quantiles[0]) for s in (a, b))
        low, high = difference_interval(a, b, of_a, of_b)
        covered += low <= truth_b - truth_a <= high
    # 0.2 % is the standard deviation of the share; the method itself is good to about 1 % here (Zou and Donner).
    assert covered / 10_000 == pytest.approx(0.95, abs=0.018)


def test_no_verdict_without_covariance_and_for_one_run_and_against_a_map() -> None:
    with_one = calibrate(2, full_covariance=True)
    cases = {
        "no covariance of A (write it as .nc)": (calibrate(1), with_one),
        "A and B are evaluations of the same run": (
            with_one.with_provenance({"run_sha256": "a" * 64}),
            scaled(with_one, 0.5).with_provenance({"run_sha256": "a" * 64}),
        ),
        "one of the two is an error map": (with_one, sd.random_error_map(VOLUME, seed=3, intervals=5)),
    }
    for reason, (a, b) in cases.items():
        change = sd.volume_change(sd.compare(a, b))
        assert change.no_verdict_because == reason
        assert (change.largest.verdict, change.rms.verdict, change.rms.interval) == (None, None, None)


def test_missing_parameter_leaves_figures_open_and_is_named() -> None:
    plan = sd.Plan(VOLUME, ["ppp", "npp", "pnp", "nnp"], 5)
    change = sd.volume_change(sd.compare(calibrate(1), calibrate(2, plan=plan)))
    assert change.no_verdict_because == "B does not determine slope of EXX, slope of EYY, slope of EZZ"
    assert math.isnan(change.largest.b)
    assert not math.isnan(change.largest.a)
    assert change.effects


def test_better_machine_is_improved_and_the_way_back_is_worse() -> None:
    a = calibrate(1, full_covariance=True)
    b = scaled(calibrate(2, full_covariance=True), 0.5)
    for before, after, verdict in ((a, b, "improved"), (b, a, "worse")):
        change = sd.volume_change(sd.compare(before, after))
        assert (change.largest.verdict, change.rms.verdict, change.no_verdict_because) == (verdict, verdict, "")
        for figure in (change.largest, change.rms):
            assert figure.interval is not None
            assert figure.interval[0] < figure.change < figure.interval[1]
            assert figure.a_interval is not None
            assert figure.b_interval is not None
            assert figure.interval == difference_interval(figure.a, figure.b, figure.a_interval, figure.b_interval)


def test_two_calibrations_of_one_machine_tell_no_change() -> None:
    change = sd.volume_change(sd.compare(calibrate(1, full_covariance=True), calibrate(2, full_covariance=True)))
    assert (change.largest.verdict, change.rms.verdict) == ("undecided", "undecided")


@pytest.mark.slow
def test_interval_covers_the_true_change_of_a_machine() -> None:
    """40 pairs of calibrations with much noise, 2 µm and 20 µrad, of two machines whose true errors are known."""
    plan, noise = small_plan(), {"distance": 2e-3, "tilt": 2e-5}
    machines = [sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=seed, intervals=5), TOOL) for seed in (3, 4)]
    one, other = (sd.volume(machine, box=[np.zeros(3), VOLUME], ranking=False) for machine in machines)

    def calibration(machine: sd.Machine, seed: int) -> sd.Calibration:
        run = sd.simulate(machine, plan, sd.Head(), noise=sd.Noise(**noise, seed=seed))
        stated = sd.methods.ReadingUncertainty(**noise)
        return sd.methods.evaluate(run, plan, sd.Head(), CHAIN, TOOL, full_covariance=True, uncertainty=stated)

    covered = {"largest": 0, "rms": 0}
    for seed in range(40):
        pair = (calibration(machine, 2 * seed + k) for k, machine in enumerate(machines))
        change = sd.volume_change(sd.compare(*pair))
        for name, figure in (("largest", change.largest), ("rms", change.rms)):
            assert figure.interval is not None
            low, high = figure.interval
            covered[name] += low <= getattr(other, name) - getattr(one, name) <= high
    # Binomial, 40 of 0.95: 38 with a standard deviation of 1.4; four of them. Priors of the set-up make it more.
    assert min(covered.values()) >= 33
