"""Covariances (eq. 6) against noisy repetitions, for every layout and both evaluations."""

from __future__ import annotations

import numpy as np
import pytest
from truth import Setup, changed, without
from usual import DIAGONALS, FACES, SCALE_LINES

import stepdiag as sd

REPETITIONS = 4000
DISTANCE, TILT, SPOT = 1e-4, 1e-6, 2e-3  # mm, rad, mm
UNCERTAINTY = sd.methods.ReadingUncertainty(distance=DISTANCE, tilt=TILT, spot=SPOT)
SIGMA = {"distance": DISTANCE, "alpha": TILT, "beta": TILT, "spot_x": SPOT, "spot_y": SPOT}

HEADS = {
    "ideal": sd.Head(),
    "psd": sd.Head("psd", psd_distance=50.0),
    "multi_beam": sd.Head("multi_beam", beam_offsets=[[0, 0], [20, 0], [0, 20]]),
}


def vector(calibration: sd.Calibration) -> np.ndarray:
    functions, squareness = calibration.functions, calibration.squareness
    values = [functions[name][1] for name in ORDER if name in functions]
    return np.concatenate([*values, [squareness[name][0] for name in ("C0Y", "B0Z", "A0Z")]])


ORDER = [f"E{c}{a}" for a in "XYZ" for c in "XYZABC"]


def repeated(setup: Setup, run: sd.Measurement, method: str) -> np.ndarray:
    """Calibrations of the run with fresh noise, one a row."""
    rng = np.random.default_rng(2026)
    results = []
    for _ in range(REPETITIONS):
        noisy = {
            name: value + SIGMA.get(name, DISTANCE) * rng.standard_normal(len(run))
            for name, value in run.channels.items()
        }
        results.append(vector(setup.evaluate(changed(run, noisy), method=method, uncertainty=UNCERTAINTY)))
    return np.array(results)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("layout", "method", "lines", "lost"),
    [
        ("ideal", "enhanced", DIAGONALS, []),
        ("ideal", "enhanced", ["ppp", "nnp", "npp"], []),
        ("ideal", "enhanced", DIAGONALS, [("ppp", 4), ("npp", 9), ("nnp", 0)]),  # bridged
        ("ideal", "enhanced", [*FACES, "nnn"], []),
        ("ideal", "conventional", DIAGONALS, []),
        ("psd", "enhanced", DIAGONALS, []),  # u(tilt) = u(spot) / 2(L + psd_distance) is not constant
        ("multi_beam", "enhanced", DIAGONALS, []),  # distance and tilts are correlated
    ],
)
def test_covariance_is_that_of_noisy_repetitions(
    layout: str, method: str, lines: list[str], lost: list[tuple[str, int]]
) -> None:
    setup = Setup(steps=6, lines=lines, scale_lines=SCALE_LINES, head=HEADS[layout])
    run = setup.simulate(setup.errors(3), sd.Misalignment(reflector=(1e-4, 3e-4), laser=(2e-4, -1e-4)))
    run = without(run, lost)
    calibration = setup.evaluate(run, method=method, uncertainty=UNCERTAINTY, full_covariance=True)
    samples = repeated(setup, run, method)
    covariance = calibration.covariance
    assert covariance.shape == (samples.shape[1],) * 2 == (len(calibration.covariance_labels),) * 2
    assert np.array_equal(covariance, covariance.T)

    predicted = np.sqrt(np.diag(covariance))
    stated = [u for name in ORDER if name in calibration.functions for u in calibration.functions[name][2]]
    stated += [calibration.squareness[name][1] for name in ("C0Y", "B0Z", "A0Z")]
    # The same numbers summed in another order.
    assert np.allclose(predicted, stated, rtol=1e-9, atol=1e-12 * np.max(predicted))

    observed = np.std(samples, axis=0, ddof=1)
    uncertain = predicted > 1e-9 * np.max(predicted[: len(predicted) // 2])
    uncertain &= observed > 0
    # What is certain (ends of straightness, home) does not move: roundings of 1 m.
    assert np.max(observed[~uncertain], initial=0.0) <= 1e-11
    # A standard deviation from 4,000 samples is itself uncertain by 1.1 %: 5 % are four and a half of it.
    ratio = observed[uncertain] / predicted[uncertain]
    assert np.max(np.abs(ratio - 1.0)) <= 0.05
    # Their mean square, over some 30 independent directions at least: 0.3 %, five of them.
    assert abs(np.sqrt(np.mean(ratio**2)) - 1.0) <= 0.015

    # A correlation r is uncertain by (1 - r^2)/sqrt(4000) = 1.6 %; of 10,000 pairs the worst lies at 4 to 4.5 of that.
    scale = predicted[uncertain]
    expected = covariance[np.ix_(uncertain, uncertain)] / np.outer(scale, scale)
    assert np.max(np.abs(np.corrcoef(samples[:, uncertain].T) - expected)) <= 5.5 / np.sqrt(REPETITIONS)


def test_neighbouring_increments_share_a_reading() -> None:
    """Along one axis the increments sum to last minus first: their sum is as uncertain after 20 steps as after one."""
    setup = Setup(steps=20, lines=["p00"], scale_lines=[])
    functions = setup.evaluate(setup.simulate(setup.errors(3)), uncertainty=UNCERTAINTY).functions
    assert functions["EXX"][2][1:] == pytest.approx(np.sqrt(2) * DISTANCE, rel=1e-6)  # tilts enter with their square
    assert functions["EBX"][2][1:] == pytest.approx(np.sqrt(2) * TILT, rel=1e-9)


def test_uncertainty_of_tilts_falls_with_the_distance_for_a_position_sensing_device() -> None:
    """u(tilt) = u(spot) / 2(L + psd_distance): along one axis EBX(p) is the tilt at p less that at 0."""
    setup = Setup(steps=20, lines=["p00"], scale_lines=[], head=HEADS["psd"])
    functions = setup.evaluate(setup.simulate(setup.errors(3)), uncertainty=UNCERTAINTY).functions
    tilt = SPOT / (2 * (100.0 + setup.plan.nodes("X") + 50.0))
    # The distances differ from nominal ones by 20 um of 100 mm.
    assert functions["EBX"][2][1:] == pytest.approx(np.hypot(tilt[0], tilt[1:]), rel=1e-3)


def test_uncertainty_grows_about_as_the_square_root_of_the_number_of_steps() -> None:
    """0.1 um and 1 urad: 0.74 um / 1.7 urad at N = 10, 1.67 / 3.6 at 50, found by a separate exact adjustment."""
    largest = {}
    for steps in (10, 50):
        setup = Setup(steps=steps)
        functions = setup.evaluate(setup.simulate(setup.errors(3)), uncertainty=UNCERTAINTY).functions
        largest[steps] = [
            max(np.max(u) for name, (_, _, u) in functions.items() if name[1] in kind) for kind in ("XYZ", "ABC")
        ]
    # The linear evaluation weighs less well than an exact adjustment: up to twice as large, never smaller.
    assert 0.74e-3 * 0.99 <= largest[10][0] <= 2 * 0.74e-3
    assert 1.7e-6 * 0.99 <= largest[10][1] <= 2 * 1.7e-6
    assert 1.67e-3 * 0.99 <= largest[50][0] <= 2 * 1.67e-3
    assert 3.6e-6 * 0.99 <= largest[50][1] <= 2 * 3.6e-6
