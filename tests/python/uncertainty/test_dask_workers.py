"""Monte Carlo runs on Dask's workers: the same bytes as here, also when one is killed, or is another machine."""

import os
import signal
import sys
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from small_models import Sums

from stepdiag import _core
from stepdiag._core import InvalidArgument, PartialStatistics, StatisticsOptions
from stepdiag.uncertainty import dask_workers
from stepdiag.uncertainty.dask_workers import Platform, Workers, WorkersLost, check_scheduler, this_machine, workers_of
from stepdiag.uncertainty.model_source import KEPT, model_of
from stepdiag.uncertainty.monte_carlo import run_monte_carlo

pytest.importorskip("distributed", reason="Dask distributed is an optional dependency")

OPTIONS = StatisticsOptions(covariance=True)
LEAVES = 60


@pytest.fixture(scope="module")
def warnings() -> list[str]:
    return []


@pytest.fixture(scope="module")
def three(warnings: list[str]) -> Iterator[Workers]:
    """Three worker processes for all tests of this file: starting them takes the most time."""
    with workers_of(count=3, warn=warnings.append) as workers:
        yield workers


def whole(parts: Iterator[PartialStatistics]) -> bytes:
    first = next(parts)
    for part in parts:
        first.merge(part)
    return first.to_bytes()


def test_worker_killed_on_the_way_changes_nothing(three: Workers) -> None:
    model = Sums(seed=5).model()
    bins = _core.make_bins(model, OPTIONS, threads=1)
    expected = _core.run_leaves(model, bins, 0, LEAVES, threads=1).to_bytes()
    before: dict[str, int] = three._client.run(os.getpid)
    victim = sorted(before.values())[0]

    def parts() -> Iterator[PartialStatistics]:
        # A leaf takes a worker some hundredths of a second, so that each has work when one of them is killed.
        compute = three.executor(Sums(seed=5, seconds=0.01))
        for count, part in enumerate(compute(bins, ((k, k + 1) for k in range(LEAVES)))):
            if count == 6:
                os.kill(victim, signal.SIGKILL)
            yield part

    assert whole(parts()) == expected
    assert victim not in three._client.run(os.getpid).values(), "the worker was not killed"
    three._client.wait_for_workers(3, timeout=120)  # it is started again, and later tests count on all three


def test_adaptive_run_takes_the_blocks_that_it_takes_here(three: Workers) -> None:
    source = Sums(seed=6)
    options = StatisticsOptions(digits=1)
    here, there = (
        run_monte_carlo(source.model(), samples=1_000_000, adaptive=True, options=options, threads=1, executor=executor)
        for executor in (None, three.executor(source))
    )
    assert there.samples == here.samples < 1_000_000
    for name in ("mean", "standard_uncertainty", "symmetric", "shortest"):
        np.testing.assert_array_equal(getattr(there, name), getattr(here, name))


def test_worker_of_another_machine_takes_no_part(three: Workers, warnings: list[str]) -> None:
    source = Sums(seed=7)
    here = run_monte_carlo(source.model(), samples=200_000, options=OPTIONS, threads=1)
    odd = sorted(three._client.run(os.getpid))[0]
    three._client.run(pretend, "another set", workers=[odd])
    there = run_monte_carlo(source.model(), samples=200_000, options=OPTIONS, executor=three.executor(source))
    assert warnings == [
        f"worker {odd} is not used: it has stepdiag {_core.__version__} with another set, this program {this_machine()}"
    ]
    np.testing.assert_array_equal(there.covariance, here.covariance)
    three._client.run(pretend, "another set")
    with pytest.raises(WorkersLost, match=f"no worker has {this_machine()}, as this program does"):
        run_monte_carlo(source.model(), samples=20_000, executor=three.executor(source))
    three._client.run(pretend, this_machine().instruction_set)


def pretend(instruction_set: str) -> None:
    """Of a worker: that it had this one."""
    import stepdiag.uncertainty.dask_workers

    machine = Platform(_core.__version__, instruction_set)
    stepdiag.uncertainty.dask_workers.this_machine = lambda: machine


def test_errors_of_a_task_come_home_as_they_are(three: Workers) -> None:
    with pytest.raises(InvalidArgument, match="no such thing"):
        list(three.compute(refuse, [("no such thing",)]))


def refuse(message: str) -> None:
    raise InvalidArgument(message)


# --- without workers -------------------------------------------------------------------------------------------------
def test_models_of_the_last_sources_are_kept() -> None:
    sources = [Sums(seed=k) for k in range(KEPT + 1)]
    models = [model_of(source) for source in sources]
    assert model_of(sources[-1]) is models[-1]
    assert model_of(sources[0]) is not models[0]


@pytest.mark.parametrize("address", ["", "host:8786", "http://host:8786", "tcp://host", "tcp://:1", "tcp://host:70000"])
def test_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(InvalidArgument, match=r"`scheduler`: expected an address such as tcp://127.0.0.1:8786, got"):
        check_scheduler(address)


def test_scheduler_that_does_not_answer_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stepdiag.uncertainty.dask_workers.CONNECT_SECONDS", 0.5)
    # Port 9 is "discard": nobody listens there any more.
    expected = r"^`scheduler`: tcp://127.0.0.1:9: no scheduler answers"
    with pytest.raises(InvalidArgument, match=expected), workers_of("tcp://127.0.0.1:9"):
        pass


def test_missing_dask_is_said_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(InvalidArgument, match=r"need Dask distributed \(pip install 'stepdiag\[dask\]'\)"),
        workers_of(count=2),
    ):
        pass


@pytest.mark.parametrize(("status", "arrived"), [("running", True), ("closed", False)])
def test_a_worker_that_died_at_its_start_is_not_waited_for(status: str, *, arrived: bool) -> None:
    """Of a cluster whose second worker comes after a while, or never."""
    waits = iter([TimeoutError, None])

    class Client:
        def wait_for_workers(self, count: int, timeout: float) -> None:
            error = next(waits)
            if error is not None:
                raise error(count, timeout)

    workers = {0: SimpleNamespace(status=SimpleNamespace(name="running"))}
    workers[1] = SimpleNamespace(status=SimpleNamespace(name=status))
    assert dask_workers._arrive(Client(), SimpleNamespace(workers=workers), 2) is arrived


def test_a_worker_that_hangs_at_its_start_is_not_waited_for_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    class Client:
        def wait_for_workers(self, count: int, timeout: float) -> None:
            raise TimeoutError(count, timeout)

    monkeypatch.setattr("stepdiag.uncertainty.dask_workers.START_SECONDS", 0.0)
    workers = {0: SimpleNamespace(status=SimpleNamespace(name="running"))}
    assert not dask_workers._arrive(Client(), SimpleNamespace(workers=workers), 2)
