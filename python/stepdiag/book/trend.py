"""How a machine changes from calibration to calibration, and when it will leave its limit.

A line is fitted to the values by weighted least squares. Where they scatter more than their uncertainties say, the
uncertainties of the line are multiplied by the Birge ratio (the root of chi-square by its degrees of freedom). The
calibrations are taken as independent of each other. docs/book.md has the formulas.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from itertools import pairwise
from statistics import NormalDist
from typing import Final, Literal

from stepdiag.book.book import Entry
from stepdiag.book.facts import CalibrationFacts, Value
from stepdiag.parameters import SQUARENESSES

FEWEST: Final = 3  # calibrations, for a line
DAYS: Final = 365.25  # of a year
FARTHEST: Final = 20 * 366  # days of a forecast
SAME_TEMPERATURE: Final = 1.0  # K: calibrations as found that differ by more are not alike
_TWO_SIDED: Final = NormalDist().inv_cdf(0.975)
_ONE_SIDED: Final = NormalDist().inv_cdf(0.95)


@dataclass(frozen=True)
class TrendPoint:
    """A value of one calibration. unlike: why it is not comparable with the latest one; empty if it is."""

    day: date
    value: float
    u: float | None  # standard uncertainty
    entry: Entry
    unlike: str = ""


@dataclass(frozen=True)
class Drift:
    """A line through values against time: `at_mean` on the day `mean`, both independent."""

    mean: date
    at_mean: float
    u_at_mean: float
    per_year: float
    u_per_year: float

    @property
    def is_significant(self) -> bool:
        """With 95 %, on two sides."""
        return abs(self.per_year) > _TWO_SIDED * self.u_per_year

    def at(self, day: date) -> float:
        return self.at_mean + self.per_year * (day - self.mean).days / DAYS

    def u_at(self, day: date) -> float:
        return math.hypot(self.u_at_mean, self.u_per_year * (day - self.mean).days / DAYS)


@dataclass(frozen=True)
class Trend:
    """One quantity against time, the oldest value first. changed: the points before which it changed significantly."""

    name: str
    unit: str
    points: tuple[TrendPoint, ...]
    drift: Drift | None
    changed: tuple[TrendPoint, ...]


@dataclass(frozen=True)
class Due:
    """When to calibrate again. why: the limit is reached by the trend; the stated interval ends; it is not known."""

    day: date | None
    why: Literal["limit", "interval", "not enough to say", "no limit", "not in sight"]


def trends(calibrations: Sequence[Entry]) -> list[Trend]:
    """Of the largest error, squarenesses, slopes of positioning and temperatures; `calibrations`: the oldest first.

    Those that are rejected or unverified do not count. Quantities without a value in any are left out."""
    sound = [one for one in calibrations if one.facts.calibration is not None and not one.facts.calibration.not_counted]
    if not sound:
        return []
    found = [_trend("largest error", "µm", sound)]
    found += [_trend(name, "µrad", sound) for name in SQUARENESSES]
    found += [_trend(name, "µm/m", sound) for name in ("EXX", "EYY", "EZZ")]
    found.append(_trend("temperature", "°C", sound))
    return [one for one in found if one.points]


def due(largest: Trend | None, last: Entry | None, limit: float | None, interval: float | None) -> Due:
    """The earliest day on which the line of the largest error, and 1.645 times its standard uncertainty, reach the
    limit (µm), but not later than `interval` days after the last calibration."""
    by_interval = None
    if last is not None and interval is not None:
        by_interval = date.fromisoformat(last.date[:10]) + timedelta(days=interval)
    by_trend = Due(None, "no limit") if limit is None else _reaches(largest, limit)
    if by_trend.day is not None and (by_interval is None or by_trend.day <= by_interval):
        return by_trend
    return by_trend if by_interval is None else Due(by_interval, "interval")


def _trend(name: str, unit: str, sound: Sequence[Entry]) -> Trend:
    latest = sound[-1].facts.calibration
    assert latest is not None
    points = []
    for entry in sound:
        facts = entry.facts.calibration
        value = None if facts is None else _value(name, facts)
        if facts is not None and value is not None:
            points.append(TrendPoint(date.fromisoformat(entry.date[:10]), *value, entry, _unlike(facts, latest)))
    alike = [one for one in points if not one.unlike and one.u is not None]
    tests = max(len(alike) - 1, 1)
    least = NormalDist().inv_cdf(1.0 - 0.025 / tests)  # 95 % for all changes of the quantity together
    changed = [
        new
        for old, new in pairwise(alike)
        if abs(new.value - old.value) > least * math.hypot(old.u or 0.0, new.u or 0.0)
    ]
    return Trend(name, unit, tuple(points), _line(alike), tuple(changed))


def _value(name: str, facts: CalibrationFacts) -> Value | None:
    if name == "largest error":
        if facts.largest is None:
            return None
        ends = facts.largest.interval
        return facts.largest.value, None if ends is None else (ends[1] - ends[0]) / (2.0 * _TWO_SIDED)
    if name == "temperature":
        return (sum(facts.temperatures) / len(facts.temperatures), None) if facts.temperatures else None
    return facts.squareness.get(name) or facts.slopes.get(name)


def _unlike(facts: CalibrationFacts, latest: CalibrationFacts) -> str:
    """Why two calibrations are not to be compared."""
    if facts.fit == "doubtful":  # its uncertainties are not to be relied on
        return "the fit is doubtful"
    if facts.chain != latest.chain or facts.volume != latest.volume:
        return "another chain or volume"
    if facts.method != latest.method:
        return f"method {facts.method}"
    if facts.referred != latest.referred:
        return "as found" if latest.referred else "referred to a temperature"
    both = zip(facts.temperatures, latest.temperatures, strict=False)
    if any(abs(one - other) > SAME_TEMPERATURE for one, other in both):
        return "another temperature"
    return ""


def _line(points: Sequence[TrendPoint]) -> Drift | None:
    """Weighted least squares; None for fewer than three values, or for values of one day."""
    if len(points) < FEWEST:
        return None
    first = points[0].day
    w = [1.0 / max(one.u or 0.0, 1e-12) ** 2 for one in points]
    x = [(one.day - first).days / DAYS for one in points]
    y = [one.value for one in points]
    total = sum(w)
    x_mean = sum(a * b for a, b in zip(w, x, strict=True)) / total
    y_mean = sum(a * b for a, b in zip(w, y, strict=True)) / total
    spread = sum(a * (b - x_mean) ** 2 for a, b in zip(w, x, strict=True))
    if spread <= 0.0:
        return None
    slope = sum(a * (b - x_mean) * (c - y_mean) for a, b, c in zip(w, x, y, strict=True)) / spread
    chi2 = sum(a * (c - y_mean - slope * (b - x_mean)) ** 2 for a, b, c in zip(w, x, y, strict=True))
    birge = max(1.0, math.sqrt(chi2 / (len(points) - 2)))
    mean = first + timedelta(days=round(x_mean * DAYS))
    return Drift(mean, y_mean, birge / math.sqrt(total), slope, birge / math.sqrt(spread))


def _reaches(largest: Trend | None, limit: float) -> Due:
    if largest is None or largest.drift is None:
        return Due(None, "not enough to say")
    line, last = largest.drift, largest.points[-1].day
    for days in range(FARTHEST):
        day = last + timedelta(days=days)
        if line.at(day) + _ONE_SIDED * line.u_at(day) >= limit:
            return Due(day, "limit")
    return Due(None, "not in sight")
