"""What an evaluation claims to determine against the rank of a whole first-order model (rank_model.py)."""

from __future__ import annotations

import numpy as np
import pytest
from rank_model import RankModel
from truth import SQUARENESS_AXIS, Setup, without
from usual import DIAGONALS, FACES, SCALE_LINES

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "scale_lines"),
    [
        (DIAGONALS, SCALE_LINES),
        (DIAGONALS, SCALE_LINES[:2]),
        (DIAGONALS, SCALE_LINES[:1]),
        (DIAGONALS, []),
        (DIAGONALS[:3], SCALE_LINES),
        (DIAGONALS[:3], []),
        (["ppn", "nnn", "pnp", "npp"], ["n00", "00p"]),
        (DIAGONALS[:2], []),
        (FACES, []),
        (FACES[:4], []),
        (FACES[:2], []),
        (["pp0", "p0p", "0pp"], []),
        (SCALE_LINES, []),
        (["ppp"], []),
    ],
)
def test_evaluation_determines_what_the_rank_allows(lines: list[str], scale_lines: list[str]) -> None:
    setup = Setup(steps=2, lines=lines, scale_lines=scale_lines, order="YZX", tool=(10.0, -20.0, 60.0))
    assert_claims_are_the_rank(setup, [])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_lost_readings_are_bridged_where_the_rank_allows(seed: int) -> None:
    setup = Setup(steps=3, lines=DIAGONALS, scale_lines=SCALE_LINES, tool=(10.0, -20.0, 60.0))
    random = np.random.default_rng(seed)
    points = [(line, k) for line in DIAGONALS for k in range(3 * setup.steps + 1)]
    lost = [points[i] for i in random.choice(len(points), size=1 + seed % 4, replace=False)]
    assert_claims_are_the_rank(setup, lost)


def assert_claims_are_the_rank(setup: Setup, lost: list[tuple[str, int]]) -> None:
    model = RankModel(setup, lost)
    shapes = {name for name in FUNCTIONS if model.shape_is_determined(name)}
    slopes = {axis for axis in "XYZ" if f"E{axis}{axis}" in shapes and model.slope_is_determined(axis)}
    squareness = {name for name in SQUARENESS_AXIS if model.determines({(name, 0): 1.0})}

    run = without(setup.simulate(setup.errors(3)), lost)
    if not shapes:
        with pytest.raises(sd.InvalidArgument, match="nothing can be determined"):
            setup.evaluate(run)
        return
    calibration = setup.evaluate(run)
    assert set(calibration.functions) == shapes
    assert {a for a in "XYZ" if f"E{a}{a}" in shapes and f"E{a}{a}" not in calibration.undetermined_slopes} == slopes
    assert set(calibration.squareness) == squareness
