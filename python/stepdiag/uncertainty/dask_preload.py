"""Preload module of stepdiag's own Dask schedulers and workers (Dask calls dask_setup)."""

import signal
from typing import Any

from distributed import Worker


def dask_setup(server: Any) -> None:
    server.http_server.stop()  # Dask always starts it; see dask_workers
    if isinstance(server, Worker):  # Ctrl-C is meant for the program that started this process
        signal.signal(signal.SIGINT, signal.SIG_IGN)
