"""The examples run as they stand, and importing the package stays quick."""

import subprocess
import sys
from pathlib import Path

import pytest
from places import EXAMPLES

import stepdiag as sd
from stepdiag.scenario.truth import errors_of


def output_of(*arguments: str | Path) -> str:
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=True)
    return done.stdout


def test_quickstart_shows_that_each_method_is_better_than_the_one_before() -> None:
    lines = output_of(EXAMPLES / "quickstart.py").splitlines()
    conventional, enhanced, adjustment, mirror, judged = lines
    assert conventional.startswith("conventional: positioning known to 100.0")
    assert enhanced.startswith("enhanced: positioning known to 0.0")
    assert adjustment == "adjustment: positioning known to 0.000000 µm"
    assert mirror == "the mirror stood at 100.000, 300.000 µrad on ppp"
    assert judged == "the run of examples/scenario.toml is accepted"


def test_program_of_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readme = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    (tmp_path / "program.py").write_text(readme.split("```python\n")[1].split("```")[0], encoding="utf-8")
    (tmp_path / "examples").symlink_to(EXAMPLES)
    monkeypatch.chdir(tmp_path)
    assert output_of("program.py").startswith("accepted []\n")
    assert sd.read_calibration("table.csv").fit == "accepted"
    assert "<html" in Path("report.html").read_text(encoding="utf-8")[:200]


def test_compensation_leaves_as_much_as_readme_says() -> None:
    readme = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    before, after = (
        line.split("largest error ")[1].split(" µm")[0]
        for line in output_of(EXAMPLES / "before_and_after.py").splitlines()
    )
    assert f"falls from {before} to {after} µm" in readme


def test_measurement_takes_as_long_as_readme_says(tmp_path: Path) -> None:
    said = output_of(
        "-m", "stepdiag", "nc", EXAMPLES / "better_plan.toml", "-o", tmp_path / "run.ngc", "--dialect", "iso"
    )
    readme = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    minutes, set_ups = (words.split()[-1] for words in said.split(" min")[:2])
    assert f"takes {minutes} minutes, {float(set_ups):g} of them for set-ups" in " ".join(readme.split())


def test_report_page_has_what_evaluate_prints(tmp_path: Path) -> None:
    run, out = tmp_path / "run.csv", tmp_path / "calibration.csv"
    sd.simulate(sd.read_scenario(EXAMPLES / "scenario.toml")).write(run)
    said = output_of("-m", "stepdiag", "evaluate", EXAMPLES / "scenario.toml", run, "-o", out)
    page = (EXAMPLES.parent / "docs" / "report.md").read_text(encoding="utf-8")
    *report, last = said.splitlines()
    assert "".join(f"    {line}\n" for line in report) in page
    assert last == f"wrote {out}"


def test_better_plan_is_as_much_better_as_the_page_on_plans_says(tmp_path: Path) -> None:
    paper, better = output_of(EXAMPLES / "two_plans.py", tmp_path / "plans.png").splitlines()
    assert (tmp_path / "plans.png").read_bytes().startswith(b"\x89PNG")
    paper_plan, better_plan = ((EXAMPLES / name).read_text() for name in ("scenario.toml", "better_plan.toml"))
    assert better_plan.split("[volume]")[1].replace('scale_points = "steps"\n', "") == paper_plan.split("[volume]")[1]
    page = " ".join((EXAMPLES.parent / "docs" / "plans.md").read_text(encoding="utf-8").split())
    for kind, said in {
        "positioning": "positioning falls from {} to {}",
        "straightness": "straightness from {} to {}",
        "angle": "angles from {} to {}",
    }.items():
        values = [line.split(f"{kind} ")[1].split(",")[0].split()[0] for line in (paper, better)]
        assert said.format(*values) in page


def test_method_page_has_the_tables_of_the_examples() -> None:
    page = (EXAMPLES.parent / "docs" / "method.md").read_text(encoding="utf-8")
    assert output_of(EXAMPLES / "variants.py") in page
    said = output_of("-m", "stepdiag", "observe", EXAMPLES / "scenario.toml")
    faults, by_steps = said.split("faults that the readings control")[1].split("largest standard uncertainties by")
    assert f"faults that the readings control{faults}" in page
    assert by_steps.split("mirror that they take:\n")[1] in page


@pytest.mark.slow
def test_page_on_rechecks_has_the_month_of_the_example(tmp_path: Path) -> None:
    page = (EXAMPLES.parent / "docs" / "verify.md").read_text(encoding="utf-8")
    assert output_of(EXAMPLES / "month_of_a_machine.py", tmp_path) in page
    days = ["plan", tmp_path / "day1.toml", "--recheck", tmp_path / "day0.nc", "--minutes", "10"]
    taken = next(line for line in output_of("-m", "stepdiag", *days).splitlines() if line.startswith("    * "))
    cells = taken.split()[-6:-2]
    assert all(cell in page for cell in cells)


def test_own_measurement_goes_from_files_to_a_table(tmp_path: Path) -> None:
    scenario = EXAMPLES / "scenario.toml"
    sd.simulate(sd.read_scenario(scenario)).write(tmp_path / "run.csv")
    assert output_of(EXAMPLES / "own_measurement.py", scenario, tmp_path / "run.csv").startswith("EXX at x = 400 mm")


@pytest.mark.parametrize(("rotation", "verdict"), [(2.0, "accepted"), (30.0, "rejected")])
def test_small_machine_of_figure_2_needs_no_tilts_while_its_angles_are_small(rotation: float, verdict: str) -> None:
    text = (EXAMPLES / "paper_figure2.toml").read_text(encoding="utf-8")
    assert "rotation_urad = 2.0" in text
    scenario = sd.parse_scenario(text.replace("rotation_urad = 2.0", f"rotation_urad = {rotation}"))
    assert list(scenario.known.plan.volume) == [260.0, 420.0, 160.0]
    found = sd.methods.adjust_scenario(scenario, sd.simulate(scenario))
    assert found.verdict.fit == verdict
    if verdict == "accepted":
        worst = sd.largest_deviations(found.calibration, errors_of(scenario.truth, scenario.known))
        # Six times the largest standard uncertainty, 0.5 um: angles of 2 urad on arms of 0.4 m add 0.8 um.
        assert max(abs(worst[kind].value) for kind in ("positioning", "straightness")) < 3e-3


def test_import_brings_nothing_heavy() -> None:
    heavy = "('matplotlib', 'xarray', 'pandas', 'pydantic')"
    code = f"import sys, stepdiag.cli; print([m for m in {heavy} if m in sys.modules])"
    assert output_of("-c", code).strip() == "[]"


def test_evaluating_a_scenario_imports_neither_plots_nor_tables() -> None:
    code = (
        "import sys, stepdiag as sd; sd.read_scenario(sys.argv[1]); "
        "print([m for m in ('matplotlib', 'xarray', 'pandas') if m in sys.modules])"
    )
    assert output_of("-c", code, EXAMPLES / "scenario.toml").strip() == "[]"


def test_every_exported_name_is_there() -> None:
    for name in sd.__all__:
        assert getattr(sd, name) is not None
    assert set(sd.__all__) <= set(dir(sd))
