"""The report of `stepdiag verify`."""

from collections.abc import Iterator

from stepdiag._core import Measurement, Verification
from stepdiag.report.text_columns import text_columns
from stepdiag.units import MICROMETRE, MICRORADIAN

COVERAGE = 2.0  # of U, and in E_n


def agrees(verification: Verification, alpha: float) -> bool:
    """Whether chance makes chi-square as large in at least this share of cases."""
    return verification.probability >= alpha


def verification_report(verification: Verification, measurement: Measurement, alpha: float) -> Iterator[str]:
    """The verdict first, then E_n by line, then the largest deviation of a reading."""
    p = verification.probability
    tested = (
        f"chi-square {verification.chi_square:.1f} with {verification.degrees_of_freedom} degrees of freedom; "
        f"by chance it is larger in {_percent(p)} of cases"
    )
    if agrees(verification, alpha):
        yield f"the readings agree with the calibration: {tested}"
    else:
        yield f"the readings do not agree with the calibration: {tested} (limit {100.0 * alpha:g} %)"
    rows = [("line", "run", "direction", "deviation", "U", "E_n")]
    for line in verification.lines:
        deviation, expanded = line.deviation / MICROMETRE, COVERAGE * line.standard_uncertainty / MICROMETRE
        numbers = (f"{deviation:+.2f}", f"{expanded:.2f}", f"{line.normalised:+.2f}")
        rows.append((line.line, str(line.run), line.direction, *numbers))
    if len(rows) > 1:
        yield "from end to end of each line, read minus predicted (µm), U its expanded uncertainty (k = 2), E_n by U:"
        yield from text_columns(rows, left=(0, 2))
        beyond = sum(abs(line.normalised) > 1.0 for line in verification.lines)
        yield f"  beyond 1: {beyond} of {len(verification.lines)}; 4.6 % are expected by chance"
    yield f"largest deviation of a reading: {_worst(verification, measurement)}"


def _percent(p: float) -> str:
    if p < 1e-6:
        return "less than 0.0001 %"
    return f"{100.0 * p:.0f} %" if p > 0.1 else f"{100.0 * p:.2g} %"


def _worst(verification: Verification, measurement: Measurement) -> str:
    row, channel = verification.worst
    unit, scale = ("µrad", MICRORADIAN) if channel in ("alpha", "beta") else ("µm", MICROMETRE)
    deviation = float(verification.deviations[channel][row]) / scale
    expanded = COVERAGE * float(verification.standard_uncertainties[channel][row]) / scale
    normalised = float(verification.normalised[channel][row])
    place = f"line {measurement.line[row]}, run {measurement.run[row]}, point {measurement.point[row]}"
    return f"{channel} at {place}: {deviation:+.3g} {unit}, U {expanded:.3g} {unit}, E_n {normalised:+.2f}"
