"""What a worker process of ours does first (Dask calls dask_setup): Ctrl-C is meant for the program that started it."""

import signal


def dask_setup(worker: object) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
