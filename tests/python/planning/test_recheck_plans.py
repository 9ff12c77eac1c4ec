"""`plan --recheck`: which short run shows what may have changed."""

import csv
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from refusal import refused
from scipy.stats import chi2, ncx2

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.config.scenario_keys import TruthKeys
from stepdiag.planning.observation import not_measured
from stepdiag.planning.recheck_plans import POWER, Power, candidates, choose, common_steps, front, own_limit, powers
from stepdiag.rechecking.recheck import Judged, changes_seen
from stepdiag.rechecking.verification import ALPHA
from stepdiag.scenario.description import Scenario, parse_scenario, simulate_scenario
from stepdiag.scenario.truth import truth_of

SCENARIO = """
[volume]
x_mm = 400.0
y_mm = 300.0
z_mm = 250.0
[machine]
chain = "[w X' b Y Z t]"
random = { seed = 5, intervals = 6 }
[head]
layout = "ideal"
[noise]
distance_um = 0.2
tilt_urad = 1.0
[adjustment]
lateral_mm = "fixed"
roll_urad = "fixed"
gain = "fixed"
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
scale_lines = ["p00", "0p0", "00p"]
steps = 6
[plan_by_time]
line_change_min = 0.5
repeats = [1, 2]
"""
MINUTES = 5.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recheck")
    (folder / "scenario.toml").write_text(SCENARIO)
    assert main(["simulate", str(folder / "scenario.toml"), "-o", str(folder / "run.csv")]) == 0
    arguments = [str(folder / name) for name in ("scenario.toml", "run.csv")]
    assert main(["evaluate", *arguments, "-o", str(folder / "calibration.nc")]) == 0
    return folder


@pytest.fixture(scope="module")
def baseline(folder: Path) -> sd.Calibration:
    return sd.read_calibration(folder / "calibration.nc")


@pytest.fixture(scope="module")
def scenario(folder: Path) -> sd.Scenario:
    return sd.read_scenario(folder / "scenario.toml")


@pytest.fixture(scope="module")
def found(scenario: sd.Scenario, baseline: sd.Calibration) -> list[Power]:
    return powers(scenario, baseline, MINUTES)


def test_smallest_change_seen_is_that_of_the_noncentral_distribution(
    scenario: sd.Scenario, baseline: sd.Calibration
) -> None:
    """With SciPy's: at the smallest change the test has the stated power."""
    run = sd.simulate(scenario)
    found = sd.recheck(baseline, scenario, run)
    weights = np.array([one.weight for one in found.combinations])
    u = np.array([one.standard_uncertainty for one in found.combinations])
    for alpha, power in ((0.001, 0.95), (0.05, 0.5)):
        smallest = found.smallest_changes_seen(alpha=alpha, power=power)
        in_priors = smallest / [term.prior for term in found.terms]
        noncentrality = ((weights * in_priors / u[:, None]) ** 2).sum(axis=0)
        limit = chi2.isf(alpha, len(u))
        np.testing.assert_allclose(ncx2.sf(limit, len(u), noncentrality), power, rtol=1e-7)
    refused(found.smallest_changes_seen, alpha=0.5, power=0.4, names="0 < alpha < power < 1")


def test_shape_is_what_terms_add_to_the_entries(scenario: sd.Scenario, baseline: sd.Calibration) -> None:
    """By the closed forms of docs/verify.md."""
    found = sd.recheck(baseline, scenario, sd.simulate(scenario))
    for term, added in zip(found.terms, found.shape.T, strict=True):
        for (parameter, position), value in zip(baseline.covariance_labels, added, strict=True):
            share = 0.0 if position is None else position / baseline.volume["XYZ".index(term.parameter[2])]
            expected = {"scale": position, "bow": 4 * share * (1 - share), "slope": share, "squareness": 1.0}
            assert value == pytest.approx(expected[term.kind] if parameter == term.parameter else 0.0, abs=1e-9)


@pytest.mark.parametrize("more", ["", "backward = true\n", "one_setup_per_line = true\n"])
def test_plans_show_what_a_recheck_of_their_readings_does(folder: Path, baseline: sd.Calibration, more: str) -> None:
    section = "[adjustment]\n" if "one" in more else "[plan]\n"
    scenario = parse_scenario(SCENARIO.replace(section, section + more))
    for one in powers(scenario, baseline, MINUTES)[::5]:
        plan = one.candidate
        changes = {
            "lines": plan.lines,
            "scale_lines": plan.scale_lines,
            "steps": plan.steps,
            "repeats": plan.repeats,
            "check_points": 0,
        }
        planned = not_measured(scenario.known, changes)
        run = simulate_scenario(Scenario(planned, truth_of(TruthKeys(), {}, planned)), baseline.to_error_map())
        if one.trouble:
            refused(sd.recheck, baseline, planned, run, names=one.trouble)
            continue
        found = sd.recheck(baseline, planned, run)
        moved = np.array(one.gains) > 0.0
        # A laser's angle that the readings hardly tell is where a recheck happens to end.
        np.testing.assert_allclose(
            np.array(one.smallest)[moved], found.smallest_changes_seen(power=POWER)[moved], rtol=1e-3
        )
        judged = Judged(found, baseline, ALPHA)
        assert one.hidden == pytest.approx(judged.hidden, rel=1e-3)


def test_lines_that_no_run_has_are_refused(scenario: sd.Scenario, baseline: sd.Calibration) -> None:
    planned = not_measured(scenario.known, {"repeats": 1})
    seen = changes_seen(baseline, planned, sd.simulate(scenario))
    refused(seen.by, ["pp0"], [], names='the run has no line "pp0"')
    refused(seen.by, [], [], names="lines: expected at least one")
    refused(seen.by, ["ppp"], [], repeats=0, names="repeats: expected at least 1, got 0")
    refused(seen.by, ["ppp"], [], alpha=0.5, power=0.4, names="0 < alpha < power < 1")


def test_points_of_plans_are_nodes_of_the_baseline(scenario: sd.Scenario, baseline: sd.Calibration) -> None:
    assert common_steps(baseline) == [2, 3, 6]
    some = candidates(scenario, baseline, MINUTES)
    assert {one.steps for _, one in some} == {2, 3, 6}
    assert [seconds for seconds, _ in some] == sorted(seconds for seconds, _ in some)


def test_more_of_a_plan_shows_smaller_changes(found: list[Power]) -> None:
    by_plan = {
        (one.candidate.lines, one.candidate.scale_lines, one.candidate.steps, one.candidate.repeats): one
        for one in found
    }
    for (lines, scales, steps, repeats), one in by_plan.items():
        twice = by_plan.get((lines, scales, steps, 2 * repeats))
        if twice is not None:
            # What is not a number: of terms that neither of them shows.
            assert not np.any(np.array(twice.smallest) > np.array(one.smallest) * (1.0 + 1e-6))
            assert twice.seconds > one.seconds


def test_chosen_plan_leaves_the_fewest_terms_unseen(found: list[Power], baseline: sd.Calibration) -> None:
    limit = own_limit(baseline)
    taken = choose(found, MINUTES, limit)
    assert taken is not None
    assert taken.minutes <= MINUTES
    in_time = [one for one in found if one.minutes <= MINUTES]
    assert len(taken.unseen(limit)) == min(len(one.unseen(limit)) for one in in_time)
    assert choose(found, 0.1, limit) is None
    plans = front(found, limit)
    assert [one.seconds for one in plans] == sorted(one.seconds for one in plans)
    assert all(
        later.left < earlier.left or len(later.unseen(limit)) < len(earlier.unseen(limit))
        for earlier, later in pairwise(plans)
    )


def test_command_says_which_plan_and_what_it_shows(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["plan", str(folder / "scenario.toml"), "--recheck", str(folder / "calibration.nc"), "--minutes", "5"]
    capsys.readouterr()
    assert main([*words, "-o", str(folder / "plans.csv")]) == 0
    said = capsys.readouterr().out
    assert "\ntake: " in said
    assert "  C0Y (squareness) " in said
    rows = list(csv.DictReader((folder / "plans.csv").open()))
    assert len(rows) > 20
    assert {row["steps"] for row in rows} == {"2", "3", "6"}
    assert main([*words, "-o", str(folder / "plans.svg")]) == 0
    assert (folder / "plans.svg").read_text().count("smallest change seen") == 4
    assert main([*words, "--limit", "1e6"]) == 0
    assert "\nany one change that moves the tool by 1e+06 µm is seen" in capsys.readouterr().out


def test_what_cannot_be_planned_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario, baseline = str(folder / "scenario.toml"), str(folder / "calibration.nc")
    assert main(["plan", scenario, "--limit", "3"]) == 2
    assert "--limit: expected --recheck as well" in capsys.readouterr().err
    assert main(["plan", scenario, "--recheck", baseline, "--minutes", "0.1"]) == 2
    assert "no plan fits 0.2 minutes: see line_change_min" in capsys.readouterr().err
    assert main(["plan", scenario, "--recheck", baseline, "-o", baseline]) == 2
