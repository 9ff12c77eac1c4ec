"""Noisy runs against the dense adjustment: values, variances, residuals, redundancies, the whole covariance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference
from adjusted import adjust, assert_as_dense, assert_rank, claims, statement
from dense_adjustment import DenseAdjustment, Knowledge, Prior, deviation
from dense_model import SQUARENESS, Setup, Table, rounding
from noisy_repetitions import ratios
from usual import DIAGONALS, FACES, SCALE_LINES
from virtual_runs import lost, measured, noisy, random_scenario, random_table, truth_of, within

import stepdiag as sd

EPSILON = 2.2e-16


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_dense_model_reads_what_the_reference_reads(layout: str) -> None:
    """Every set-up unknown and reversal in force; the reference has the readings with 40 digits."""
    rng = np.random.default_rng(1)
    scenario = random_scenario(rng, layout=layout, steps=3, backward=True, repeats=2, seconds_per_reading=20.0)
    for line in scenario.lines:
        scenario.misalignment[line] |= {
            "roll": 0.01,
            "gain": -0.02,
            "lateral": within(rng, 2.0),
            "drift": 1e-7,
            "distance_constant": 3.0,
        } | ({"beam_constants": [0.5, -0.2, 0.7]} if layout == "multi_beam" else {})
    table = random_table(rng, scenario.volume, 3, reversal=0.3)
    run = measured(reference.simulate(scenario, table))
    dense = DenseAdjustment(run, scenario)
    truth = truth_of(scenario, table, runs=(0, 2))
    x = np.array([truth.get(unknown, 0.0) for unknown in dense.model.unknowns])
    difference = np.abs(dense.model(x) - dense.read)
    for name, worst in zip(dense.channels, np.max(difference, axis=1), strict=True):
        assert worst <= rounding(name)
    # The derivatives against central differences of a step that leaves nine digits.
    jacobian = dense.model.jacobian(x)
    for j in range(0, len(x), 7):
        step = 1e-6 * np.eye(len(x))[j]
        numeric = (dense.model(x + step) - dense.model(x - step)) / 2e-6
        assert np.max(np.abs(numeric - jacobian[:, :, j])) <= 1e-6 * max(1.0, np.max(np.abs(jacobian[:, :, j])))


def known_run(
    seed: int, layout: str = "ideal", knowledge: Knowledge | None = None, **given: Any
) -> tuple[sd.Measurement, reference.Scenario, DenseAdjustment]:
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng, **({"steps": 4, "layout": layout} | given))
    for line in scenario.lines:  # as well as it is known to be
        for quantity in ("reflector", "laser"):
            size = deviation(scenario, knowledge or Knowledge(), line, quantity)
            if np.isfinite(size):
                scenario.misalignment[line][quantity] = within(rng, size)
    table = random_table(rng, scenario.volume, scenario.steps)
    run = noisy(measured(reference.simulate(scenario, table)), rng)
    return run, scenario, DenseAdjustment(run, scenario, knowledge).solve()


CASES: dict[str, tuple[dict[Any, Any], dict[str, Any]]] = {
    "ideal": ({}, {}),
    "psd": ({}, {"layout": "psd"}),
    "multi_beam": ({}, {"layout": "multi_beam"}),
    "steps": ({}, {"scale_points": "steps"}),
    "psd, steps": ({}, {"layout": "psd", "scale_points": "steps"}),
    "multi_beam, steps": ({}, {"layout": "multi_beam", "scale_points": "steps"}),
    "blocks": ({}, {"block": 2}),
    "psd, blocks with a rest": ({}, {"layout": "psd", "block": 3, "scale_points": "steps"}),
    "three diagonals, steps": ({}, {"lines": DIAGONALS[:3], "scale_points": "steps"}),
    "faces, steps": (
        {(line, quantity): 3e-4 for line in FACES[::2] for quantity in ("reflector", "laser")},
        {"lines": [*DIAGONALS, *FACES[::2]], "steps": 3, "scale_points": "steps"},
    ),
    "repeats, steps": ({}, {"repeats": 2, "steps": 3, "scale_points": "steps"}),
    "backward, steps": ({}, {"backward": True, "steps": 3, "scale_points": "steps"}),
    "common beams": ({"beam_constants": "fixed"}, {"layout": "multi_beam"}),
    "three diagonals": ({}, {"lines": ["nnn", "ppn", "pnp"]}),
    "faces": ({"reflector": "fixed"}, {"lines": FACES, "scale_lines": []}),
    "priors": ({"reflector": 1e-4, "laser": 3e-4, "distance_constant": 0.5, ("npp", "reflector"): "fixed"}, {}),
    "some of a line": ({("ppp", "laser"): "fixed", ("pnp", "roll"): "fixed", "lateral": "fixed"}, {}),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_everything_is_that_of_the_dense_adjustment(case: str) -> None:
    setup, given = CASES[case]
    knowledge = Knowledge(setup, reversal=False)  # of which one run there and back leaves constants open
    run, scenario, dense = known_run(11, knowledge=knowledge, **given)
    adjustment = adjust(run, scenario, knowledge, outlier_probability=0.0)
    assert_rank(adjustment, dense)
    # Normal equations lose the square of the condition; the dense decomposition does not. What rounding leaves open of
    # the solution moves the derivatives: three times what signs at random tell.
    relative = 10 * EPSILON * dense.condition**2
    assert relative <= 1e-6, "the case is too ill-conditioned to say anything"
    change = 3 * dense.change_of_uncertainties(dense.rounding)
    assert_as_dense(adjustment, dense, value=relative + dense.rounding, relative=min(relative + change, 1e-6))


@pytest.mark.parametrize("case", ["single axes", "distances", "distances of diagonals and a machine without angles"])
def test_uncertainties_hold_where_something_is_open(case: str) -> None:
    """What is not determined is held near 0, here tightly, there as is usual, and is seen in second order only."""
    rng = np.random.default_rng(19)
    turning = 0.0 if case.endswith("without angles") else 60e-6
    given = {"lines": SCALE_LINES, "scale_lines": []} if case == "single axes" else {"lines": [*FACES, *DIAGONALS]}
    scenario = random_scenario(rng, **({"steps": 3, "misalignment": {}} | given))
    table = random_table(rng, scenario.volume, 3, rotation=turning)
    run = noisy(measured(reference.simulate(scenario, table)), rng)
    if case != "single axes":
        run = lost(run, channels=("alpha", "beta"))
    # Without tilts the laser's second order is as large as the noise, where the machine turns.
    laser: Prior = "fixed" if case == "distances" else "free"
    knowledge = Knowledge({"reflector": "fixed", "laser": laser}, rotations=turning > 0)
    dense = DenseAdjustment(run, scenario, knowledge).solve()
    adjustment = adjust(run, scenario, knowledge, outlier_probability=0.0)
    assert_rank(adjustment, dense)
    assert len(adjustment.calibration.functions) >= 9
    for key, weights in claims(adjustment.calibration, dense).items():
        found, u = statement(adjustment.calibration, dense, key)
        expected = dense.standard_uncertainty(weights)
        assert u == pytest.approx(expected, rel=5e-3), key
        assert abs(found - dense.value(weights)) <= 0.05 * expected, key


@pytest.mark.parametrize("layout", ["ideal", "psd"])
def test_full_covariance_is_the_dense_inverse(layout: str) -> None:
    run, scenario, dense = known_run(12, layout)
    calibration = adjust(run, scenario, outlier_probability=0.0, full_covariance=True).calibration
    forms = []
    for name, position in calibration.covariance_labels:
        if name in SQUARENESS:
            forms.append(dense.vector({Table(name): 1.0}))
        else:
            edge = scenario.volume["XYZ".index(name[2])]
            forms.append(dense.vector(dense.node(name, round(position / edge * scenario.steps))))
    matrix = np.array(forms)
    expected = matrix @ dense.covariance @ matrix.T
    deviation = np.sqrt(np.diag(expected))
    scale = np.outer(np.where(deviation > 0, deviation, 1.0), np.where(deviation > 0, deviation, 1.0))
    assert calibration.covariance.shape == expected.shape
    assert np.max(np.abs(calibration.covariance - expected) / scale) <= 10 * EPSILON * dense.condition**2
    assert np.array_equal(calibration.covariance, calibration.covariance.T)


def test_uncertainty_columns_weigh_every_field_by_itself() -> None:
    run, scenario, _ = known_run(13)
    rng = np.random.default_rng(13)
    u = {name: (1e-4 if name == "distance" else 1e-6) * rng.uniform(0.3, 3.0, len(run)) for name in run.channels}
    weighted = sd.Measurement(run.line, run.point, run.position, run.channels, standard_uncertainty=u)
    dense = DenseAdjustment(weighted, scenario).solve()
    assert_as_dense(adjust(weighted, scenario, outlier_probability=0.0), dense)


@pytest.mark.parametrize("seed", range(3))
def test_fields_lost_anywhere(seed: int) -> None:
    """A tenth of all fields, each by itself; not of scale lines, whose two spots tell tilt and zero only together."""
    run, scenario, _ = known_run(14 + seed, ["ideal", "psd", "multi_beam"][seed])
    rng = np.random.default_rng(seed)
    measured_line = ~np.isin(run.line, scenario.scale_lines)
    channels = {
        name: np.where((rng.random(len(run)) < 0.1) & measured_line, np.nan, value)
        for name, value in run.channels.items()
    }
    lost = sd.Measurement(run.line, run.point, run.position, channels)
    dense = DenseAdjustment(lost, scenario).solve()
    adjustment = adjust(lost, scenario, outlier_probability=0.0)
    assert_rank(adjustment, dense)
    assert_as_dense(adjustment, dense, value=1e-5, relative=1e-5)


def test_set_ups_of_repeated_runs_and_of_lines() -> None:
    """Two runs of every line: a set-up each, or one for both."""
    rng = np.random.default_rng(17)
    scenario = random_scenario(rng, steps=3, repeats=2)
    table = random_table(rng, scenario.volume, 3)
    run = noisy(measured(reference.simulate(scenario, table)), rng)
    for knowledge, count in ((Knowledge(), 2), (Knowledge(one_setup_per_line=True), 1)):
        dense = DenseAdjustment(run, scenario, knowledge).solve()
        adjustment = adjust(run, scenario, knowledge, outlier_probability=0.0)
        assert len({(s.run, s.line) for s in adjustment.setup if s.line == "ppp"}) == count
        assert Setup(0, "ppp", "laser") in dense.place
        assert_as_dense(adjustment, dense)


def test_uncertainties_are_those_of_repeated_runs() -> None:
    """300 repetitions: a standard deviation is known to 4.1 %; four times that. noisy_repetitions.py runs 2,000."""
    found = ratios(300, seed=18)
    assert np.max(np.abs(found - 1)) <= 0.17
    assert abs(float(np.mean(found)) - 1) <= 0.08
