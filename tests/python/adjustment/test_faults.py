"""Faults of readings are found, named in classes and corrected or reported; sound readings are left alone."""

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


@pytest.mark.slow
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
    assert [found.treatment for found in adjustment.faults] == ["left_out", "left_out"]
    assert is_sound_but_for_its_costs(adjustment)
    named = {(o.row, o.channel) for o in adjustment.outliers}
    assert named >= set(places)
    for found in adjustment.faults:
        # Distances may have a partner that no other reading tells from them (below); tilts have none.
        assert found.distinguished or {fault.channel for fault in found.members} == {"distance"}
        for fault in found.members:
            place = (fault.row, fault.channel)
            assert (fault.run, fault.line, fault.point) == (
                int(run.run[fault.row]),
                run.line[fault.row],
                int(run.point[fault.row]),
            )
            assert not adjustment.used[fault.channel][fault.row]
            if place in sizes:
                # Its uncertainty says how far off the size may be; five of them in one of a million.
                expected = sizes[place] * SIGMA[fault.channel]
                assert abs(fault.size - expected) < 5 * fault.standard_uncertainty

    # As good as without them: the same as if these readings had been lost.
    lost = adjust(spoilt(run, [(*place, np.nan) for place in named]), scenario)
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
    (found,) = ignored.faults  # the larger one hides nothing and is named; nothing is done about it
    assert (found.treatment, found.corrected, ignored.verdict.fit) == ("none", False, "rejected")


def test_distances_that_no_reading_tells_apart_are_both_left_out() -> None:
    """A distance enters two intervals; of each the four lines leave one residual, and another line may see both."""
    run, scenario = run_of(37, steps=20)
    rng = np.random.default_rng(37)
    pairs = 0
    for row in rng.choice(240, 8, replace=False):
        bad = spoilt(run, [(int(row), "distance", 30.0)])
        adjustment = adjust(bad, scenario)
        (found,) = adjustment.faults
        assert int(row) in {fault.row for fault in found.members}
        assert {o.row for o in adjustment.outliers} == {fault.row for fault in found.members}
        sizes = np.sort(np.abs(adjust(bad, scenario, outlier_probability=0.0).normalised_residuals["distance"]))
        is_pair = bool(sizes[-2] > 0.99 * sizes[-1])
        assert len(found.members) == 1 + is_pair
        assert found.distinguished == (not is_pair)
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


def test_where_a_fifth_of_the_distances_is_wrong_it_is_their_noise() -> None:
    run, scenario = run_of(35, steps=10)
    rng = np.random.default_rng(35)
    rows = rng.choice(124, 25, replace=False)
    adjustment = adjust(spoilt(run, [(int(r), "distance", float(rng.choice([-40, 40]))) for r in rows]), scenario)
    assert adjustment.outliers == []
    assert all(np.all(used[np.isfinite(run.channels[c])]) for c, used in adjustment.used.items() if c == "distance")
    assert adjustment.faults == []
    (reason,) = adjustment.verdict.reasons
    assert (adjustment.verdict.fit, reason.finding, reason.channel) == ("rejected", "noise_factor", "distance")
    assert abs(reason.value - np.sqrt(0.8 + 0.2 * 40.0**2)) < 3 * reason.standard_uncertainty


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


# --- slips, scale lines and gross values, on the workshop machine ----------------------------------------------------
def slipped(run: sd.Measurement, line: str, point: int, channel: str, size: float) -> sd.Measurement:
    """The channel reads `size` (mm or rad) too much from this point of the line on."""
    channels = {name: np.array(value) for name, value in run.channels.items()}
    channels[channel][(np.asarray(run.line) == line) & (run.point >= point)] += size
    return with_channels(run, channels)


def changed(run: sd.Measurement, places: list[tuple[str, int, str, float]]) -> sd.Measurement:
    """(line, point, channel, size in mm or rad): added."""
    channels = {name: np.array(value) for name, value in run.channels.items()}
    for line, point, channel, size in places:
        channels[channel][(np.asarray(run.line) == line) & (run.point == point)] += size
    return with_channels(run, channels)


def normalised(adjustment: sd.Adjustment, table: reference.ErrorTable) -> float:
    """The largest error of the calibration in its standard uncertainties."""
    found = adjustment.calibration
    errors = [
        np.abs(value - np.interp(position, *table.functions[name])) / np.maximum(u, 1e-9)
        for name, (position, value, u) in found.functions.items()
        if name not in found.undetermined_slopes
    ]
    of_squareness = [abs(value - table.squareness[name]) / u for name, (value, u) in found.squareness.items()]
    return max(float(np.max(np.concatenate(errors))), *of_squareness)


def is_sound_but_for_its_costs(adjustment: sd.Adjustment) -> bool:
    """Accepted, or doubtful for what was left out or freed alone."""
    costs = {reason.finding for reason in adjustment.verdict.reasons}
    return adjustment.verdict.fit == ("doubtful" if costs else "accepted") and costs <= {"undetermined", "fault_cost"}


def told(layout: str = "ideal") -> tuple[sd.Measurement, reference.Scenario, reference.ErrorTable]:
    rng = np.random.default_rng(41)
    scenario = random_scenario(rng, steps=20, layout=layout)
    table = random_table(rng, scenario.volume, scenario.steps, roughness=0.2)
    return noisy(measured(reference.simulate(scenario, table)), rng), scenario, table


# Of some 700 values of one run one stands beyond 4.5 in one of 200 sound runs.
SOUND = 4.5


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.05, 1.0])
def test_slip_of_a_body_diagonal_is_a_class_with_its_twin_and_rejected(size: float) -> None:
    run, scenario, table = told()
    bad = slipped(run, "npp", 31, "distance", size)
    adjustment = adjust(bad, scenario)
    (found,) = adjustment.faults
    assert ("slip", "npp", 31) in {(fault.kind, fault.line, fault.point) for fault in found.members}
    assert len({fault.line for fault in found.members}) > 1
    assert (found.treatment, found.corrected) == ("estimated", False)
    assert adjustment.verdict.fit == "rejected"
    assert "fault" in {reason.finding for reason in adjustment.verdict.reasons}
    # Estimated it is judged with the rest, and the truth is within what is said in either case.
    estimated = adjust(bad, scenario, slips="estimate")
    assert is_sound_but_for_its_costs(estimated)
    assert estimated.verdict.fit == "doubtful"  # a slip costs more than half of what a squareness is known to
    assert estimated.faults[0].corrected
    assert normalised(adjustment, table) < SOUND
    assert normalised(estimated, table) < SOUND
    if size < 1.0:  # else Gauss-Newton finds nothing with it
        assert normalised(adjust(bad, scenario, outlier_probability=0.0), table) > 10.0


def test_end_of_a_scale_line_may_be_any_of_the_three_or_a_factor_of_a_diagonal() -> None:
    run, scenario, table = told()
    small = adjust(changed(run, [("p00", 1, "distance", 10e-3)]), scenario)
    (found,) = small.faults
    by_kind = {kind: {f.line for f in found.members if f.kind == kind} for kind in ("reading", "factor")}
    assert by_kind == {"reading": {"p00", "0p0", "00p"}, "factor": {"ppp", "npp", "pnp", "nnp"}}
    assert found.treatment == "estimated"
    assert (small.verdict.fit, is_sound_but_for_its_costs(small)) == ("doubtful", True)
    assert normalised(small, table) < SOUND
    assert small.calibration.functions["EXX"][2][-1] > 3e-3  # what the alternatives differ by
    large = adjust(changed(run, [("p00", 1, "distance", 1.0)]), scenario)
    assert large.verdict.fit == "rejected"
    (reason,) = (r for r in large.verdict.reasons if r.finding == "alternatives")
    assert reason.value > reason.limit
    assert normalised(large, table) < SOUND


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
@pytest.mark.parametrize("size", [9.0, 1000.0, -400.0])
def test_gross_distance_is_found_and_does_no_harm(layout: str, size: float) -> None:
    run, scenario, table = told(layout)
    channel = "d1" if layout == "multi_beam" else "distance"
    bad = changed(run, [("ppp", 30, channel, size)])
    adjustment = adjust(bad, scenario)
    (found,) = adjustment.faults
    assert ("ppp", 30) in {(fault.line, fault.point) for fault in found.members}
    assert is_sound_but_for_its_costs(adjustment)
    assert normalised(adjustment, table) < SOUND


def test_gross_tilt_is_found_and_does_no_harm() -> None:
    run, scenario, table = told()
    adjustment = adjust(changed(run, [("npp", 12, "alpha", 10e-3)]), scenario)
    ((fault,),) = (found.members for found in adjustment.faults)
    assert (fault.line, fault.point, fault.channel) == ("npp", 12, "alpha")
    assert fault.size == pytest.approx(10e-3, abs=5 * fault.standard_uncertainty)
    assert adjustment.verdict.fit == "accepted"
    assert normalised(adjustment, table) < SOUND


def test_several_gross_readings_are_found_up_to_a_tenth_of_the_redundancy() -> None:
    """Distances of one run, 0.1 to 9 mm off, on steps of their own; some 48 of them are redundant."""
    run, scenario, table = told()
    places = [("ppp", 7, 0.1), ("npp", 21, -0.3), ("pnp", 40, 9.0), ("nnp", 47, 2.0), ("ppp", 33, -1.0)]
    four, five = (
        adjust(changed(run, [(line, p, "distance", size) for line, p, size in places[:count]]), scenario)
        for count in (4, 5)
    )
    assert len(four.faults) == 4
    for line, point, _ in places[:4]:
        assert any((line, point) in {(f.line, f.point) for f in found.members} for found in four.faults)
    assert is_sound_but_for_its_costs(four)
    assert normalised(four, table) < SOUND
    assert five.verdict.fit == "rejected"
    assert not any(found.corrected for found in five.faults)


def test_consecutive_rows_that_are_off_are_two_slips() -> None:
    run, scenario, table = told()
    bad = changed(run, [("pnp", p, "distance", 0.1) for p in range(30, 35)])
    adjustment = adjust(bad, scenario)
    assert [found.treatment for found in adjustment.faults] == ["estimated", "estimated"]
    assert {f.kind for found in adjustment.faults for f in found.members} == {"slip"}
    assert adjustment.verdict.fit == "rejected"
    assert adjust(bad, scenario, slips="estimate").verdict.fit == "rejected"  # other pairs may explain it as well
    assert normalised(adjustment, table) < SOUND


@pytest.mark.slow
@pytest.mark.parametrize("line", ["ppp", "nnp"])
@pytest.mark.parametrize("size", [1e-3, 9e-3])
def test_tilts_that_are_off_from_point_1_on_are_not_taken_for_a_wrong_first_one(line: str, size: float) -> None:
    """They act as the mirror's angle, which bends distances: a scale line must not be blamed for that."""
    run, scenario, table = told()
    adjustment = adjust(slipped(run, line, 1, "beta", size), scenario)
    (found,) = adjustment.faults
    assert (found.members[0].kind, found.members[0].line, found.members[0].point) == ("slip", line, 1)
    assert normalised(adjustment, table) < SOUND
    if found.distinguished:
        assert adjustment.verdict.fit == "rejected"
    else:  # both are unknowns, so that what they differ by is in the uncertainties
        assert [(fault.kind, fault.point) for fault in found.members] == [("slip", 1), ("reading", 0)]
        assert (found.treatment, is_sound_but_for_its_costs(adjustment)) == ("estimated", True)
    first = adjust(changed(run, [(line, 0, "beta", size)]), scenario)
    assert (first.faults[0].members[0].kind, first.faults[0].members[0].point) == ("reading", 0)
    assert is_sound_but_for_its_costs(first)
    assert normalised(first, table) < SOUND


def test_slip_from_point_1_on_is_the_same_as_a_wrong_first_distance() -> None:
    """The constant of a line's distances is free."""
    run, scenario, table = told()
    slip = adjust(slipped(run, "npp", 1, "distance", 0.02), scenario)
    reading = adjust(changed(run, [("npp", 0, "distance", -0.02)]), scenario)
    for adjustment in (slip, reading):
        (found,) = adjustment.faults
        members = {(f.kind, f.line, f.point): f for f in found.members}
        one, other = members["reading", "npp", 0], members["slip", "npp", 1]
        assert (one.size, one.chi_square_gain) == (-other.size, other.chi_square_gain)
        assert found.corrected
        assert is_sound_but_for_its_costs(adjustment)
        assert normalised(adjustment, table) < SOUND
    for name, (_, value, u) in slip.calibration.functions.items():
        assert np.max(np.abs(reading.calibration.functions[name][1] - value) - 1e-6 * u) <= 0  # both at their minimum


def test_wrong_distances_at_twins_do_no_harm_where_second_order_tells_one_of_them() -> None:
    """Without the one that was found, no other reading controls its twin any more."""
    run, scenario, table = told()
    small = adjust(changed(run, [("ppp", 7, "distance", 0.01)]), scenario)
    (twin,) = ({(f.line, f.point) for f in small.faults[0].members if f.kind == "reading"} - {("ppp", 7)},)
    ((line, point),) = twin
    bad = changed(run, [("ppp", 7, "distance", 9.0), (line, point, "distance", 0.1)])
    adjustment = adjust(bad, scenario)
    assert {(f.line, f.point) for f in adjustment.faults[0].members} == {("ppp", 7), (line, point)}
    assert adjustment.faults[0].treatment == "left_out"
    assert normalised(adjustment, table) < SOUND


def test_sound_runs_have_no_faults() -> None:
    """At the usual limit one run of 8,000 has one by chance."""
    rng = np.random.default_rng(42)
    scenario = random_scenario(rng, steps=10)
    clean = measured(reference.simulate(scenario, random_table(rng, scenario.volume, 10)))
    assert not any(adjust(noisy(clean, rng), scenario).faults for _ in range(100))
