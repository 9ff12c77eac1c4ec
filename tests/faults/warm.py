"""Imports what the commands import, so that a forked child need not."""

import importlib
import pkgutil


def warm() -> None:
    import stepdiag

    for name in ("matplotlib.backends.backend_agg", "matplotlib.backends.backend_svg", "netCDF4", "xarray", "openpyxl"):
        importlib.import_module(name)
    for module in pkgutil.walk_packages(stepdiag.__path__, "stepdiag."):
        if "__main__" not in module.name and not module.name.endswith(("linuxcnc.driver", "dask_preload")):
            importlib.import_module(module.name)
