"""Fewer nodes for functions that are linear between their nodes.

`fewest_nodes` finds which nodes to keep so that linear interpolation between them deviates by at most a tolerance, with
as few of them as can be: the shortest path from the first node to the last, where an edge is a chord that passes every
node between at most the tolerance away (Imai and Iri, Computational-geometric methods for polygonal approximations of
a curve, 1986). `best_subset` searches the least tolerance that a number of nodes permits: of all subsets of that size
none has a smaller largest deviation, but for the relative RESOLUTION of the search.
"""

from typing import Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int_]

RESOLUTION: Final = 1e-4
MOST_NODES: Final = 5_000  # the search takes ten seconds
FIRST_WINDOW: Final = 32  # nodes looked at, as long as chords end within them


def best_subset(x: FloatArray, functions: FloatArray, size: int) -> IntArray:
    """Which `size` nodes (or fewer) to keep, the first and the last among them.

    x: (n,) ascending. functions: (m, n), values at the nodes. Their largest deviation, over all positions and all m, is
    the least that any such subset has. Raises InvalidArgument for fewer than 2 or for more than MOST_NODES nodes."""
    if size < 2:
        raise InvalidArgument(f"rows: expected at least 2, got {size}")
    if len(x) > MOST_NODES:
        raise InvalidArgument(f"a table with {len(x)} nodes: at most {MOST_NODES} can be resampled")
    every = np.arange(len(x))
    if len(every) <= size:
        return every
    low, high = 0.0, float(np.max(np.ptp(functions, axis=1)))  # one chord never deviates by more than the range
    best = fewest_nodes(x, functions, 0.0)
    if len(best) <= size:
        return best
    best = np.array([0, len(x) - 1])
    while high - low > RESOLUTION * high:
        middle = 0.5 * (low + high)
        kept = fewest_nodes(x, functions, middle)
        if len(kept) <= size:
            best, high = kept, min(middle, largest_deviation(x, functions, kept))
        else:
            low = middle
    return best


def fewest_nodes(x: FloatArray, functions: FloatArray, tolerance: float) -> IntArray:
    """The fewest nodes whose chords deviate by at most the tolerance from every function."""
    n = len(x)
    # The slack keeps nodes on one straight line together, whatever the rounding of their values.
    slack = tolerance + 4.0 * np.finfo(float).eps * np.max(np.abs(functions), axis=1, keepdims=True)
    edges = np.full(n, n)  # from the first node, so far
    came_from = np.zeros(n, dtype=int)
    edges[0] = 0
    for i in range(n - 1):
        ends = _ends_of_chords(x, functions, slack, i)
        ends = ends[edges[ends] > edges[i] + 1]
        edges[ends], came_from[ends] = edges[i] + 1, i
    path = [n - 1]
    while path[-1] != 0:
        path.append(int(came_from[path[-1]]))
    return np.array(path[::-1])


def _ends_of_chords(x: FloatArray, functions: FloatArray, slack: FloatArray, i: int) -> IntArray:
    """The nodes after i to which a chord from i may go: its slope must pass all those between."""
    width = FIRST_WINDOW
    while True:
        step = x[i + 1 : i + 1 + width] - x[i]
        slope = (functions[:, i + 1 : i + 1 + width] - functions[:, i, None]) / step
        least = np.maximum.accumulate(slope - slack / step, axis=1)
        most = np.minimum.accumulate(slope + slack / step, axis=1)
        # Where no slope is left that passes all nodes so far, no chord goes farther.
        if np.any(least[:, -1] > most[:, -1]) or i + 1 + width >= len(x):
            break
        width *= 2
    passes = np.ones(slope.shape[1], dtype=bool)
    passes[1:] = np.all((slope[:, 1:] >= least[:, :-1]) & (slope[:, 1:] <= most[:, :-1]), axis=0)
    return i + 1 + np.flatnonzero(passes)


def largest_deviation(x: FloatArray, functions: FloatArray, kept: IntArray) -> float:
    """Of linear interpolation between the kept nodes from the functions."""
    return max(float(np.max(np.abs(np.interp(x, x[kept], f[kept]) - f))) for f in functions)
