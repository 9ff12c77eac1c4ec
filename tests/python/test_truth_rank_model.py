"""What an evaluation claims to determine against the rank of a whole first-order model (rank_model.py)."""

from __future__ import annotations

import pytest
from rank_model import RankModel
from truth import DIAGONALS, FACES, SCALE_LINES, SQUARENESS_AXIS, Setup

import stepdiag as sd

FUNCTIONS = {f"E{c}{a}" for c in "XYZABC" for a in "XYZ"}


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
    model = RankModel(setup)
    shapes = {name for name in FUNCTIONS if model.shape_is_determined(name)}
    slopes = {axis for axis in "XYZ" if f"E{axis}{axis}" in shapes and model.slope_is_determined(axis)}
    squareness = {name for name in SQUARENESS_AXIS if model.determines({(name, 0): 1.0})}

    run = setup.simulate(setup.errors(3))
    if not shapes:
        with pytest.raises(sd.InvalidArgument, match="nothing can be determined"):
            setup.evaluate(run)
        return
    calibration = setup.evaluate(run)
    assert set(calibration.functions) == shapes
    assert {a for a in "XYZ" if f"E{a}{a}" in shapes and f"E{a}{a}" not in calibration.undetermined_slopes} == slopes
    assert set(calibration.squareness) == squareness
