"""Options of commands that can compute on Dask workers."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.options import Command, tell

if TYPE_CHECKING:
    from stepdiag.uncertainty.dask_workers import Workers

MOST_WORKERS: Final = 1024


def worker_options(command: Command) -> Command:
    """Add --scheduler and --workers; see `chosen_workers`."""
    scheduler = click.option(
        "--scheduler", metavar="ADDRESS", help="Compute on the workers of this Dask scheduler, such as tls://HOST:8786."
    )
    workers = click.option(
        "--workers",
        type=click.IntRange(1, MOST_WORKERS),
        metavar="N",
        help="Compute with N worker processes on this computer (Dask, for this run only).",
    )
    return scheduler(workers(command))


@contextmanager
def chosen_workers(scheduler: str | None, count: int | None) -> Iterator["Workers | None"]:
    """The chosen workers; None if neither option is given.

    Raises InvalidArgument if both are given or Dask is missing."""
    if scheduler is None and count is None:
        yield None
        return
    if scheduler is not None and count is not None:
        raise InvalidArgument("--workers: cannot be combined with --scheduler, which has its own workers")
    from stepdiag.uncertainty.dask_workers import workers_of

    with workers_of(scheduler, count, lambda message: tell("warning", message)) as workers:
        yield workers
