"""Trends: the line is that of weighted least squares, and the day on which the limit may be reached is the first."""

from dataclasses import dataclass
from datetime import date, timedelta

import numpy as np
import pytest

from stepdiag.book.facts import CalibrationFacts, Facts, LargestError
from stepdiag.book.trend import Trend, due, trends


@dataclass(frozen=True)
class FakeEntry:
    """What a trend needs of an entry."""

    date: str
    facts: Facts
    file: str = "calibrations/a.nc"


def entry(day: date, c0y: float, largest: float, u: float = 1.0, **changed: object) -> FakeEntry:
    facts = CalibrationFacts(
        method="adjustment",
        chain="[w X' b Y Z t]",
        volume=(800.0, 600.0, 500.0),
        fit="accepted",
        squareness={"C0Y": (c0y, u)},
        largest=LargestError(
            value=largest, interval=(largest - 1.959964 * u, largest + 1.959964 * u), at=(0.0, 0.0, 0.0)
        ),
    )
    return FakeEntry(f"{day}T08:00:00Z", Facts(kind="calibration", calibration=facts.model_copy(update=changed)))


def named(name: str, found: list[Trend]) -> Trend:
    return next(one for one in found if one.name == name)


DAYS = [date(2020, 1, 1) + timedelta(days=200 * k) for k in range(6)]


def test_line_is_that_of_weighted_least_squares() -> None:
    """Against NumPy's, which scales its covariance by the scatter where it is asked to."""
    rng = np.random.default_rng(3)
    for factor, scaled in ((0.3, "unscaled"), (5.0, True)):
        u = rng.uniform(0.5, 2.0, 6)
        values = rng.normal(0.0, factor * u)
        found = trends([entry(d, v, 10.0, w) for d, v, w in zip(DAYS, values, u, strict=True)])  # type: ignore[arg-type]
        line = named("C0Y", found).drift
        assert line is not None
        years = np.array([(day - DAYS[0]).days / 365.25 for day in DAYS])
        (slope, _), covariance = np.polyfit(years, values, 1, w=1.0 / u, cov=scaled)
        assert line.per_year == pytest.approx(slope, rel=1e-9)
        assert line.u_per_year == pytest.approx(np.sqrt(covariance[0, 0]), rel=1e-9)
        at_end = float(np.polyval(np.polyfit(years, values, 1, w=1.0 / u), years[-1]))
        assert line.at(DAYS[-1]) == pytest.approx(at_end, abs=2e-3 * abs(slope) + 1e-9), "the mean is a whole day"


def test_share_of_drifts_that_are_found_where_there_is_none() -> None:
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(2000):
        values = rng.normal(0.0, 1.0, 6)
        line = named("C0Y", trends([entry(d, v, 10.0) for d, v in zip(DAYS, values, strict=True)])).drift  # type: ignore[arg-type]
        found += line is not None and line.is_significant
    assert found / 2000 < 0.05 + 3 * np.sqrt(0.05 * 0.95 / 2000), "the Birge ratio makes it safer, never less safe"


def test_sudden_change_is_marked_at_its_calibration() -> None:
    values = [0.0, 0.5, -0.3, 9.0, 9.2, 8.8]
    found = named("C0Y", trends([entry(d, v, 10.0) for d, v in zip(DAYS, values, strict=True)]))  # type: ignore[arg-type]
    assert [one.day for one in found.changed] == [DAYS[3]]


def test_due_is_the_first_day_on_which_the_limit_may_be_reached() -> None:
    entries = [entry(d, 0.0, 10.0 + 0.01 * (d - DAYS[0]).days, 0.5) for d in DAYS]
    (largest, *_) = trends(entries)  # type: ignore[arg-type]
    found = due(largest, entries[-1], 30.0, None)  # type: ignore[arg-type]
    assert found.why == "limit"
    assert found.day is not None
    line = largest.drift
    assert line is not None
    before = found.day - timedelta(days=1)
    assert line.at(before) + 1.644854 * line.u_at(before) < 30.0 <= line.at(found.day) + 1.644854 * line.u_at(found.day)
    exact = DAYS[0] + timedelta(days=(30.0 - 10.0) / 0.01)
    assert found.day < exact, "the uncertainty of the line makes it earlier"
    assert due(largest, entries[-1], 30.0, 100.0).why == "interval"  # type: ignore[arg-type]
    assert due(largest, entries[-1], 30.0, 5000.0).day == found.day  # type: ignore[arg-type]
    assert due(largest, entries[-1], 1000.0, None).why == "not in sight"  # type: ignore[arg-type]
    assert due(largest, entries[-1], None, None).why == "no limit"  # type: ignore[arg-type]


def test_fewer_than_three_are_not_enough_to_say() -> None:
    entries = [entry(d, 0.0, 10.0) for d in DAYS[:2]]
    (largest, *_) = trends(entries)  # type: ignore[arg-type]
    assert largest.drift is None
    assert due(largest, entries[-1], 30.0, None).why == "not enough to say"  # type: ignore[arg-type]
    assert trends([]) == []


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"method": "enhanced"}, "method enhanced"),
        ({"chain": "[w b X Y Z t]"}, "another chain or volume"),
        ({"temperatures": (20.0,), "referred": True}, "referred to a temperature"),
        ({"temperatures": (23.0, 23.0, 23.0)}, "another temperature"),
    ],
)
def test_what_cannot_be_compared_is_marked_and_left_out_of_the_line(changed: dict[str, object], why: str) -> None:
    entries = [entry(d, 0.0, 10.0, temperatures=(20.0, 20.0, 20.0)) for d in DAYS]
    entries[2] = entry(DAYS[2], 50.0, 60.0, **{"temperatures": (20.0, 20.0, 20.0), **changed})
    found = named("C0Y", trends(entries))  # type: ignore[arg-type]
    assert [one.unlike for one in found.points] == ["", "", why, "", "", ""]
    assert found.drift is not None
    assert found.drift.per_year == pytest.approx(0.0, abs=1e-9)
    assert found.changed == ()


def test_rejected_and_unverified_calibrations_do_not_count() -> None:
    entries = [entry(d, 0.0, 10.0) for d in DAYS]
    entries[0] = entry(DAYS[0], 99.0, 99.0, fit="rejected")
    entries[1] = entry(DAYS[1], 99.0, 99.0, unverified=True)
    assert [one.day for one in named("C0Y", trends(entries)).points] == DAYS[2:]  # type: ignore[arg-type]
