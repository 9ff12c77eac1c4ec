"""`stepdiag plan`: how long plans take, by hand, and that what it says of them is what runs of them give."""

import csv
import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ROOT, SHIPPED_HEADS
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag._core import InvalidArgument
from stepdiag.calibration.largest_by_kind import largest_uncertainties
from stepdiag.cli import main
from stepdiag.figures.plan_by_time import draw_plans
from stepdiag.planning.best_plan import best_plans
from stepdiag.planning.measuring_time import Times, measuring_time, times_of
from stepdiag.planning.observation import not_measured
from stepdiag.planning.plan_by_time import (
    Aim,
    Candidate,
    Outcome,
    choose,
    complete,
    distinguishing,
    evaluate,
    front,
    outcome,
    own_candidate,
    settings,
    stated_candidates,
)
from stepdiag.planning.scenario_with_plan import scenario_with_plan
from stepdiag.presentation.plan_by_time import (
    advice,
    fault_advice,
    inputs_row,
    left_out_rows,
    plan_csv,
    plan_rows,
    shown,
)
from stepdiag.scenario.description import Scenario, parse_scenario
from stepdiag.scenario.known import Known

FEW = """
[plan_by_time]
steps = [5, 10]
repeats = [1, 2]
line_change_min = 2.0
"""
SETS = 'line_sets = [["ppp", "npp", "pnp", "nnp", "p00", "0p0"], ["pp0", "np0", "p0p", "n0p", "0pp", "0np"]]\n'
AT_ONCE = Times(feed=100.0, acceleration=math.inf, settle=1.0, measure=2.0, line_change=60.0, scale_line_change=30.0)


# --- time ------------------------------------------------------------------------------------------------------------
def test_short_move_never_reaches_the_feed() -> None:
    times = Times(feed=100.0, acceleration=1000.0, settle=0.0, measure=0.0, line_change=0.0, scale_line_change=0.0)
    # Full speed takes 5 mm to reach and 5 mm to leave: 2.5 mm are 2 sqrt(2.5/1000) s, 110 mm are 0.2 s and 1 s.
    np.testing.assert_allclose(times.move(np.array([0.0, 2.5, 10.0, 110.0])), [0.0, 0.1, 0.2, 1.2], rtol=1e-15)


def test_time_of_a_plan_is_that_of_its_set_ups_moves_and_readings() -> None:
    plan = sd.Plan((800.0, 600.0, 500.0), ["ppp", "npp"], 2, scale_lines=["p00"])
    seconds, between = measuring_time(plan, AT_ONCE)
    # Home is the first point of ppp; its end (800, 600, 500) is 781.02 mm from the beginning of npp, (800, 0, 0); the
    # end of that one, (0, 600, 500), as far from the scale line's.
    back = 2 * math.hypot(600.0, 500.0) / 100.0
    moves = (2 * 1900.0 + 800.0) / 100.0
    assert seconds == pytest.approx(2 * 60.0 + 30.0 + back + moves + (2 * 7 + 2) * 3.0)
    assert between == pytest.approx((moves + 13 * 3.0) / 13)


def test_runs_after_the_first_go_back_to_the_beginning_and_backward_runs_do_not() -> None:
    plan = sd.Plan((800.0, 600.0, 500.0), ["ppp"], 2)
    once = measuring_time(plan, AT_ONCE)[0]
    run = 19.0 + 7 * 3.0
    assert once == pytest.approx(60.0 + run)
    assert measuring_time(plan, AT_ONCE, repeats=2)[0] == pytest.approx(60.0 + 2 * run + math.sqrt(1.25e6) / 100.0)
    assert measuring_time(plan, AT_ONCE, backward=True)[0] == pytest.approx(60.0 + 2 * run)


def test_seconds_per_mm_stand_in_place_of_the_feed() -> None:
    scenario = parse_scenario(SCENARIO + "[plan_by_time]\nseconds_per_mm = 0.02\nline_change_min = 4.0\n")
    times = times_of(scenario.known.keys.plan_by_time, "")
    assert times.move(np.array([100.0])) == pytest.approx(2.0)
    assert times.scale_line_change == times.line_change == 240.0
    both = parse_scenario(SCENARIO + "[plan_by_time]\nseconds_per_mm = 0.02\nfeed_mm_per_min = 100.0\n")
    with pytest.raises(sd.InvalidArgument, match=r"seconds_per_mm: expected it or feed_mm_per_min, got both"):
        times_of(both.known.keys.plan_by_time, "")


# --- plans -----------------------------------------------------------------------------------------------------------
def test_plan_of_the_scenario_has_the_uncertainties_of_its_run() -> None:
    scenario = parse_scenario(SCENARIO)
    plan = scenario.known.plan
    # A plan knows the time of each reading, and so what is known of drift counts.
    _, between = measuring_time(plan, times_of(scenario.known.keys.plan_by_time, ""))
    timed = SCENARIO.replace("distance_um = 0.1", "distance_um = 0.0")
    noiseless = parse_scenario(timed.replace("[plan]", f"[plan]\nseconds_per_reading = {between!r}"))
    found = outcome(scenario, Candidate(tuple(plan.lines), tuple(plan.scale_lines), plan.steps, 1))
    expected = largest_uncertainties(sd.methods.evaluate_scenario(scenario, sd.simulate(noiseless)))
    assert found.largest == pytest.approx({kind: value for kind, (value, _) in expected.items()}, rel=1e-9)
    assert len(found.determined) == 21
    assert found.spacing == 16.0


@pytest.mark.parametrize(
    ("lines", "scale_lines"),
    [
        (("ppp", "npp", "pnp", "nnp"), ("p00", "0p0", "00p")),
        (("ppp", "npp", "pnp", "nnp"), ()),
        (("ppp", "npp"), ("00p",)),
        (("pp0", "np0"), ("p00",)),  # Z does not move
        (("pp0", "np0", "p0p", "n0p", "0pp", "0np"), ()),
    ],
)
@pytest.mark.parametrize("backward", [False, True])
def test_without_tests_of_the_readings_a_plan_gives_the_same(
    lines: tuple[str, ...], scale_lines: tuple[str, ...], backward: bool
) -> None:
    """Faults take the adjustment with its tests and the covariance of all values."""
    scenario = parse_scenario(SCENARIO + FEW)
    plan = replace(own_candidate(scenario.known), lines=lines, scale_lines=scale_lines, backward=backward)
    quick, whole = (evaluate(scenario, plan, 5.0, faults=faults) for faults in (False, True))
    assert quick.trouble == whole.trouble == ""
    assert quick.determined == whole.determined
    assert quick.largest == pytest.approx(whole.largest, rel=1e-6)
    assert quick.volume == pytest.approx(whole.volume, rel=1e-4)
    assert quick.variances is not None
    assert whole.variances is not None
    # 1e-4: the errors of the machine turn its axes a little, which the volume of the quick way leaves out.
    # The calibration does not say an error where it is 0 whatever is not determined, as at home.
    is_said = np.isfinite(whole.variances)
    np.testing.assert_allclose(quick.variances[is_said], whole.variances[is_said], rtol=1e-4)


def test_uncertainties_are_those_of_a_machine_with_errors() -> None:
    faces = Candidate(("pp0", "np0", "p0p", "n0p", "0pp", "0np"), (), 10, 1)
    large = SCENARIO.replace("x_mm = 80.0", "x_mm = 800.0").replace("y_mm = 60.0", "y_mm = 600.0")
    text = large.replace("z_mm = 50.0", "z_mm = 500.0").split("[misalignment]")[0] + "[noise]\ndistance_um = 0.1\n"
    text += '[adjustment]\nlaser_urad = 100.0\ndrift_um_per_h = "fixed"\n'
    perfect = "translation_um = 0.0\nrotation_urad = 0.0\nsquareness_urad = 0.0\n"
    usual, none = (
        outcome(parse_scenario(text.replace("[plan]", f"{errors}[plan]")), faces).largest["positioning"]
        for errors in ("", perfect)
    )
    # A beam known to stand in its place to 1 mm reads 0.06 µm more or less for a tilt of 60 µrad. Found: 1.2.
    assert usual > 1.1 * none


def test_drift_counts_by_the_time_that_measuring_takes() -> None:
    head = "[plan_by_time]\nline_change_min = 0.0\n"
    drift = SCENARIO.replace("steps = 5", "steps = 5\nseconds_per_reading = 2.0") + (
        "[uncertainty]\ndistance_um = 0.1\ntilt_urad = 1.0\nmachine_drift_um_per_h = 100.0\nscale_ppm = 1.0\n"
    )
    lines = (("ppp", "npp", "pnp", "nnp"), ("p00", "0p0", "00p"))
    slow, fast, without = (
        outcome(parse_scenario(text + head + times), Candidate(*lines, 5, 1))
        for text, times in ((drift, "measure_s = 30.0\n"), (drift, ""), (drift.replace("100.0\nsc", "1e-6\nsc"), ""))
    )
    assert slow.seconds > 5.0 * fast.seconds
    assert slow.worst("length") > 3.0 * fast.worst("length")  # the drift dominates: by the time, 10 times
    assert fast.worst("length") > 1.2 * without.worst("length")
    # A plan without scale lines has no use for what is said of them.
    assert "scale_ppm" not in outcome(parse_scenario(drift + head), Candidate(lines[0], (), 5, 1)).trouble


def test_four_runs_halve_what_one_leaves() -> None:
    scenario = parse_scenario(SCENARIO)
    lines = (("ppp", "npp", "pnp", "nnp"), ("p00", "0p0", "00p"))
    one, four = (outcome(scenario, Candidate(*lines, 10, repeats)) for repeats in (1, 4))
    # Not quite: what is known of roll, gain and beam beforehand is no better known after four runs.
    assert four.largest["straightness"] == pytest.approx(0.5 * one.largest["straightness"], rel=0.02)
    assert four.largest["angle"] == pytest.approx(0.5 * one.largest["angle"], rel=0.02)
    assert four.seconds < 4.0 * one.seconds  # set up once


def test_sets_of_lines_named_by_the_scenario_stand_beside_its_own() -> None:
    text = (
        FEW + 'line_sets = [["pp0", "np0", "p0p", "n0p", "0pp", "0np"], ["ppp", "npp", "pnp", "p00", "0p0", "00p"]]\n'
    )
    plans = stated_candidates(parse_scenario(SCENARIO + text))
    assert len(plans) == (2 * 2 + 1) * 2 * 2  # without scale lines it does not matter where these are read
    assert {c.description for c in plans} == {
        "4 body diagonals, 3 scale lines",
        "4 body diagonals, 3 scale lines at every step",
        "6 face diagonals",
        "3 body diagonals, 3 scale lines",
        "3 body diagonals, 3 scale lines at every step",
    }
    assert {(c.steps, c.repeats) for c in plans} == {(5, 1), (5, 2), (10, 1), (10, 2)}


def test_what_the_scenario_says_of_lines_that_a_plan_lacks_is_passed_over() -> None:
    own = '[adjustment.nnp]\nlaser_urad = "fixed"\n[misalignment.nnp]\nlaser_urad = [1.0, 2.0]\n'
    scenario = parse_scenario(SCENARIO + own)
    found = outcome(scenario, Candidate(("ppp", "npp", "pnp"), ("p00", "0p0", "00p"), 5, 1))
    assert not found.trouble
    assert len(found.determined) == 21


def test_plan_that_determines_less_is_left_out_and_said_why() -> None:
    scenario = parse_scenario(SCENARIO)
    scales, none = (
        outcome(scenario, Candidate(("ppp", "npp", "pnp", "nnp"), lines, 5, 1)) for lines in (("p00", "0p0"), ())
    )
    assert none.seconds < scales.seconds
    assert front([none, scales]) == complete([none, scales]) == [scales]
    assert list(left_out_rows([none, scales])) == [
        "left out: 4 body diagonals; 5 steps: does not determine EXX, EYY, EZZ"
    ]


def made(minutes: float, spacing: float, u: float) -> Outcome:
    largest = {"positioning": u, "straightness": u, "angle": u, "squareness": u}
    candidate = Candidate(("ppp",), (), round(800.0 / spacing), 1)
    return Outcome(candidate, minutes * 60.0, spacing, (1.0, 1.0), largest, frozenset("a"), u)


def test_front_keeps_what_is_faster_or_finer_or_better() -> None:
    fast, fine, better = made(10.0, 80.0, 2.0), made(20.0, 40.0, 3.0), made(20.0, 80.0, 1.0)
    beaten, hardly = made(15.0, 80.0, 2.5), made(30.0, 80.0, 0.99)
    assert front([hardly, beaten, better, fine, fast]) == [fast, fine, better]


def test_choice_fits_the_time_and_the_nodes_and_says_what_more_time_gives() -> None:
    plans = [made(10.0, 80.0, 2.0), made(20.0, 80.0, 1.0), made(40.0, 80.0, 0.5), made(25.0, 40.0, 3.0)]
    choice = choose(plans, Aim(minutes=30.0, spacing=80.0))
    assert choice.taken == plans[1]
    assert choice.next_better == plans[2]
    assert choose(plans, Aim(minutes=30.0, spacing=40.0)).taken == plans[3]
    near = Aim(minutes=22.0, spacing=40.0)
    none_so_near = choose(plans, near)
    assert (none_so_near.taken, none_so_near.spacing_kept) == (plans[1], False)
    assert "at most 40 mm apart fits 22 minutes; the fastest takes 25.0" in next(iter(advice(plans, near)))
    short = Aim(minutes=5.0, spacing=80.0)
    assert choose(plans, short).taken is None
    assert list(advice(plans, short)) == [
        "no plan fits 5 minutes; the fastest takes 10.0: 1 body diagonal, 10 steps (80 mm), once"
    ]


def test_same_plans_give_the_same_table_and_picture() -> None:
    scenario = parse_scenario(SCENARIO + FEW + SETS)
    aim = Aim(minutes=20.0, spacing=16.0)
    done: list[int] = []
    found = best_plans(scenario, aim, progress=lambda count, of: done.append(count))
    assert done == list(range(1, len(found) + 1))
    choice = choose(found, aim)
    rows = list(plan_rows(shown(found, choice, aim), choice, aim))
    (taken,) = [row.split() for row in rows if "*" in row]
    assert taken[1] == f"{choice.taken.minutes:.1f}"
    end = rows.index("  -- 20 minutes: the available time --")
    within, later = ([float(row.strip(" *").split()[0]) for row in part] for part in (rows[2:end], rows[end + 1 :]))
    assert max(within) <= 20.0 < min(later)
    assert max(map(len, rows)) <= 100
    picture = draw_plans(found, choice.taken, 20.0, "svg")
    assert picture == draw_plans(best_plans(scenario, aim), choice.taken, 20.0, "svg")
    table = list(csv.DictReader(plan_csv(found).splitlines()))
    assert len(table) == len(found)
    assert [float(row["minutes"]) for row in table] == sorted(o.minutes for o in found)
    assert sum(row["on_front"] == "1" for row in table) == len(front(found))
    assert list(table[0])[:15] == [
        *("minutes", "lines", "scale_lines", "steps", "spacing_mm", "repeats", "check_points", "mirror_width_mm"),
        *("mirror_height_mm", "parameters_determined", "u_positioning_um", "u_straightness_um", "u_angle_urad"),
        *("u_squareness_urad", "on_front"),
    ]


def test_first_line_says_whether_noise_alone_counts() -> None:
    assert "noise of readings alone" in inputs_row(parse_scenario(SCENARIO).known)
    more = SCENARIO.replace("steps = 5", "steps = 5\nseconds_per_reading = 2.0")
    more += "[uncertainty]\ndistance_um = 0.1\ntilt_urad = 1.0\nmachine_drift_um_per_h = 2.0\nscale_ppm = 1.0\n"
    assert "machine drift" in inputs_row(parse_scenario(more).known)


def test_volume_is_that_of_the_calibration_at_the_worst_point() -> None:
    scenario = parse_scenario(SCENARIO)
    plain, steps = (
        outcome(scenario, Candidate(("ppp", "npp", "pnp", "nnp"), ("p00", "0p0", "00p"), 5, 1, 0, points))
        for points in ("ends", "steps")
    )
    _, between = measuring_time(scenario.known.plan, times_of(scenario.known.keys.plan_by_time, ""))
    planned = not_measured(scenario.known, {"seconds_per_reading": between})
    run = sd.simulate(Scenario(planned, scenario.truth))
    calibration = sd.methods.adjust_scenario(planned, run, full_covariance=True).calibration
    axes = [np.linspace(0.0, edge, 5) for edge in (80.0, 60.0, 50.0)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    u = sd.errors_at(calibration, points).error_uncertainty
    # The machine of the run is another one: errors of 60 µrad change the derivatives by some 1e-4; noise is not in u.
    assert plain.volume == pytest.approx(np.sqrt((u**2).sum(axis=1)).max(), rel=1e-3)
    assert steps.volume < plain.volume
    assert steps.seconds > plain.seconds


def test_backward_runs_are_tried_where_there_are_no_reversal_errors_to_find() -> None:
    assert {one.backward for one in settings(parse_scenario(SCENARIO).known)} == {False}
    without = parse_scenario(SCENARIO + '[adjustment]\nreversal = false\ndrift_um_per_h = "fixed"\n')
    assert {one.backward for one in settings(without.known)} == {False, True}
    own = own_candidate(without.known)
    once, there, twice = (outcome(without, one) for one in (own, replace(own, backward=True), replace(own, repeats=2)))
    # As many readings as two forward runs, without the ways back; not in the same order, so that drift acts otherwise.
    assert twice.volume < there.volume < 0.8 * once.volume
    assert there.seconds < twice.seconds


def test_plan_that_tells_faults_apart_is_named_with_its_minutes() -> None:
    scenario = parse_scenario(SCENARIO + FEW)
    lines = (("ppp", "npp", "pnp", "nnp"), ("p00", "0p0", "00p"))
    once, twice = (outcome(scenario, Candidate(*lines, 10, repeats)) for repeats in (1, 2))
    taken, distinguishing_all = distinguishing(scenario, [once, twice], once)
    assert any(c.twins for c in taken.faults)
    assert distinguishing_all is not None
    assert distinguishing_all.candidate == twice.candidate
    assert not any(c.twins or c.uncontrolled for c in distinguishing_all.faults)
    said = list(fault_advice(taken, distinguishing_all))
    assert said[0].startswith("faults distinguished in the plan to take: wrong distance none; slip of distances none; ")
    assert f"(+{twice.minutes - once.minutes:.1f})" in said[1]
    assert len(list(fault_advice(distinguishing_all, distinguishing_all))) == 1
    assert distinguishing(scenario, [once], once)[1] is None
    assert "no plan of as many steps" in list(fault_advice(taken, None))[1]


# --- the command -----------------------------------------------------------------------------------------------------
@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO + FEW + SETS)
    return "scenario.toml"


def test_command_says_which_plan_to_take(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", scenario, "--minutes", "20", "-o", "plan.png"]) == 0
    said = capsys.readouterr().out
    assert "\ntake: " in said
    assert Path("plan.png").read_bytes().startswith(b"\x89PNG")
    (row,) = [line for line in said.splitlines() if line.lstrip().startswith("* ")]
    assert float(row.split()[1]) <= 20.0
    assert "\nfaults distinguished in the plan to take: " in said


@pytest.mark.slow
def test_page_has_the_table_of_the_example(capsys: pytest.CaptureFixture[str]) -> None:
    root = ROOT
    assert main(["plan", str(root / "examples" / "scenario.toml")]) == 0
    assert capsys.readouterr().out in (root / "docs" / "study.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--minutes", "0"], "--minutes"),
        (["--minutes", "nan"], "--minutes"),
        (["-o", "plan.jpg"], "expected a name that ends in .png, .svg, .pdf or .csv"),
        (["-o", "scenario.toml"], "is also an input"),
        (["-o", "no/plan.png"], "the folder no does not exist"),
        (["--for", "everything"], "'everything' is not one of"),
    ],
)
def test_mistakes_are_said_in_one_line(
    scenario: str, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", scenario, *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith("stepdiag: error: ")
    assert message in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("steps = [0]", "plan_by_time.steps: expected a list of integers from 1 to 2000, got [0]"),
        ("steps = []", "plan_by_time.steps: expected a list of integers from 1 to 2000, got []"),
        ("feed_mm_per_min = 0.0", "plan_by_time.feed_mm_per_min: expected a positive number, got 0.0"),
        ("settle_s = -1.0", "plan_by_time.settle_s: expected a time of at least 0, got -1.0"),
        ('line_sets = [["ppx"]]', "plan_by_time.line_sets: set 1"),
        ("speed = 1.0", "plan_by_time.speed: unknown key"),
        (f"steps = {list(range(1, 500))}\n{SETS}", "expected at most 2000 plans to choose from"),
    ],
)
def test_keys_that_are_wrong_are_named(
    scenario: str, keys: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path(scenario).write_text(f"{SCENARIO}[plan_by_time]\n{keys}\n")
    assert main(["plan", scenario]) == 2
    said = capsys.readouterr().err
    assert said.startswith("stepdiag: error: scenario.toml: ")
    assert message in said


# --- returns to check points -----------------------------------------------------------------------------------------
def test_plans_with_and_without_returns_are_compared_where_the_functional_point_may_drift() -> None:
    few = (
        '[plan_by_time]\nsteps = [8]\nrepeats = [1]\nline_sets = [["ppp", "npp", "pnp", "nnp", "p00", "0p0", "00p"]]\n'
    )
    assert {one.check_points for one in stated_candidates(parse_scenario(SCENARIO + few))} == {0}
    drifting = parse_scenario(
        SCENARIO.replace("seed = 3", "tilt_urad = 1.0\nseed = 3")
        + few
        + "[adjustment]\nmachine_drift_um_per_h = 20.0\n"
    )
    some = [one for one in stated_candidates(drifting) if (one.steps, one.scale_points) == (8, "ends")]
    found = [outcome(drifting, one) for one in some]
    without, returning = sorted(found, key=lambda one: one.candidate.check_points)
    assert (without.candidate.check_points, returning.candidate.check_points) == (0, 2)
    assert returning.seconds > without.seconds
    assert returning.largest["squareness"] < without.largest["squareness"]
    aim = Aim("squareness", 60.0, 20.0)
    assert "returns" in "\n".join(plan_rows(found, choose(found, aim), aim))
    assert "returning to check points after every 2 steps" in "\n".join(advice([returning], aim))


def test_plan_is_the_best_of_the_stated_ones_in_the_time_or_the_shortest_for_a_goal() -> None:
    scenario = parse_scenario(SCENARIO + FEW + SETS)
    outcomes = [outcome(scenario, candidate) for candidate in stated_candidates(scenario)]
    within = [one for one in outcomes if one.minutes <= 25.0 and one.spacing <= 16.0 * (1.0 + 1e-9)]
    taken = sd.plan(scenario, minutes=25.0, spacing=16.0).taken
    assert taken is not None
    assert taken.volume == min(one.volume for one in within)
    goal = sd.plan(scenario, spacing=16.0, volume_u=2.0 * taken.volume)
    assert goal.reached
    assert goal.taken is not None
    reached = [one for one in outcomes if one.volume <= 2.0 * taken.volume and one.spacing <= 16.0 * (1.0 + 1e-9)]
    assert goal.taken.minutes == min(one.minutes for one in reached)
    assert sd.plan(scenario, minutes=0.1).taken is None


# --- the scenario with the advised plan ------------------------------------------------------------------------------
def test_advised_plan_is_written_into_a_scenario(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given, written = tmp_path / "scenario.toml", tmp_path / "other.toml"
    given.write_text(SCENARIO + FEW + SETS)
    assert main(["plan", str(given), "--minutes", "20", "--write", str(written)]) == 0
    advised = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("take: "))
    new = sd.read_scenario(written).known
    assert f"take: {own_candidate(new).description}, {new.plan.steps} steps" in advised
    assert main(["plan", str(given), "--minutes", "20", "--write", str(written)]) == 2
    assert "exists already, perhaps written by hand: name another file" in capsys.readouterr().err


def test_another_plan_leaves_the_rest_of_the_text(tmp_path: Path) -> None:
    """Comments too; but what is said of a line that is not measured any more goes."""
    given = tmp_path / "scenario.toml"
    of_lines = "# aligned again\n[misalignment.npp]\nroll_urad = 5.0\n[misalignment.pnp]\nroll_urad = 4.0\n"
    given.write_text(SCENARIO.replace("steps = 5", "steps = 5 # of 16 mm\nblock = 5") + of_lines)
    known = sd.read_scenario(given).known
    candidate = Candidate(("ppp", "npp", "pp0"), (), 3, 2, scale_points="ends")
    text = scenario_with_plan(known, candidate, tmp_path / "other.toml")
    assert own_candidate(parse_scenario(text).known) == candidate
    changed = {one for one in text.splitlines() if one not in given.read_text().splitlines()}
    assert changed == {
        'lines = ["ppp", "npp", "pp0"]',
        "steps = 3 # of 16 mm",
        "block = 3",
        "scale_lines = []",
        "repeats = 2",
    }
    gone = [one for one in given.read_text().splitlines() if one not in text.splitlines()]
    assert "[misalignment.pnp]" in gone
    assert len(gone) == 6
    with pytest.raises(InvalidArgument, match=r"elsewhere.scenario\.toml: head.description"):
        scenario_with_plan(_described(given), candidate, tmp_path / "elsewhere" / "scenario.toml")


def _described(scenario: Path) -> Known:
    """The same with a description of its head beside it."""
    shutil.copy(SHIPPED_HEADS / "three_beams.toml", scenario.parent / "own.toml")
    scenario.write_text(SCENARIO.replace('layout = "ideal"', 'description = "./own.toml"'))
    return sd.read_scenario(scenario).known


def test_no_plan_no_scenario(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given, written = tmp_path / "scenario.toml", tmp_path / "other.toml"
    given.write_text(SCENARIO + FEW + SETS)
    assert main(["plan", str(given), "--minutes", "1", "--write", str(written)]) == 2
    assert "other.toml: not written, for no plan is advised" in capsys.readouterr().err
    assert not written.exists()
