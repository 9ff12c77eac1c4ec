"""`stepdiag study`: a grid of scenarios, cells as if each were computed alone, and what an interruption leaves."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from places import EXAMPLES, SHIPPED_HEADS
from small_scenario import SCENARIO

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.cli import main
from stepdiag.config.toml_text import parse_toml
from stepdiag.scenario.description import read_scenario, simulate_scenario
from stepdiag.scenario.packed import pack_scenario, unpacked
from stepdiag.uncertainty.dask_workers import workers_of
from stepdiag.uncertainty.run import UncertaintyRequest, evaluate_uncertainty
from stepdiag.uncertainty.study import FinishedCells, run_study, tasks_of
from stepdiag.uncertainty.study_cell import CellResult, compute_cell
from stepdiag.uncertainty.study_keys import read_study
from stepdiag.uncertainty.study_table import study_table

SMALL = """
[study]
scenario = "scenario.toml"
samples = 2000
[grid]
plan.steps = [2, 3]
[together.noise]
noise.distance_um = [0.1, 0.2]
noise.tilt_urad = [1.0, 2.0]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    Path("study.toml").write_text(SMALL)
    return tmp_path


# --- the grid --------------------------------------------------------------------------------------------------------
def test_grid_is_the_product_and_groups_go_together(folder: Path) -> None:
    study = read_study("study.toml")
    assert study.shape == (2, 2, 1)
    cells = list(study.cells())
    assert [cell.index for cell in cells] == [(0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0)]
    assert cells[1].name == "plan.steps = 2, noise.distance_um = 0.2, noise.tilt_urad = 2.0, method = adjustment"
    assert cells[3].content["noise"] == {"distance_um": 0.2, "tilt_urad": 2.0, "seed": 3}
    assert cells[3].content["volume"] == study.content["volume"]


def test_check_knows_a_study(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "study.toml"]) == 0
    assert capsys.readouterr().out == "study.toml: study: 2 x 2 x 1 cells of 2000 samples\n"


def test_quoted_and_nested_keys_are_the_same(folder: Path) -> None:
    dotted = read_study("study.toml")
    Path("study.toml").write_text(SMALL.replace("plan.steps =", '"plan.steps" ='))
    assert read_study("study.toml").axes == dotted.axes


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("plan.steps = [2, 3]", "plan.stepz = [2, 3]", "plan.stepz: unknown key; did you mean steps?"),
        ("plan.steps = [2, 3]", "plan.steps = [2, 0]", "plan.steps = 0, noise.distance_um = 0.1"),
        ("plan.steps = [2, 3]", "plan.steps = [2, 0]", "scenario.toml: plan.steps: expected an integer from 1 to 2000"),
        ("plan.steps = [2, 3]", "plan.steps = 2", "grid.plan.steps: expected a list of values to try, got 2"),
        ("plan.steps = [2, 3]", "plan.steps = []", "grid.plan.steps: expected a list of values to try, got []"),
        ("plan.steps = [2, 3]", "steps = [2, 3]", "grid.steps: expected a key of the scenario with its section"),
        ("plan.steps = [2, 3]", "noise.tilt_urad = [2.0]", "together.noise.noise.tilt_urad: is also in grid"),
        (
            "tilt_urad = [1.0, 2.0]",
            "tilt_urad = [1.0]",
            "together.noise: expected lists of one length, got 2 of noise.",
        ),
        ("samples = 2000", "samples = -1", "study.samples: expected a whole number from 0 to 4e9, got -1"),
        ("samples = 2000", 'methods = ["magic"]', "study.methods: expected a list of "),
        ("samples = 2000", 'methods = ["enhanced", "enhanced"]', "study.methods: expected each method once"),
        ("samples = 2000", "sample = 2000", "study.sample: unknown key; did you mean samples?"),
        ("[grid]", "[grad]", "grad: unknown section; did you mean grid?"),
        ('"scenario.toml"', '"no.toml"', "no.toml: cannot be read"),
        (
            "plan.steps = [2, 3]",
            f"plan.steps = {list(range(1, 1000))}\nnoise.seed = {list(range(20))}",
            "at most 10000",
        ),
    ],
)
def test_mistakes_are_said_before_anything_runs(
    folder: Path, old: str, new: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert old in SMALL
    Path("study.toml").write_text(SMALL.replace(old, new))
    assert main(["study", "study.toml", "-o", "study.nc"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("stepdiag: error: study.toml: ")
    assert message in said
    assert said.count("\n") == 1
    assert {path.name for path in folder.iterdir()} == {"scenario.toml", "study.toml"}


# --- scenarios that travel -------------------------------------------------------------------------------------------
def test_packed_scenario_makes_the_same_run_without_its_files(folder: Path) -> None:
    (folder / "parts").mkdir()
    _core.random_error_map((80.0, 60.0, 50.0), seed=4, intervals=5).write(folder / "parts" / "map.csv")
    shutil.copy(SHIPPED_HEADS / "beam_and_psd.toml", folder / "parts" / "own.toml")
    text = SCENARIO.replace("[machine.random]\nseed = 7", 'errors = "parts/map.csv"')
    text = text.replace('layout = "ideal"', 'description = "parts/own.toml"').replace("steps = 5", "steps = 2")
    Path("scenario.toml").write_text(text)
    expected = simulate_scenario(read_scenario("scenario.toml"))
    packed = pack_scenario(parse_toml(text, "scenario.toml"), "scenario.toml")
    shutil.rmtree(folder / "parts")
    with unpacked(packed) as scenario:
        run = simulate_scenario(scenario)
    assert {name: value.tobytes() for name, value in run.channels.items()} == {
        name: value.tobytes() for name, value in expected.channels.items()
    }
    with pytest.raises(InvalidArgument, match=r"^scenario.toml: machine.errors: parts/map.csv: cannot be read"):
        pack_scenario(parse_toml(text, "scenario.toml"), "scenario.toml")


def test_unpacked_scenario_is_named_as_at_home(folder: Path) -> None:
    packed = pack_scenario(parse_toml(SCENARIO.replace('"ppp", ', '"ppx", '), ""), "somewhere/scenario.toml")
    with pytest.raises(InvalidArgument, match=r"^somewhere/scenario.toml: plan: "), unpacked(packed):
        pass


# --- cells -----------------------------------------------------------------------------------------------------------
def test_cell_is_what_uncertainty_says_of_its_scenario(folder: Path) -> None:
    study = read_study("study.toml")
    task = tasks_of(study)[3]
    found = compute_cell(task.job)
    changed = SCENARIO.replace("steps = 5", "steps = 3").replace(
        "distance_um = 0.1", "distance_um = 0.2\ntilt_urad = 2.0"
    )
    Path("scenario.toml").write_text(changed)
    alone = evaluate_uncertainty(read_scenario("scenario.toml"), UncertaintyRequest(samples=2000)).monte_carlo
    of = [k for k, output in enumerate(alone.outputs) if output.name == "EXX"]
    assert found.figures["EXX"]["u"] == (max(alone.standard_uncertainty[of]), np.median(alone.standard_uncertainty[of]))
    lengths = alone.shortest[of, 1] - alone.shortest[of, 0]
    assert found.figures["EXX"]["shortest"][0] == max(lengths)
    assert found.figures["positioning"]["u"][0] == max(found.figures[f"E{a}{a}"]["u"][0] for a in "XYZ")
    assert (found.samples, found.lost) == (2000, 0)
    assert CellResult.from_json(found.to_json()) == found


def test_cell_that_cannot_be_computed_is_data(folder: Path) -> None:
    Path("study.toml").write_text(
        SMALL.replace("samples = 2000", 'samples = 0\nmethods = ["conventional", "enhanced"]').replace(
            "plan.steps = [2, 3]", 'plan.lines = [["pp0", "np0", "p0p", "n0p", "0pp", "0np"]]'
        )
    )
    assert main(["study", "study.toml", "-o", "study.nc"]) == 0
    with xr.open_dataset("study.nc") as table:
        assert table["failure"].dims == ("plan_lines", "noise", "evaluation")
        said = str(table["failure"].sel(evaluation="conventional").values[0, 0])
        assert said.startswith("scenario.toml: ")
        assert "diagonal" in said


def test_example_is_a_table_with_units_and_words(tmp_path: Path) -> None:
    output = tmp_path / "study.nc"
    assert main(["study", str(EXAMPLES / "study.toml"), "-o", str(output)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["study.nc"]
    with xr.open_dataset(output) as table:
        assert dict(table.sizes) == {"plan_steps": 2, "uncertainty_tilt_urad": 2, "evaluation": 2}
        assert table["uncertainty_tilt_urad"].attrs["units"] == "urad"
        assert table["plan_steps"].values.tolist() == [5, 10]
        for name, variable in table.data_vars.items():
            assert variable.attrs.get("long_name"), name
            assert "units" in variable.attrs or variable.dtype.kind in "OSU", name
        u = table["angle_u_largest"].sel(evaluation="enhanced")
        # Angles are sums of tilts alone: four times the noise gives four times the uncertainty, but for 2000 samples.
        np.testing.assert_allclose(u[:, 1] / u[:, 0], 4.0, rtol=0.05)
        np.testing.assert_allclose(table["angle_u_largest"], table["angle_propagated_u_largest"], rtol=0.1)
        assert (table["failure"] == "").all()


# --- interrupted -----------------------------------------------------------------------------------------------------
def interrupt_after(count: int) -> Callable[[int, int], None]:
    def progress(done: int, of: int) -> None:
        if done == count:
            raise KeyboardInterrupt

    return progress


def test_interrupted_study_goes_on_to_the_same_table(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    study = read_study("study.toml")
    whole = study_table(study, run_study(study, FinishedCells(folder / "whole.cells", resume=False)))
    stopped = FinishedCells(folder / "study.nc.cells", resume=False)
    with pytest.raises(KeyboardInterrupt):
        run_study(study, stopped, progress=interrupt_after(2))
    stopped.close()
    with open(stopped.path, "a") as file:
        file.write('0123 {"figures": {"EX')  # what a fall of the power leaves
    assert main(["study", "study.toml", "-o", "study.nc"]) == 2
    assert "--resume continues it, or delete the file" in capsys.readouterr().err
    computed = []
    monkeypatch.setattr(
        "stepdiag.uncertainty.study.compute_cell", lambda job: computed.append(job) or compute_cell(job)
    )
    assert main(["study", "study.toml", "-o", "study.nc", "--resume"]) == 0
    assert len(computed) == 2
    assert not stopped.path.exists()
    with xr.open_dataset("study.nc") as table:
        assert {*table.data_vars} == {*whole.data_vars}
        for name in whole.data_vars:
            assert np.array_equal(table[name].values, whole[name].values), name


def test_changed_study_computes_what_has_changed(folder: Path) -> None:
    study = read_study("study.toml")
    kept = FinishedCells(folder / "study.nc.cells", resume=False)
    run_study(study, kept)
    kept.close()
    Path("study.toml").write_text(SMALL.replace("[2, 3]", "[3, 4]"))
    changed = read_study("study.toml")
    again = FinishedCells(kept.path, resume=True)
    assert [again.find(task) is not None for task in tasks_of(changed)] == [True, True, False, False]
    again.close()


def test_interruption_of_the_command_gives_130_and_says_how_to_go_on(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done = []

    def interrupted(job: object) -> CellResult:
        if done:
            raise KeyboardInterrupt
        done.append(job)
        return compute_cell(job)  # type: ignore[arg-type]

    monkeypatch.setattr("stepdiag.uncertainty.study.compute_cell", interrupted)
    assert main(["study", "study.toml", "-o", "study.nc"]) == 130
    assert "study.nc.cells has the finished cells: repeat the command with --resume" in capsys.readouterr().err
    assert not Path("study.nc").exists()
    assert Path("study.nc.cells").exists()


# --- elsewhere -------------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_study_on_workers_is_that_of_this_process(folder: Path) -> None:
    study = read_study("study.toml")
    here = run_study(study, FinishedCells(folder / "here.cells", resume=False))
    with workers_of(count=2) as workers:
        there = run_study(study, FinishedCells(folder / "there.cells", resume=False), workers=workers)
    assert list(there) == list(here)
    for index, cell in here.items():
        assert cell.figures == there[index].figures
        assert cell.figures["EXX"]["u"][0] > 0.0


def test_uncertainty_on_workers_writes_what_it_writes_here(folder: Path) -> None:
    _core.random_error_map((80.0, 60.0, 50.0), seed=4, intervals=5).write(folder / "map.csv")
    Path("scenario.toml").write_text(SCENARIO.replace("[machine.random]\nseed = 7", 'errors = "map.csv"'))
    arguments = ["uncertainty", "scenario.toml", "-n", "30000", "--point", "40,30,20", "--keep", "C0Y"]
    assert main([*arguments, "-o", "here.nc"]) == 0
    assert main([*arguments, "-o", "there.nc", "--workers", "2"]) == 0
    with xr.open_dataset("here.nc") as here, xr.open_dataset("there.nc") as there:
        assert there.identical(here)


def test_scheduler_and_workers_exclude_each_other(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    both = ["--workers", "2", "--scheduler", "tcp://127.0.0.1:9"]
    assert main(["study", "study.toml", "-o", "study.nc", *both]) == 2
    assert "--workers: cannot be combined with --scheduler" in capsys.readouterr().err
    assert main(["uncertainty", "scenario.toml", "--workers", "2"]) == 2
    assert "--scheduler and --workers: go with the Monte Carlo method" in capsys.readouterr().err
    assert {path.name for path in folder.iterdir()} == {"scenario.toml", "study.toml"}


# --- samples without a result ----------------------------------------------------------------------------------------
def test_commands_whose_samples_are_survivors_end_untrusted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    narrow = SCENARIO.replace('layout = "ideal"', 'layout = "ideal"\naperture_mm = 3.0')
    Path("scenario.toml").write_text(narrow + "[uncertainty]\nlaser_urad = 3000.0\n")
    assert main(["uncertainty", "scenario.toml", "-n", "2000", "-m", "enhanced", "-o", "u.nc"]) == 3
    said = capsys.readouterr()
    assert said.out.startswith("not to be trusted: 1,")
    assert said.err.startswith("warning: 1,")
    assert "virtual calibrations gave no result" in said.err
    with xr.open_dataset("u.nc") as table:
        assert "gave no result" in table.attrs["warning"]
    one_cell = '[study]\nscenario = "scenario.toml"\nsamples = 2000\nmethods = ["enhanced"]\n[grid]\nplan.steps = [2]\n'
    Path("study.toml").write_text(one_cell)
    assert main(["study", "study.toml", "-o", "s.nc"]) == 3
    assert "warning: cells not to be trusted: 1; in one of them, " in capsys.readouterr().err
