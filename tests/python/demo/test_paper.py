"""The demonstration: its numbers, its files, and that it makes the same ones again."""

import re
from pathlib import Path

import numpy as np
import pytest
from places import ROOT

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.demo.paper import run_demo
from stepdiag.demo.paper_cases import (
    CASES,
    LASER_OFFSET,
    POSITIONING,
    PSD_DISTANCE,
    SCREW_AMPLITUDE,
    Result,
    run_case,
    write_truths,
)
from stepdiag.demo.paper_report import alias_of, between_nodes, traced_differences


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("demo")
    run_demo(folder)
    return folder


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Result]:
    folder: Path = tmp_path_factory.mktemp("results")
    write_truths(folder)
    return {case.name: run_case(case, folder) for case in CASES}


# What is left of the enhanced method is of second order: products of errors (60 µrad, 20 µm) with each other and with
# the misalignment (mm, rad). The limits of 1a, 1b and 4 are those that the project has set itself: for this machine,
# the angles of 1b for misaligned runs at large; squarenesses are angles here.
# For 1c and 1d it asks 2.5 µm only; the products say more. An error of 60 µrad times the laser's 1.22 mrad is 73 nrad,
# and over the diagonal of 1118 mm 82 nm. Lengths and squarenesses sum over axes and lines: three such products are
# allowed. Angles are read at every step by themselves: one product in 1d. In 1c, where the mirror stays, no more than
# the 50 nrad of 1b.
@pytest.mark.parametrize(
    ("case", "length_limit", "angle_limit", "squareness_limit"),
    [
        ("1a", 15e-6, 5e-9, 5e-9),
        ("1b", 150e-6, 50e-9, 50e-9),
        ("1c", 250e-6, 50e-9, 220e-9),
        ("1d", 250e-6, 73e-9, 220e-9),
        ("4", 15e-6, 5e-9, 5e-9),
    ],
)
def test_enhanced_recovers_the_truth_to_second_order(
    results: dict[str, Result], case: str, length_limit: float, angle_limit: float, squareness_limit: float
) -> None:
    largest = sd.largest_deviations(results[case].calibrations["enhanced"], results[case].truth)
    assert abs(largest["positioning"].value) <= length_limit
    assert abs(largest["straightness"].value) <= length_limit
    assert abs(largest["angle"].value) <= angle_limit
    assert abs(largest["squareness"].value) <= squareness_limit


# The floor of double precision at distances of a metre: some 1e-12 mm of rounding a reading, three times as much where
# fifty steps add up. The project has set itself 2e-11 mm and 1e-13 rad.
@pytest.mark.parametrize("case", ["1a", "1b", "1c", "1d", "3d", "4"])
def test_adjustment_recovers_the_truth_to_the_floor_of_double_precision(results: dict[str, Result], case: str) -> None:
    largest = sd.largest_deviations(results[case].calibrations["adjustment"], results[case].truth)
    assert abs(largest["positioning"].value) <= 2e-11
    assert abs(largest["straightness"].value) <= 2e-11
    assert abs(largest["angle"].value) <= 1e-13
    assert abs(largest["squareness"].value) <= 1e-13


def test_adjustment_removes_the_zero_error_of_the_traced_psd(results: dict[str, Result]) -> None:
    largest = sd.largest_deviations(results["3"].calibrations["adjustment"], results["3"].truth)
    # What is left is what the definition of the readings does not know: 1.8 nm in distance, the window being shorter
    # for the angle; over the spot's shortest arm, twice 131 mm, 7 nrad.
    assert abs(largest["positioning"].value) <= 1.8e-6
    assert abs(largest["straightness"].value) <= 1.8e-6
    assert abs(largest["angle"].value) <= 7e-9
    found = [
        e
        for e in sd.methods.adjust_scenario(results["3"].scenario, results["3"].measurement).setup
        if e.quantity == "psd_zero"
    ]
    for e in found:
        assert e.value == pytest.approx((1.5, 2.0)[e.component], abs=1e-4)  # 34 nm beside a second-order term or two


@pytest.mark.parametrize("case", ["1a", "1b", "1c", "1d"])
def test_conventional_misses_the_truth_by_micrometres(results: dict[str, Result], case: str) -> None:
    largest = sd.largest_deviations(results[case].calibrations["conventional"], results[case].truth)
    assert abs(largest["positioning"].value) >= 10e-3
    assert abs(largest["straightness"].value) >= 10e-3
    assert "angle" not in largest


def positioning(result: Result, method: str) -> np.ndarray:
    return np.concatenate([result.calibrations[method].functions[name][1] for name in POSITIONING])


def test_laser_alone_makes_no_trend_but_a_following_mirror_does(results: dict[str, Result]) -> None:
    moved = {
        case: np.max(np.abs(positioning(results[case], "conventional") - positioning(results["1a"], "conventional")))
        for case in ("1c", "1d")
    }
    # Second order: half the square of 1.22 mrad over a diagonal of 1118 mm is 0.83 µm; the geometry of the four lines
    # can multiply it by a few. First order: 1 mrad times the way that steps go sideways, hundreds of micrometres.
    assert moved["1c"] < 5e-3
    assert moved["1d"] > 0.1


def test_displaced_psd_spoils_positions_and_angles(results: dict[str, Result]) -> None:
    largest = sd.largest_deviations(results["3"].calibrations["enhanced"], results["3"].truth)
    assert abs(largest["positioning"].value) > 0.05
    assert abs(largest["angle"].value) > 100e-6


def test_constants_of_the_definition_are_those_of_the_traced_head(results: dict[str, Result]) -> None:
    calibration = results["3"].scenario.known.head.calibration
    assert calibration.psd_distance == pytest.approx(PSD_DISTANCE, abs=1e-6)  # as many digits are written
    assert calibration.spot_beam.tolist() == pytest.approx([LASER_OFFSET, 0.0], abs=1e-6)


def test_traced_readings_are_the_defined_ones_to_second_order(results: dict[str, Result]) -> None:
    for name, (difference, rest) in traced_differences(results["3"], results["3d"]).items():
        # 25 mm times twice the square of 1 mrad is 50 nm. What is left is of third order: paths of a metre, 1 mrad.
        assert 0.5e-6 < difference < 50e-6, name
        assert rest < 1e-6, name


def test_traced_run_evaluated_with_the_defined_head_gives_the_defined_calibration(results: dict[str, Result]) -> None:
    traced, defined = results["3"], results["3d"]
    known, head = traced.scenario.known, defined.scenario.known.head
    ours = sd.methods.evaluate(
        traced.measurement, known.plan, head, known.chain, known.tool, method="enhanced"
    ).functions
    theirs = defined.calibrations["enhanced"].functions
    for name in theirs:
        # 34 nm of spot over an arm of twice 131 mm are 130 nrad, most of it constant along a line; over a lateral
        # travel of 16 mm at each of 150 steps that drifts by some nanometres.
        limit = 130e-9 if name[1] in "ABC" else 20e-6
        assert np.max(np.abs(ours[name][1] - theirs[name][1])) < limit, name


@pytest.mark.parametrize("name", POSITIONING)
def test_screw_error_is_right_at_the_nodes_and_unseen_between_them(results: dict[str, Result], name: str) -> None:
    at, between = between_nodes(results["4"], name)
    assert at < 15e-6  # as in 1a
    # The truth's own nodes come close to the crests of the sine, not onto them: 90 % of the amplitude is always seen.
    assert between > 0.9 * SCREW_AMPLITUDE


def test_screw_of_10_mm_cannot_be_seen_in_steps_of_10_mm() -> None:
    assert alias_of(10.0) == "nothing"
    assert alias_of(12.0) == "a period of 60 mm"
    assert alias_of(16.0) == "a period of 40 mm"


def test_every_file_is_sound(demo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = sorted([*demo.glob("**/*.csv"), *demo.glob("**/*.toml")])
    assert len(files) == 5 * len(CASES) + 2
    # The conventional evaluation of machines that turn contradicts its readings, as the enhanced one's of the displaced
    # sensor: their files say so.
    assert main(["check", *map(str, files)]) == 3
    kinds = [line.split(": ")[1] for line in capsys.readouterr().out.splitlines() if ": warning: " not in line]
    assert {kind: kinds.count(kind) for kind in kinds} == {
        "calibration": 3 * len(CASES),
        "measurement": len(CASES),
        "scenario": len(CASES),
        "error map": 2,
    }


@pytest.mark.slow
@pytest.mark.parametrize("case", ["1b", "3", "4"])
def test_commands_go_on_from_the_files_with_the_same_tables(demo: Path, case: str, tmp_path: Path) -> None:
    scenario, run = str(demo / case / "scenario.toml"), str(demo / case / "run.csv")
    assert main(["simulate", scenario, "-o", str(tmp_path / "run.csv")]) == 0
    assert (tmp_path / "run.csv").read_bytes() == (demo / case / "run.csv").read_bytes()
    for method in ("conventional", "enhanced", "adjustment"):
        status = main(["evaluate", scenario, run, "-m", method, "-o", str(tmp_path / "out.csv")])
        fit = sd.read_calibration(tmp_path / "out.csv").fit
        assert status == (3 if fit == "rejected" else 0)
        assert fit == "rejected" if method == "conventional" else method == "enhanced" or fit != "rejected"
        dated = (tmp_path / "out.csv").read_text().splitlines()
        # The command knows its files, and says of a linear method what the adjustment says too.
        own = [
            "date",
            *sd.Calibration.provenance_keys(),
            *(["fit", "fit_codes", "fit_reasons"] if method != "adjustment" else []),
        ]
        plain, made = (
            [line for line in lines if not line.startswith(tuple(f"# {key}=" for key in own))]
            for lines in (dated, (demo / case / f"{method}.csv").read_text().splitlines())
        )
        assert plain == made


@pytest.mark.slow
def test_demo_makes_the_same_bytes_again(demo: Path, tmp_path: Path) -> None:
    assert main(["demo", "-o", str(tmp_path / "again")]) == 0
    files = [path.relative_to(demo) for path in sorted(demo.rglob("*")) if path.is_file()]
    again = [path.relative_to(tmp_path / "again") for path in sorted(tmp_path.rglob("*")) if path.is_file()]
    assert files == again
    for file in files:
        assert (demo / file).read_bytes() == (tmp_path / "again" / file).read_bytes(), file


def table_of_report(report: str) -> dict[tuple[str, str], list[str]]:
    """The cells of the error table, by case and method."""
    cells, case = {}, ""
    for line in report.split("\n\n")[0].splitlines()[3:]:
        name, *rest = line.split()
        if line.startswith("   "):
            cells[case, name] = rest
        else:
            case = name
    return cells


def test_page_on_the_paper_has_the_numbers_of_the_demo(demo: Path) -> None:
    page = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
    table = table_of_report((demo / "report.txt").read_text(encoding="utf-8"))
    rows = re.findall(r"^\|.*\((\d\w?)(?:, \w+)?\) \| (.+) \|$", page, re.MULTILINE)
    assert [panel for panel, _ in rows] == ["1a", "1b", "1c", "1d", "3a"]
    for panel, row in rows:
        case = "3" if panel == "3a" else panel
        said = [cell.rsplit(maxsplit=1)[0] for cell in row.split(" | ")]
        made = [
            table[case, "conventional"][0],
            *(table[case, m][k] for m in ("enhanced", "adjustment") for k in (0, 2)),
        ]
        for cell, number in zip(said, made, strict=True):
            if cell.startswith("< "):
                assert float(number) < float(cell[2:]), case
            else:
                assert cell == f"{float(number):.{len(cell.partition('.')[2])}f}", case


def test_report_has_a_row_for_each_case_and_method(demo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = (demo / "report.txt").read_text(encoding="utf-8")
    assert {report.count(f"   {method} ") for method in ("conventional", "enhanced", "adjustment")} == {len(CASES)}
    assert "that of 1d" in report
    assert (demo / "figure.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in (demo / "figure.svg").read_bytes()
