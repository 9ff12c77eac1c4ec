"""A calibration against the true errors of its machine."""

import math

import mpmath as mp
import numpy as np
import pytest
from calibrations import TOOL, VOLUME, calibrate, parts_of, simulate
from refusal import refused
from usual import CHAIN, DIAGONALS, small_plan

import stepdiag as sd
from stepdiag.calibration.truth import chi_square_probability

TRUTH = sd.random_error_map(VOLUME, seed=3, intervals=5)  # of calibrations.simulate


@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 87, 350])
def test_probability_of_chi_square_is_the_incomplete_gamma_function(freedom: int) -> None:
    for share in (0.0, 0.1, 0.9, 1.0, 1.5, 5.0):
        expected = mp.gammainc(mp.mpf(freedom) / 2, share * freedom / 2, regularized=True)
        # Exponents of up to 1000 have rounding of 1e-13.
        assert chi_square_probability(share * freedom, freedom) == pytest.approx(float(expected), rel=1e-11, abs=1e-300)


def test_deviations_are_the_truth_less_the_calibration_at_its_nodes() -> None:
    calibration = calibrate(1)
    for a, b, sign in ((calibration, TRUTH, 1.0), (TRUTH, calibration, -1.0)):
        comparison = sd.compare(a, b)
        for difference in comparison.differences:
            name = difference.parameter
            if name in calibration.functions:
                position, value, u = calibration.functions[name]
                expected = sign * (TRUTH.function(name, position) - value)
                np.testing.assert_array_equal(difference.position, position)
            else:
                value, u = calibration.squareness[name]
                expected = sign * np.array([TRUTH.squareness[name] - value])
            np.testing.assert_allclose(difference.value, expected, rtol=1e-12, atol=1e-20)
            np.testing.assert_array_equal(difference.standard_uncertainty, np.atleast_1d(u))
        agreement = comparison.agreement
        assert agreement is not None
        normalised = np.concatenate([d.normalised[d.testable] for d in comparison.differences])
        assert agreement.values == len(normalised) == comparison.count
        assert agreement.beyond_two == np.count_nonzero(np.abs(normalised) > 2.0)
        assert agreement.rms == pytest.approx(np.sqrt(np.mean(normalised**2)), rel=1e-12)
        assert (agreement.chi_square, agreement.probability) == (None, None)


def test_two_calibrations_have_no_agreement() -> None:
    assert sd.compare(calibrate(1), calibrate(2)).agreement is None


@pytest.fixture(scope="module")
def agreements() -> list[sd.results.TruthAgreement]:
    found = [sd.compare(calibrate(seed, full_covariance=True), TRUTH).agreement for seed in range(60)]
    return [agreement for agreement in found if agreement is not None]


def test_chi_square_of_truths_drawn_with_the_covariance_is_that_of_its_freedom() -> None:
    calibration = calibrate(1, full_covariance=True)
    assert calibration.covariance is not None
    names = np.array([name for name, _ in calibration.covariance_labels])
    variances, vectors = np.linalg.eigh(calibration.covariance)
    random = np.random.default_rng(5)
    sums = []
    for _ in range(200):
        noise = vectors @ (np.sqrt(variances.clip(0.0)) * random.standard_normal(len(names)))
        drawn = sd.ErrorMap(
            {name: (p, value + noise[names == name]) for name, (p, value, _) in calibration.functions.items()},
            {name: value + float(noise[names == name][0]) for name, (value, _) in calibration.squareness.items()},
        )
        agreement = sd.compare(calibration, drawn).agreement
        assert agreement is not None
        # 18 functions of 5 nodes beside home, of which 6 straightnesses are 0 at the end, and 3 squarenesses.
        assert agreement.degrees_of_freedom == 18 * 5 - 6 + 3
        assert agreement.chi_square is not None
        sums.append(agreement.chi_square)
    # The mean of 200 has a standard deviation of sqrt(2 n/200); four of them. The same for the variance of 2 n.
    assert np.mean(sums) == pytest.approx(87.0, abs=4.0 * math.sqrt(2.0 * 87.0 / 200.0))
    assert np.var(sums, ddof=1) == pytest.approx(2.0 * 87.0, rel=4.0 * math.sqrt(2.0 / 199.0))


def test_chi_square_of_calibrations_of_a_known_machine_is_at_most_that(
    agreements: list[sd.results.TruthAgreement],
) -> None:
    """Noise is as stated; what the priors of the set-up allow for is 0 in this simulation, and takes some off."""
    mean = np.mean([agreement.chi_square for agreement in agreements if agreement.chi_square is not None])
    assert 87.0 - 21.0 < mean < 87.0 + 4.0 * math.sqrt(2.0 * 87.0 / 60.0)  # 7 lines of 3 angles that have priors


def test_one_value_in_twenty_is_beyond_two_u(agreements: list[sd.results.TruthAgreement]) -> None:
    share = np.mean([agreement.beyond_two / agreement.values for agreement in agreements])
    # 4.55 %. Correlated neighbours make less of 60 times 87 values: 1.5 % allows for a tenth of them.
    assert share == pytest.approx(0.0455, abs=0.015)
    assert np.mean([agreement.rms for agreement in agreements]) == pytest.approx(1.0, abs=0.06)


def test_chi_square_sees_an_uncertainty_that_is_too_small() -> None:
    calibration = calibrate(1, full_covariance=True)
    assert calibration.covariance is not None
    smaller = sd.montecarlo.with_covariance(calibration, calibration.covariance / 4.0)
    one, other = (sd.compare(each, TRUTH).agreement for each in (calibration, smaller))
    assert one is not None
    assert other is not None
    assert one.chi_square is not None
    assert other.chi_square == pytest.approx(4.0 * one.chi_square, rel=1e-9)
    assert other.rms == pytest.approx(2.0 * one.rms, rel=1e-9)
    assert other.probability is not None
    assert other.probability < 1e-6


def test_shapes_are_compared_where_slopes_are_open() -> None:
    """Without scale lines: chi-square over what is left, 3 less, and 3 more with the positioning at its end."""
    plan = sd.Plan(VOLUME, DIAGONALS, 5)
    calibration = calibrate(4, plan=plan, full_covariance=True)
    assert calibration.undetermined_slopes == ["EXX", "EYY", "EZZ"]
    agreement = sd.compare(calibration, TRUTH).agreement
    assert agreement is not None
    assert agreement.probability is not None
    assert 1e-4 < agreement.probability < 1.0 - 1e-4


def test_reversal_errors_are_compared_too() -> None:
    run = simulate(1, repeats=2, backward=True)
    calibration = sd.methods.evaluate(run, small_plan(), sd.Head(), CHAIN, TOOL, full_covariance=True)
    comparison = sd.compare(calibration, TRUTH)
    reversal = next(d for d in comparison.differences if d.parameter == "EXX_reversal")
    np.testing.assert_allclose(reversal.value, -calibration.reversal["EXX"][1], atol=1e-18)  # the truth has none
    assert comparison.agreement is not None
    assert comparison.agreement.degrees_of_freedom == 18 * 5 - 6 + 3


def test_parameters_that_the_map_lacks_are_0() -> None:
    calibration = calibrate(1)
    comparison = sd.compare(calibration, sd.ErrorMap())
    assert [d.parameter for d in comparison.differences if d.parameter == "EXX"] == ["EXX"]
    (difference,) = (d for d in comparison.differences if d.parameter == "EXX")
    np.testing.assert_array_equal(difference.value, -calibration.functions["EXX"][1])
    assert comparison.only_in_a == comparison.only_in_b == ()


def test_map_that_breaks_the_frame_is_noted() -> None:
    broken = sd.ErrorMap({"EYX": ([0.0, 80.0], [0.0, 5e-3])})
    notes = sd.compare(calibrate(1), broken).notes
    assert any(note.startswith("error map: EYX is 5 µm at the end of travel") for note in notes)


def test_map_of_another_machine_is_refused(tmp_path_factory: pytest.TempPathFactory) -> None:
    file = tmp_path_factory.mktemp("maps") / "map.csv"
    TRUTH.write(file, chain="[w b X Y Z t]")
    refused(sd.compare, calibrate(1), sd.read_error_map(file), names="the chains differ")
    TRUTH.write(file, volume=(80.0, 60.0, 51.0))
    refused(sd.compare, calibrate(1), sd.read_error_map(file), names="the volumes differ")
    file.write_text(f"# volume_mm=large\n{file.read_text()}")
    refused(sd.compare, TRUTH, TRUTH, names="expected one calibration at least, got two error maps")


def test_uncertainties_that_are_not_known_leave_the_agreement_open() -> None:
    parts = parts_of(calibrate(1))
    parts["functions"] = {n: (p, v, np.full(len(p), np.nan)) for n, (p, v, _) in parts["functions"].items()}
    parts["squareness"] = {name: (value, math.nan) for name, (value, _) in parts["squareness"].items()}
    agreement = sd.compare(sd.Calibration(**parts), TRUTH).agreement
    assert agreement is not None
    assert (agreement.values, agreement.beyond_two) == (0, 0)
    assert math.isnan(agreement.rms)
