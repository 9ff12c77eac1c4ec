"""A reading waits until the values have settled, and averages those that have."""

import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.settling import Settling, take_reading
from stepdiag.instruments.instrument import ReadColumn, Sample

MICROMETRE = 1_000_000  # pm
BEAMS = [ReadColumn(f"d{i}", "pm") for i in (1, 2, 3)]


def options(**given: float) -> Settling:
    return Settling(**({"interval": 0.0, "retry_wait": 0.0, "count": 3, "average": 2, "retries": 2} | given))  # type: ignore[arg-type]


class Values:
    """Gives these one after the other, and then the last for ever. None: no beam."""

    def __init__(self, *rows: Sequence[int | None]) -> None:
        self.rows = rows
        self.asked = 0

    def __call__(self) -> Sample:
        row = self.rows[min(self.asked, len(self.rows) - 1)]
        self.asked += 1
        return Sample(tuple(row), tuple("interrupted" if value is None else "" for value in row))


def test_values_at_rest_are_averaged_after_those_that_must_agree() -> None:
    values = Values([10], [11], [12], [20], [23])
    reading = take_reading(values, BEAMS[:1], options())
    assert [value.kind for value in reading.values] == ["settling"] * 3 + ["average"] * 2
    assert reading.mean == (22,)  # 21.5, to the even picometre
    assert reading.deviation == [math.sqrt(4.5)]
    assert values.asked == 5
    assert not reading.lost


def test_one_value_has_no_deviation() -> None:
    reading = take_reading(Values([5, 6]), BEAMS[:2], options(average=1))
    assert (reading.mean, reading.deviation) == ((5, 6), [None, None])


def test_every_axis_must_settle() -> None:
    ringing = [[0, (-1) ** k * MICROMETRE >> k] for k in range(8)]
    reading = take_reading(Values(*ringing, [0, 0]), BEAMS[:2], options(limit_um=0.01))
    assert len(reading.values) > 8
    assert reading.mean[0] == 0
    assert abs(reading.mean[1] or 0) < 0.01 * MICROMETRE


def test_values_that_leave_while_they_are_averaged_begin_again() -> None:
    reading = take_reading(Values([0], [0], [0], [0], [MICROMETRE]), BEAMS[:1], options(average=5))
    assert reading.mean == (MICROMETRE,)
    assert [value.kind for value in reading.values] == ["settling"] * 7 + ["average"] * 5


def test_values_that_never_settle_are_lost() -> None:
    step = iter(range(10**9))
    reading = take_reading(lambda: Sample((next(step) * MICROMETRE,), ("",)), BEAMS[:1], options(timeout=0.2))
    assert (reading.mean, reading.deviation) == ((None,), [None])
    assert reading.lost[0].startswith("did not settle within 0.2 s (last values apart: d1 2 um")
    assert reading.values
    assert {value.kind for value in reading.values} == {"settling"}


def test_beam_that_comes_back_is_not_lost() -> None:
    reading = take_reading(Values([1], [1], [None], [None], [1]), BEAMS[:1], options(retries=2))
    assert reading.mean == (1,)
    assert not reading.lost
    assert [value.kind for value in reading.values].count("lost") == 2


def test_beam_that_stays_away_is_lost_and_the_others_are_read_on() -> None:
    reading = take_reading(Values([1, None, 3]), BEAMS, options(retries=2))
    assert reading.mean == (1, None, 3)
    assert reading.lost == {1: "no beam (interrupted)"}
    assert reading.deviation == [0.0, None, 0.0]


def test_reading_without_any_beam_ends() -> None:
    values = Values([None, None])
    reading = take_reading(values, BEAMS[:2], options(retries=4))
    assert reading.mean == (None, None)
    assert set(reading.lost) == {0, 1}
    assert values.asked == 5


@given(
    rows=st.lists(st.tuples(*[st.none() | st.integers(-(10**12), 10**12)] * 2), min_size=1, max_size=40),
    count=st.integers(2, 4),
    average=st.integers(1, 4),
    retries=st.integers(0, 3),
)
def test_every_value_is_kept_and_the_mean_is_of_values_within_the_limit(
    rows: list[tuple[int | None, int | None]], count: int, average: int, retries: int
) -> None:
    values = Values(*rows)
    reading = take_reading(values, BEAMS[:2], options(count=count, average=average, retries=retries))
    assert [value.values for value in reading.values] == [rows[min(k, len(rows) - 1)] for k in range(values.asked)]
    limit = options().limit(BEAMS[0])
    for i, mean in enumerate(reading.mean):
        assert (mean is None) == (i in reading.lost)
        if mean is not None:
            column = [row[i] for row in reading.averaged]
            assert len(column) == average
            assert all(value is not None and abs(value - mean) <= 2 * limit + 1 for value in column)


@pytest.mark.parametrize(
    "given",
    [
        {"count": 1},
        {"average": 0},
        {"retries": -1},
        {"limit_um": 0.0},
        {"limit_um": math.nan},
        {"timeout": 0.0},
        {"timeout": math.inf},
        {"interval": -1.0},
        {"retry_wait": math.nan},
    ],
)
def test_settling_that_makes_no_sense_is_refused(given: dict[str, float]) -> None:
    with pytest.raises(InvalidArgument, match=f"settling: {next(iter(given))}: expected"):
        Settling(**given)  # type: ignore[arg-type]
