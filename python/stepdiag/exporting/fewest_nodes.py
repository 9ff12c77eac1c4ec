"""Fewer nodes for functions that are linear between their nodes.

`fewest_nodes` keeps the fewest nodes such that linear interpolation between them deviates by at
most a tolerance. This is the shortest path from the first node to the last, where an edge is a
chord that passes every node between its ends within the tolerance (Imai and Iri,
Computational-geometric methods for polygonal approximations of a curve, 1986). `best_subset`
searches the smallest tolerance for a given number of nodes: no subset of that size has a smaller
largest deviation, except for the relative RESOLUTION of the search.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int_]

RESOLUTION: Final = 1e-4
MOST_NODES: Final = 5_000  # so that the search takes seconds
ROWS_AT_ONCE: Final = 512  # limits the memory


def best_subset(x: FloatArray, functions: FloatArray, size: int) -> IntArray:
    """Indices of at most `size` nodes to keep, among them the first and the last.

    Their largest deviation, over all positions and functions, is the smallest of all such subsets.
    Raises InvalidArgument for fewer than 2 or more than MOST_NODES nodes.

    Args:
        x: positions of the nodes, (n,), ascending.
        functions: values at the nodes, (m, n).
        size: largest number of nodes to keep."""
    if size < 2:
        raise InvalidArgument(f"rows: expected at least 2, got {size}")
    if len(x) > MOST_NODES:
        raise InvalidArgument(f"a table with {len(x)} nodes: at most {MOST_NODES} can be resampled")
    every = np.arange(len(x))
    if len(every) <= size:
        return every
    window = 2 * len(x) // size + 8
    best = fewest_nodes(x, functions, 0.0, window)
    if len(best) <= size:
        return best
    # The deviation of evenly chosen nodes bounds the search, which avoids many long chords.
    best = np.linspace(0, len(x) - 1, size).round().astype(int)
    low, high = 0.0, largest_deviation(x, functions, best)
    while high - low > RESOLUTION * high:
        middle = 0.5 * (low + high)
        kept = fewest_nodes(x, functions, middle, window)
        if len(kept) <= size:
            best, high = kept, min(middle, largest_deviation(x, functions, kept))
        else:
            low = middle
    return best


def fewest_nodes(x: FloatArray, functions: FloatArray, tolerance: float, window: int = 32) -> IntArray:
    """Indices of the fewest nodes whose chords deviate from no function by more than the tolerance.

    `window`: expected length of a chord in nodes. It affects only the run time."""
    n = len(x)
    # With this slack nodes on one straight line need no node between them despite rounding.
    slack = tolerance + 4.0 * np.finfo(float).eps * np.max(np.abs(functions), axis=1)
    edges = np.full(n, n)  # number of chords from the first node, so far
    came_from = np.zeros(n, dtype=int)
    edges[0] = 0
    for i, ends in enumerate(_all_ends_of_chords(x, functions, slack, window)):
        better = ends[edges[ends] > edges[i] + 1]
        edges[better], came_from[better] = edges[i] + 1, i
    path = [n - 1]
    while path[-1] != 0:
        path.append(int(came_from[path[-1]]))
    return np.array(path[::-1])


def _all_ends_of_chords(x: FloatArray, functions: FloatArray, slack: FloatArray, window: int) -> Iterator[IntArray]:
    """For each node except the last, the later nodes to which a chord may go."""
    n = len(x)
    for first in range(0, n - 1, ROWS_AT_ONCE):
        begin = np.arange(first, min(first + ROWS_AT_ONCE, n - 1))
        passes, goes_on = _chords(x, functions, slack, begin, window)
        for row, i in enumerate(begin.tolist()):
            ahead, farther = window, bool(goes_on[row])
            through = passes[row]
            while farther and i + 1 + ahead < n:
                ahead *= 2
                (through,), (farther,) = _chords(x, functions, slack, begin[row : row + 1], ahead)
            yield i + 1 + np.flatnonzero(through[: n - 1 - i])


def _chords(
    x: FloatArray, functions: FloatArray, slack: FloatArray, begin: IntArray, ahead: int
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Which chords from each node to the nodes ahead pass all nodes between, (n, ahead).

    Also, (n,): whether any slope still passes all these nodes, such that longer chords are
    possible."""
    end = np.minimum(begin[:, None] + np.arange(1, ahead + 1), len(x) - 1)
    step = x[end] - x[begin, None]
    slope = (functions[:, end] - functions[:, begin, None]) / step
    least = np.maximum.accumulate(slope - slack[:, None, None] / step, axis=2)
    most = np.minimum.accumulate(slope + slack[:, None, None] / step, axis=2)
    passes = np.ones(step.shape, dtype=bool)
    passes[:, 1:] = np.all((slope[..., 1:] >= least[..., :-1]) & (slope[..., 1:] <= most[..., :-1]), axis=0)
    return passes, np.all(least[..., -1] <= most[..., -1], axis=0)


def largest_deviation(x: FloatArray, functions: FloatArray, kept: IntArray) -> float:
    """Largest deviation of linear interpolation between the kept nodes from the functions."""
    return max(float(np.max(np.abs(np.interp(x, x[kept], f[kept]) - f))) for f in functions)
