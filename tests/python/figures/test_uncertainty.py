"""Figures of uncertainties: curves and budgets of a result, from Python as from its file; what a plan determines."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from ink import ink, panel, texts
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.figures.uncertainty import draw_observation, draw_uncertainty, read_drawn_uncertainty
from stepdiag.parameters import FUNCTIONS
from stepdiag.presentation.blocks import text_of
from stepdiag.presentation.uncertainty import uncertainty_blocks
from stepdiag.uncertainty.write import write_uncertainty

UNCERTAIN = SCENARIO + "[uncertainty]\ndistance_um = 0.1\nscale_ppm = 0.5\nreflector_urad = 300.0\n"


@pytest.fixture(scope="module")
def result() -> sd.montecarlo.UncertaintyResult:
    scenario = sd.parse_scenario(UNCERTAIN)
    return sd.montecarlo.evaluate_uncertainty(scenario, sd.montecarlo.UncertaintyRequest(samples=10_000))


def test_curves_are_standard_uncertainties_and_bars_are_shares_of_the_variance(
    result: sd.montecarlo.UncertaintyResult,
) -> None:
    figure = draw_uncertainty(result)
    assert all(count > 60 for count in ink(figure).values()), ink(figure)
    sampled, propagated = (np.asarray(x.standard_uncertainty) for x in (result.monte_carlo, result.propagation))
    names = np.array([output.name for output in result.outputs])
    for name in FUNCTIONS:
        factor = 1e6 if name[1] in "ABC" else 1e3
        curve, _, other, *_ = panel(figure, name).lines
        np.testing.assert_allclose(curve.get_ydata(), sampled[names == name] * factor, rtol=1e-15)
        np.testing.assert_allclose(other.get_ydata(), propagated[names == name] * factor, rtol=1e-15)
    bars = panel(figure, "budget at the node with the largest standard uncertainty").containers
    heights = np.array([[bar.get_height() for bar in group] for group in bars])
    assert heights.shape[1] == 21
    np.testing.assert_allclose(heights.sum(axis=0), 100.0, rtol=1e-12)
    budget = result.propagation.budget
    k = int(np.flatnonzero(names == "EXX")[np.argmax(propagated[names == "EXX"])])
    by_group = {group.get_label(): 100.0 * budget[group.get_label()][k] ** 2 for group in bars}
    expected = np.array(list(by_group.values())) / sum(by_group.values()) * 100.0
    column = [label.get_text().split("\n")[0] for label in bars[0][0].axes.get_xticklabels()].index("EXX")
    np.testing.assert_allclose(heights[:, column], expected, rtol=1e-9, atol=1e-12)  # of 100: rounding


@pytest.mark.slow
@pytest.mark.parametrize("name", [None, "u.nc", "u.csv"])
@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("", "positioning as found"),
        (
            "[temperature]\nexpansion_um_per_m_k = 11.5\nu_expansion_um_per_m_k = 1.0\nu_temperature_c = 0.1\n"
            "reference_c = 22.5\naxes_c = 24.0\n",
            "positioning referred to 22.5 °C",
        ),
    ],
)
def test_heading_says_whether_positioning_is_as_found(
    tmp_path: Path, name: str | None, section: str, words: str
) -> None:
    known = sd.parse_scenario(UNCERTAIN + section)
    result = sd.montecarlo.evaluate_uncertainty(known, sd.montecarlo.UncertaintyRequest())
    assert f"temperature: positioning errors are {words.removeprefix('positioning ')}" in list(
        text_of(uncertainty_blocks(result))
    )
    if name is not None:
        write_uncertainty(result, tmp_path / name)
    drawn = result if name is None else read_drawn_uncertainty(tmp_path / name)
    assert any(text.endswith(words) for text in texts(draw_uncertainty(drawn)))
    run, found = sd.observe(known)
    assert any(text.endswith(words) for text in texts(draw_observation(run, found, known.known)))


def test_file_gives_the_same_figure(result: sd.montecarlo.UncertaintyResult, tmp_path: Path) -> None:
    write_uncertainty(result, tmp_path / "u.nc")
    assert texts(draw_uncertainty(read_drawn_uncertainty(tmp_path / "u.nc"))) == texts(draw_uncertainty(result))
    assert texts(result.plot()) == texts(draw_uncertainty(result))


def test_csv_file_gives_the_same_curves_and_says_where_the_budget_is(
    result: sd.montecarlo.UncertaintyResult, tmp_path: Path
) -> None:
    write_uncertainty(result, tmp_path / "u.csv")
    figure, whole = draw_uncertainty(read_drawn_uncertainty(tmp_path / "u.csv")), draw_uncertainty(result)
    for name in FUNCTIONS:
        for line, expected in zip(panel(figure, name).lines, panel(whole, name).lines, strict=True):
            # One rounding each way between rad and the file's µrad.
            np.testing.assert_allclose(line.get_xydata(), expected.get_xydata(), rtol=1e-15)
    assert "the sources of these uncertainties (budget) are in netCDF files (.nc), not in CSV files" in texts(figure)
    assert len(figure.axes) == len(whole.axes) - 1


def test_csv_file_of_the_propagation_alone_is_drawn(tmp_path: Path) -> None:
    result = sd.montecarlo.evaluate_uncertainty(
        sd.parse_scenario(UNCERTAIN), sd.montecarlo.UncertaintyRequest(points=(((1.0, 2.0, 3.0), None),))
    )
    write_uncertainty(result, tmp_path / "u.csv")
    drawn = read_drawn_uncertainty(tmp_path / "u.csv")
    assert not drawn.sampled
    assert len(drawn.propagated) == 21, "without the error at the point"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("EXX,0.0,um", "EXX,,um", "position_mm: expected a number for functions alone, got ''"),
        ("EXX,0.0,um", "EXX,near,um", "position_mm: expected a finite number, got 'near'"),
        ("EXX,0.0,um", "EXX,0.0,mm", "unit: expected um for EXX, got 'mm'"),
        ("EXX,16.0,um", "EXX,0.0,um", "expected positions of EXX that ascend, got 0.0"),
        (
            "EXX,0.0,um,0.0,0.0,",
            "EXX,0.0,um,0.0,-1.0,",
            "propagated_standard_uncertainty: expected at least 0, got -1.0",
        ),
        ("EXX,0.0,um", 'EXX,0.0,"u"m', "not valid CSV"),
        ("EXX,0.0,um", "EXX,um", "fields, as in the header"),
        ("volume_mm=80", "volume_mm=", "volume_mm: expected three numbers"),
        ("propagated_standard_uncertainty", "u", "u.csv: expected standard uncertainties of EXX ... A0Z, got none"),
        ("# format=stepdiag uncertainty 1", "# format=stepdiag uncertainty 9", "format: expected"),
    ],
)
def test_damaged_csv_files_are_refused(old: str, new: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "u.csv"
    write_uncertainty(
        sd.montecarlo.evaluate_uncertainty(sd.parse_scenario(UNCERTAIN), sd.montecarlo.UncertaintyRequest()), path
    )
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(sd.InvalidArgument, match=re.escape(message)):
        read_drawn_uncertainty(path)


def test_observation_shows_what_is_determined_and_what_is_not() -> None:
    scenario = sd.parse_scenario(SCENARIO.replace('"ppp", "npp", "pnp", "nnp"', '"ppp", "npp"'))
    run, found = sd.observe(scenario)
    figure = draw_observation(run, found, scenario.known)
    calibration = found.calibration
    missing = [name for name in FUNCTIONS if name not in calibration.functions]
    assert missing
    for name in FUNCTIONS:
        assert bool(panel(figure, name).texts) == (name in missing)
    for name, (_, _, u) in calibration.functions.items():
        if name not in ("EYY", "EZZ"):  # determined at some of the positions
            factor = 1e6 if name[1] in "ABC" else 1e3
            np.testing.assert_allclose(panel(figure, name).lines[0].get_ydata(), u * factor, rtol=1e-15)
    assert any(text.startswith("undetermined: ") for text in texts(figure))
