"""The memory that work needs, told before it begins.

The estimates are upper bounds of peaks measured at several sizes (GNU/Linux, x86-64), and all stand
here. Where the memory that is free is not known, nothing is refused.
"""

import math
import resource
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final


class NotEnoughMemory(MemoryError):
    """Work was refused because it would need more memory than is free."""


PROGRAM: Final = 150e6  # bytes: Python and the libraries
A_READING: Final = 30e3  # bytes for each row of a run that is adjusted
COVARIANCES: Final = 6.0  # copies of a covariance between its computation and the end of its file
STATISTICS: Final = 70e3  # bytes for each output of virtual calibrations
COVARIANCES_READ: Final = 4.0  # copies of one from its file to the calibration, the file among them


def for_evaluation(rows: int, values: int, covariance: bool) -> float:
    """Bytes to evaluate a run of so many rows for so many values of a calibration."""
    return PROGRAM + A_READING * rows + (COVARIANCES * 8 * values**2 if covariance else 0.0)


def for_covariance_file(size: int) -> float:
    """Bytes to read a calibration whose file has a covariance and so many bytes."""
    return PROGRAM + COVARIANCES_READ * size


def for_samples(outputs: int, kept: int, samples: int, covariance: bool) -> float:
    """Bytes for the statistics of so many outputs of virtual calibrations, `kept` of them with all samples."""
    moments = COVARIANCES * 8 * outputs**2 if covariance else 0.0
    return PROGRAM + STATISTICS * outputs + 3 * 8 * kept * samples + moments


def check_memory(need: float, what: str, remedy: str) -> None:
    """Raise NotEnoughMemory if `what` needs more bytes than are free."""
    free = free_memory()
    if need > free:
        raise NotEnoughMemory(f"{what} needs about {_size(need)} of memory, but {_size(free)} are free: {remedy}")


def free_memory() -> float:
    """Bytes that this process can still take: of the computer, of its control groups, of its limit of addresses."""
    return min([math.inf, *_of_computer(), *_of_groups(), *_of_limit()])


def _of_computer() -> Iterator[float]:
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                yield 1024.0 * int(line.split()[1])


def _of_groups() -> Iterator[float]:
    """What is left of the limits of this process's control groups, versions 2 and 1, and of those above them."""
    with suppress(OSError, ValueError):
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            _, controllers, path = line.split(":", 2)
            if controllers == "":
                root, limit, used = Path("/sys/fs/cgroup"), "memory.max", "memory.current"
            elif "memory" in controllers.split(","):
                root, limit, used = Path("/sys/fs/cgroup/memory"), "memory.limit_in_bytes", "memory.usage_in_bytes"
            else:
                continue
            group = root / path.lstrip("/")
            for folder in (group, *group.parents):
                with suppress(OSError, ValueError):  # "max"; or a path of another namespace
                    yield max(0.0, int((folder / limit).read_text()) - _in_use(folder, used))
                if folder == root:
                    break


def _in_use(folder: Path, used: str) -> float:
    """Without the pages of files, which make room."""
    files = 0
    for line in (folder / "memory.stat").read_text().splitlines():
        name, value = line.split()
        if name in ("inactive_file", "total_inactive_file"):
            files = max(files, int(value))
    return float(int((folder / used).read_text()) - files)


def _of_limit() -> Iterator[float]:
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY:
        with suppress(OSError, ValueError, IndexError):
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            yield max(0.0, float(limit - pages * resource.getpagesize()))


def _size(count: float) -> str:
    return f"{count * 1e-9:.2g} GB" if count >= 1e9 else f"{count * 1e-6:.0f} MB"
