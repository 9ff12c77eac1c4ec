"""Parameter studies: virtual calibrations for every cell of a grid of scenarios.

Finished cells are kept in a file beside the result, one per line. Lines are identified by a digest
of everything that the cell's result depends on. Therefore a study may be changed between two runs:
cells that it still contains are not computed again.
"""

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.interruption import uninterrupted
from stepdiag.io.outputs import CELLS, claim
from stepdiag.io.whole_files import read_text, reason
from stepdiag.platform import sync_folder
from stepdiag.scenario.packed import pack_scenario
from stepdiag.uncertainty.dask_workers import Workers
from stepdiag.uncertainty.study_cell import CellJob, CellResult, compute_cell
from stepdiag.uncertainty.study_keys import Cell, Study
from stepdiag.wrong_arguments import checked

Index = tuple[int, ...]
CellProgress = Callable[[int, int], None]  # cells done, and their total


@dataclass(frozen=True)
class Task:
    """A cell and its place in the grid."""

    index: Index
    job: CellJob

    @property
    def digest(self) -> str:
        content = asdict(self.job)
        content["packed"]["files"] = [(name, hashlib.sha256(data).hexdigest()) for name, data in self.job.packed.files]
        content["version"] = _core.__version__
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def tasks_of(study: Study) -> list[Task]:
    """The tasks of a study. Raises InvalidArgument for files that cannot be read."""
    return [Task(cell.index, _job(study, cell)) for cell in study.cells()]


def _job(study: Study, cell: Cell) -> CellJob:
    wanted = study.settings
    packed = pack_scenario(cell.content, study.scenario)
    return CellJob(packed, cell.method, wanted.samples, wanted.seed, wanted.digits, wanted.coverage)


class FinishedCells:
    """File with the finished cells of a study, one per line; makes a study resumable.

    A line that an interruption left incomplete is ignored. Raises InvalidArgument if the file
    cannot be written, or exists without `resume`."""

    def __init__(self, path: Path, resume: bool) -> None:
        self.path = path
        claim(path, CELLS, overwrite=resume)
        self._known = dict(self._read()) if path.exists() else {}
        try:
            self._file = open(path, "a", encoding="utf-8")  # noqa: SIM115 (open as long as this object)
        except OSError as error:
            raise InvalidArgument(f"{path}: cannot be written: {reason(error)}") from None
        sync_folder(path.parent)
        if self._file.tell() > 0:
            self._file.write("\n")  # the last line may be incomplete

    def _read(self) -> Iterator[tuple[str, CellResult]]:
        for line in read_text(self.path).splitlines() if self.path.stat().st_size > 0 else ():
            digest, _, content = line.partition(" ")
            try:
                yield digest, CellResult.from_json(content)
            except (ValueError, KeyError, TypeError, IndexError):
                continue

    def find(self, task: Task) -> CellResult | None:
        return self._known.get(task.digest)

    def keep(self, task: Task, result: CellResult) -> None:
        with uninterrupted():
            self._file.write(f"{task.digest} {result.to_json()}\n")
            self._file.flush()
            os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()

    def remove(self) -> None:
        self.close()
        self.path.unlink(missing_ok=True)


@checked
def run_study(
    study: Study, finished: FinishedCells, *, workers: Workers | None = None, progress: CellProgress | None = None
) -> dict[Index, CellResult]:
    """Compute all cells of a study that are not finished. Returns all results by grid index.

    Results have the order of the grid. An interruption (KeyboardInterrupt) leaves the cells done so
    far in `finished`.

    Args:
        study: from `read_study`.
        finished: keeps the results of finished cells.
        workers: compute the cells on these workers, one thread each; None: one after the other, on
            all threads of this computer.
        progress: called with the number of cells done and their total."""
    tasks = tasks_of(study)
    results: dict[Index, CellResult] = {}
    waiting = []
    for task in tasks:
        known = finished.find(task)
        if known is None:
            waiting.append(task)
        else:
            results[task.index] = known
    if progress is not None:
        progress(len(results), len(tasks))
    for task, result in _here(waiting) if workers is None else _there(waiting, workers):
        finished.keep(task, result)
        results[task.index] = result
        if progress is not None:
            progress(len(results), len(tasks))
    return {task.index: results[task.index] for task in tasks}


def _here(tasks: Sequence[Task]) -> Iterator[tuple[Task, CellResult]]:
    for task in tasks:
        yield task, compute_cell(task.job)


def _there(tasks: Sequence[Task], workers: Workers) -> Iterator[tuple[Task, CellResult]]:
    for k, content in workers.compute(cell_on_worker, [(task.job,) for task in tasks]):
        yield tasks[k], CellResult.from_json(content)


def cell_on_worker(job: CellJob) -> str:
    return compute_cell(job, threads=1).to_json()
