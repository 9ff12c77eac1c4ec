"""Distances beside the nominal way: what a line tells by itself."""

import numpy as np
import pytest
from usual import VOLUME

import stepdiag as sd
from stepdiag.mistakes.nominal_way import Way, line_remark, shift_of

STEPS = 10
PLAN = sd.Plan(VOLUME, ["ppp", "pp0"], STEPS, scale_lines=["p00", "0p0"])


def travel_of(line: str, order: str = "XYZ") -> np.ndarray:
    plan = sd.Plan(VOLUME, [line], STEPS, order=order)
    return plan.points(line) @ plan.frame(line)[:, 2]


def way(distance: np.ndarray, line: str = "ppp") -> Way:
    return Way(0, line, np.arange(len(distance)), travel_of(line), np.asarray(distance, dtype=float))


def remark(distance: np.ndarray, line: str = "ppp") -> str | None:
    return line_remark(way(distance, line), {"other": travel_of(line, "ZYX")})


def test_a_sound_line_has_no_remark() -> None:
    noise = np.random.default_rng(1).normal(size=3 * STEPS + 1)
    assert remark(100.0 + travel_of("ppp") + 0.05 * noise) is None
    single = travel_of("ppp").copy()
    single[7] = np.nan
    single[12] += 50.0
    assert remark(single) is None  # the adjustment finds such a one


@pytest.mark.parametrize(
    ("distance", "words"),
    [
        (np.full(3 * STEPS + 1, 312.0), "hardly change: does the mirror move"),
        (500.0 - travel_of("ppp"), "the sign of distances is wrong, or the line is reversed"),
        (travel_of("ppp", "ZYX"), "the distances are those of line other"),
        (2.0 * travel_of("ppp"), "grow by 2 mm for each mm"),
        (np.insert(travel_of("ppp"), 9, travel_of("ppp")[8])[:-1], "read twice at reading 10"),
        (np.append(np.delete(travel_of("ppp"), 9), np.nan), "skipped at reading 10"),
    ],
)
def test_what_is_odd_about_a_line_is_said(distance: np.ndarray, words: str) -> None:
    said = remark(distance)
    assert said is not None
    assert words in said


@pytest.mark.parametrize("line", ["ppp", "pp0"])
@pytest.mark.parametrize("twice", [True, False])
def test_every_place_of_a_shift_is_found(line: str, twice: bool) -> None:
    travel = travel_of(line)
    for k in range(1, len(travel) - 3):
        read = np.insert(travel, k, travel[k - 1])[:-1] if twice else np.append(np.delete(travel, k), travel[-1])
        shifts = [shift for shift in shift_of(way(read, line)) if shift.twice is twice]
        assert [shift.place for shift in shifts] == [k]
        # Undone, each row has its own distance again, or none.
        source = shifts[0].source
        undone = np.where(source >= 0, read[source], np.nan)
        assert np.array_equal(undone[source >= 0], travel[source >= 0])
        assert np.count_nonzero(source < 0) == 1
