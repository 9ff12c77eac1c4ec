"""The compensator answers what the conventions say: compared with an oracle of 40 digits that shares no code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compensator_oracle import CAPPED, OUTSIDE, REFUSED, Oracle
from error_tables import COLUMNS, TOOL, RandomTable, leading_lines
from usual import ALL_CHAINS, VOLUME

import stepdiag as sd

# Each interval has its functions continued to the position 0: values of about a millimetre and products of that size,
# each with a rounding of 1e-16 mm.
ERROR = 1e-15  # mm
ORIENTATION = 1e-18  # rad: of 1e-4 rad, and a series that ends where 1e-14 of it is left
# A position has a rounding of 5.7e-14 mm below 1000 mm, and below 2000 mm twice that.
POSITION = 2.4e-13  # mm


class Both:
    """A compensator and the oracle for the same file and options."""

    def __init__(self, folder: Path, text: str, **options: Any) -> None:
        path = folder / "table.csv"
        path.write_text(text)
        self.oracle = Oracle(text, **options)
        self.compensator = sd.Compensator(path, self.oracle.chain, **options)

    def compare(self, positions: Any, tool: Any = None, status: int | None = None, size: float = 1.0) -> None:
        """`size`: how much larger deviations may be than with errors of 0.1 mm and 1e-4 rad."""
        positions = np.atleast_2d(np.asarray(positions, dtype=float))
        answers = [self.oracle.error(p, tool) for p in positions]
        given = self.compensator.status(positions)
        np.testing.assert_array_equal(given, [a.status for a in answers])
        assert status is None or set(given) == {status}
        close(self.compensator.error(positions, tool=tool), [a.position for a in answers], ERROR * size)
        close(self.compensator.orientation(positions, tool=tool), [a.orientation for a in answers], ORIENTATION * size)
        close(
            self.compensator.forward(positions, tool=tool), [self.oracle.forward(p, tool) for p in positions], POSITION
        )

    def compare_commands(self, targets: Any, tool: Any = None) -> None:
        targets = np.atleast_2d(np.asarray(targets, dtype=float))
        found = self.compensator.command(targets, tool=tool)
        close(found, [self.oracle.command(t, tool) for t in targets], POSITION + 1.2 * self.compensator.inverse_bound)


def close(found: Any, expected: Any, tolerance: float) -> None:
    worst = max(float(abs(f - e)) for f, e in zip(np.ravel(found), np.ravel(np.array(expected)), strict=True))
    assert worst <= tolerance, f"{worst} is more than {tolerance}"


def inside(seed: int, count: int, volume: tuple[float, ...] = VOLUME) -> np.ndarray:
    return np.random.default_rng(seed).uniform(size=(count, 3)) * volume


def corners(volume: tuple[float, ...] = VOLUME) -> np.ndarray:
    return np.array(np.meshgrid(*[(0.0, edge) for edge in volume])).reshape(3, -1).T


@pytest.mark.parametrize("chain", ALL_CHAINS)
def test_errors_of_every_chain_are_those_of_the_conventions(tmp_path: Path, chain: str) -> None:
    both = Both(tmp_path, RandomTable(seed=ALL_CHAINS.index(chain), chain=chain).text())
    both.compare(inside(1, 6), status=0)
    both.compare(corners()[[0, 3, 7]], status=0)
    both.compare(inside(2, 3), tool=(0.0, 0.0, 0.0))
    both.compare(inside(3, 3), tool=(-150.0, 40.0, 220.0))
    both.compare_commands(inside(4, 2))
    both.compare_commands(inside(5, 1), tool=(30.0, 20.0, -10.0))


def test_errors_at_the_nodes_and_beside_them_are_those_of_the_conventions(tmp_path: Path) -> None:
    both = Both(tmp_path, RandomTable(seed=100).text())
    for axis in range(3):
        nodes = {p for name, (p, _) in both.oracle.table.functions.items() if name[2] == "XYZ"[axis] for p in p}
        for node in sorted(float(p) for p in nodes if 0 <= p <= VOLUME[axis])[::8]:
            positions = np.tile(np.array(VOLUME) / 3.0, (3, 1))
            positions[:, axis] = np.clip([np.nextafter(node, -1), node, np.nextafter(node, 1e9)], 0.0, VOLUME[axis])
            both.compare(positions)


@pytest.mark.parametrize("seed", range(8))
def test_common_nodes_one_in_each_equal_share_of_an_axis_are_still_uneven(tmp_path: Path, seed: int) -> None:
    """Equidistant nodes may be found faster. These look alike when they are counted, and are not equidistant."""
    random = np.random.default_rng(seed)
    count = 2 + seed
    rows = []
    for axis, edge in zip("XYZ", VOLUME, strict=True):
        inner = (np.arange(count - 1) + random.uniform(0.05, 1.0, count - 1)) * edge / count
        for component in "XYZABC":
            size, unit = (40.0, "um") if component in "XYZ" else (15.0, "urad")
            rows += [
                f"E{component}{axis},{float(p)},{random.uniform(-size, size)},{unit}," for p in (0.0, *inner, edge)
            ]
    text = "\n".join([*leading_lines("[w X' b Y Z t]", VOLUME, TOOL), COLUMNS, *rows]) + "\n"
    both = Both(tmp_path, text)
    both.compare(inside(20 + seed, 12), status=0)
    both.compare_commands(inside(40 + seed, 3))


def test_large_angles_are_turned_exactly(tmp_path: Path) -> None:
    """1 mrad each: without second order errors would be off by micrometres; a series leaves 5e-13 mm at most."""
    rows = [
        f"E{r}{axis},{p},{value},urad,"
        for axis, edge in zip("XYZ", VOLUME, strict=True)
        for r, value in zip("ABC", (1000.0, -900.0, 1100.0), strict=True)
        for p, value in ((0.0, 0.0), (edge, value))
    ]
    text = "\n".join([*leading_lines("[w Y' b X Z t]", VOLUME, TOOL), COLUMNS, *rows]) + "\n"
    both = Both(tmp_path, text, largest_correction=10.0)
    both.compare(inside(6, 8), status=0, size=2500.0)
    both.compare_commands(inside(7, 4))


@pytest.mark.parametrize("seed", range(4))
def test_positions_outside_are_held_continued_or_refused(tmp_path: Path, seed: int) -> None:
    text = RandomTable(seed=200 + seed).text()
    random = np.random.default_rng(seed)
    near = np.where(
        random.uniform(size=(8, 3)) < 0.5, -random.uniform(0.5, 9.5, (8, 3)), VOLUME + random.uniform(0.1, 9.5, (8, 3))
    )
    near[4:, 1] = 300.0
    Both(tmp_path, text).compare(near, status=OUTSIDE)
    linear = Both(tmp_path, text, outside="linear", margin=10.0)
    linear.compare(near, status=OUTSIDE)
    linear.compare_commands(near[:3] * 0.5 + np.array(VOLUME) / 4.0)
    beyond = near.copy()
    beyond[:, 0] = -10.5  # errors are below 0.2 mm: where the tool comes to is beyond the margin, too
    refusing = Both(tmp_path, text, outside="refuse")
    for both, positions in ((linear, beyond), (refusing, near)):
        assert set(both.compensator.status(positions)) == {OUTSIDE | REFUSED}
        for answer in (both.compensator.error, both.compensator.forward, both.compensator.command):
            assert np.all(np.isnan(answer(positions)))
    refusing.compare(inside(8, 3), status=0)


def test_positions_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    both = Both(tmp_path, RandomTable(seed=300).text())
    for value in (np.nan, np.inf, -np.inf):
        position = np.array([[100.0, value, 100.0]])
        assert both.compensator.status(position) == [REFUSED]
        for answer in (both.compensator.error, both.compensator.forward, both.compensator.command):
            assert np.all(np.isnan(answer(position)))


def test_positions_are_those_of_the_controller(tmp_path: Path) -> None:
    """`origin` is where the controller's coordinates have the home of the table."""
    origin = (-400.0, 1000.0, -500.0)
    both = Both(tmp_path, RandomTable(seed=301).text(), origin=origin)
    both.compare(inside(9, 5) + origin, status=0)
    both.compare_commands(inside(10, 3) + origin)
    both.compare(inside(9, 3), status=OUTSIDE)


def test_corrections_are_capped_in_length(tmp_path: Path) -> None:
    both = Both(tmp_path, RandomTable(seed=302).text(), largest_correction=0.01)
    both.compare(inside(11, 8))
    capped = (both.compensator.status(inside(11, 8)) & CAPPED) > 0
    assert capped.any()
    targets = inside(12, 200)
    corrections = np.linalg.norm(both.compensator.command(targets) - targets, axis=1)
    assert corrections.max() <= 0.01 + both.compensator.inverse_bound


@pytest.mark.parametrize("approach", ["mean", "positive", "negative"])
def test_approach_chooses_among_two_directions(tmp_path: Path, approach: str) -> None:
    both = Both(tmp_path, RandomTable(seed=303, directed=True).text(), approach=approach)
    both.compare(inside(13, 8), status=0)
    both.compare_commands(inside(14, 3))


def test_worst_of_many_random_tables(tmp_path: Path, record_property: Any) -> None:
    """Everything at once, and what the largest deviation was."""
    worst = 0.0
    for seed in range(12):
        table = RandomTable(seed=400 + seed, chain=ALL_CHAINS[(5 * seed) % 24], directed=seed % 2 == 1)
        both = Both(tmp_path, table.text())
        positions = inside(seed, 4)
        expected = [both.oracle.error(p).position for p in positions]
        found = both.compensator.error(positions)
        worst = max(worst, *(float(abs(f - e)) for f, e in zip(found.ravel(), np.ravel(expected), strict=True)))
    record_property("largest deviation of an error component, mm", worst)
    assert worst <= ERROR
