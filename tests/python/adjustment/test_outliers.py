"""Readings that do not fit are found, named and left out; those that fit are left alone."""

from __future__ import annotations

import numpy as np
import pytest
import reference
from adjusted import adjust, is_complete
from dense_adjustment import DenseAdjustment
from virtual_runs import measured, noisy, random_scenario, random_table

import stepdiag as sd

SIGMA = {"distance": 1e-4, "alpha": 1e-6, "beta": 1e-6, "spot_x": 1e-3, "spot_y": 1e-3, "d2": 1e-4, "d3": 1e-4}


def run_of(seed: int, roughness: float = 0.2, **given: object) -> tuple[sd.Measurement, reference.Scenario]:
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng, **given)
    table = random_table(rng, scenario.volume, scenario.steps, roughness=roughness)
    return noisy(measured(reference.simulate(scenario, table)), rng), scenario


def with_channels(run: sd.Measurement, channels: dict[str, np.ndarray]) -> sd.Measurement:
    return sd.Measurement(run.line, run.point, run.position, channels, run=run.run, direction=run.direction)


def spoilt(run: sd.Measurement, places: list[tuple[int, str, float]]) -> sd.Measurement:
    """(row, channel, standard deviations): added; NaN: lost."""
    channels = {name: np.array(value) for name, value in run.channels.items()}
    for row, channel, size in places:
        channels[channel][row] += size * SIGMA[channel]
    return with_channels(run, channels)


@pytest.fixture(scope="module")
def long_run() -> tuple[sd.Measurement, reference.Scenario]:
    """Four diagonals of 50 steps on a machine of long waves, 604 points; 6 of scale lines."""
    return run_of(31, roughness=0.0, steps=50)


@pytest.mark.parametrize("seed", range(8))
def test_two_outliers_of_twenty_sigma_are_found_and_named(
    long_run: tuple[sd.Measurement, reference.Scenario], seed: int
) -> None:
    run, scenario = long_run
    rng = np.random.default_rng(seed)
    channels = [str(c) for c in rng.choice(["distance", "alpha", "beta"], 2)]
    rows = [int(i) for i in rng.choice(604, 2, replace=False)]
    places = list(zip(rows, channels, strict=True))
    sizes = dict(zip(places, [20.0, -20.0], strict=True))
    bad = spoilt(run, [(*place, size) for place, size in sizes.items()])
    adjustment = adjust(bad, scenario)
    left_out = [o for o in adjustment.outliers if o.left_out]
    assert {(o.row, o.channel) for o in left_out} == set(places)
    for outlier in left_out:
        assert (outlier.run, outlier.line, outlier.point) == (
            int(run.run[outlier.row]),
            run.line[outlier.row],
            int(run.point[outlier.row]),
        )
        assert not adjustment.used[outlier.channel][outlier.row]
        # What the others say of it: the outlier itself, with the noise of both.
        assert np.sign(outlier.residual) == np.sign(sizes[outlier.row, outlier.channel])
        assert abs(outlier.normalised) > 5
    # Distances may have a partner that no other reading tells from them (below); tilts have none.
    partners = [o for o in adjustment.outliers if not o.left_out]
    assert len(partners) <= channels.count("distance")
    assert all(o.channel == "distance" and adjustment.used["distance"][o.row] for o in partners)

    # As good as without them: the same as if those two readings had been lost.
    lost = adjust(spoilt(run, [(*place, np.nan) for place in places]), scenario)
    assert lost.outliers == []
    for name, (_, value, u) in lost.calibration.functions.items():
        _, found_value, found_u = adjustment.calibration.functions[name]
        known = u > 0
        assert np.max(np.abs(found_value - value)[known] / u[known]) <= 1e-6  # both at their minimum
        assert np.max(np.abs(found_u - u)[known] / u[known]) <= 1e-6
    assert adjustment.degrees_of_freedom == lost.degrees_of_freedom
    assert adjustment.chi_square_probability == pytest.approx(lost.chi_square_probability, abs=1e-6)
    assert adjustment.chi_square_probability > 1e-3
    ignored = adjust(bad, scenario, outlier_probability=0.0)
    assert ignored.outliers == []
    assert ignored.chi_square_probability < 1e-3


def test_distances_that_no_reading_tells_apart_are_both_named() -> None:
    """A distance enters two intervals; of each the four lines leave one residual, and another line may see both.

    On a rough machine, too, where smoothness may decide for the wrong one, it is among those named."""
    run, scenario = run_of(37, steps=20)
    rng = np.random.default_rng(37)
    pairs = 0
    for row in rng.choice(240, 8, replace=False):
        bad = spoilt(run, [(int(row), "distance", 30.0)])
        named = adjust(bad, scenario).outliers
        assert int(row) in {o.row for o in named}
        sizes = np.sort(np.abs(adjust(bad, scenario, outlier_probability=0.0).normalised_residuals["distance"]))
        is_pair = bool(sizes[-2] > 0.99 * sizes[-1])
        assert [(o.number, o.left_out) for o in named] == [(1, True), (1, False)][: 1 + is_pair]
        pairs += is_pair
    assert 0 < pairs < 8


@pytest.mark.parametrize("layout", ["psd", "multi_beam"])
def test_outliers_of_other_layouts(layout: str) -> None:
    run, scenario = run_of(32, steps=12, layout=layout)
    channel = "spot_y" if layout == "psd" else "d2"
    adjustment = adjust(spoilt(run, [(17, channel, 30.0)]), scenario)
    assert [(o.row, o.channel) for o in adjustment.outliers] == [(17, channel)]


def test_control_reading_says_what_the_others_say() -> None:
    """The residual of one left out is the reading less the model of all others; its variance is that of both."""
    run, scenario = run_of(33, steps=4)
    bad = spoilt(run, [(20, "alpha", 40.0)])
    adjustment = adjust(bad, scenario)
    (outlier,) = adjustment.outliers  # a tilt is controlled by those of other lines, each in its own way
    dense = DenseAdjustment(spoilt(run, [(20, "alpha", np.nan)]), scenario).solve()
    channel = dense.channels.index("alpha")
    predicted = dense.model(dense.x)[channel, 20]
    row = dense.model.jacobian(dense.x)[channel, 20][dense.active]
    expected = bad.channels["alpha"][20] - predicted
    deviation = np.sqrt(1e-12 + row @ dense.covariance @ row)
    assert outlier.residual == pytest.approx(expected, rel=1e-6)
    assert outlier.normalised == pytest.approx(expected / deviation, rel=1e-6)


def test_false_alarms_are_as_rare_as_stated() -> None:
    """At 5 % a run, 200 clean runs: 10, and no more than 22 (four standard deviations of such a count)."""
    rng = np.random.default_rng(34)
    scenario = random_scenario(rng, steps=3)
    clean = measured(reference.simulate(scenario, random_table(rng, scenario.volume, 3)))
    alarms = sum(bool(adjust(noisy(clean, rng), scenario, outlier_probability=0.05).outliers) for _ in range(200))
    assert alarms <= 22


def test_where_the_model_is_wrong_nothing_is_left_out() -> None:
    """More than one in fifty, and more than ten: it is not the readings."""
    run, scenario = run_of(35, steps=10)
    rng = np.random.default_rng(35)
    rows = rng.choice(124, 25, replace=False)
    adjustment = adjust(spoilt(run, [(int(r), "distance", float(rng.choice([-40, 40]))) for r in rows]), scenario)
    assert adjustment.outliers == []
    assert all(np.all(used[np.isfinite(run.channels[c])]) for c, used in adjustment.used.items() if c == "distance")
    assert adjustment.chi_square_probability < 1e-6


def test_outlier_that_nothing_controls_is_not_invented() -> None:
    """One reading of each node only: it defines what it reads, and cannot be wrong."""
    rng = np.random.default_rng(36)
    scenario = random_scenario(rng, steps=5, lines=["p00", "0p0", "00p"], scale_lines=[], misalignment={})
    run = noisy(measured(reference.simulate(scenario, random_table(rng, scenario.volume, 5))), rng)
    adjustment = adjust(spoilt(run, [(3, "distance", 1000.0)]), scenario)
    assert adjustment.outliers == []
    assert adjustment.redundancy["distance"][3] <= 1e-6
    assert adjustment.normalised_residuals["distance"][3] == 0.0
    assert not is_complete(adjustment.calibration)
