"""The memory that work needs, told before it begins.

The estimates are upper bounds of peaks measured at several sizes (GNU/Linux, x86-64), and all stand
here. Where the memory that is free is not known, nothing is refused.
"""

import math
from typing import Final

from stepdiag.platform import free_memory


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
    free = min([math.inf, *free_memory()])
    if need > free:
        raise NotEnoughMemory(f"{what} needs about {_size(need)} of memory, but {_size(free)} are free: {remedy}")


def _size(count: float) -> str:
    return f"{count * 1e-9:.2g} GB" if count >= 1e9 else f"{count * 1e-6:.0f} MB"
