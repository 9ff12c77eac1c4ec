"""Runs of the Monte Carlo method (JCGM 101) with progress, checkpoints and executors.

The bits of a result depend only on its set of leaves. An interrupted run therefore continues to the
same result.
"""

import os
import struct
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Protocol

from stepdiag._core import (
    AdaptiveProcedure,
    Bins,
    InvalidArgument,
    MonteCarloResult,
    PartialStatistics,
    SampleModel,
    StatisticsOptions,
    leaf_samples,
    make_bins,
    newer_format,
    run_ranges,
)
from stepdiag.io.file_kind import CHECKPOINT_BEGINS
from stepdiag.io.outputs import CHECKPOINT, claim
from stepdiag.io.whole_files import check_output, read_bytes, write_whole
from stepdiag.wrong_arguments import checked

LeafRange = tuple[int, int]  # half-open
Progress = Callable[[int, int], object]  # samples done, and their total (adaptive: at most)

SECONDS_BETWEEN_CHECKPOINTS = 10.0
LEAVES_OF_A_TASK = 5  # leaves in a task of an executor
MAGIC = f"{CHECKPOINT_BEGINS}1\n".encode()


class Executor(Protocol):
    """Computes the statistics of ranges of leaves elsewhere and yields them in any order.

    It takes ranges as it can process them (there may be infinitely many), and cancels its remaining
    work when it is closed."""

    def __call__(self, bins: Bins, ranges: Iterable[LeafRange]) -> Iterator[PartialStatistics]: ...


@checked
def run_monte_carlo(
    model: SampleModel,
    *,
    samples: int,
    adaptive: bool = False,
    options: StatisticsOptions | None = None,
    threads: int = 0,
    checkpoint: Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> MonteCarloResult:
    """Run the Monte Carlo method on a model (JCGM 101).

    Args:
        model: the sample model, such as VirtualCalibrations.
        samples: number of samples, rounded up to leaves of 2,000.
        adaptive: draw blocks until all outputs are stable, and at most about `samples` samples;
            `stability` of the result tells which.
        options: statistics to compute; None: the defaults.
        threads: number of threads; 0: all of the computer's.
        checkpoint: a new file, written every ten seconds, at the end, and when an exception such as
            KeyboardInterrupt ends the run (it is raised again).
        resume: continue from the checkpoint, also to more samples than before.
        progress: called with the samples done and their total.
        executor: computes the leaves elsewhere, see `Workers.executor`.

    Raises:
        InvalidArgument: an argument is invalid, the checkpoint belongs to another run, or without
            `resume` a file would be replaced by the checkpoint.
    """
    if samples < 1:
        raise InvalidArgument(f"samples: expected 1 or more, got {samples}")
    if resume and checkpoint is None:
        raise InvalidArgument("resume: expected a checkpoint to continue")
    saved = read_bytes(checkpoint) if resume and checkpoint else None  # fails before the work
    if checkpoint and resume:
        check_output(checkpoint)
    elif checkpoint:
        claim(checkpoint, CHECKPOINT)
    bins = make_bins(model, StatisticsOptions() if options is None else options, threads)
    run = (_AdaptiveRun if adaptive else _FixedRun)(bins, samples, checkpoint, progress)
    if saved is not None:
        run.restore(saved, f"{checkpoint}")
    run.report()
    try:
        if executor is None:
            run.go_here(model, threads)
        else:
            run.go(executor)
    finally:
        run.save()
    return run.result()


def plan_ranges(leaves: int, done: Sequence[LeafRange], size: int) -> Iterator[LeafRange]:
    """The missing ones of leaves 0 ... leaves - 1, in ranges of at most `size`."""
    for first, end in _missing(leaves, done):
        for start in range(first, end, size):
            yield start, min(start + size, end)


def _missing(leaves: int, done: Sequence[LeafRange]) -> Iterator[LeafRange]:
    first = 0
    for begin, end in [*done, (leaves, leaves)]:
        if first < min(begin, leaves):
            yield first, min(begin, leaves)
        first = max(first, end)


def _threads_of(model: SampleModel, threads: int, report: Callable[[int], None]) -> Executor:
    """An executor that uses this process's threads, one range per thread at a time.

    `report` is called with the number of leaves done in the current ranges."""
    at_a_time = threads or os.cpu_count() or 1

    def compute(bins: Bins, ranges: Iterable[LeafRange]) -> Iterator[PartialStatistics]:
        remaining = iter(ranges)
        while batch := list(islice(remaining, at_a_time)):
            yield from run_ranges(model, bins, batch, threads=threads, progress=report)

    return compute


class _Run(ABC):
    """The statistics so far, their checkpoint, and the progress report."""

    kind = "with a fixed number of samples"

    def __init__(self, bins: Bins, samples: int, checkpoint: Path | None, progress: Progress | None) -> None:
        self.bins = bins
        self.statistics = PartialStatistics(bins)
        self.leaves = -(-samples // leaf_samples)
        self.checkpoint = checkpoint
        self.progress = progress
        self.due = time.monotonic() + SECONDS_BETWEEN_CHECKPOINTS

    def done(self) -> int:
        return sum(end - first for first, end in self.statistics.leaves)

    def report(self, further_leaves: int = 0) -> None:
        if self.progress:
            self.progress(min(self.done() + further_leaves, self.leaves) * leaf_samples, self.leaves * leaf_samples)

    @abstractmethod
    def go(self, executor: Executor) -> None: ...

    def go_here(self, model: SampleModel, threads: int) -> None:
        """Run on the threads of this process, leaf by leaf, pausing now and then to save."""
        self.go(_threads_of(model, threads, self.report))

    @abstractmethod
    def result(self) -> MonteCarloResult: ...

    def procedure_bytes(self) -> bytes:
        return b""

    def restore_procedure(self, saved: bytes) -> None:  # noqa: B027 (a fixed run has none)
        pass

    def save_if_due(self) -> None:
        if time.monotonic() >= self.due:
            self.save()

    def save(self) -> None:
        if self.checkpoint:
            parts = self.statistics.to_bytes(), self.procedure_bytes()
            write_whole(self.checkpoint, MAGIC + b"".join(struct.pack("<Q", len(part)) + part for part in parts))
        self.due = time.monotonic() + SECONDS_BETWEEN_CHECKPOINTS

    def restore(self, saved: bytes, name: str) -> None:
        """Continue from a checkpoint. Raises InvalidArgument if it is not one of this run."""
        statistics, procedure = _parts_of(saved, name)
        its_kind = _AdaptiveRun.kind if procedure else _FixedRun.kind
        if its_kind != self.kind:
            raise InvalidArgument(f"{name}: a checkpoint of a run {its_kind}, expected one of a run {self.kind}")
        try:
            self.statistics.merge(PartialStatistics.from_bytes(statistics))
            self.restore_procedure(procedure)
        except InvalidArgument as error:
            raise InvalidArgument(f"{name}: {error}") from None
        if self.done() > self.leaves:
            raise InvalidArgument(
                f"{name}: holds {self.done() * leaf_samples} samples, more than the {self.leaves * leaf_samples} "
                "that are asked for"
            )


class _FixedRun(_Run):
    def go_here(self, model: SampleModel, threads: int) -> None:
        """By the threads of this process, leaf by leaf; a pause now and then, to save what is done."""
        while missing := next(_missing(self.leaves, self.statistics.leaves), None):
            before = self.done()

            def go_on(leaves_done: int, before: int = before) -> bool:
                if self.progress:  # not from the statistics, which are changing
                    self.progress((before + leaves_done) * leaf_samples, self.leaves * leaf_samples)
                return self.checkpoint is None or time.monotonic() < self.due

            self.statistics.run(model, missing[0], missing[1] - missing[0], threads=threads, progress=go_on)
            self.save_if_due()

    def go(self, executor: Executor) -> None:
        parts = executor(self.bins, plan_ranges(self.leaves, self.statistics.leaves, LEAVES_OF_A_TASK))
        for part in _closing(parts):
            self.statistics.merge(part)
            self.report()
            self.save_if_due()

    def result(self) -> MonteCarloResult:
        missing = list(_missing(self.leaves, self.statistics.leaves))
        if missing:
            raise RuntimeError(f"the executor gave no statistics of the leaves {missing}")
        return self.statistics.result()


class _AdaptiveRun(_Run):
    """Blocks in order: whether a block is the last depends only on the blocks before it."""

    kind = "by the adaptive procedure"

    def __init__(self, bins: Bins, samples: int, checkpoint: Path | None, progress: Progress | None) -> None:
        super().__init__(bins, samples, checkpoint, progress)
        self.procedure = AdaptiveProcedure(bins)
        self.size = AdaptiveProcedure.leaves_per_block(bins.options.coverage)
        self.most = max(2, -(-self.leaves // self.size))  # blocks; one block alone has no spread
        self.leaves = self.most * self.size

    def procedure_bytes(self) -> bytes:
        return self.procedure.to_bytes()

    def restore_procedure(self, saved: bytes) -> None:
        self.procedure = AdaptiveProcedure.from_bytes(saved)

    def ended(self) -> bool:
        return self.procedure.blocks >= self.most or self.procedure.stability(self.statistics).stable

    def go(self, executor: Executor) -> None:
        if self.ended():
            return
        blocks = ((k * self.size, (k + 1) * self.size) for k in range(self.procedure.blocks, self.most))
        waiting: dict[LeafRange, PartialStatistics] = {}
        for part in _closing(executor(self.bins, blocks)):
            waiting[part.leaves[0]] = part
            while block := waiting.pop(self.procedure.next_block, None):
                self.procedure.add(block, self.statistics)
                self.report()
                if self.ended():
                    return
            self.save_if_due()

    def result(self) -> MonteCarloResult:
        return self.procedure.result(self.statistics)


def _closing(parts: Iterator[PartialStatistics]) -> Iterator[PartialStatistics]:
    """Yield all parts; close the executor when no more are wanted."""
    try:
        yield from parts
    finally:
        if hasattr(parts, "close"):
            parts.close()


def _parts_of(saved: bytes, name: str) -> tuple[bytes, bytes]:
    if not saved.startswith(MAGIC):
        expected, given = (text.split(b"\n")[0][:40].decode(errors="replace") for text in (MAGIC, saved))
        raise InvalidArgument(f'{name}: expected "{expected}", got {given!a}{newer_format(expected, given)}')
    parts, rest = [], saved[len(MAGIC) :]
    for _ in range(2):
        if len(rest) < 8:
            raise InvalidArgument(f"{name}: the checkpoint is not all there")
        (size,) = struct.unpack("<Q", rest[:8])
        parts.append(rest[8 : 8 + size])
        rest = rest[8 + size :]
    if rest:
        raise InvalidArgument(f"{name}: the checkpoint is damaged: {len(rest)} bytes too many")
    return parts[0], parts[1]
