"""What residuals have in common: noise of another size than stated, lines and channels that scatter more, trends; and
uncertainties that are scaled by what the readings say of their noise."""

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from usual import CHAIN, DIAGONALS, SCALE_LINES, VOLUME

import stepdiag as sd
from stepdiag.findings.verdict import verdict_words

STATED = {"distance": 0.1e-3, "alpha": 1e-6, "beta": 1e-6}
MACHINE = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=7))
MACHINE_OF_THREE = sd.Machine(CHAIN, sd.random_error_map(VOLUME, seed=7, intervals=3))
NOISE = {"distance": STATED["distance"], "tilt": STATED["alpha"]}
PLAN = sd.Plan(VOLUME, DIAGONALS, 10, scale_lines=SCALE_LINES)
# Everything measured twice: what a line does is not what the machine does.
TWICE = sd.simulate(MACHINE, PLAN, sd.Head(), repeats=2, seconds_per_reading=10.0)
ONCE = sd.simulate(MACHINE, PLAN, sd.Head())
Rows = np.ndarray
Change = Callable[[str, sd.Measurement], np.ndarray | float]


def noisy(
    run: sd.Measurement, seed: int = 0, factor: Change | float = 1.0, offset: Change | float = 0.0
) -> sd.Measurement:
    """A run with noise of `factor` times what is stated, and offsets, by channel."""
    random, channels = np.random.default_rng(seed), dict(run.channels)
    for name, u in STATED.items():
        scale = factor(name, run) if callable(factor) else factor
        shift = offset(name, run) if callable(offset) else offset
        channels[name] = channels[name] + u * scale * random.standard_normal(len(run)) + shift
    return sd.Measurement(run.line, run.point.tolist(), run.position, channels, run=run.run.tolist())


def adjust(run: sd.Measurement, **options: object) -> sd.Adjustment:
    return sd.methods.adjust(run, PLAN, sd.Head(), CHAIN, (0, 0, 0), **{"outlier_probability": 0.0, **options})


def on(run: sd.Measurement, line: str) -> Rows:
    return np.asarray(run.line) == line


def test_larger_noise_is_measured_by_channel_and_said() -> None:
    found = adjust(noisy(TWICE, factor=1.4))
    assert found.verdict.fit == "doubtful"
    assert [(r.finding, r.channel) for r in found.verdict.reasons] == [
        ("misfit", "alpha"),
        ("misfit", "beta"),
        ("misfit", "distance"),
    ]
    for reason, component in zip(found.verdict.reasons, found.variance_components, strict=True):
        assert component.used
        assert (reason.value, reason.standard_uncertainty) == (component.factor, component.standard_uncertainty)
        assert abs(component.factor - 1.4) < 3 * component.standard_uncertainty
    # The run is adjusted with that noise: to 1 % of a factor, where the iteration ends, so 2 % of its square, and to
    # what 16 draws know of the redundancies.
    assert found.variance_factor == pytest.approx(1.0, abs=0.05)
    words = verdict_words(found)
    assert words.said.startswith("doubtful: noise: alpha scatters 1.4")
    assert "state it in [uncertainty]" in words.notes[-1][1]


def test_smaller_noise_is_measured_and_said() -> None:
    (reason,) = adjust(noisy(TWICE, factor=0.7)).verdict.reasons
    assert reason.finding == "no_misfit"
    assert abs(reason.value - 0.7) < 4 * reason.standard_uncertainty


@pytest.mark.parametrize("seed", range(3))
def test_many_runs_with_one_set_up_are_accepted_and_their_noise_is_what_it_is(seed: int) -> None:
    """All runs have one set-up, which then scatters far less than its priors: the instrument does not."""
    plan = sd.Plan(VOLUME, DIAGONALS, 3, scale_lines=SCALE_LINES)
    noise = sd.Noise(STATED["distance"], STATED["alpha"], seed=seed)
    run = sd.simulate(MACHINE_OF_THREE, plan, sd.Head(), repeats=100, noise=noise)
    found = sd.methods.adjust(run, plan, sd.Head(), CHAIN, uncertainty=sd.methods.ReadingUncertainty(**NOISE))
    assert found.chi_square_probability > 0.999  # priors counted
    assert found.verdict.fit == "accepted"
    # What is stated too large is found all the same.
    larger = {name: 1.1 * u for name, u in NOISE.items()}
    found = sd.methods.adjust(run, plan, sd.Head(), CHAIN, uncertainty=sd.methods.ReadingUncertainty(**larger))
    (reason,) = found.verdict.reasons
    assert reason.finding == "no_misfit"
    assert abs(reason.value - 1 / 1.1) < 4 * reason.standard_uncertainty


@pytest.mark.parametrize(
    ("where", "named"),
    [
        (lambda name, run: np.where(on(run, "npp"), 2.9, 1.0), {("alpha", "npp"), ("beta", "npp")}),
        (lambda name, run: 2.0 if name == "beta" else 1.0, {("beta", "")}),
        (lambda name, run: np.where(on(run, "pnp") & (name == "alpha"), 5.0, 1.0), {("alpha", "pnp")}),
    ],
)
def test_what_scatters_more_is_named_and_weighed_with_that(where: Change, named: set[tuple[str, str]]) -> None:
    found = adjust(noisy(TWICE, factor=where))
    assert found.verdict.fit == ("rejected" if any(c.factor > 3.0 for c in found.variance_components) else "doubtful")
    used = {(c.channel, c.line) for c in found.variance_components if c.used}
    assert named <= used
    assert {line for _, line in named} == {line for _, line in used}
    for component in found.variance_components:
        stated = where(component.channel, TWICE)
        true = float(np.max(stated)) if (component.channel, component.line) in used else 1.0
        assert abs(component.factor - true) < 3.5 * component.standard_uncertainty  # of a dozen


def test_a_run_that_scatters_more_is_named() -> None:
    found = adjust(noisy(TWICE, factor=lambda name, run: np.where(run.run == 1, 2.5, 1.0)))  # or run 0 less
    (reason,) = (r for r in found.verdict.reasons if r.finding == "uneven_misfit")
    assert found.verdict.fit == "doubtful"
    assert reason.run in (0, 1) or reason.aspect == "second_half"


def test_a_trend_has_the_size_that_it_has_as_an_unknown_and_then_leaves_none() -> None:
    """An independent way to the same number: the drift of that line, adjusted."""

    def drift(name: str, run: sd.Measurement) -> np.ndarray:
        return np.where(on(run, "ppp") & (name == "distance"), 1e-6 * run.channels["time"], 0.0)

    run = noisy(TWICE, offset=drift)
    known = adjust(run, one_setup_per_line=True, setup=sd.methods.SetupPriors(drift="fixed"))
    free = adjust(run, one_setup_per_line=True, setup_by_line={"ppp": sd.methods.SetupPriors(drift="free")})
    trend, *others = (r for r in known.verdict.reasons if r.finding == "trend")
    (rate,) = (e for e in free.setup if e.quantity == "drift" and e.line == "ppp")
    span = np.ptp(run.channels["time"][on(run, "ppp")])
    assert known.verdict.fit != "accepted"
    assert (trend.line, trend.channel, trend.aspect, trend.alternative) == ("ppp", "distance", "time", False)
    assert all(r.alternative for r in others)
    assert rate.value is not None
    assert trend.value == pytest.approx(rate.value * span, rel=1e-3)  # to second order
    # Measured against the scatter that is left, which is what was stated to 5 %.
    assert trend.standard_uncertainty == pytest.approx(rate.standard_uncertainty * span, rel=0.15)
    assert (free.verdict.fit, free.verdict.reasons) == ("accepted", [])


@pytest.mark.slow
def test_sound_runs_raise_no_alarms_beyond_what_is_stated() -> None:
    fits = Counter(adjust(noisy(ONCE, seed)).verdict.fit for seed in range(400))
    assert fits["rejected"] == 0
    assert fits["doubtful"] <= 14  # expected: at most 1.4 % of 400; more than 14 in one of 1,000 such tests


# --- scale_uncertainty -----------------------------------------------------------------------------------------------
def test_scaling_multiplies_all_stated_uncertainties_by_the_factor_and_makes_the_fit_doubtful() -> None:
    run = noisy(ONCE, factor=1.4)
    plain, scaled = (
        adjust(run, full_covariance=True, scale_uncertainty=scale, variance_components=False) for scale in (False, True)
    )
    factor = np.sqrt(plain.variance_factor)
    assert scaled.variance_factor == plain.variance_factor
    assert scaled.calibration.uncertainty_scaled == pytest.approx(factor, rel=1e-15)
    assert plain.calibration.uncertainty_scaled is None
    for name, (_, value, u) in plain.calibration.functions.items():
        np.testing.assert_array_equal(scaled.calibration.functions[name][1], value)
        np.testing.assert_allclose(scaled.calibration.functions[name][2], factor * u, rtol=1e-15)
    for name, (_, u) in plain.calibration.squareness.items():
        assert scaled.calibration.squareness[name][1] == pytest.approx(factor * u, rel=1e-15)
    assert plain.calibration.covariance is not None
    np.testing.assert_allclose(
        scaled.calibration.covariance, factor**2 * plain.calibration.covariance, rtol=1e-14, atol=0
    )
    for one, other in zip(plain.setup, scaled.setup, strict=True):
        assert other.standard_uncertainty == pytest.approx(factor * one.standard_uncertainty, rel=1e-15)
    assert scaled.verdict.fit == "doubtful"
    assert scaled.verdict.reasons[-1].finding == "scaled"
    assert "multiplied by" in scaled.calibration.fit_reasons[-1]


def test_what_was_weighed_by_channel_is_not_scaled_again() -> None:
    run = noisy(TWICE, factor=1.4)
    plain, scaled = (adjust(run, scale_uncertainty=scale) for scale in (False, True))
    assert scaled.calibration.uncertainty_scaled is None
    assert scaled.calibration.squareness == plain.calibration.squareness


@pytest.mark.slow
def test_scaling_restores_the_coverage_of_noise_that_is_larger_by_one_factor() -> None:
    """Squarenesses of 100 runs with noise 1.4 times what is stated: 300 deviations in units of their uncertainty."""
    exact = adjust(ONCE).calibration.squareness
    z = []
    for seed in range(100):
        calibration = adjust(noisy(ONCE, seed, 1.4), scale_uncertainty=True).calibration
        z += [(value - exact[name][0]) / u for name, (value, u) in calibration.squareness.items()]
    assert 0.8 < np.std(z) < 1.2  # its standard deviation is about 1/sqrt(600), and 0.06 more for what they share


def test_noise_that_is_smaller_than_stated_scales_nothing() -> None:
    found = adjust(noisy(ONCE, factor=0.9), scale_uncertainty=True)
    assert found.calibration.uncertainty_scaled is None
    assert not [r for r in found.verdict.reasons if r.finding == "scaled"]
