"""Commands import what they use: which modules they do not wait for."""

import subprocess
import sys
from pathlib import Path

import pytest
from places import EXAMPLES

import stepdiag as sd

PROGRAM = (
    "import sys, stepdiag.cli as cli; words = sys.argv.pop(1).split(); status = cli.main(); "
    "print('imported:', *[word for word in words if word in sys.modules]); sys.exit(status)"
)


def imported_of(modules: str, *arguments: str | Path) -> str:
    """Which of these modules a command has imported at its end."""
    command = [sys.executable, "-c", PROGRAM, modules, *map(str, arguments)]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return said.split("imported:")[1].strip()


def test_help_imports_neither_numpy_nor_a_command() -> None:
    modules = (
        "numpy pydantic tomllib hashlib stepdiag.cli.evaluate stepdiag.cli.options stepdiag.cli.at_machine.acquire"
    )
    assert imported_of(modules, "--help") == ""


def test_evaluating_to_csv_imports_no_netcdf_and_no_search_that_is_not_made(tmp_path: Path) -> None:
    scenario, run = EXAMPLES / "scenario.toml", tmp_path / "run.csv"
    sd.simulate(sd.read_scenario(scenario)).write(run)
    modules = (
        "netCDF4 xarray pandas matplotlib numpy.ma concurrent.futures tqdm "
        "stepdiag.head.description stepdiag.presentation.objects.evaluation stepdiag.cli.at_machine.acquire"
    )
    assert imported_of(modules, "evaluate", scenario, run, "-o", tmp_path / "calibration.csv") == ""


@pytest.mark.slow
def test_netcdf_files_need_neither_xarray_nor_pandas(tmp_path: Path) -> None:
    scenario, run, calibration = EXAMPLES / "scenario.toml", tmp_path / "run.nc", tmp_path / "calibration.nc"
    modules = "xarray pandas matplotlib dask scipy"
    assert imported_of(modules, "simulate", scenario, "-o", run) == ""
    assert imported_of(modules, "evaluate", scenario, run, "-o", calibration) == ""
    for command in ("volume", "report", "check"):
        assert imported_of(modules, command, calibration) == ""
    assert imported_of(modules, "compare", calibration, calibration, "-o", tmp_path / "changes.nc") == ""
