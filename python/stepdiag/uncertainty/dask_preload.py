"""Preload module of stepdiag's own Dask schedulers and workers (Dask calls dask_setup)."""

from typing import Any


def dask_setup(server: Any) -> None:
    server.http_server.stop()  # Dask always starts it; see dask_workers
