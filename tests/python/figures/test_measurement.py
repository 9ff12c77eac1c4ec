"""The figure of a measurement shows every reading once, and marks what its adjustment has found to be wrong."""

from __future__ import annotations

import numpy as np
import pytest
from calibrations import full_run, simulate
from ink import ink, labels, panel, texts
from matplotlib.figure import Figure
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.figures.measurement import draw_measurement


@pytest.fixture(scope="module")
def scenario() -> sd.Scenario:
    return sd.parse_scenario(SCENARIO.replace("steps = 5", "steps = 20") + "tilt_urad = 1.0\n")


def changed(run: sd.Measurement, channel: str, rows: np.ndarray, size: float) -> sd.Measurement:
    channels = {name: np.array(values) for name, values in run.channels.items()}
    channels[channel][rows] += size
    return sd.Measurement(run.line, run.point.tolist(), run.position, channels)


def rows_of(run: sd.Measurement, line: str) -> np.ndarray:
    return np.flatnonzero(np.asarray(run.line) == line)


def marked(figure: Figure, what: str) -> set[tuple[int, str]]:
    """(row, channel) of the marks whose id begins so."""
    ids = [artist.get_gid() for artist in figure.findobj() if (artist.get_gid() or "").startswith(f"{what}-")]
    return {(int(row), channel) for _, row, channel in (name.split("-") for name in ids)}


def test_every_line_and_channel_has_ink_and_units(scenario: sd.Scenario) -> None:
    run = sd.simulate(scenario)
    figure = draw_measurement(run)
    found = ink(figure)
    assert found.keys() == {f"{line}  {channel}" for line in dict.fromkeys(run.line) for channel in run.channels}
    assert min(found.values()) > 50, found
    assert set(labels(figure)) == {
        "position along line (mm)",
        "deviation of distance (µm)",
        "alpha (µrad)",
        "beta (µrad)",
    }


def test_deviation_of_a_distance_is_the_error_along_the_line() -> None:
    """A machine with a scale error of 100 ppm in X alone, on the line p00: the reading is 100 ppm too long."""
    length = 80.0
    errors = sd.ErrorMap({"EXX": ([0.0, length], [0.0, 1e-4 * length])})
    plan = sd.Plan((length, 60.0, 50.0), ["p00", "ppp"], 4)
    run = sd.simulate(sd.Machine("[w X' b Y Z t]", errors), plan, sd.Head())
    along, deviation = panel(draw_measurement(run), "p00  distance").lines[0].get_xydata().T
    np.testing.assert_allclose(along, np.linspace(0.0, length, 5), rtol=1e-12)
    np.testing.assert_allclose(deviation, 1e-4 * along * 1e3, atol=1e-6)  # µm; the path differs by 1e-9 of 8 µm


def test_lost_readings_and_directions_are_shown() -> None:
    run = full_run()
    figure = draw_measurement(run)
    assert {"forward", "backward", "lost reading"} <= set(texts(figure))
    line = run.line[17]
    values = np.concatenate([x.get_ydata() for x in panel(figure, f"{line}  distance").lines if len(x.get_xdata()) > 2])
    assert np.isnan(values).sum() == 1


def test_residuals_are_those_of_the_adjustment(scenario: sd.Scenario) -> None:
    run = sd.simulate(scenario)
    found = sd.methods.adjust_scenario(scenario, run)
    figure = draw_measurement(run, found)
    for channel, factor in (("distance", 1e3), ("alpha", 1e6), ("beta", 1e6)):
        for line in dict.fromkeys(run.line):
            drawn = panel(figure, f"{line}  {channel}").lines[0].get_ydata()
            np.testing.assert_allclose(drawn, found.residuals[channel][rows_of(run, line)] * factor, rtol=1e-15)
    assert marked(figure, "outlier") == set()
    assert "fit accepted" in texts(figure)


def test_marked_outliers_and_slips_are_those_of_the_adjustment(scenario: sd.Scenario) -> None:
    run = sd.simulate(scenario)
    run = changed(run, "alpha", rows_of(run, "pnp")[[10]], 4e-5)
    run = changed(run, "distance", rows_of(run, "npp")[25:], 5e-3)
    found = sd.methods.adjust_scenario(scenario, run)
    figure = draw_measurement(run, found)
    assert found.outliers
    assert marked(figure, "outlier") == {(o.row, o.channel) for o in found.outliers}
    slips = {(f.row, f.channel) for c in found.faults for f in c.members if f.kind == "slip"}
    assert slips
    assert marked(figure, "slip") == slips
    numbers = {str(k) for k in range(1, len(found.faults) + 1)}
    assert numbers <= {text.split(" ")[0] for text in texts(figure)}
    assert sum(text.startswith("fault ") for text in texts(figure)) >= len(found.faults)
    assert found.verdict.fit != "rejected" or "FIT REJECTED: DO NOT USE" in texts(figure)


def test_gross_outlier_does_not_flatten_the_others(scenario: sd.Scenario) -> None:
    run = sd.simulate(scenario)
    run = changed(run, "alpha", rows_of(run, "pnp")[[10]], 1e-2)
    found = sd.methods.adjust_scenario(scenario, run)
    figure = draw_measurement(run, found)
    largest = 1e6 * np.max(np.abs(found.residuals["alpha"][found.used["alpha"]]))
    low, high = panel(figure, "pnp  alpha").get_ylim()
    assert -3.0 * largest < low < -largest
    assert largest < high < 3.0 * largest


def test_empty_sheet_and_foreign_adjustment_are_refused(scenario: sd.Scenario) -> None:
    run = sd.simulate(scenario)
    empty = changed(run, "distance", np.arange(len(run)), np.nan)
    empty = changed(empty, "alpha", np.arange(len(run)), np.nan)
    empty = changed(empty, "beta", np.arange(len(run)), np.nan)
    with pytest.raises(sd.InvalidArgument, match="with readings, got empty fields only"):
        draw_measurement(empty)
    with pytest.raises(sd.InvalidArgument, match="`adjustment`: expected that of this measurement of"):
        draw_measurement(simulate(1), sd.methods.adjust_scenario(scenario, run))


def test_method_plot_draws_the_same(scenario: sd.Scenario) -> None:
    run = sd.simulate(scenario)
    assert texts(run.plot()) == texts(draw_measurement(run))
    found = sd.methods.adjust_scenario(scenario, run)
    assert texts(run.plot(adjustment=found)) == texts(draw_measurement(run, found))
