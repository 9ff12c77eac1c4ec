"""Whether the packages of the application are installed."""

import importlib.util

from stepdiag._core import InvalidArgument


def check_installed() -> None:
    """Raises InvalidArgument naming what to install."""
    for name in ("starlette", "uvicorn"):
        if importlib.util.find_spec(name) is None:
            raise InvalidArgument(f"the application needs {name}: pip install 'stepdiag[app]'")
