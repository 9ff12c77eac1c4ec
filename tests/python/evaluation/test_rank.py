"""What readings can determine: lost readings, few lines, no scale lines, weights. Nothing is invented."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from truth import MICROMETRE, NANOMETRE, NANORADIAN, Setup, changed, row_of, without, worst
from usual import DIAGONALS, FACES, SCALE_LINES

import stepdiag as sd

# As in test_truth_evaluation: products of 60 urad, some of them; bridging weighs them otherwise.
CLEAN = (20 * NANOMETRE, 10 * NANORADIAN)
ALL_FUNCTIONS = {f"E{c}{a}" for c in "XYZABC" for a in "XYZ"}


def assert_clean(calibration: sd.Calibration, truth: sd.ErrorMap) -> None:
    """Everything that is claimed is true."""
    error = worst(calibration, truth)
    assert error.position <= CLEAN[0]
    assert error.angle <= CLEAN[1]


def test_without_scale_lines_shapes_and_squarenesses_stay() -> None:
    setup = Setup(steps=20, scale_lines=[])
    truth = setup.errors(2)
    calibration = setup.evaluate(setup.simulate(truth))
    assert sorted(calibration.undetermined_slopes) == ["EXX", "EYY", "EZZ"]
    assert set(calibration.functions) == ALL_FUNCTIONS
    # Four diagonals: each squareness is a difference of two pairs, whatever the scales and the laser angles are.
    assert set(calibration.squareness) == {"C0Y", "B0Z", "A0Z"}
    for name in ("EXX", "EYY", "EZZ"):
        value = calibration.functions[name][1]
        assert value[0] == 0.0
        assert abs(value[-1]) <= 1e-15  # the slope is absent, not guessed
        assert any(name in sentence for sentence in calibration.undetermined)
    assert_clean(calibration, truth)


@pytest.mark.parametrize(
    ("scale_lines", "slopes"),
    [(SCALE_LINES[:2], []), (SCALE_LINES[1:], []), (["p00"], ["EYY", "EZZ"]), (["00n"], ["EXX", "EYY"])],
)
def test_two_scale_lines_suffice_and_one_does_not(scale_lines: list[str], slopes: list[str]) -> None:
    setup = Setup(steps=20, scale_lines=scale_lines)
    truth = setup.errors(2)
    calibration = setup.evaluate(setup.simulate(truth))
    assert sorted(calibration.undetermined_slopes) == slopes
    assert len(calibration.undetermined) == len(slopes)
    assert_clean(calibration, truth)


@pytest.mark.parametrize("lines", [DIAGONALS[:3], DIAGONALS[1:], ["ppn", "nnn", "pnp"]])
def test_three_diagonals_and_scale_lines_determine_everything(lines: list[str]) -> None:
    setup = Setup(steps=20, lines=lines)
    truth = setup.errors(2)
    run = setup.simulate(truth)
    calibration = setup.evaluate(run)
    assert set(calibration.functions) == ALL_FUNCTIONS
    assert len(calibration.squareness) == 3
    assert calibration.undetermined == []
    assert_clean(calibration, truth)


def test_three_diagonals_without_scale_lines_leave_the_squarenesses_open() -> None:
    setup = Setup(steps=20, lines=DIAGONALS[:3], scale_lines=[])
    truth = setup.errors(2)
    calibration = setup.evaluate(setup.simulate(truth))
    assert calibration.squareness == {}
    assert sorted(calibration.undetermined_slopes) == ["EXX", "EYY", "EZZ"]
    for name in ("C0Y", "B0Z", "A0Z"):
        assert any(name in sentence for sentence in calibration.undetermined)
    assert_clean(calibration, truth)


def test_faces_determine_everything_by_themselves() -> None:
    setup = Setup(steps=20, lines=FACES, scale_lines=[])
    truth = setup.errors(2)
    calibration = setup.evaluate(setup.simulate(truth))
    assert set(calibration.functions) == ALL_FUNCTIONS
    assert calibration.undetermined_slopes == []
    assert_clean(calibration, truth)


@pytest.mark.parametrize(
    ("lines", "some", "never"),
    [
        # Along two lines in the plane x = +-y z/... only the components within their plane are seen.
        (["ppp", "npp"], {"EXX", "EAX", "EBX", "ECX"}, {"EYX", "EZX", "EYY", "EZZ"}),
        # A single axis shows its own positioning, and the two rotations across the beam.
        (["p00", "0p0", "00p"], {"EXX", "EYY", "EZZ", "EBX", "ECX", "EAY", "ECY"}, {"EAX", "EBY", "ECZ", "EYX"}),
        # Two face diagonals of XY know nothing of Z.
        (["pp0", "np0"], {"EAX", "EBX", "ECX", "EAY", "EBY", "ECY"}, {"EXZ", "EYZ", "EZZ", "EAZ", "EBZ", "ECZ"}),
    ],
)
def test_few_lines_determine_what_they_see_and_no_more(lines: list[str], some: set[str], never: set[str]) -> None:
    setup = Setup(steps=10, lines=lines, scale_lines=[])
    truth = setup.errors(2)
    calibration = setup.evaluate(setup.simulate(truth))
    assert some <= set(calibration.functions)
    assert never.isdisjoint(calibration.functions)
    for name in ALL_FUNCTIONS - set(calibration.functions):
        assert any(name in sentence for sentence in calibration.undetermined), f"{name} is missing and nobody says so"
    assert_clean(calibration, truth)


@settings(max_examples=25)
@given(st.data())
def test_four_lines_bridge_a_lost_reading_anywhere(data: st.DataObject) -> None:
    setup = Setup(steps=8)
    truth = setup.errors(2)
    run = setup.simulate(truth)
    line, point = data.draw(st.sampled_from(DIAGONALS)), data.draw(st.integers(0, 24))
    channels = data.draw(st.sampled_from([(), ("distance",), ("alpha",), ("beta",), ("alpha", "beta")]))
    if data.draw(st.booleans()):
        lost = without(run, [(line, point)], channels)
    else:  # the row is not there at all
        gone = row_of(run, line, point)
        lost = changed(run, rows=[i for i in range(len(run)) if i != gone])
    calibration = setup.evaluate(lost)
    assert set(calibration.functions) == ALL_FUNCTIONS
    assert len(calibration.squareness) == 3
    assert calibration.undetermined == []
    assert_clean(calibration, truth)


@settings(max_examples=40)
@example({("ppp", 0), ("pnp", 0)})  # once gave EYX with angles of the laser that nobody knew
@given(st.sets(st.tuples(st.sampled_from(DIAGONALS + SCALE_LINES), st.integers(0, 24)), max_size=40))
def test_whatever_is_lost_nothing_is_invented(places: set[tuple[str, int]]) -> None:
    setup = Setup(steps=8)
    truth = setup.errors(2)
    lost = [(line, point) for line, point in places if line in DIAGONALS or point < 2]
    run = setup.simulate(truth, sd.Misalignment(laser=(70e-6, 100e-6)))
    try:
        calibration = setup.evaluate(without(run, lost))
    except sd.InvalidArgument:
        return  # so much is lost that nothing can be determined, and it says so
    error = worst(calibration, truth)
    # Fewer lines amplify the second order three to five times, also that of the laser: (120 urad)^2 / 2 x 1 m = 7 nm.
    # An angle of the laser that is guessed instead of known would show with 100 urad x a step of 100 mm = 10 um.
    assert error.position <= 10 * CLEAN[0]
    assert error.angle <= 5 * CLEAN[1]
    for name in ALL_FUNCTIONS - set(calibration.functions):
        assert any(name in sentence for sentence in calibration.undetermined)
    for name in {"C0Y", "B0Z", "A0Z"} - set(calibration.squareness):
        assert any(name in sentence for sentence in calibration.undetermined)


def test_three_lines_cannot_bridge_and_say_where() -> None:
    setup = Setup(steps=10, lines=DIAGONALS[:3])
    truth = setup.errors(2)
    run = without(setup.simulate(truth), [("ppp", 7)])  # ends the third step of X, begins that of Y
    calibration = setup.evaluate(run)
    assert {"EXX", "EYX", "EXY", "EYY"}.isdisjoint(calibration.functions)
    # The other two lines, npp and pnp, both see z; X and Y only together.
    assert {"EZX", "EZY", "EXZ", "EYZ", "EZZ", "EAX", "ECY"} <= set(calibration.functions)
    assert any("step 3 of X" in sentence and "160 to 240 mm" in sentence for sentence in calibration.undetermined)
    assert any("step 3 of Y" in sentence for sentence in calibration.undetermined)
    assert_clean(calibration, truth)


def test_advice_after_losses_is_to_measure_again() -> None:
    setup = Setup(steps=5)
    run = without(setup.simulate(setup.errors(2)), [(line, k) for line in DIAGONALS for k in (4, 5)] + [("0p0", 1)])
    advice = setup.evaluate(run).undetermined
    assert any("measure the lost points again" in sentence for sentence in advice)
    assert not any("add body diagonals" in sentence or "add the scale line" in sentence for sentence in advice)


def test_conventional_looks_at_distances_only() -> None:
    """An interferometer zeroed at the start leaves no absolute distance to make tilts of spots with."""
    setup = Setup(steps=5, head=sd.Head("psd", psd_distance=50.0))
    run = setup.simulate(setup.errors(2))
    zeroed = changed(run, {"distance": run.channels["distance"] - 100.0})
    for name, (_, value, _) in setup.evaluate(zeroed, method="conventional").functions.items():
        expected = setup.evaluate(run, method="conventional").functions[name][1]
        np.testing.assert_allclose(value, expected, atol=2e-12, err_msg=name)  # mm: distances near 1 m are rounded


def test_conventional_evaluation_says_that_it_knows_no_rotations() -> None:
    setup = Setup(steps=10)
    calibration = setup.evaluate(setup.simulate(setup.errors(2)), method="conventional")
    assert not any(name[1] in "ABC" for name in calibration.functions)
    assert any("rotation" in sentence for sentence in calibration.undetermined)


def test_distances_alone_serve_the_conventional_evaluation_only() -> None:
    setup = Setup(steps=10)
    truth = setup.errors(2, rotation=0.0)
    full = setup.simulate(truth)
    run = sd.Measurement(full.line, full.point, full.position, {"distance": full.channels["distance"]})
    assert_clean(setup.evaluate(run, method="conventional"), truth)
    with pytest.raises(sd.InvalidArgument):
        setup.evaluate(run)


def test_line_of_large_uncertainty_counts_for_nothing() -> None:
    """Weights come from the u_ columns: a bad line of which the run says that it is bad does no harm."""
    setup = Setup(steps=10)
    truth = setup.errors(2)
    run = setup.simulate(truth)
    bad = np.array([line == "nnp" for line in run.line])
    rng = np.random.default_rng(5)
    channels = {
        name: value + bad * rng.normal(0, 0.1, len(run)) * (1 if name == "distance" else 1e-3)
        for name, value in run.channels.items()
    }
    u = {"distance": np.where(bad, 1e3, 1e-4), "alpha": np.where(bad, 10.0, 1e-6), "beta": np.where(bad, 10.0, 1e-6)}
    weighted = changed(run, channels, standard_uncertainty=u)
    assert worst(setup.evaluate(changed(run, channels)), truth).position > 10 * MICROMETRE
    assert_clean(setup.evaluate(weighted), truth)


def test_uncertainty_columns_say_the_same_as_the_option() -> None:
    setup = Setup(steps=10)
    run = setup.simulate(setup.errors(2), noise=sd.Noise(distance=1e-4, tilt=1e-6, seed=8))
    option = setup.evaluate(run, uncertainty=sd.methods.ReadingUncertainty(distance=3e-4, tilt=2e-6))
    ones = np.ones(len(run))
    columns = changed(run, standard_uncertainty={"distance": 3e-4 * ones, "alpha": 2e-6 * ones, "beta": 2e-6 * ones})
    for name, (_, value, u) in setup.evaluate(columns).functions.items():
        assert np.allclose(value, option.functions[name][1], rtol=0, atol=1e-13)  # roundings
        assert np.allclose(u, option.functions[name][2], rtol=1e-12)


def test_second_run_of_the_lines_halves_the_variances() -> None:
    setup = Setup(steps=8)
    run = setup.simulate(setup.errors(2))
    once = setup.evaluate(run)
    backward = np.arange(len(run))[::-1]
    lines, points = [*run.line, *[run.line[i] for i in backward]], np.concatenate([run.point, run.point[backward]])
    twice = sd.Measurement(
        lines,
        points,
        np.concatenate([run.position, run.position[backward]]),
        {name: np.concatenate([value, value[backward]]) for name, value in run.channels.items()},
        run=[0] * len(run) + [1] * len(run),
        direction=["forward"] * len(run) + ["backward"] * len(run),
    )
    for name, (_, value, u) in setup.evaluate(twice).functions.items():
        assert np.allclose(value, once.functions[name][1], rtol=0, atol=1e-12)  # roundings of 1 m
        assert np.allclose(u, once.functions[name][2] / np.sqrt(2), rtol=1e-9, atol=1e-18)
