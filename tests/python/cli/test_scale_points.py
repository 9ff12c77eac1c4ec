"""Scale lines read at every step, from the scenario's key to the calibration; and files that have the other points."""

import csv
from pathlib import Path

import numpy as np
import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main

STEPS = SCENARIO.replace("[head]", 'scale_points = "steps"\n[head]')
ENDS = SCENARIO


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Both scenarios, with a run of each."""
    monkeypatch.chdir(tmp_path)
    for name, text in {"steps": STEPS, "ends": ENDS}.items():
        Path(f"{name}.toml").write_text(text)
        assert main(["simulate", f"{name}.toml", "-o", f"{name}.csv"]) == 0
    return tmp_path


def write_without_positions(run: str, to: str) -> None:
    with Path(run).open() as file:
        rows = [row for row in csv.reader(file) if not row[0].startswith("#")]
    Path(to).write_text("".join(",".join([*row[:2], *row[5:]]) + "\n" for row in rows))


def test_run_has_a_reading_at_every_step_of_a_scale_line(folder: Path) -> None:
    steps, ends = sd.read_measurement("steps.csv"), sd.read_measurement("ends.csv")
    assert len(steps) == 4 * 16 + 3 * 6
    assert len(ends) == 4 * 16 + 3 * 2
    of_line = [position for line, position in zip(steps.line, steps.position, strict=True) if line == "0p0"]
    np.testing.assert_allclose(of_line, [(0.0, 12.0 * k, 0.0) for k in range(6)], atol=1e-12)


@pytest.mark.parametrize("method", ["adjustment", "enhanced", "conventional"])
def test_every_method_evaluates_it(folder: Path, method: str) -> None:
    assert main(["evaluate", "steps.toml", "steps.csv", "-m", method, "-o", "calibration.csv"]) in (0, 3)
    assert len(sd.read_calibration("calibration.csv").functions) == 18 - 9 * (method == "conventional")


@pytest.mark.parametrize("method", ["enhanced", "conventional"])
def test_published_evaluations_take_the_two_ends(folder: Path, method: str) -> None:
    main(["evaluate", "steps.toml", "steps.csv", "-m", method, "-o", "all.csv"])
    with Path("steps.csv").open() as file:
        rows = [row for row in csv.reader(file) if row[0] not in ("p00", "0p0", "00p") or row[1] in "05"]
    Path("two.csv").write_text("".join(",".join(row) + "\n" for row in rows if not row[0].startswith("#")))
    main(["evaluate", "steps.toml", "two.csv", "-m", method, "-o", "two_ends.csv"])
    every, two = sd.read_calibration("all.csv"), sd.read_calibration("two_ends.csv")
    for name, columns in every.functions.items():
        for column, other in zip(columns, two.functions[name], strict=True):
            # Sums of the same numbers, of 1e-4 mm, in another order.
            np.testing.assert_allclose(column, other, rtol=0.0, atol=1e-18, err_msg=name)
    for name, of_all in every.squareness.items():
        np.testing.assert_allclose(of_all, two.squareness[name], rtol=0.0, atol=1e-18)


@pytest.mark.parametrize(
    ("scenario", "run", "words"),
    [
        ("steps", "ends", 'at its two ends, the plan has every step (expected scale_points = "ends")'),
        ("ends", "steps", 'after every step, the plan has its two ends (expected scale_points = "steps")'),
    ],
)
@pytest.mark.parametrize(
    "command", [["check"], ["evaluate", "-o", "x.csv"], ["evaluate", "-m", "enhanced", "-o", "x.csv"]]
)
def test_file_with_the_other_points_is_that_mistake(
    folder: Path, capsys: pytest.CaptureFixture[str], scenario: str, run: str, words: str, command: list[str]
) -> None:
    capsys.readouterr()
    assert main([*command, f"{scenario}.toml", f"{run}.csv"]) == 2
    assert words in capsys.readouterr().err
    assert not Path("x.csv").exists()


def test_ends_whose_positions_an_import_took_from_the_plan_are_that_mistake(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_without_positions("ends.csv", "short.csv")
    assert main(["import", "short.csv", "--scenario", "steps.toml", "-o", "run.csv"]) == 0
    assert main(["evaluate", "steps.toml", "run.csv", "-o", "x.csv"]) == 2
    assert "at its two ends, the plan has every step" in capsys.readouterr().err


def test_steps_that_an_import_looks_up_in_a_plan_of_ends_are_that_mistake(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_without_positions("steps.csv", "short.csv")
    assert main(["import", "short.csv", "--scenario", "ends.toml", "-o", "run.csv"]) == 2
    assert 'reads this scale line at its two ends (expected scale_points = "steps")' in capsys.readouterr().err


def test_a_lost_inner_point_is_a_lost_point(folder: Path) -> None:
    with Path("steps.csv").open() as file:
        rows = [row for row in csv.reader(file) if row[:2] != ["p00", "2"] and not row[0].startswith("#")]
    Path("lost.csv").write_text("".join(",".join(row) + "\n" for row in rows))
    assert main(["evaluate", "steps.toml", "lost.csv", "-o", "calibration.csv"]) == 0
    assert len(sd.read_calibration("calibration.csv").functions) == 18


def test_one_step_has_the_same_points_either_way() -> None:
    for points in ("ends", "steps"):
        plan = sd.Plan((80.0, 60.0, 50.0), ["ppp"], 1, scale_lines=["p00"], scale_points=points)
        assert plan.scale_points == points
        np.testing.assert_array_equal(plan.points("p00"), [(0.0, 0.0, 0.0), (80.0, 0.0, 0.0)])


def test_steps_without_scale_lines_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = STEPS.replace('scale_lines = ["p00", "0p0", "00p"]\n', "")
    (tmp_path / "s.toml").write_text(text)
    assert main(["observe", str(tmp_path / "s.toml")]) == 2
    assert "s.toml: plan: scale_points: expected scale_lines as well, got none" in capsys.readouterr().err
