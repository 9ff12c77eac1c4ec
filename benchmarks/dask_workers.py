"""How well Monte Carlo runs spread over Dask workers on this computer, and what they cost the scheduler.

    ./run python benchmarks/dask_workers.py [--samples 80000] [--scenario examples/uncertainty.toml]

The run of the command `uncertainty` on workers of one thread each, against as many threads of this process; of two
runs each the faster one, without the bins that come first. Scheduler and client are this process: its processor time
by task is theirs together. Checks that all runs have the same bits. The exit code is 1 where they do not.
"""

from __future__ import annotations

import argparse
import logging
import os
import pickle
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import distributed
from dask import config

from stepdiag import _core
from stepdiag.uncertainty.dask_workers import LOOPBACK, QUIET, Workers
from stepdiag.uncertainty.model_source import ModelSource, model_of
from stepdiag.uncertainty.monte_carlo import LEAVES_OF_A_TASK, Executor, leaf_samples, plan_ranges
from stepdiag.uncertainty.packed_calibrations import pack_calibrations
from stepdiag.uncertainty.run import UncertaintyRequest

COUNTS = (1, 2, 4)
ROUNDS = 2


@contextmanager
def executor_of(count: int, source: ModelSource) -> Iterator[Executor]:
    with (
        config.set(QUIET),
        distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            host=LOOPBACK,
            security=distributed.Security.temporary(),
            dashboard_address=None,
            memory_limit=0,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        client.wait_for_workers(count)
        client.run(lambda: model_of(source) is None)  # each worker reads the scenario once
        yield Workers(client, lambda _: None).executor(source)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=80_000)
    parser.add_argument("--scenario", type=Path, default=Path(__file__).parent.parent / "examples" / "uncertainty.toml")
    arguments = parser.parse_args()
    logging.getLogger("distributed").setLevel(logging.CRITICAL)

    source = pack_calibrations(arguments.scenario, UncertaintyRequest())
    model = model_of(source)
    bins = _core.make_bins(model, _core.StatisticsOptions(), 0)
    ranges = list(plan_ranges(-(-arguments.samples // leaf_samples), [], LEAVES_OF_A_TASK))
    cores = len(os.sched_getaffinity(0))
    print(f"{arguments.samples} samples in {len(ranges)} tasks, {cores} cores, {_core.instruction_set()}")

    here: dict[int, float] = {}
    contents: set[bytes] = set()
    for threads in sorted({min(count, cores) for count in COUNTS}):
        for _ in range(ROUNDS):
            start = time.perf_counter()
            parts = list(_core.run_ranges(model, bins, ranges, threads=threads))
            here[threads] = min(here.get(threads, float("inf")), time.perf_counter() - start)
            contents.add(merged(parts))
        print(f"{threads} threads of one process: {here[threads]:.2f} s")
    size = len(parts[0].to_bytes())
    sent = len(pickle.dumps((source, bins.to_bytes())))
    for count in COUNTS:
        best, load = float("inf"), 0.0
        with executor_of(count, source) as executor:
            for _ in range(ROUNDS):
                start, before = time.perf_counter(), time.process_time()
                parts = list(executor(bins, ranges))
                seconds = time.perf_counter() - start
                if seconds < best:
                    best, load = seconds, (time.process_time() - before) / len(ranges)
                contents.add(merged(parts))
        threads = min(count, cores)
        print(
            f"{count} workers: {best:.2f} s, {here[threads] / best:.3f} of as many threads, "
            f"{here[1] / (threads * best):.3f} of one thread; a task: {best * threads / len(ranges):.2f} s, "
            f"{sent} bytes there, {size} back, {1e3 * load:.0f} ms of scheduler and client"
        )
    same = len(contents) == 1
    print("same bits" if same else "DIFFERENT BITS")
    return 0 if same else 1


def merged(parts: list[_core.PartialStatistics]) -> bytes:
    whole, *rest = sorted(parts, key=lambda part: part.leaves)
    for part in rest:
        whole.merge(part)
    return bytes(whole.to_bytes())


if __name__ == "__main__":
    sys.exit(main())
