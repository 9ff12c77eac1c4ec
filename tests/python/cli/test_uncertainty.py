"""`stepdiag uncertainty`: tables, files, an interruption that loses nothing, and one clear line for a mistake."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import xarray as xr
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag import platform
from stepdiag.cli import main
from stepdiag.progress import Progress
from stepdiag.uncertainty import write as uncertainty_write
from stepdiag.uncertainty.run import UncertaintyRequest, evaluate_uncertainty

UNCERTAIN = """[uncertainty]
distance_um = 0.1
tilt_urad = 1.0
reflector_urad = 100.0
scale_ppm = {distribution = "rectangular", half_width = 2.0}
"""
# One leaf of samples is 2,000, the pilot run five; seven leaves leave something to do after an interruption.
SAMPLES = "1.4e4"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with a scenario that says what is uncertain."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenario.toml").write_text(SCENARIO + UNCERTAIN)
    return tmp_path


def run(*arguments: str) -> int:
    return main(["uncertainty", "scenario.toml", *arguments])


# --- what is told ----------------------------------------------------------------------------------------------------
def test_without_samples_the_propagation_is_told_with_its_budget(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run() == 0
    said = capsys.readouterr().out
    for family in ("positioning", "straightness", "angle", "squareness"):
        assert said.count(f"  {family}") == 2, "a row of the table and one of the budget"
    assert "11 inputs, 3 kinds of noise" in said
    assert "Monte Carlo" not in said


@pytest.mark.slow
def test_budget_names_what_matters_most(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (SCENARIO + UNCERTAIN).replace("half_width = 2.0", "half_width = 2000.0")
    Path("scenario.toml").write_text(text)
    assert run() == 0
    budget = capsys.readouterr().out.split("shares of the variance")[1]
    (row,) = [line for line in budget.splitlines() if line.startswith("  positioning")]
    # 1155 ppm of 80 mm are 92 µm, beside 0.1 µm of noise.
    assert row.split()[1] == "scale"


def test_samples_are_told_beside_the_propagation(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("-n", SAMPLES, "--compare") == 0
    said = capsys.readouterr().out
    assert "14,000 samples, seed 0" in said
    assert "JCGM 101" in said


def test_inputs_are_listed_by_the_names_that_correlations_take(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("--inputs") == 0
    said = capsys.readouterr().out
    assert "reflector a of ppp" in said
    assert "normal, standard uncertainty 100 µrad" in said
    assert "rectangular, standard uncertainty 1.15 ppm" in said
    assert len(said.splitlines()) == 11 + 3


def test_error_at_a_point_is_told_with_its_uncertainty(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--point", "40,30,25", "--point", "40,30,25,0,0,-100", "-n", SAMPLES, "-o", "u.nc") == 0
    said = capsys.readouterr().out
    assert said.count("(40, 30, 25)") >= 12
    with xr.open_dataset("u.nc") as table:
        assert table.sizes["derived"] == 12
        u = table["derived_u"].values
        # The same samples of a linear combination: noise of both is 1 % of u.
        assert u == pytest.approx(table["derived_propagated_u"].values, rel=0.05)
        tilted = u[table["derived_units"].values == "mm"].reshape(2, 3)
        assert np.all(tilted[1, :2] > tilted[0, :2]), "a longer tool makes more of an angle"


def test_ranges_over_the_volume_are_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--volume", "-o", "u.nc") == 0
    said = capsys.readouterr().out
    assert "V_X" in said
    assert "E_D nnp" in said
    with xr.open_dataset("u.nc") as table:
        assert np.all(table["range_low"].values <= table["range_high"].values)


# --- files -----------------------------------------------------------------------------------------------------------
def test_file_has_covariance_joint_region_and_kept_samples(folder: Path) -> None:
    wanted = ("--covariance", "--keep", "C0Y", "--keep", "EXX@80", "--joint", "C0Y,B0Z")
    assert run("-n", SAMPLES, *wanted, "-o", "u.nc") == 0
    with xr.open_dataset("u.nc") as table:
        kept = table["kept_samples"].values
        names = table["kept_name"].values.tolist()
        assert sorted(names) == ["C0Y", "EXX at 80 mm"]
        squareness = kept[names.index("C0Y")]
        assert squareness.shape == (14_000,)
        # Sums in another order.
        assert squareness.mean() == pytest.approx(table["C0Y"].item(), abs=1e-9 * table["C0Y_u"].item())
        assert squareness.std(ddof=1) == pytest.approx(table["C0Y_u"].item(), rel=1e-9)
        (k,) = np.flatnonzero(table["output_name"].values == "C0Y")
        assert table["covariance"].values[k, k] == pytest.approx(table["C0Y_u"].item() ** 2, rel=1e-9)
        assert table["joint_a_name"].values.tolist() == ["C0Y", "B0Z"]
        assert table.attrs["samples"] == 14_000


def test_result_has_the_same_bytes_for_any_number_of_threads(folder: Path) -> None:
    for threads in ("1", "2"):
        assert run("-n", SAMPLES, "--threads", threads, "-o", f"{threads}.nc") == 0
    assert Path("1.nc").read_bytes() == Path("2.nc").read_bytes()


def test_another_seed_gives_other_samples(folder: Path) -> None:
    for seed in ("0", "1"):
        assert run("-n", SAMPLES, "--seed", seed, "-o", f"{seed}.csv") == 0
    assert Path("0.csv").read_text() != Path("1.csv").read_text()


@pytest.mark.parametrize("method", ["conventional", "enhanced", "adjustment", "one_step"])
def test_every_method_is_drawn_and_propagated(folder: Path, method: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("-n", "1e4", "-m", method, "-o", "u.nc") == 0
    assert f"method {method}" in capsys.readouterr().out
    with xr.open_dataset("u.nc") as table:
        drawn, propagated = table["EXX_u"].values[1:], table["EXX_propagated_u"].values[1:]
    # 10,000 samples know a standard deviation to 0.7 %; the scenario is all but linear.
    assert drawn == pytest.approx(propagated, rel=0.05)


def test_python_gives_what_the_command_gives(folder: Path) -> None:
    assert run("-n", SAMPLES, "-o", "u.nc") == 0
    found = evaluate_uncertainty(sd.read_scenario("scenario.toml"), UncertaintyRequest(samples=14_000))
    with xr.open_dataset("u.nc") as table:
        rows = [k for k, output in enumerate(found.outputs) if output.name == "EXX"]
        assert found.monte_carlo is not None
        assert table["EXX_u"].values.tobytes() == found.monte_carlo.standard_uncertainty[rows].tobytes()


# --- interruption ----------------------------------------------------------------------------------------------------
def test_interrupted_run_goes_on_to_the_same_bytes(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("-n", SAMPLES, "-o", "whole.nc") == 0
    capsys.readouterr()

    with monkeypatch.context() as patched:
        patched.setattr(Progress, "__call__", interrupt)
        assert run("-n", SAMPLES, "-o", "u.nc") == 130
    said = capsys.readouterr()
    assert "--resume" in said.err
    assert "u.nc.checkpoint" in said.err
    assert not Path("u.nc").exists()
    assert Path("u.nc.checkpoint").exists()
    assert run("-n", SAMPLES, "-o", "u.nc", "--resume") == 0
    assert Path("u.nc").read_bytes() == Path("whole.nc").read_bytes()
    assert not Path("u.nc.checkpoint").exists(), "of no more use"


def interrupt(self: Progress, done: int, total: int) -> None:
    """In place of the progress bar."""
    if done > 0:
        raise KeyboardInterrupt


def test_checkpoint_of_an_interrupted_run_is_not_overwritten_by_another(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(Progress, "__call__", interrupt)
        assert run("-n", SAMPLES) == 130
    kept = Path("scenario.checkpoint").read_bytes()
    capsys.readouterr()
    assert run("-n", SAMPLES, "--seed", "1") == 2
    assert "scenario.checkpoint: is the checkpoint of an earlier run: --resume continues it" in capsys.readouterr().err
    assert run() == 0, "a propagation draws nothing"
    assert Path("scenario.checkpoint").read_bytes() == kept
    assert run("-n", SAMPLES, "--resume") == 0
    assert not Path("scenario.checkpoint").exists()


def disk_full(*_: Any) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def ctrl_c(*_: Any) -> None:
    raise KeyboardInterrupt


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["nc", "csv"])
@pytest.mark.parametrize(
    ("failure", "status", "said"), [(disk_full, 2, "No space left on device"), (ctrl_c, 130, "interrupted")]
)
@pytest.mark.parametrize("where", [(os, "fsync"), (platform, "replace"), (platform, "sync_folder")])
def test_result_that_cannot_be_written_leaves_the_checkpoint(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    where: tuple[ModuleType, str],
    failure: Callable[..., None],
    status: int,
    said: str,
    ending: str,
) -> None:
    assert run("-n", SAMPLES, "-o", f"whole.{ending}") == 0
    with monkeypatch.context() as patched:

        def write(*arguments: Any) -> None:
            patched.setattr(*where, failure)
            written(*arguments)

        written = uncertainty_write.write_uncertainty
        patched.setattr(uncertainty_write, "write_uncertainty", write)
        assert run("-n", SAMPLES, "-o", f"u.{ending}") == status
    told = capsys.readouterr().err
    assert said in told
    assert f"u.{ending}.checkpoint has the finished samples: repeat the command with --resume" in told
    assert run("-n", SAMPLES, "-o", f"u.{ending}", "--resume") == 0
    assert Path(f"u.{ending}").read_bytes() == Path(f"whole.{ending}").read_bytes()
    assert {path.name for path in folder.iterdir()} == {"scenario.toml", f"whole.{ending}", f"u.{ending}"}


def test_result_is_on_the_disk_before_the_checkpoint_goes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    events: list[tuple[str, str]] = []

    def synced(to: Callable[[Path], None] = platform.sync_folder) -> Callable[[Path], None]:
        return lambda path: (to(path), events.append(("synced", ",".join(sorted(p.name for p in path.iterdir())))))[0]

    def unlinked(path: Path, missing_ok: bool = False, to: Any = Path.unlink) -> None:
        to(path, missing_ok=missing_ok)
        events.append(("removed", path.name))

    monkeypatch.setattr(platform, "sync_folder", synced())
    monkeypatch.setattr(Path, "unlink", unlinked)
    assert run("-n", SAMPLES, "-o", "u.csv") == 0
    assert events[-2:] == [("synced", "scenario.toml,u.csv,u.csv.checkpoint"), ("removed", "u.csv.checkpoint")]


# --- what is refused -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("samples", [0, -1])
def test_a_request_without_samples_is_refused(folder: Path, samples: int) -> None:
    with pytest.raises(sd.InvalidArgument, match=f"`samples`: expected at least 1, .* got {samples}"):
        evaluate_uncertainty(sd.read_scenario("scenario.toml"), UncertaintyRequest(samples=samples))


REFUSED = [
    (["-n", "many"], "expected a whole number such as 100000 or 1e6, got 'many'"),
    (["-n", "1.5"], "expected a whole number"),
    (["-n", "0"], "expected a whole number"),
    (["--compare"], "--compare: goes with the Monte Carlo method: -n or --adaptive"),
    (["--keep", "C0Y", "-o", "u.nc"], "--keep: goes with the Monte Carlo method"),
    (["--resume"], "--resume: goes with the Monte Carlo method"),
    (["--checkpoint", "u.checkpoint"], "--checkpoint: goes with the Monte Carlo method"),
    (["-n", "1e4", "--keep", "C0Y"], "--keep: expected -o with a name that ends in .nc"),
    (["-n", "1e4", "--covariance", "-o", "u.csv"], "--covariance: expected -o with a name that ends in .nc"),
    (["-n", "1e4", "--keep", "C0Z", "-o", "u.nc"], "--keep: 'C0Z' is no output; did you mean"),
    (["-n", "1e4", "--joint", "C0Y,C0Y"], "--joint: expected one to 3 different outputs, such as C0Y,B0Z, got"),
    (["-n", "1e4", "--joint", "C0Y,B0Z,A0Z,EXX"], "--joint: expected one to 3 different outputs"),
    (["--coverage", "95"], "--coverage: expected a probability between 0 and 1, got 95"),
    (["--point", "1,2"], "expected X,Y,Z in mm, or X,Y,Z followed by a tool offset"),
    (["--point", "1,2,nan"], "expected X,Y,Z in mm"),
    (["-o", "u.txt"], "u.txt: expected a name that ends in .nc or .csv"),
    (["-o", "nowhere/u.nc"], "the folder nowhere does not exist"),
    (["-n", "1e4", "--digits", "4"], "4 is not in the range 1<=x<=3"),
    (["-m", "guess"], "'guess' is not one of"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "message"), REFUSED, ids=[" ".join(arguments) for arguments, _ in REFUSED])
def test_mistake_is_told_in_one_line(
    folder: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert sorted(path.name for path in folder.iterdir()) == ["scenario.toml"]


def test_checkpoint_of_another_run_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(Progress, "__call__", interrupt)
        assert run("-n", SAMPLES, "--checkpoint", "c.checkpoint") == 130
    capsys.readouterr()
    assert run("-n", SAMPLES, "--checkpoint", "c.checkpoint", "--resume", "--seed", "1") == 2
    assert "seed" in capsys.readouterr().err
    Path("scenario.toml").write_text((SCENARIO + UNCERTAIN).replace("reflector_urad = 100.0", "reflector_urad = 101.0"))
    assert run("-n", SAMPLES, "--checkpoint", "c.checkpoint", "--resume") == 2
    assert capsys.readouterr().err.startswith("stepdiag: error: c.checkpoint: ")


def test_scenario_that_no_machine_can_run_is_refused_by_its_key(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("scenario.toml").write_text(SCENARIO + "[uncertainty]\nreflektor_urad = 100.0\n")
    assert run() == 2
    assert "uncertainty.reflektor_urad: unknown key; did you mean reflector_urad?" in capsys.readouterr().err
