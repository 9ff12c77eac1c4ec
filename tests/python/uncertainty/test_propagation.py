"""Propagation of uncertainty: sensitivities, covariances and budgets against what is computed here a second time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from truth import Setup, changed
from usual import DIAGONALS, SCALE_LINES

import stepdiag as sd
from stepdiag import _core as core
from stepdiag.head.description import find_head

INFINITY = float("inf")
DISTANCE, TILT, SPOT = 1e-4, 1e-6, 2e-3  # mm, rad, mm
HEADS = {
    "ideal": sd.Head(),
    "psd": sd.Head("psd", psd_distance=50.0),
    "multi_beam": sd.Head("multi_beam", beam_offsets=[[0, 0], [20, 0], [0, 20]]),
}
SIGMA = {"alpha": TILT, "beta": TILT, "spot_x": SPOT, "spot_y": SPOT}


def setup_of(layout: str, steps: int = 4) -> Setup:
    return Setup(steps=steps, head=HEADS[layout], tool=(20.0, -30.0, -150.0), scale_lines=SCALE_LINES)


def machine_of(setup: Setup) -> sd.Machine:
    return sd.Machine(sd.Chain(setup.chain), setup.errors(3), setup.tool)


def virtual(setup: Setup, inputs: core.UncertainInputs, **options: Any) -> core.VirtualCalibrations:
    return core.VirtualCalibrations(machine_of(setup), setup.plan, setup.head, inputs, **options)


def of_line(quantity: str, spread: float, line: str, component: int = 0) -> core.UncertainInput:
    return core.UncertainInput(quantity, core.Distribution(spread=spread), line=line, component=component)


def channel_noise(setup: Setup) -> list[core.ReadingNoise]:
    return [
        core.ReadingNoise("channel", core.Distribution(spread=SIGMA.get(name, DISTANCE)), channel=name)
        for name in setup.head.signals
    ]


def values(calibration: sd.Calibration) -> np.ndarray:
    """In the order of the covariance."""
    functions, squareness = calibration.functions, calibration.squareness
    names = [f"E{c}{a}" for a in "XYZ" for c in "XYZABC"]
    parts = [functions[name][1] for name in names if name in functions]
    return np.concatenate([*parts, [squareness[s][0] for s in ("C0Y", "B0Z", "A0Z") if s in squareness]])


# --- generic ----------------------------------------------------------------------------------------------------------


def test_straight_line_of_the_gum_is_numpys_fit() -> None:
    """JCGM 100, H.3, and what it prints; its covariance by numpy."""
    t = np.array([21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511]) - 20.0
    b = -np.array([0.171, 0.169, 0.166, 0.159, 0.164, 0.165, 0.156, 0.157, 0.159, 0.161, 0.160])
    (slope, intercept), covariance = np.polyfit(t, b, 1, cov=True)
    inverse = np.linalg.pinv(np.vander(t, 2))
    s = np.sqrt(np.sum((b - slope * t - intercept) ** 2) / 9)
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [10.0, 1.0]])  # slope, intercept, correction at 30 degrees
    found = core.propagate_linear(
        rows @ inverse @ b,
        rows @ inverse,
        np.full(11, s),
        degrees_of_freedom=np.full(11, 9.0),
        estimates=[0] * 11,
        groups=["readings"] * 11,
        covariance=True,
    )
    # Sums of eleven terms.
    assert np.allclose(found.covariance, rows @ covariance @ rows.T, rtol=1e-10)
    assert np.allclose(found.value, [0.00218, -0.1712, -0.1494], atol=[0.5e-5, 0.5e-4, 0.5e-4])
    assert np.allclose(found.standard_uncertainty, [0.00067, 0.0029, 0.0041], atol=[0.5e-5, 0.5e-4, 0.5e-4])
    assert np.allclose(found.degrees_of_freedom, 9.0)
    assert np.allclose(found.expanded(0.95), 2.26216 * found.standard_uncertainty, rtol=1e-5)  # t of table G.2
    assert np.allclose(found.budget["readings"], found.standard_uncertainty)


def test_correlated_inputs_propagate_as_numpy_says() -> None:
    rng = np.random.default_rng(1)
    sensitivity, u = rng.normal(size=(4, 5)), rng.uniform(0.1, 2.0, 5)
    root = rng.normal(size=(5, 5))
    correlation = np.corrcoef(root)
    found = core.propagate_linear(
        np.zeros(4), sensitivity, u, correlation=correlation, groups=["a", "a", "b", "b", "b"], covariance=True
    )
    covariance = sensitivity @ (correlation * np.outer(u, u)) @ sensitivity.T
    assert np.allclose(found.covariance, covariance, rtol=1e-12, atol=1e-12)
    squares = found.budget["a"] ** 2 + found.budget["b"] ** 2 + found.between_groups
    assert np.allclose(squares, np.diag(covariance), rtol=1e-12)
    assert np.all(found.degrees_of_freedom == INFINITY)
    few = core.propagate_linear(np.zeros(4), sensitivity, u, correlation=correlation, degrees_of_freedom=[5.0] * 5)
    assert np.all(np.isnan(few.degrees_of_freedom))
    assert np.all(np.isnan(few.expanded()))


@pytest.mark.parametrize(
    ("arguments", "options", "words"),
    [
        (([1.0], [[1.0, 2.0]], [1.0]), {}, "sensitivity: expected 1 x 1"),
        (([1.0], [1.0], [1.0]), {}, "sensitivity: expected two dimensions"),
        (([1.0], [[1.0]], [-1.0]), {}, "x0: expected a standard uncertainty"),
        (([1.0], [[1.0]], [1.0]), {"names": ["a", "b"]}, "names: expected 1, got 2"),
        (([1.0], [[1.0]], [1.0]), {"degrees_of_freedom": [0.0]}, "x0: expected degrees of freedom"),
        (([1.0], [[1.0, 1.0]], [1.0, 1.0]), {"correlation": [[1.0, 2.0], [2.0, 1.0]]}, "positive semidefinite"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments: Any, options: Any, words: str) -> None:
    with pytest.raises(sd.InvalidArgument, match=words):
        core.propagate_linear(*arguments, **options)


# --- of virtual calibrations ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("layout", HEADS)
def test_sensitivities_are_differences_of_simulated_and_evaluated_runs(layout: str) -> None:
    setup = setup_of(layout)
    u = {"reflector": 2e-4, "laser": 3e-4, "distance_constant": 1e-3, "roll": 5e-3, "lateral": 0.5}
    inputs = [of_line("reflector", u["reflector"], "ppp", 1), of_line("laser", u["laser"], "npp", 0)]
    inputs += [of_line(q, u[q], "pnp") for q in ("distance_constant", "roll")] + [of_line("lateral", 0.5, "nnp", 1)]
    found = core.propagate(virtual(setup, core.UncertainInputs(inputs)), covariance=True)

    def evaluated(line: str, misalignment: sd.Misalignment) -> np.ndarray:
        run = sd.simulate(machine_of(setup), setup.plan, setup.head, misalignment={line: misalignment})
        return values(setup.evaluate(run))

    def setup_with(case: int, sign: float) -> tuple[str, sd.Misalignment]:
        if case == 0:
            return "ppp", sd.Misalignment(reflector=(0.0, sign * u["reflector"]))
        if case == 1:
            return "npp", sd.Misalignment(laser=(sign * u["laser"], 0.0))
        if case == 2:
            return "pnp", sd.Misalignment(distance_constant=sign * u["distance_constant"])
        if case == 3:
            return "pnp", sd.Misalignment(roll=sign * u["roll"])
        return "nnp", sd.Misalignment(lateral=(0.0, sign * 0.5))

    nominal = evaluated("ppp", sd.Misalignment())
    # Two evaluations of lengths of 1 m and angles: their rounding, summed over the steps.
    assert np.allclose(found.value, nominal, rtol=0, atol=1e-11)
    for case in range(5):
        up, down = evaluated(*setup_with(case, 1.0)), evaluated(*setup_with(case, -1.0))
        # Evaluated by itself a run weighs its readings by its own tilts, not by those of the nominal run: 16 pm.
        assert np.allclose(found.first_order[:, case], (up - down) / 2, rtol=0, atol=5e-8), case
        assert np.allclose(found.second_order[:, case], (up + down) / 2 - nominal, rtol=0, atol=5e-8), case
    assert np.allclose(found.covariance, found.first_order @ found.first_order.T, rtol=1e-9, atol=1e-24)
    assert set(found.budget) == {"reflector", "laser", "distance_constant", "roll", "lateral"}
    assert np.allclose(found.budget["laser"], np.abs(found.first_order[:, 1]))


@pytest.mark.parametrize("layout", HEADS)
def test_noise_of_channels_is_the_covariance_of_the_evaluation(layout: str) -> None:
    setup = setup_of(layout)
    uncertainty = sd.methods.ReadingUncertainty(distance=DISTANCE, tilt=TILT, spot=SPOT)
    model = virtual(setup, core.UncertainInputs([], channel_noise(setup)), uncertainty=uncertainty)
    found = core.propagate(model, covariance=True)
    calibration = setup.evaluate(model.nominal, uncertainty=uncertainty, full_covariance=True)
    scale = np.sqrt(np.outer(found.standard_uncertainty, found.standard_uncertainty))
    assert np.max(np.abs(found.covariance - calibration.covariance) / np.maximum(scale**2, 1e-30)) < 1e-6
    assert np.allclose(found.value, values(calibration), rtol=0, atol=1e-11)
    squares = sum(part**2 for part in found.budget.values())
    assert np.allclose(squares, found.standard_uncertainty**2, rtol=1e-12, atol=1e-30)


def test_noise_by_gain_is_that_of_numpys_gain() -> None:
    setup = setup_of("psd", 3)
    common = core.ReadingNoise("common", core.Distribution(spread=3e-4))
    walk = core.ReadingNoise("head_walk", core.Distribution(spread=2e-4))
    model = virtual(setup, core.UncertainInputs([], [*channel_noise(setup), common, walk]), seconds_per_reading=4.0)
    found = core.propagate(model, covariance=True)
    run, names = model.nominal, list(setup.head.signals)
    nominal = values(setup.evaluate(run))
    gain = {}
    for name in names:
        step = 1e-5 if name == "distance" else 1e-4
        columns = []
        for row in range(len(run)):
            moved = [np.array(run.channels[name]) for _ in range(2)]
            moved[0][row] += step
            moved[1][row] -= step
            up, down = (values(setup.evaluate(changed(run, {name: m}))) for m in moved)
            columns.append((up - down) / (2 * step))
        gain[name] = np.array(columns).T
    expected = sum(gain[name] @ gain[name].T * SIGMA.get(name, DISTANCE) ** 2 for name in names)
    expected = expected + gain["distance"] @ gain["distance"].T * 3e-4**2
    lines = np.array(run.line)
    for line in dict.fromkeys(lines):
        rows = np.flatnonzero(lines == line)
        steps = np.tril(np.ones((len(rows), len(rows))))[:, 1:]  # place = sum of the steps so far
        effect = gain["distance"][:, rows] @ steps * 2e-4 * 2.0  # sqrt(4 s)
        expected = expected + effect @ effect.T
    u = np.sqrt(np.diag(expected))
    # Differences of readings of 1 m by 1e-5 mm, rounding 1e-13 of them, summed over twenty rows.
    assert np.allclose(found.standard_uncertainty, u, rtol=1e-5, atol=1e-9 * np.max(u[:20]))
    assert np.allclose(found.value, nominal, rtol=0, atol=1e-11)


POSES = [("position", 2e-4), ("machine_walk", 1e-4), ("orientation", 2e-6)]


@pytest.mark.parametrize(("quantity", "spread"), [*POSES, ("head_walk", 1e-4), ("common", 1e-4)])
def test_noise_is_that_of_drawn_samples(quantity: str, spread: float) -> None:
    setup = replace(setup_of("psd", 3), chain="[w Y' X' b Z t]")
    components = range(3 if (quantity, spread) in POSES else 1)
    noise = [core.ReadingNoise(quantity, core.Distribution(spread=spread), component=c) for c in components]
    model = virtual(setup, core.UncertainInputs([], noise), seconds_per_reading=3.0, repeats=2, seed=5)
    found = core.propagate(model)
    drawn = np.std(model.evaluate(0, 8000), axis=1, ddof=1)
    uncertain = found.standard_uncertainty > 1e-11
    # A standard deviation of 8,000 samples is uncertain by 0.8 %: five of them, at a hundred outputs.
    assert np.max(np.abs(drawn[uncertain] / found.standard_uncertainty[uncertain] - 1)) < 0.04
    assert np.max(drawn[~uncertain], initial=0.0) < 1e-10


def test_noise_of_sensors_is_that_of_drawn_samples() -> None:
    text = find_head("beam_and_psd").read_text(encoding="utf-8").replace("# noise_um", "noise_um")
    head = sd.Head.from_design(sd.optics.parse_head_design(text), standoff=100.0)
    setup = replace(setup_of("psd", 3), head=head)
    model = virtual(setup, core.UncertainInputs([]), seed=5)
    found = core.propagate(model)
    assert list(found.budget) == ["noise of sensors"]
    drawn = np.std(model.evaluate(0, 400), axis=1, ddof=1)
    uncertain = found.standard_uncertainty > 1e-11
    # 400 samples know it to 3.5 %; sixteen simulated runs, of the twenty readings that an output sums up, to 4 %.
    assert np.max(np.abs(drawn[uncertain] / found.standard_uncertainty[uncertain] - 1)) < 0.25
    assert abs(np.median(drawn[uncertain] / found.standard_uncertainty[uncertain]) - 1) < 0.08


def test_degrees_of_freedom_and_t_distributions_count_as_in_the_gum() -> None:
    setup = setup_of("ideal")
    t = core.Distribution("t", spread=1e-4, degrees_of_freedom=6.0)
    inputs = [core.UncertainInput("reflector", t, line="ppp"), of_line("scale_length", 1e-3, "p00")]
    noise = [core.ReadingNoise("channel", core.Distribution(spread=TILT, degrees_of_freedom=12.0), channel="alpha")]
    found = core.propagate(virtual(setup, core.UncertainInputs(inputs, noise)))
    u = found.standard_uncertainty
    fourth = found.budget["reflector"] ** 4 / 6.0 + found.budget["noise of alpha"] ** 4 / 12.0
    some = fourth > 1e-6 * u**4
    assert np.any(some)
    assert np.allclose(found.degrees_of_freedom[some], u[some] ** 4 / fourth[some], rtol=1e-9)
    # The scale of the t distribution, not its standard deviation, which is sqrt(6/4) times that.
    plain = core.propagate(virtual(setup, core.UncertainInputs([of_line("reflector", 1e-4, "ppp")])))
    assert np.allclose(found.budget["reflector"], plain.standard_uncertainty, rtol=1e-9, atol=1e-15)
    assert "scale lines" in found.budget


def test_correlated_set_ups_propagate_together() -> None:
    setup = setup_of("ideal")
    inputs = [of_line("laser", 2e-4, line) for line in DIAGONALS]
    correlation = np.full((4, 4), 0.8) + 0.2 * np.eye(4)
    found = core.propagate(
        virtual(setup, core.UncertainInputs(inputs, [], [([0, 1, 2, 3], correlation)])), covariance=True
    )
    expected = found.first_order @ correlation @ found.first_order.T
    assert np.allclose(found.covariance, expected, rtol=1e-9, atol=1e-12 * np.max(np.abs(expected)))
    assert np.allclose(found.budget["laser"] ** 2, np.diag(expected), rtol=1e-9, atol=1e-24)


def test_expectations_move_the_value() -> None:
    setup = setup_of("ideal")
    shifted = core.UncertainInput("scale_length", core.Distribution(spread=1e-4, expectation=2e-3), line="p00")
    noise = core.ReadingNoise("channel", core.Distribution(spread=1e-7, expectation=3e-6), channel="alpha")
    model = virtual(setup, core.UncertainInputs([shifted], [noise]), seed=9)
    found = core.propagate(model)
    drawn = np.mean(model.evaluate(0, 4000), axis=1)
    # The mean of 4,000 samples is uncertain by u/63: five of these.
    assert np.all(np.abs(drawn - found.value) <= 5 / 63 * found.standard_uncertainty + 1e-11)


def test_contributions_are_added_to_a_measured_calibration() -> None:
    setup = setup_of("psd")
    inputs = [of_line("scale_length", 5e-4, "p00"), of_line("laser", 3e-4, "ppp")]
    point = (300.0, 200.0, 100.0)
    pattern = virtual(setup, core.UncertainInputs(inputs)).calibration
    derived = core.derived_at_point(pattern, point)
    model = virtual(setup, core.UncertainInputs(inputs, channel_noise(setup)), derived=derived)
    noise = sd.Noise(distance=DISTANCE, spot=SPOT, seed=4)
    uncertainty = sd.methods.ReadingUncertainty(distance=DISTANCE, spot=SPOT)
    measured = setup.evaluate(
        sd.simulate(machine_of(setup), setup.plan, setup.head, noise=noise),
        uncertainty=uncertainty,
        full_covariance=True,
    )
    found = core.propagate(model, measured, covariance=True)
    rows = np.vstack([np.eye(len(values(measured))), [d.row for d in derived]])
    expected = rows @ measured.covariance @ rows.T + found.first_order @ found.first_order.T
    assert np.allclose(found.covariance, expected, rtol=1e-9, atol=1e-12 * np.max(expected))
    assert np.allclose(found.value, rows @ values(measured), rtol=1e-12, atol=1e-15)
    assert set(found.budget) == {"readings", "scale lines", "laser"}
    at_point = sd.Calibration(
        measured.method, measured.chain, measured.volume, measured.tool, measured.functions, measured.squareness
    )
    assert np.allclose(found.value[-6:], core.error_at_point(at_point, point).value, rtol=1e-9)
    with pytest.raises(sd.InvalidArgument, match="full covariance"):
        core.propagate(model, setup.evaluate(model.nominal))
    other = replace(setup, steps=3)
    few = other.evaluate(virtual(other, core.UncertainInputs([])).nominal, full_covariance=True)
    with pytest.raises(sd.InvalidArgument, match="parameters and nodes"):
        core.propagate(model, few)


# --- beside the Monte Carlo method ------------------------------------------------------------------------------------


def monte_carlo(model: core.SampleModel, leaves: int, digits: int = 2) -> core.MonteCarloResult:
    bins = core.make_bins(model, core.StatisticsOptions(digits=digits))
    return core.run_leaves(model, bins, 0, leaves).result()


def test_small_set_up_angles_are_validated_and_large_ones_are_not() -> None:
    setup = setup_of("ideal")
    noise = channel_noise(setup)
    small = virtual(setup, core.UncertainInputs([of_line("laser", 1e-5, "npp")], noise), seed=2)
    agreed = core.compare(core.propagate(small), monte_carlo(small, 100), digits=1)
    assert agreed.failures == 0
    assert set(agreed.reason) == {""}

    large = virtual(setup, core.UncertainInputs([of_line("laser", 1e-3, "npp")], noise), seed=2)
    propagated = core.propagate(large)
    compared = core.compare(propagated, monte_carlo(large, 100))
    failed = [i for i, ok in enumerate(compared.validated) if not ok]
    assert failed
    shifted = [i for i in failed if "the square of laser a of npp" in compared.reason[i]]
    assert shifted
    # What is said to be the square's share is what the Monte Carlo method finds, cubes apart.
    result = monte_carlo(large, 100)
    for i in shifted:
        found, expected = result.mean[i] - propagated.value[i], propagated.second_order_shift[i]
        assert abs(found - expected) < 0.1 * abs(expected) + 5 * result.standard_uncertainty[i] / np.sqrt(200_000)


def test_products_of_set_up_angles_are_found_and_named() -> None:
    setup = setup_of("ideal")
    inputs = [of_line(q, 1e-3, "npp", c) for q in ("laser", "reflector") for c in (0, 1)]
    model = virtual(setup, core.UncertainInputs(inputs, channel_noise(setup)), seed=2)
    propagated = core.propagate(model)
    assert propagated.knows_products
    squares = np.sum(propagated.second_order**2, axis=1)
    expected = propagated.standard_uncertainty**2 + 2 * squares + propagated.product_variance
    assert np.allclose(propagated.second_order_uncertainty**2, expected, rtol=1e-12)
    # A product from four whole calibrations, the cross difference.
    signs = np.array([[1, 1, -1, -1], [0, 0, 0, 0], [1, -1, 1, -1], [0, 0, 0, 0]]) * 1e-3
    cross = model.evaluate_at(signs) @ [1, -1, -1, 1] / 4
    for output, (first, second, product) in enumerate(propagated.strongest_product):
        if (first, second) == ("laser a of npp", "reflector a of npp"):
            # Fourth orders are a millionth; rounding of readings of 1 m, summed up.
            assert product == pytest.approx(cross[output], rel=1e-4, abs=1e-11)
    result = monte_carlo(model, 100)
    drawn, second_order = result.standard_uncertainty, propagated.second_order_uncertainty
    uncertain = drawn > 1e-9
    # 200,000 samples: 0.16 %; squares of normal numbers have heavy tails, and orders above the second a thousandth.
    assert np.max(np.abs(drawn[uncertain] / second_order[uncertain] - 1)) < 0.02
    assert np.max(np.abs(drawn[uncertain] / propagated.standard_uncertainty[uncertain] - 1)) > 0.05
    compared = core.compare(propagated, result)
    assert any("the product of laser" in reason for reason in compared.reason)
