"""What is named and what is not: sound and noisy runs, two mistakes at once, faults of single readings, lost lines."""

from dataclasses import replace

import numpy as np
import pytest
from mistaken import NOISE, changed, described, rows_of, simulated, step_plan

import stepdiag as sd
from stepdiag._core import fit_quality
from stepdiag.findings.mistakes import mistake_text
from stepdiag.mistakes.search import MistakeSearch
from stepdiag.scenario.description import adjustment_options

HEADS = ["ideal", "psd", "multi_beam"]


@pytest.mark.parametrize("head", HEADS)
def test_quick_fit_is_that_of_the_adjustment(head: str) -> None:
    scenario = described(head, steps=5)
    run, known = simulated(scenario, seed=2), scenario.known
    options = adjustment_options(known)
    quick = fit_quality(run, known.plan, known.head, known.chain, known.tool, options, 30)
    adjusted = sd.methods.adjust_scenario(scenario, run)
    assert quick is not None
    assert quick.degrees_of_freedom == adjusted.degrees_of_freedom
    assert quick.weighted_square_sum == pytest.approx(adjusted.weighted_square_sum, rel=1e-8)
    # What the search relies on: a run that fits is told from the others after a few steps.
    screened = fit_quality(run, known.plan, known.head, known.chain, known.tool, options, 3)
    assert screened is not None
    assert screened.weighted_square_sum < 4.0 * quick.weighted_square_sum
    enough = fit_quality(run, known.plan, known.head, known.chain, known.tool, options, 8)
    assert enough is not None
    assert enough.weighted_square_sum == pytest.approx(quick.weighted_square_sum, abs=0.1)  # of gains of 60


@pytest.mark.slow
@pytest.mark.parametrize("head", HEADS)
@pytest.mark.parametrize("noise", [1.0, 1.5, 4.0])
def test_nothing_is_named_where_there_is_no_mistake(head: str, noise: float) -> None:
    scenario = described(head, steps=6)
    for seed in range(3):
        assert sd.find_mistakes(scenario, simulated(scenario, seed=seed, noise=noise)) == []


def test_readings_made_smaller_explain_nothing() -> None:
    """Their noise falls with them, of which a machine without angles would have little else."""
    scenario = described("ideal", steps=10)
    known = scenario.known
    machine = sd.Machine(known.chain, sd.ErrorMap({}, {}))
    run = sd.simulate(machine, known.plan, known.head, noise=sd.Noise(seed=1, **{n: 1.3 * v for n, v in NOISE.items()}))
    assert sd.find_mistakes(scenario, run) == []


def test_a_gain_is_not_larger_because_smaller_readings_fit_better() -> None:
    scenario = described("ideal", steps=50)
    run = simulated(scenario, seed=0)
    found = sd.find_mistakes(scenario, changed(run, {n: 1.2 * run.channels[n] for n in ("alpha", "beta")}))
    assert [(one.entry, one.fit) for one in found] == [("near factor", "accepted")]
    assert found[0].text.startswith("alpha and beta are too large by a factor of 1.1")


def test_two_mistakes_at_once_are_named() -> None:
    scenario = described("ideal", steps=6)
    run = simulated(scenario, seed=5, plan=step_plan(6, order="ZYX"))
    found = sd.find_mistakes(scenario, changed(run, {"alpha": -run.channels["alpha"]}))
    assert {one.entry for one in found} == {"order, sign"}
    assert found[0].text == "the step order is ZYX, not XYZ, and alpha has the wrong sign on all lines"
    assert found[0].fit == "accepted"


def test_mistakes_that_act_alike_are_named_together() -> None:
    """On these beams an exchange of d2 and d3 is a mirrored layout."""
    scenario = described("multi_beam", steps=6)
    run = simulated(scenario, seed=5)
    channels = run.channels
    found = sd.find_mistakes(scenario, changed(run, {"d2": channels["d3"], "d3": channels["d2"]}))
    # So is one of the lines: distances alone do not tell which hand the frame has.
    assert [one.entry for one in found] == ["exchanged", "mirrored", "axes reversed"]


@pytest.mark.parametrize("size", [0.02, 5.0])
def test_a_single_wrong_reading_is_no_mistake_of_the_catalogue(size: float) -> None:
    scenario = described("ideal", steps=6)
    run = simulated(scenario, seed=5)
    distance = run.channels["distance"].copy()
    distance[rows_of(run, "npp")[8]] += size
    wrong = changed(run, {"distance": distance})
    adjustment = sd.methods.adjust_scenario(scenario, wrong)
    assert adjustment.faults
    assert sd.find_mistakes(scenario, wrong, adjustment) == []


def test_a_slip_is_named_by_the_faults_alone() -> None:
    scenario = described("ideal", steps=6)
    run = simulated(scenario, seed=5)
    distance = run.channels["distance"].copy()
    distance[rows_of(run, "npp")[8:]] += 0.02
    wrong = changed(run, {"distance": distance})
    adjustment = sd.methods.adjust_scenario(scenario, wrong)
    assert adjustment.verdict.fit == "rejected"
    assert sd.find_mistakes(scenario, wrong, adjustment) == []


def test_a_disturbed_stretch_is_found_where_nothing_says_what_it_was() -> None:
    scenario = described("ideal", steps=6)
    run, rng = simulated(scenario, seed=5), np.random.default_rng(1)
    rows = rows_of(run, "pnp")[4:11]
    fields = {name: values.copy() for name, values in run.channels.items()}
    fields["distance"][rows] += 0.05 * rng.normal(size=len(rows))
    fields["alpha"][rows] += 5e-5 * rng.normal(size=len(rows))
    (found,) = sd.find_mistakes(scenario, changed(run, fields))
    assert found.entry == "disturbed"
    assert found.text.startswith("the readings of line pnp from point 4 to point 10 do not go with the others")


def test_same_names_on_any_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = described("psd", steps=5)
    run = simulated(scenario, seed=5)
    wrong = changed(run, {"spot_x": -run.channels["spot_x"]})
    several = sd.find_mistakes(scenario, wrong)
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    assert sd.find_mistakes(scenario, wrong) == several


def test_a_factor_on_one_line_is_named_once() -> None:
    """The adjustment finds it as a fault; a mistake that no reading tells from it refers to that."""
    scenario = described("ideal", steps=6)
    run = simulated(scenario, seed=5)
    factors = np.ones(len(run))
    factors[rows_of(run, "npp")] = 1.00005
    wrong = changed(run, {"distance": run.channels["distance"] * factors})
    adjustment = sd.methods.adjust_scenario(scenario, wrong)
    assert {fault.kind for found in adjustment.faults for fault in found.members} >= {"factor"}
    (found,) = sd.find_mistakes(scenario, wrong, adjustment)
    assert "on the scale lines" in found.text
    assert "or the faults that were found happened instead (" in mistake_text([found])
    # Without an adjustment nobody else says so.
    assert any("on line npp has a factor" in found.text for found in sd.find_mistakes(scenario, wrong))


@pytest.mark.parametrize("channel", ["distance", "alpha"])
def test_a_reading_that_is_no_length_warns_of_nothing(channel: str, recwarn: pytest.WarningsRecorder) -> None:
    scenario = described("ideal", steps=6)
    run = simulated(scenario, seed=5)
    values = run.channels[channel].copy()
    values[4] = 1e308
    sd.find_mistakes(scenario, changed(run, {channel: values}))
    assert not recwarn.list


def test_a_gross_mistake_is_known_before_the_adjustment() -> None:
    scenario = described("ideal", steps=6)
    run = simulated(scenario, seed=5)
    wrong = changed(run, {"alpha": -run.channels["alpha"]})
    (found,) = MistakeSearch(scenario, wrong).before()
    assert found.text == "alpha has the wrong sign on all lines"
    adjustment = sd.methods.adjust_scenario(scenario, wrong, search_faults=False)
    assert adjustment.faults == []
    assert adjustment.verdict.fit == "rejected"


@pytest.mark.parametrize(("size", "row"), [(5.0, 8), (5.0, -1), (0.1, 3)])
def test_gross_faults_are_not_taken_for_a_mistake(size: float, row: int) -> None:
    scenario = described("ideal", steps=6)
    run = simulated(scenario, seed=5)
    distance = run.channels["distance"].copy()
    distance[rows_of(run, "npp")[row]] += size
    assert MistakeSearch(scenario, changed(run, {"distance": distance})).before() == []


def test_of_many_alternatives_some_are_counted() -> None:
    one = sd.results.FoundMistake("sign", "alpha has the wrong sign", "change it", "accepted", 1.0, 90.0)
    text = mistake_text([replace(one, alternatives=3), one])
    assert text.startswith("either alpha has the wrong sign; or alpha has the wrong sign; or one of 3 more; with")


@pytest.mark.slow
@pytest.mark.parametrize("few", [True, False])
def test_mistakes_of_many_runs_are_those_of_all(few: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is screened by two of six runs is named as by all six: in all, in one of them, with a number of its own."""
    scenario = described("ideal", steps=4)
    run = repeated(scenario, 6)
    alpha, distance = run.channels["alpha"], run.channels["distance"]
    backwards = np.arange(len(run))
    one = np.flatnonzero((run.run == 4) & (np.array(run.line) == "npp"))
    backwards[one] = one[::-1]
    if few:
        monkeypatch.setattr("stepdiag.mistakes.search.SAMPLE", len(run) // 3)
    assert sd.find_mistakes(scenario, run) == []
    assert sd.find_mistakes(scenario, changed(run, {"alpha": -alpha}))[0].entry == "sign"
    assert "npp" in sd.find_mistakes(scenario, changed(run, {"distance": distance[backwards]}))[0].text
    factor = sd.find_mistakes(scenario, changed(run, {"alpha": 1.3 * alpha, "beta": 1.3 * run.channels["beta"]}))
    assert "1.3" in factor[0].text


def repeated(scenario: sd.Scenario, runs: int) -> sd.Measurement:
    """Runs of one machine, each with set-ups and noise of its own."""
    single = [simulated(scenario, seed=seed, machine=1) for seed in range(runs)]
    return sd.Measurement(
        [line for run in single for line in run.line],
        [point for run in single for point in run.point.tolist()],
        np.concatenate([run.position for run in single]),
        {name: np.concatenate([run.channels[name] for run in single]) for name in single[0].channels},
        run=[k for k, run in enumerate(single) for _ in run.line],
    )
