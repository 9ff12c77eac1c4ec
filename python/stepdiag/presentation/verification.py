"""What `stepdiag verify` and `stepdiag recheck` say, in blocks."""

from collections.abc import Iterator, Sequence

import numpy as np

from stepdiag._core import ChangeCombination, ChangeTerm, FaultClass, Measurement, Recheck, Verification
from stepdiag.calibration.volume import VolumeErrors
from stepdiag.findings.faults import fault_rows
from stepdiag.presentation.blocks import Block, NoteBlock, RowBlock, TableBlock, VerdictBlock
from stepdiag.rechecking.recheck import CHANGE_UNITS, Judged
from stepdiag.units import MICROMETRE, MICRORADIAN

COVERAGE = 2.0  # of U, and in E_n


def agrees(verification: Verification, alpha: float) -> bool:
    """Whether chance makes chi-square as large in at least this share of cases."""
    return verification.probability >= alpha


def verification_blocks(verification: Verification, measurement: Measurement, alpha: float) -> Iterator[Block]:
    """The verdict first, then E_n by line, then the largest deviation of a reading."""
    tested = (
        f"chi-square {verification.chi_square:.1f} with {verification.degrees_of_freedom} degrees of freedom; "
        f"by chance it is larger in {_percent(verification.probability)} of cases"
    )
    rest = _rest(verification.left_out)
    if agrees(verification, alpha):
        yield VerdictBlock("", "agrees", f"{rest} agree with the calibration", tested)
    else:
        tested += f" (limit {100.0 * alpha:g} %)"
        yield VerdictBlock("", "does not agree", f"{rest} do not agree with the calibration", tested)
    yield from (RowBlock(*row) for row in fault_rows(verification.left_out))
    rows = []
    for line in verification.lines:
        deviation, expanded = line.deviation / MICROMETRE, COVERAGE * line.standard_uncertainty / MICROMETRE
        numbers = (f"{deviation:+.2f}", f"{expanded:.2f}", f"{line.normalised:+.2f}")
        rows.append((line.line, str(line.run), line.direction, *numbers))
    if rows:
        title = "from end to end of each line, read minus predicted (µm), U its expanded uncertainty (k = 2), E_n by U"
        yield TableBlock(tuple(rows), ("line", "run", "direction", "deviation", "U", "E_n"), title, left=(0, 2))
        beyond = sum(abs(line.normalised) > 1.0 for line in verification.lines)
        text = f"beyond 1: {beyond} of {len(verification.lines)}; 4.6 % are expected by chance"
        yield NoteBlock(text, indented=True)
    if agrees(verification, alpha):
        yield RowBlock("largest deviation of a reading", next(_worst(verification, measurement)))
    else:
        yield NoteBlock("largest deviations of readings:")
        yield from (NoteBlock(text, indented=True) for text in _worst(verification, measurement))


def _percent(p: float) -> str:
    if p < 1e-6:
        return "less than 0.0001 %"
    return f"{100.0 * p:.0f} %" if p > 0.1 else f"{100.0 * p:.2g} %"


def _rest(left_out: Sequence[FaultClass]) -> str:
    return "the readings that are not left out" if left_out else "the readings"


def _worst(verification: Verification, measurement: Measurement) -> Iterator[str]:
    """The readings with the largest E_n, the worst first."""
    shown = 3
    channels = list(verification.normalised)
    table = np.nan_to_num(np.abs(np.array([verification.normalised[channel] for channel in channels])))
    for place in np.argsort(-table, axis=None, kind="stable")[:shown]:
        k, row = divmod(int(place), table.shape[1])
        channel = channels[k]
        unit, scale = _unit(channel)
        deviation = float(verification.deviations[channel][row]) / scale
        expanded = COVERAGE * float(verification.standard_uncertainties[channel][row]) / scale
        yield (
            f"{channel} at {_place(measurement, row)}: {deviation:+.3g} {unit}, U {expanded:.3g} {unit}, "
            f"E_n {float(verification.normalised[channel][row]):+.2f}"
        )


def _unit(channel: str) -> tuple[str, float]:
    return ("µrad", MICRORADIAN) if channel in ("alpha", "beta") else ("µm", MICROMETRE)


def _place(measurement: Measurement, row: int) -> str:
    return f"line {measurement.line[row]}, run {measurement.run[row]}, point {measurement.point[row]}"


ALONE = 0.9  # of a change that the readings determine by itself
HARDLY = 0.1
SHARE = 0.2  # of a sum, below which a term is not named
MOSTLY = 0.5  # of a sum, that has to be of changes determined together


def recheck_blocks(judged: Judged, measurement: Measurement, volume: VolumeErrors) -> Iterator[Block]:
    """The verdict first; then what is known of each change, what may be hidden, and the volume's error."""
    found = judged.recheck
    tested = (
        f"chi-square {found.chi_square:.1f} of {found.degrees_of_freedom} directions of change that the readings "
        f"determine; by chance it is larger in {_percent(found.probability)} of cases "
        f"(limit {100.0 * judged.alpha:g} %)"
    )
    without = ", by the readings that are not left out" if found.left_out else ""
    headline, why = {
        "unexplained": (
            "the machine has changed, unexplained",
            f"{_rest(found.left_out)} agree neither with the calibration nor with a change of low order; it "
            f"has changed in another way, or readings are wrong (chi-square {found.fit_chi_square:.1f} with "
            f"{found.fit_degrees_of_freedom} degrees of freedom, by chance larger in {_percent(found.fit_probability)} "
            f"of cases, limit {100.0 * judged.alpha:g} %)",
        ),
        "changed": (f"the machine has changed{without}", tested),
        "unchanged": (f"no change of the machine is seen{without}", tested),
    }[judged.verdict]
    yield VerdictBlock("", judged.verdict, headline, why)
    yield from (RowBlock(*row) for row in fault_rows(found.left_out))
    if judged.verdict == "unexplained":
        yield NoteBlock("readings that are farthest from the machine with the best change of low order:")
        yield from (NoteBlock(text, indented=True) for text in _misfits(found, measurement))
        yield RowBlock("change of low order", tested)
    yield from _change_blocks(found)
    yield NoteBlock(
        f"changes that are not seen may move the tool by {judged.hidden / MICROMETRE:.1f} µm somewhere in the volume "
        "(k = 2, with the priors of [change])"
    )
    interval = ""
    if volume.largest_interval is not None:
        low, high = (end / MICROMETRE for end in volume.largest_interval)
        interval = f", 95 % interval {low:.1f} to {high:.1f} µm"
    yield RowBlock("largest error in the volume with the change", f"{volume.largest / MICROMETRE:.1f} µm{interval}")


def _change_blocks(found: Recheck) -> Iterator[Block]:
    """What the readings determine of each change: by itself, only together, or not."""
    alone = [term for term in found.terms if term.determined >= ALONE]
    if alone:
        title = "changes that the readings determine one by one, U their expanded uncertainty (k = 2)"
        columns = ("parameter", "change", "", "U", "")
        yield TableBlock(tuple(map(_change_row, alone)), columns, title, left=(0, 2, 4))
    together = [term for term in found.terms if HARDLY < term.determined < ALONE]
    if together:
        yield RowBlock("determined only together", ", ".join(f"{term.parameter} ({term.kind})" for term in together))
        sums = [text for one in found.combinations if (text := _sum_text(one, found.terms, together))]
        yield from (NoteBlock(text, indented=True) for text in sums)
    others = [f"{term.parameter} ({term.kind})" for term in found.terms if term.determined <= HARDLY]
    if others:
        yield RowBlock("not determined", ", ".join(others))


def _misfits(found: Recheck, measurement: Measurement) -> Iterator[str]:
    for misfit in found.misfits:
        unit, scale = _unit(misfit.channel)
        times = abs(misfit.deviation) / misfit.standard_uncertainty
        yield (
            f"{misfit.channel} at {_place(measurement, misfit.row)}: {misfit.deviation / scale:+.3g} {unit}, "
            f"{times:.3g} times its standard uncertainty"
        )


def _change_row(term: ChangeTerm) -> tuple[str, ...]:
    unit, scale = CHANGE_UNITS[term.kind]
    value, expanded = term.value / scale, COVERAGE * term.standard_uncertainty / scale
    return f"{term.parameter} ({term.kind})", f"{value:+.2f}", unit, f"{expanded:.2f}", unit


def _sum_text(one: ChangeCombination, terms: Sequence[ChangeTerm], named: Sequence[ChangeTerm]) -> str:
    """A sum of changes by their priors, largest shares first; empty if it is mostly of others than `named`."""
    weights = sorted(zip(one.weight, terms, strict=True), key=lambda pair: -abs(pair[0]))
    parameters = {(term.parameter, term.kind) for term in named}
    if sum(weight**2 for weight, term in weights if (term.parameter, term.kind) in parameters) < MOSTLY:
        return ""
    shares = [(weight, term) for weight, term in weights if abs(weight) >= SHARE]
    parts = []
    for weight, term in shares:
        unit, scale = CHANGE_UNITS[term.kind]
        parts.append(f"{weight:+.2f} {term.parameter}/({term.prior / scale:g} {unit})")
    return f"{' '.join(parts)} = {one.value:+.2f}, U {COVERAGE * one.standard_uncertainty:.2f}"
