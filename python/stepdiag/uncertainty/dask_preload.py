"""What schedulers and workers of ours do first (Dask calls dask_setup)."""

import signal
from typing import Any

from distributed import Worker


def dask_setup(server: Any) -> None:
    server.http_server.stop()  # Dask starts it in any case; see dask_workers
    if isinstance(server, Worker):  # a process of its own: Ctrl-C is meant for the program that started it
        signal.signal(signal.SIGINT, signal.SIG_IGN)
