"""Imports what the commands import and fills what the libraries remember, so that a forked child need not."""

import contextlib
import importlib
import io
import os
import pkgutil
from pathlib import Path


def warm() -> None:
    import stepdiag

    for name in ("matplotlib.backends.backend_agg", "matplotlib.backends.backend_svg", "netCDF4", "xarray", "openpyxl"):
        importlib.import_module(name)
    for module in pkgutil.walk_packages(stepdiag.__path__, "stepdiag."):
        if "__main__" not in module.name and not module.name.endswith(("linuxcnc.driver", "dask_preload")):
            importlib.import_module(module.name)


def warm_up(folder: Path) -> None:
    """Run commands with these inputs that take long for the first time: netCDF and figures."""
    from stepdiag.cli import main

    before = Path.cwd()
    os.chdir(folder)
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        for line in (
            "simulate scenario.toml -o warm.nc",
            "evaluate scenario.toml warm.nc -o warm_calibration.nc",
            "plot calibration.csv -o warm.svg",
            "plot run.csv -o warm.png",
            "head show beam_and_psd -o warm_head.svg",
            "uncertainty scenario.toml -m enhanced -n 4000 -o warm_uncertainty.nc",
            "study study.toml -o warm_study.nc",
        ):
            assert main(line.split()) in (0, 3), line
    for path in Path.cwd().glob("warm*"):
        path.unlink()
    os.chdir(before)
