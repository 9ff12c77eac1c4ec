"""The verdict of a fit in words: CONVENTIONS, "Verdict of a fit"."""

from collections.abc import Iterator
from typing import Final

from stepdiag._core import Adjustment, Calibration, FitReason
from stepdiag.setup_quantities import SETUP_QUANTITIES, component_name

# Of a calibration whose reasons are not at hand.
MEANING: Final = {
    "accepted": "the readings agree with each other and with the scenario",
    "doubtful": "the readings scatter more, or less, than their stated uncertainties allow",
    "rejected": "the readings contradict each other or the scenario; do not use this calibration",
    "unchecked": "nothing controls the readings",
}


def fit_row(calibration: Calibration) -> str:
    """What the file of a calibration says of its fit."""
    if calibration.fit is None:
        return "fit: not known"
    factor = calibration.variance_factor
    figures = "" if factor is None else f" (variance factor {factor:.3g})"
    return f"fit: {_shown(calibration.fit)}: {MEANING[calibration.fit]}{figures}"


def verdict_rows(adjustment: Adjustment) -> Iterator[str]:
    """The verdict of an adjustment with its reasons, and what no verdict tells."""
    verdict = adjustment.verdict
    if verdict.fit == "unchecked":
        yield "fit: unchecked: there are no more readings than unknowns, so that nothing controls them"
        return
    said = MEANING[verdict.fit] if verdict.fit != "doubtful" else next(map(reason_text, verdict.reasons))
    yield (
        f"fit: {_shown(verdict.fit)}: {said} (variance factor {adjustment.variance_factor:.3g} with "
        f"{adjustment.degrees_of_freedom} degrees of freedom, probability {adjustment.chi_square_probability:.2g})"
    )
    if verdict.fit == "rejected":
        yield from (f"rejected because {reason_text(reason)}" for reason in verdict.reasons)
    if verdict.fit == "accepted":
        yield "note: no fit shows a wrong wavelength, temperature, chain or tool offset: the parameters absorb them"


def reason_text(reason: FitReason) -> str:
    """One reason, without a full stop."""
    place = f"line {reason.line}" if reason.line else f"channel {reason.channel}"
    match reason.finding:
        case "noise_factor":
            return (
                f"the readings scatter {reason.value:.3g} times as much as their stated uncertainties "
                f"(at most {reason.limit:g} times is credible)"
            )
        case "uneven_misfit":
            return (
                f"the readings do not fit, and not evenly: {place} scatters {reason.value:.3g} times as much as its "
                f"stated uncertainties, the others {reason.limit:.3g} times"
            )
        case "prior":
            name = f"{reason.channel.replace('_', ' ')}{_component(reason)}"
            return (
                f"{name} of {place} is {reason.value:.3g} standard uncertainties from what [adjustment] takes it for "
                f"(at most {reason.limit:g} is credible)"
            )
        case "misfit":
            return f"the readings scatter more than their stated uncertainties say: chance {reason.value:.2g}"
        case "no_misfit":
            return f"the readings scatter less than their stated uncertainties say: chance {reason.value:.2g}"
        case _:
            return "nothing controls the readings"


def _component(reason: FitReason) -> str:
    of = " of" if SETUP_QUANTITIES[reason.channel].of_beams else ""
    return f"{of} {component_name(reason.channel, reason.component)}".rstrip()


def _shown(fit: str) -> str:
    return fit.upper() if fit == "rejected" else fit
