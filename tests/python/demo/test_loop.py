"""The closed loop, calculated: the same instrument and compensator as in LinuxCNC (tests/linuxcnc/test_loop.py)."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from stepdiag import Machine, read_calibration, read_measurement
from stepdiag.cli import main
from stepdiag.demo.loop_cases import CLEAN, IN_USE, NOISE, RADIUS, SCREW, VOLUME, WARM, LoopCase
from stepdiag.demo.loop_job import Calculated
from stepdiag.demo.loop_outcome import LoopOutcome, repetitions, run_case, whole_grid
from stepdiag.demo.loop_points import Sizes, agreement, grid_nodes, random_points
from stepdiag.demo.loop_recheck import along_beam
from stepdiag.demo.loop_report import report_lines
from stepdiag.scenario.description import Scenario, simulate_scenario

STEPS = 10


def outcome_of(case: LoopCase, folder: Path, steps: int = STEPS) -> LoopOutcome:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # users see warnings
        outcome, _ = run_case(case, folder, Calculated(), None, steps, (100, 200), lambda text: None)
    return outcome


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> LoopOutcome:
    return outcome_of(CLEAN, tmp_path_factory.mktemp("loop"))


def test_at_nodes_the_largest_error_is_a_thousand_times_smaller(clean: LoopOutcome) -> None:
    before = Sizes.of(clean.points["nodes"].before).largest
    assert before > 1000.0 * Sizes.of(clean.points["nodes"].after).largest
    of_all, left_of_all = whole_grid(clean)
    assert of_all >= before
    assert of_all > 1000.0 * left_of_all


def test_the_calibration_knows_the_truth_at_its_nodes(clean: LoopOutcome) -> None:
    truth = clean.machine.errors
    for name, (positions, values, _) in read_calibration(clean.table).functions.items():
        # The instrument's picometres, summed over ten steps and times levers of 800 mm over 80 mm.
        np.testing.assert_allclose(values, truth.function(name, positions), rtol=0.0, atol=2e-8)


def test_the_first_run_is_what_simulate_makes_but_for_picometres(clean: LoopOutcome) -> None:
    run = read_measurement(clean.table.with_name("run.csv"))
    simulated = simulate_scenario(clean.scenario)
    for name in ("d1", "d2", "d3"):
        np.testing.assert_allclose(run.channels[name], simulated.channels[name], rtol=0.0, atol=0.51e-9)


def test_the_second_calibration_shows_that_the_errors_are_gone(clean: LoopOutcome) -> None:
    assert clean.first.length > 0.02
    # Products of the set-up's angles (300 µrad) with those of the machine (60 µrad) over a line of 1.1 m: 0.02 µm.
    assert clean.second.length < 5e-5
    assert clean.second.squareness < 1e-7


def test_the_place_along_the_beam_is_that_of_the_functional_point(tmp_path: Path, clean: LoopOutcome) -> None:
    """Of a head in true, the reading's own definition: the functional point in the frame of the line."""
    text = (
        clean.scenario.path.read_text().replace("[100.0, 300.0]", "[0.0, 0.0]").replace("[200.0, -150.0]", "[0.0, 0.0]")
    )
    scenario = _read(clean.scenario.path.with_name("true.toml"), text)
    run = simulate_scenario(scenario)
    place = along_beam(scenario.known, run)
    lines = np.array(run.line)
    for line in scenario.known.plan.lines:
        rows = lines == line
        along = scenario.known.plan.frame(line)[:, 2]
        first = scenario.known.plan.points(line)[0]
        _, points = scenario.machine().pose(run.position[rows])
        expected = (points - first - np.array(scenario.known.tool)) @ along + scenario.known.head.standoff
        # Tilts of 0.1 mrad times errors of 50 µm across the beam, which are not among the commanded ones.
        np.testing.assert_allclose(place[rows], expected, rtol=0.0, atol=2e-5)


def _read(path: Path, text: str) -> Scenario:
    from stepdiag.scenario.description import read_scenario

    path.write_text(text)
    return read_scenario(path)


def test_a_screw_error_stays_between_nodes(tmp_path: Path) -> None:
    outcome = outcome_of(SCREW, tmp_path)
    after = {kind: Sizes.of(points.after).largest for kind, points in outcome.points.items()}
    # Its slope, 1.9e-3, times the error, 0.1 mm, is what can be left at a node; between them its own amplitude.
    assert after["nodes"] < 2e-4
    assert after["random"] > 3e-3


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> LoopOutcome:
    return outcome_of(WARM, tmp_path_factory.mktemp("warm"))


def test_measured_while_it_warms_up_a_machine_is_compensated_at_another_temperature(
    clean: LoopOutcome, warm: LoopOutcome
) -> None:
    before, after = (Sizes.of(errors).largest for errors in (warm.points["nodes"].before, warm.points["nodes"].after))
    assert before > 0.1
    assert before > 1000.0 * after
    # The calibration is that of the machine whose scales are always at 20 °C, and it knows how they expand.
    for name, (_, values, _) in clean.calibration.functions.items():
        np.testing.assert_allclose(warm.calibration.functions[name][1], values, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(warm.calibration.expansion, 11.5e-6, rtol=0.0, atol=1e-10)


def test_without_the_temperatures_the_expansion_of_the_scales_is_left(warm: LoopOutcome) -> None:
    points = warm.points["nodes"]
    assert points.cold is not None
    expected = 11.5e-6 * (np.array(IN_USE) - 20.0) * points.targets
    # At nodes nothing else is left but for what stands beside them, and the tilts of axes that stand elsewhere.
    np.testing.assert_allclose(points.cold, expected, rtol=0.0, atol=1e-4)
    assert np.abs(expected).max() == pytest.approx(11.5e-6 * 6.0 * VOLUME[0], rel=1e-12)  # 55 µm


def test_the_first_warm_run_is_what_simulate_makes_but_for_picometres(warm: LoopOutcome) -> None:
    run, simulated = read_measurement(warm.table.with_name("run.csv")), simulate_scenario(warm.scenario)
    for name in ("d1", "d2", "d3"):
        np.testing.assert_allclose(run.channels[name], simulated.channels[name], rtol=0.0, atol=0.51e-9)
    np.testing.assert_array_equal(run.channels["temperature"], simulated.channels["temperature"])


def test_the_second_calibration_of_a_warm_machine_shows_that_the_errors_are_gone(warm: LoopOutcome) -> None:
    assert warm.first.length > 0.02
    assert warm.second.length < 5e-5
    assert warm.second.squareness < 1e-7


def test_what_noise_leaves_agrees_with_the_calibrations_own_uncertainty(tmp_path: Path) -> None:
    outcome = outcome_of(NOISE, tmp_path, 5)
    found = repetitions(outcome, 60)["nodes"]
    # 60 calibrations, within each of which the points go wrong together: of chi-square by 3 their means scatter by
    # sqrt(2/3/60) = 0.1 even so, and of the share by 0.03 at most.
    assert found.mean_chi_square == pytest.approx(1.0, abs=0.35)
    assert found.covered == pytest.approx(0.95, abs=0.08)
    assert found.found_rms == pytest.approx(found.stated_rms, rel=0.2)


def test_three_beams_know_tilts_as_well_as_stated() -> None:
    angles = np.radians([90.0, 210.0, 330.0])
    design = np.column_stack([np.ones(3), -RADIUS * np.cos(angles), RADIUS * np.sin(angles)])
    covariance = np.linalg.inv(design.T @ design) * 1e-4**2
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), [1e-4 / np.sqrt(3.0), 1e-6, 1e-6], rtol=1e-12)


def test_agreement_is_that_of_the_normal_distribution() -> None:
    random = np.random.default_rng(1)
    root = random.normal(size=(3, 3))
    errors = random.normal(size=(20000, 3)) @ root.T
    found = agreement(errors, np.tile(root @ root.T, (20000, 1, 1)))
    assert found.covered == pytest.approx(0.95, abs=0.006)  # four standard deviations of a share of 20,000
    assert found.mean_chi_square == pytest.approx(1.0, abs=0.025)
    assert found.found_rms == pytest.approx(found.stated_rms, rel=0.025)


def test_nodes_are_nodes_and_hold_the_corners(clean: LoopOutcome) -> None:
    plan = clean.scenario.known.plan
    nodes = grid_nodes(plan, 100, 3)
    steps = nodes / plan.volume * plan.steps
    np.testing.assert_allclose(steps, np.round(steps), rtol=0.0, atol=1e-9)
    assert {(0.0, 0.0, 0.0), tuple(plan.volume)} <= {tuple(node) for node in nodes}
    assert np.all((random_points(plan, 50, 3) >= 0.0) & (random_points(plan, 50, 3) <= plan.volume))


def test_without_errors_there_is_nothing_to_compensate(clean: LoopOutcome) -> None:
    """The judge itself: a perfect machine leaves nothing."""
    from stepdiag.demo.loop_points import errors_at

    points = clean.points["random"].targets
    assert not np.any(errors_at(Machine(clean.scenario.known.chain), points, points))


def test_the_report_says_what_is_left(clean: LoopOutcome) -> None:
    text = "\n".join(report_lines([clean], None, "no controller"))
    assert "nodes of the plan" in text
    assert "clean: largest error at any of the 1,331 nodes, calculated: " in text


def test_the_report_says_what_temperatures_do(warm: LoopOutcome) -> None:
    text = "\n".join(report_lines([warm], None, "no controller"))
    assert "measured while they warmed up from 22 to 23.07 °C" in text
    assert "in use at 26, 25, 18.5 °C" in text
    assert "nodes of the plan, after, without temperatures       65.7" in text


def test_the_command_says_what_a_controller_needs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--controller", "other", "-o", str(tmp_path)]) == 2
    assert "'linuxcnc', 'calculated'" in capsys.readouterr().err
