"""The figure of a calibration shows all that its file says, with the right bands, and hides no doubt."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from calibrations import CHAIN, TOOL, VOLUME, calibrate, parts_of
from ink import ink, labels, panel, texts
from matplotlib.collections import PolyCollection

import stepdiag as sd
from stepdiag.figures.calibration import draw_calibration
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

COVERAGE_FACTOR = 1.959963984540054  # of 95 %, normal distribution (tables)
FACTOR = {"mm": 1e3, "rad": 1e6}  # to µm, µrad


@pytest.fixture(scope="module")
def calibration() -> sd.Calibration:
    return calibrate(1)


def factor(name: str) -> float:
    return 1e6 if name[1] in "ABC" else 1e3


def test_every_panel_has_ink_name_and_units(calibration: sd.Calibration) -> None:
    figure = draw_calibration(calibration)
    found = ink(figure)
    assert found.keys() == {*FUNCTIONS, "squarenesses"}
    # A line across a panel of 120 pixels has more than 100.
    assert all(count > 100 for name, count in found.items() if name in FUNCTIONS), found
    assert found["squarenesses"] > 30
    assert {re.sub(r".*\(", "(", label) for label in labels(figure)} == {"(mm)", "(µm)", "(µrad)"}
    assert [tick.get_text() for tick in panel(figure, "squarenesses").get_xticklabels()] == list(SQUARENESSES)


def test_curves_are_the_values_and_bands_have_the_half_width_of_95_percent(calibration: sd.Calibration) -> None:
    figure = draw_calibration(calibration)
    for name, (position, value, u) in calibration.functions.items():
        axes = panel(figure, name)
        curve = axes.lines[0].get_xydata()
        np.testing.assert_allclose(curve, np.column_stack([position, value * factor(name)]), rtol=1e-15)
        (band,) = [c for c in axes.collections if isinstance(c, PolyCollection)]
        vertices = band.get_paths()[0].vertices
        for p, v, half in zip(position, value, COVERAGE_FACTOR * u, strict=True):
            y = vertices[vertices[:, 0] == p, 1]
            # rtol: sums of a few roundings; atol: of a value of 0
            np.testing.assert_allclose([y.min(), y.max()], np.array([v - half, v + half]) * factor(name), 1e-12, 1e-12)


def test_bars_of_squarenesses_have_that_half_width(calibration: sd.Calibration) -> None:
    axes = panel(draw_calibration(calibration), "squarenesses")
    for k, container in enumerate(axes.containers):
        value, u = calibration.squareness[SQUARENESSES[k]]
        ((bar,),) = (lines.get_segments() for lines in container.lines[2])
        expected = 1e6 * np.array([value - COVERAGE_FACTOR * u, value + COVERAGE_FACTOR * u])
        np.testing.assert_allclose(bar, np.column_stack([[k, k], expected]), rtol=1e-12)


def test_truth_is_drawn_beside_it(calibration: sd.Calibration) -> None:
    truth = sd.random_error_map(VOLUME, seed=3, intervals=5)
    figure = draw_calibration(calibration, truth)
    for name in FUNCTIONS:
        x, y = panel(figure, name).lines[2].get_xydata().T  # after the curve, and its values without neighbours
        np.testing.assert_allclose(y, truth.function(name, x) * factor(name), rtol=1e-12, atol=1e-12)
    assert "truth" in texts(figure)


def test_rejected_fit_is_marked_in_the_heading_and_in_every_panel(calibration: sd.Calibration) -> None:
    rejected = texts(draw_calibration(calibration.judged("rejected", ["the readings contradict each other"])))
    assert "FIT REJECTED: DO NOT USE" in rejected
    assert rejected.count("rejected") == 19
    assert "the readings contradict each other" in rejected
    accepted = texts(draw_calibration(calibration.judged("accepted")))
    assert "fit accepted" in accepted
    assert "rejected" not in accepted
    assert any(
        "scatter more, less or otherwise" in text for text in texts(draw_calibration(calibration.judged("doubtful")))
    )


@pytest.mark.parametrize(
    ("temperature", "words"),
    [
        ({"temperature_reference": 20.0}, "referred to 20 °C"),
        ({"temperature_as_found": (23.1, 23.0, 22.8)}, "as found at X 23.1, Y 23.0, Z 22.8 °C"),
        ({}, "temperature not recorded"),
    ],
)
def test_figures_say_for_which_temperature_they_are(temperature: dict[str, Any], words: str) -> None:
    calibration = sd.Calibration(**parts_of(calibrate(1)), **temperature)
    assert any(words in text for text in texts(calibration.plot()))
    assert any(words in text for text in texts(sd.volume(calibration, ranking=False).plot()))


def test_undetermined_parameters_are_marked_and_named() -> None:
    parts = parts_of(calibrate(1))
    del parts["functions"]["EXX"], parts["squareness"]["C0Y"]
    sentences = ["EXX: add the line p00", "C0Y: add body diagonals"]
    setup = "reflector tilt about local x on ppp: give a prior, or take it as fixed"
    partial = sd.Calibration(**parts | {"undetermined": [*sentences, setup]})
    figure = draw_calibration(partial)
    assert [text.get_text() for text in panel(figure, "EXX").texts] == ["not determined"]
    assert [text.get_text() for text in panel(figure, "squarenesses").texts] == ["not determined"]
    assert not panel(figure, "EYY").texts
    for sentence in (*sentences, setup):
        assert f"undetermined: {sentence}" in texts(figure)


def test_curve_ends_where_positions_are_not_determined() -> None:
    """Points without a value between them are not joined."""
    parts = parts_of(calibrate(1))
    position, value, u = parts["functions"]["EXX"]
    keep = np.array([0, 1, 2, 4])
    parts["functions"]["EXX"] = (position[keep], value[keep], u[keep])
    figure = draw_calibration(sd.Calibration(**parts | {"undetermined": ["whatever the sentence says"]}))
    drawn = panel(figure, "EXX").lines[0].get_ydata()
    assert np.array_equal(np.flatnonzero(np.isfinite(drawn)), keep)
    assert "some positions only" in texts(figure)
    assert panel(figure, "EXX").lines[1].get_xdata().tolist() == [position[4]], "marked on its own"


def test_nodes_of_their_own_are_no_gaps_where_nothing_is_undetermined() -> None:
    parts = parts_of(calibrate(1))
    position, value, u = parts["functions"]["EXX"]
    parts["functions"]["EXX"] = (position[::2], value[::2], u[::2])
    figure = draw_calibration(sd.Calibration(**parts))
    np.testing.assert_array_equal(panel(figure, "EXX").lines[0].get_xdata(), position[::2])
    assert not {"some positions only", "not determined"} & {*texts(figure)}


def test_adjustment_of_lost_points_has_gaps_at_the_positions_that_it_finds() -> None:
    """The finding of the core, which a file does not have, is the truth here."""
    from small_scenario import SCENARIO

    scenario = sd.parse_scenario(SCENARIO.replace('"ppp", "npp", "pnp", "nnp"', '"ppp", "npp"'))
    _, found = sd.observe(scenario)
    (finding,) = [one for one in found.calibration.findings if one.part == "positions" and one.parameters == ["EYY"]]
    drawn = panel(draw_calibration(found.calibration), "EYY").lines[0]
    np.testing.assert_array_equal(drawn.get_xdata()[np.isnan(drawn.get_ydata())], finding.positions)


def test_both_directions_are_drawn() -> None:
    parts = parts_of(calibrate(1))
    position, _, u = parts["functions"]["EXX"]
    parts["reversal"] = {"EXX": (position, np.full(len(position), 2e-3), u)}
    figure = draw_calibration(sd.Calibration(**parts))
    forward, _, backward, *_ = panel(figure, "EXX").lines
    np.testing.assert_allclose(forward.get_ydata() - backward.get_ydata(), 2.0, rtol=1e-9)
    assert "approached in - direction" in texts(figure)


def test_calibration_without_uncertainties_has_no_bands_and_says_so() -> None:
    functions = {"EXX": (np.array([0.0, 80.0]), np.array([0.0, 1e-3]), np.full(2, np.nan))}
    figure = draw_calibration(sd.Calibration("", CHAIN, VOLUME, TOOL, functions))
    assert not [c for c in panel(figure, "EXX").collections if isinstance(c, PolyCollection)]
    assert "no uncertainties in the file" in texts(figure)


def test_names_of_files_are_no_formulas(calibration: sd.Calibration) -> None:
    assert ink(draw_calibration(calibration, name="$x_{$.csv"))


def test_method_plot_draws_the_same(calibration: sd.Calibration) -> None:
    assert texts(calibration.plot()) == texts(draw_calibration(calibration))
    assert calibration.plot()._repr_png_()[:4] == b"\x89PNG"  # what a notebook shows
