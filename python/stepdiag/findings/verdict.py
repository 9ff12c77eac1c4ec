"""The verdict of an adjustment, in words."""

from collections.abc import Iterator

from stepdiag._core import Adjustment, FitReason
from stepdiag.findings.meaning import MEANING, NOT_SEEN, FitWords, fit_word
from stepdiag.findings.reasons import UNCHECKED, reason_texts


def verdict_words(adjustment: Adjustment) -> FitWords:
    """The verdict of an adjustment with its reasons, and what no verdict shows."""
    verdict = adjustment.verdict
    if verdict.fit == "unchecked":
        return FitWords("unchecked", f"unchecked: {UNCHECKED[verdict.reasons[0].finding]}")
    reasons = reason_texts(verdict.reasons)
    is_noise = bool(verdict.reasons) and _is_noise_of_channel(verdict.reasons[0])
    said = reasons.pop(0) if verdict.fit == "doubtful" or is_noise else MEANING[verdict.fit]
    corrected = f"; {_corrected(adjustment)}" if verdict.fit == "accepted" and adjustment.faults else ""
    figures = (
        f"variance factor {adjustment.variance_factor:.3g} with {adjustment.degrees_of_freedom} degrees of freedom, "
        f"{_probability(adjustment.chi_square_probability)}"
    )
    said = f"{fit_word(verdict.fit)}{corrected}: {said} ({figures})"
    return FitWords(verdict.fit, said, tuple(reasons), tuple(_notes(adjustment)))


def _notes(adjustment: Adjustment) -> Iterator[tuple[str, str]]:
    verdict = adjustment.verdict
    if any(component.used for component in adjustment.variance_components):
        yield (
            "note",
            "the uncertainties are of this noise; if it is what these channels have, state it in [uncertainty]",
        )
    elif [reason.finding for reason in verdict.reasons] == ["misfit"]:
        yield (
            "remedy",
            "no line, channel, time or position scatters unlike the others; if this is the usual noise, [adjustment] "
            f"scale_uncertainty = true multiplies all uncertainties by {verdict.reasons[0].value:.3g}",
        )
    if any(found.treatment == "estimated" for found in adjustment.faults) and verdict.fit == "rejected":
        yield "note", "the values come from a fit in which the faults named below are unknowns; they rest on that"
    if verdict.fit == "accepted":
        yield "note", NOT_SEEN


def _corrected(adjustment: Adjustment) -> str:
    """How many readings were left out and faults freed."""
    left_out, freed = len(adjustment.outliers), sum(found.treatment == "estimated" for found in adjustment.faults)
    texts = [f"{left_out} reading{'s' * (left_out != 1)} left out"] if left_out else []
    if freed:
        texts.append(f"{freed} fault{'s' * (freed != 1)} freed")
    return ", ".join(texts) or "a fault of readings"


def _is_noise_of_channel(reason: FitReason) -> bool:
    return reason.finding in ("noise_factor", "misfit") and bool(reason.channel)


def _probability(probability: float) -> str:
    least = 1e-12
    return f"probability {probability:.2g}" if probability >= least else f"probability below {least:g}"
