"""Fewer nodes for a function that is linear between them: no subset of the size does better."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusal import refused

from stepdiag.exporting.fewest_nodes import best_subset, fewest_nodes, largest_deviation

# The search stops when its interval is a ten-thousandth of the deviation.
RESOLUTION = 2e-4

values = st.lists(st.tuples(st.integers(1, 9), st.integers(-50, 50), st.integers(-50, 50)), min_size=2, max_size=9)


@given(rows=values, size=st.integers(2, 6))
def test_no_subset_of_the_same_size_deviates_less(rows: list[tuple[int, int, int]], size: int) -> None:
    steps, first, second = np.array(rows, dtype=float).T
    x, functions = np.cumsum(steps), np.array([first, second])
    kept = best_subset(x, functions, size)
    assert len(kept) <= size
    assert (kept[0], kept[-1]) == (0, len(x) - 1)
    inner = range(1, len(x) - 1)
    best = min(
        largest_deviation(x, functions, np.array([0, *subset, len(x) - 1]))
        for n in range(min(size, len(x)) - 1)
        for subset in combinations(inner, n)
    )
    assert largest_deviation(x, functions, kept) <= best * (1.0 + RESOLUTION) + 1e-12


@given(rows=values, tolerance=st.floats(0.0, 60.0))
def test_chords_keep_the_tolerance(rows: list[tuple[int, int, int]], tolerance: float) -> None:
    steps, first, second = np.array(rows, dtype=float).T
    x, functions = np.cumsum(steps), np.array([first, second])
    kept = fewest_nodes(x, functions, tolerance)
    assert largest_deviation(x, functions, kept) <= tolerance + 1e-12  # values up to 50: rounding


def test_nodes_on_straight_lines_go_without_loss() -> None:
    x = np.linspace(0.0, 700.0, 1001)
    corners = np.array([0.0, 70.0, 140.0, 700.0])
    function = np.interp(x, corners, [0.0, 0.013, -0.02, 0.007])
    kept = best_subset(x, function[None, :], 256)
    assert np.array_equal(x[kept], corners)
    assert largest_deviation(x, function[None, :], kept) < 1e-17  # mm; values of 0.02 mm are rounded to 4e-18


def test_as_many_nodes_as_there_are_stay_all() -> None:
    x = np.array([0.0, 1.0, 3.0])
    assert best_subset(x, np.array([[0.0, 1.0, 0.0]]), 3).tolist() == [0, 1, 2]


def test_a_sine_loses_what_a_parabola_over_its_intervals_does() -> None:
    x = np.linspace(0.0, 1.0, 801)
    kept = best_subset(x, np.sin(np.pi * x)[None, :], 11)
    # Of the best chords of sin every one deviates by the same d; the integral of sqrt(|f''| / (8 d)) is their number.
    share = np.mean(np.sqrt(np.pi**2 * np.sin(np.pi * x) / 8.0))
    assert largest_deviation(x, np.sin(np.pi * x)[None, :], kept) == pytest.approx((share / 10.0) ** 2, rel=0.05)


def test_bad_sizes_are_refused() -> None:
    x = np.array([0.0, 1.0])
    refused(best_subset, x, np.zeros((1, 2)), 1, names="at least 2")
    many = np.arange(6_000.0)
    refused(best_subset, many, np.zeros((1, len(many))), 256, names="6000 nodes")
