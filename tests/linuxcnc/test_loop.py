"""The loop, closed in LinuxCNC: measuring program, acquisition, calibration, compensation, and the program again."""

from pathlib import Path

import numpy as np
import pytest

from stepdiag import Compensator, read_measurement
from stepdiag.demo.loop import run_loop
from stepdiag.demo.loop_cases import CHAIN, CLEAN, IN_USE, NOISE, RANGE, WARM
from stepdiag.demo.loop_job import Calculated
from stepdiag.demo.loop_linuxcnc import Linuxcnc

STEPS, NODES, COUNT = 10, 40, 100


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The loop's files, by LinuxCNC in "linuxcnc" and without it in "calculated"."""
    folder = tmp_path_factory.mktemp("loop")
    for name, controller in (("linuxcnc", Linuxcnc()), ("calculated", Calculated())):
        run_loop(folder / name, controller, cases=(CLEAN, NOISE, WARM), steps=STEPS, nodes=NODES, count=COUNT, seeds=0)
    return folder


def points_of(folder: Path, case: str) -> dict[str, np.ndarray]:
    """Targets, and errors before and after in µm, of both kinds."""
    rows = [line.split(",") for line in (folder / "points.csv").read_text().splitlines()[1:]]
    return {
        kind: np.array([[float(value) for value in row[2:]] for row in rows if row[:2] == [case, kind]])
        for kind in ("nodes", "random")
    }


def test_at_nodes_of_the_plan_the_largest_error_is_a_thousand_times_smaller(folder: Path) -> None:
    points = points_of(folder / "linuxcnc", "clean")["nodes"]
    assert len(points) == NODES
    before, after = (np.linalg.norm(points[:, columns], axis=1).max() for columns in (slice(3, 6), slice(6, 9)))
    assert before > 20.0  # µm
    assert before > 1000.0 * after


def test_between_nodes_interpolation_leaves_what_the_finer_truth_has(folder: Path) -> None:
    for kind in ("nodes", "random"):
        by_linuxcnc, calculated = (points_of(folder / name, "clean")[kind] for name in ("linuxcnc", "calculated"))
        # LinuxCNC's joints are the compensator's to rounding, and the calibrations differ by picometres.
        np.testing.assert_allclose(by_linuxcnc, calculated, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize("run", ["clean", "clean-again", "noise", "warm", "warm-again", "warm-cold"])
def test_the_run_is_that_of_the_virtual_machine_to_the_picometre(folder: Path, run: str) -> None:
    by_linuxcnc, calculated = (read_measurement(folder / name / run / "run.csv") for name in ("linuxcnc", "calculated"))
    assert by_linuxcnc.line == calculated.line
    assert list(by_linuxcnc.point) == list(calculated.point)
    for channel in ("d1", "d2", "d3"):
        np.testing.assert_allclose(by_linuxcnc.channels[channel], calculated.channels[channel], rtol=0.0, atol=1.1e-9)


def test_the_joints_are_those_of_the_library(folder: Path) -> None:
    """The errors left follow from the joints; those from the table that LinuxCNC had read."""
    from stepdiag.demo.loop_points import errors_at
    from stepdiag.scenario.description import read_scenario

    here = folder / "linuxcnc" / "noise"
    compensator, machine = Compensator(here / "calibration.csv", CHAIN), read_scenario(here / "scenario.toml").machine()
    points = points_of(folder / "linuxcnc", "noise")["random"]
    targets = points[:, :3]
    # 1e-9 mm: LinuxCNC's planner, and the module's own check of forward against inverse.
    expected = errors_at(machine, compensator.command(targets), targets) * 1e3
    np.testing.assert_allclose(points[:, 6:9], expected, rtol=0.0, atol=1e-6)


def test_warm_scales_are_compensated_at_another_temperature_than_they_were_measured_at(folder: Path) -> None:
    for kind in ("nodes", "random"):
        by_linuxcnc, calculated = (points_of(folder / name, "warm")[kind] for name in ("linuxcnc", "calculated"))
        np.testing.assert_allclose(by_linuxcnc, calculated, rtol=0.0, atol=1e-4)
    points = points_of(folder / "linuxcnc", "warm")["nodes"]
    before, after = (np.linalg.norm(points[:, columns], axis=1).max() for columns in (slice(3, 6), slice(6, 9)))
    assert before > 100.0  # µm
    assert before > 1000.0 * after
    report = (folder / "linuxcnc" / "report.txt").read_text()
    (cold,) = [line for line in report.splitlines() if line.startswith("nodes of the plan, after, without")]
    assert float(cold.split()[-2]) > 50.0  # µm: 6 K of 800 mm of steel


def test_the_joints_of_a_warm_machine_are_those_of_the_library(folder: Path) -> None:
    from stepdiag.demo.loop_points import Warmth, errors_at
    from stepdiag.scenario.description import read_scenario

    here = folder / "linuxcnc" / "warm"
    scenario = read_scenario(here / "scenario.toml")
    assert scenario.known.expansion is not None
    with pytest.warns(UserWarning, match="doubtful"):  # readings without noise
        compensator = Compensator(here / "calibration.csv", CHAIN, temperatures=RANGE)
    points = points_of(folder / "linuxcnc", "warm")["random"]
    targets, warmth = points[:, :3], Warmth(scenario.known.expansion.expansion, IN_USE)
    joints = compensator.command(targets, temperature=IN_USE)
    expected = errors_at(scenario.machine(), joints, targets, warmth) * 1e3
    np.testing.assert_allclose(points[:, 6:9], expected, rtol=0.0, atol=1e-6)


def test_the_second_calibration_shows_the_errors_gone(folder: Path) -> None:
    report = (folder / "linuxcnc" / "report.txt").read_text()
    (line,) = [line for line in report.splitlines() if line.startswith("clean") and "squareness" in line]
    before, _, after, angle = map(float, line.split()[-4:])
    assert before > 20.0  # µm
    assert after < 0.05
    assert angle < 0.1  # µrad


def test_the_picture_and_the_raw_values_are_kept(folder: Path) -> None:
    for name in ("loop.png", "loop.svg", "report.txt", "noise/run.raw.jsonl", "clean-again/run.raw.jsonl"):
        assert (folder / "linuxcnc" / name).stat().st_size > 1000
