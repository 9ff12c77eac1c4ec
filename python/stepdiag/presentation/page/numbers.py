"""Numbers in the text of a page."""

import math
import re
from typing import Final

from stepdiag.presentation.page.html import Markup, element

# Half width of a two-sided 95 % interval of a normal distribution, in standard uncertainties.
COVERAGE_FACTOR: Final = 1.959963984540054
NBSP: Final = "\u00a0"  # no line ends between a number and its unit
NOT_KNOWN: Final = "not known"


def shown(value: float, *, signed: bool = False) -> str:
    """Three digits or so, with a true minus sign: 1234, 123.4, 12.3, 1.23, 0.123."""
    if not math.isfinite(value):
        return NOT_KNOWN
    size = abs(value)
    digits = 0 if size >= 999.5 else 1 if size >= 9.995 else 2 if size >= 0.9995 or size == 0.0 else 3
    text = f"{value:+.{digits}f}" if signed else f"{value:.{digits}f}"
    return f"{size:.2g}".join(("−" if value < 0 else "", "")) if size and size < 5e-4 else text.replace("-", "−")


def position(place: float) -> str:
    """A position in mm, to a tenth."""
    return f"{round(place, 1):g}".replace("-", "−")


def with_interval(value: float, uncertainty: float, unit: str) -> str:
    """A value with its expanded uncertainty (95 %), both to two digits of the latter: 21.0 ± 1.4 µm."""
    half = COVERAGE_FACTOR * uncertainty
    if not math.isfinite(half):
        return f"{shown(value)}{NBSP}{unit} (uncertainty {NOT_KNOWN})"
    if half <= 0.0:
        return f"{shown(value)}{NBSP}{unit}"
    digits = max(0, 1 - math.floor(math.log10(float(f"{half:.1e}"))))
    return f"{value:.{digits}f}{NBSP}±{NBSP}{half:.{digits}f}{NBSP}{unit}".replace("-", "−")


def moment(date: str) -> str | Markup:
    """A date of a file, 2026-11-22T23:52:08Z, as one reads it; another text as it is. The script writes local time."""
    found = re.fullmatch(r"(\d{4}-\d\d-\d\d)T(\d\d:\d\d):\d\dZ", date)
    return element("time", f"{found[1]} {found[2]} UTC", datetime=date) if found else date
