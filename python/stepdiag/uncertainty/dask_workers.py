"""Monte Carlo runs on Dask distributed: on a remote scheduler's workers, or on local processes.

A task is a pure function of the source of a model, the bytes of the bins and a range of leaves. It
returns the bytes of the statistics of these leaves. The results are merged by the numbers of the
leaves. Therefore the bits of the result do not depend on how leaves are distributed, or on a worker
that is lost (others repeat its tasks). They do depend on the instruction set: workers with another
one than this program are not used.

Dask is an optional dependency and imported on first use.
"""

import ipaddress
import logging
import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from multiprocessing import resource_tracker
from tempfile import TemporaryDirectory
from typing import Any, Final

from stepdiag import _core
from stepdiag._core import Bins, InvalidArgument, PartialStatistics
from stepdiag.interruption import at_end
from stepdiag.platform import deaf_to_interruption, kill_descendants, semaphores_of_this_process
from stepdiag.uncertainty.model_source import ModelSource, model_of
from stepdiag.uncertainty.monte_carlo import Executor, LeafRange
from stepdiag.wrong_arguments import checked

TASKS_A_THREAD: Final = 2  # submitted at a time: one computed, one waiting
CONNECT_SECONDS: Final = 10.0
START_SECONDS: Final = 60.0  # of each try
PARK_SECONDS: Final = 0.2
LOOPBACK: Final = "127.0.0.1"
PRELOAD: Final = ["stepdiag.uncertainty.dask_preload"]
# Dask samples what its workers execute, and looks every 20 ms how late its event loops are: that takes each worker 5 %
# of a core, and the scheduler 4 %.
QUIET: Final = {"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "1s"}
CREDENTIALS: Final = "ca-file, client.cert and client.key in Dask's configuration, distributed.comm.tls"

Warn = Callable[[str], None]


class WorkersLost(ConnectionError):
    """The scheduler is gone, or a task lost every worker that it was given to."""


@dataclass(frozen=True)
class Platform:
    """What the bits of a result depend on besides the task: version and instruction set."""

    version: str
    instruction_set: str

    def __str__(self) -> str:
        return f"stepdiag {self.version} with {self.instruction_set}"


@dataclass(frozen=True)
class Refusal:
    """Answer of a worker whose platform is not the one that a task requires."""

    machine: Platform


def this_machine() -> Platform:
    return Platform(_core.__version__, _core.instruction_set())


# --- tasks: executed by workers --------------------------------------------------------------------------------------
# One thread each: a worker executes as many tasks at a time as it has threads.
def perform(machine: Platform, function: Callable[..., Any], arguments: Sequence[Any]) -> Any:
    return function(*arguments) if this_machine() == machine else Refusal(this_machine())


def compute_leaves(source: ModelSource, bins: bytes, first: int, end: int) -> bytes:
    return _core.run_leaves(model_of(source), _bins_of(bins), first, end - first, threads=1).to_bytes()


@lru_cache(maxsize=2)
def _bins_of(content: bytes) -> Bins:
    return Bins.from_bytes(content)


# --- the client ------------------------------------------------------------------------------------------------------
class Workers:
    """The workers of a scheduler that have this program's platform. Made by `workers_of`."""

    def __init__(self, client: Any, warn: Warn) -> None:
        self._client = client
        self._warn = warn
        self._refused: set[str] = set()
        self._chosen: list[str] | None = None  # addresses; None: all
        self.machine = this_machine()
        found = self._machines()
        if not found:
            raise InvalidArgument(f"{self.address}: the scheduler has no workers")
        if any(machine != self.machine for machine in found.values()):
            self._choose(found)
        known = client.scheduler_info(n_workers=-1)["workers"]
        self.threads = sum(int(known[address]["nthreads"]) for address in self._chosen or found if address in known)

    @property
    def address(self) -> str:
        return str(self._client.scheduler.address)

    def executor(self, source: ModelSource) -> Executor:
        """An executor for run_monte_carlo: each range of leaves is a task."""

        def compute(bins: Bins, ranges: Iterable[LeafRange]) -> Iterator[PartialStatistics]:
            content = bins.to_bytes()
            for _, part in self.compute(compute_leaves, ((source, content, *leaves) for leaves in ranges)):
                yield PartialStatistics.from_bytes(part)

        return compute

    def compute(self, function: Callable[..., Any], arguments: Iterable[Sequence[Any]]) -> Iterator[tuple[int, Any]]:
        """Apply a pure function to these arguments; yield (index, answer) as answers arrive.

        Only a few tasks are submitted at a time. A task that a worker refuses is given to others.
        Closing the iterator cancels submitted tasks."""
        tasks = enumerate(arguments)
        return self._answers(function, tasks)

    def _answers(
        self, function: Callable[..., Any], tasks: Iterator[tuple[int, Sequence[Any]]]
    ) -> Iterator[tuple[int, Any]]:
        distributed = _dask()
        lost = distributed.client.FutureCancelledError, distributed.comm.CommClosedError
        futures = distributed.as_completed(loop=self._client.loop)
        under_way: dict[str, tuple[int, Sequence[Any]]] = {}

        def submit(task: tuple[int, Sequence[Any]] | None) -> None:
            if task is not None:
                arguments = perform, self.machine, function, task[1]
                # Other workers are allowed because a restarted worker has a new address.
                future = self._client.submit(
                    *arguments, pure=False, workers=self._chosen, allow_other_workers=self._chosen is not None
                )
                under_way[future.key] = task
                futures.add(future)

        try:
            for _ in range(TASKS_A_THREAD * self.threads):
                submit(next(tasks, None))
            for future in futures:
                task = under_way.pop(future.key)
                answer = future.result()
                if isinstance(answer, Refusal):
                    self._choose(self._machines())
                    submit(task)
                    continue
                submit(next(tasks, None))
                yield task[0], answer
        except distributed.KilledWorker as error:
            raise WorkersLost(f"a task lost every worker that it was given to: {error}") from None
        except lost as error:
            raise WorkersLost(f"{self.address}: the scheduler is gone: {error}") from None
        finally:
            futures.clear()  # cancels submitted tasks

    def _machines(self) -> dict[str, Platform | Exception]:
        """Platform by address; an exception for workers that have another stepdiag or none."""
        found: dict[str, Platform | Exception] = self._client.run(this_machine, on_error="return")
        return found

    def _choose(self, found: Mapping[str, Platform | Exception]) -> None:
        """Keep the workers with this platform, and warn about the others."""
        self._chosen = sorted(address for address, machine in found.items() if machine == self.machine)
        refused = {address: machine for address, machine in sorted(found.items()) if machine != self.machine}
        if not self._chosen:
            said = "; ".join(f"{address} has {machine}" for address, machine in refused.items())
            raise WorkersLost(f"{self.address}: no worker has {self.machine}, as this program does: {said}")
        for address in refused.keys() - self._refused:
            self._warn(f"worker {address} is not used: it has {refused[address]}, this program {self.machine}")
        self._refused |= refused.keys()


# --- clusters --------------------------------------------------------------------------------------------------------
@contextmanager
@checked
def workers_of(
    scheduler: str | None = None, count: int | None = None, warn: Warn = lambda _: None
) -> Iterator[Workers]:
    """Connect to the workers of a scheduler, or start local ones; a context manager.

    Args:
        scheduler: address, "tls://HOST:PORT" or "tcp://HOST:PORT".
        count: without a scheduler, number of processes to start on this computer. They share its
            threads, and only this process can use them.
        warn: called with a text for each worker that is not used, and for insecure connections.

    Raises:
        InvalidArgument: Dask is missing, the address is invalid, or there are no workers.
    """
    distributed = _dask()
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # Dask would report lost workers
    if scheduler is not None:
        with _connected(distributed, scheduler, warn) as client:
            yield Workers(client, warn)
        return
    for is_last in (False, False, True):
        with (
            _local_cluster(distributed, count) as cluster,
            distributed.Client(cluster, set_as_default=False) as client,
        ):
            if not _arrive(client, cluster, count or 1) and not is_last:
                continue
            yield Workers(client, warn)
            return


def _arrive(client: Any, cluster: Any, count: int) -> bool:
    """Whether all workers have started. Rarely the process of one dies or hangs at its start, where this process has
    had workers before (Python 3.13); Dask waits for it in vain."""
    deadline = time.monotonic() + START_SECONDS
    while True:
        try:
            client.wait_for_workers(count, timeout=1.0)  # they start at different times
        except TimeoutError:
            is_dead = any(worker.status.name == "closed" for worker in cluster.workers.values())
            if is_dead or time.monotonic() > deadline:
                return False
        else:
            return True


@contextmanager
def _local_cluster(distributed: Any, count: int | None) -> Iterator[Any]:
    """A cluster that only this process can use.

    Other users of the computer can reach its ports. Therefore every connection needs credentials,
    which exist only in the memory of these processes, and nothing is served by HTTP. Dask puts its
    folder for temporary files first on Python's path. That folder is private here; by default it
    belongs to the user who first created it."""
    from dask import config

    try:
        credentials = distributed.Security.temporary()
    except ImportError as error:
        raise InvalidArgument(f"`workers` needs cryptography (pip install 'stepdiag[dask]'): {error}") from None
    with (
        TemporaryDirectory(prefix="stepdiag-", ignore_cleanup_errors=True) as folder,
        at_end(partial(shutil.rmtree, folder, ignore_errors=True)),
        _own_loop(distributed) as loop,
        at_end(partial(_abandon, loop)),
    ):
        options = QUIET | {
            "temporary-directory": folder,
            # Dask always starts its HTTP servers: they have no routes, and PRELOAD stops them.
            "distributed.scheduler.http.routes": [],
            "distributed.worker.http.routes": [],
        }
        try:
            with (
                config.set(options),
                distributed.LocalCluster(
                    loop=loop,
                    n_workers=count,
                    threads_per_worker=max(1, (os.cpu_count() or 1) // (count or 1)),
                    host=LOOPBACK,
                    security=credentials,
                    dashboard_address=None,
                    scheduler_kwargs={"dashboard_address": f"{LOOPBACK}:0", "preload": PRELOAD},  # not port 8787
                    memory_limit=0,  # memory use is known; Dask would stop workers
                    silence_logs=logging.CRITICAL,
                    preload=PRELOAD,
                ) as cluster,
            ):
                yield cluster
        finally:
            sys.path[:] = [entry for entry in sys.path if not entry.startswith(folder)]


@contextmanager
def _own_loop(distributed: Any) -> Iterator[Any]:
    """Dask's event loop. What it starts does not hear Ctrl-C, which is meant for this program."""
    runner = distributed.utils.LoopRunner()
    resource_tracker.ensure_running()  # the first call unblocks the signal for its thread
    with deaf_to_interruption():
        runner.start()
    try:
        yield runner.loop
    finally:
        runner.stop()


def _abandon(loop: Any) -> None:
    """For an interruption: end the workers and remove what they share, without Dask, which takes seconds for it."""
    parked = threading.Event()

    def park() -> None:  # Dask would start other workers, and warn
        parked.set()
        threading.Event().wait()

    loop.add_callback(park)
    parked.wait(PARK_SECONDS)
    kill_descendants()
    for path in semaphores_of_this_process():
        with suppress(OSError):
            path.unlink()


def check_scheduler(address: str) -> str:
    """Return the address. Raises InvalidArgument if it is not the address of a scheduler."""
    kind, separator, rest = address.partition("://")
    host, _, port = rest.rpartition(":")
    if kind not in ("tcp", "tls") or not separator or not host or not port.isdecimal() or int(port) > 65535:
        raise InvalidArgument(f"`scheduler`: expected an address such as tcp://127.0.0.1:8786, got {address!r}")
    return address


@contextmanager
def _connected(distributed: Any, address: str, warn: Warn) -> Iterator[Any]:
    check_scheduler(address)
    security = _configured_credentials(distributed, address)
    if not address.startswith("tls:") and not _is_loopback(address):
        warn(f"{address}: anybody who can reach a scheduler without TLS can run code on its workers and here")
    try:
        client = distributed.Client(address, security=security, timeout=CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError) as error:
        said = str(error) or type(error).__name__
        raise InvalidArgument(f"`scheduler`: {address}: no scheduler answers: {said}") from None
    with client:
        yield client


def _configured_credentials(distributed: Any, address: str) -> Any:
    """The user's credentials from Dask's configuration; they must be complete for TLS."""
    if not address.startswith("tls:"):
        security = distributed.Security()
        if security.require_encryption:
            raise InvalidArgument(f"`scheduler`: expected tls://, which Dask's configuration requires, got {address!r}")
        return security
    security = distributed.Security(require_encryption=True)
    try:
        complete = security.get_connection_args("client")["ssl_context"] is not None
        said = ""
    except OSError as error:  # it names neither the file nor the key
        complete, said = False, f": {error}"
    if not complete:
        raise InvalidArgument(f"`scheduler`: {address}: expected {CREDENTIALS}; got {security}{said}")
    return security


def _is_loopback(address: str) -> bool:
    host = address.partition("://")[2].rpartition(":")[0].strip("[]")
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _dask() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise InvalidArgument(
            f"`scheduler` and `workers` need Dask distributed (pip install 'stepdiag[dask]'): {error}"
        ) from None
    return distributed
