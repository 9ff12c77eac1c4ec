"""What the verdict of a calibration means, and what it was made from, in words.

docs/conventions.md, "Verdict of a fit", has the definition."""

from typing import Final, NamedTuple

from stepdiag._core import Calibration

# By Calibration.provenance_keys().
PROVENANCE: Final = {
    "program": "made by",
    "run_sha256": "run, SHA-256",
    "scenario_sha256": "scenario, SHA-256",
    "heads_sha256": "heads, SHA-256",
    "options": "options",
}
# Of a calibration whose reasons are not at hand.
MEANING: Final = {
    "accepted": "the readings agree with each other and with the scenario",
    "doubtful": "the readings scatter more, less or otherwise than their stated uncertainties allow",
    "rejected": "the readings contradict each other or the scenario; do not use this calibration",
    "unchecked": "nothing controls the readings",
}
# Whether a calibration is valid, where nothing else is said; what the machine is against its limit is another question.
HEADLINE: Final = {
    "accepted": "valid: the readings agree",
    "doubtful": "DOUBTFUL: do not rely on the stated uncertainties",
    "rejected": "REJECTED: do not use it",
    "unchecked": "UNCHECKED: nothing controls the readings",
    None: "NOT KNOWN to be valid",
}
UNVERIFIED: Final = (
    "unverified: a checksum was absent when this calibration was read; its values may have been changed since they "
    "were written"
)
# The better first.
FITS: Final = ("accepted", "unchecked", "doubtful", "rejected")
# Of calibrations by linear methods, whose uncertainties know of nothing else.
NOISE_ALONE: Final = {
    "conventional": "uncertainties are of noise alone: what rotations, laser and mirror do to distances is "
    "neither in them nor corrected",
    "enhanced": "uncertainties are of noise alone: what laser and mirror angles do at second order is "
    "neither in them nor corrected",
}
# Of what is accepted.
NOT_SEEN: Final = "a good fit does not prove that wavelength, temperature, tool offset and place of b are right"


def is_valid(calibration: Calibration) -> bool:
    """Whether a calibration is to be relied on without a word of warning."""
    return calibration.fit == "accepted" and not calibration.unverified


def headline(calibration: Calibration, which: str = "Calibration") -> str:
    """Whether a calibration is valid, in a few words for titles and printed pages."""
    if not calibration.unverified:
        return f"{which} {HEADLINE[calibration.fit]}"
    if calibration.fit == "accepted":
        return f"{which} UNVERIFIED: its values may have been changed"
    return f"{which} {HEADLINE[calibration.fit]}. Unverified"


class FitWords(NamedTuple):
    """A verdict of a fit in words, without full stops.

    because: its reasons, as far as `said` has none. notes: label and sentence, of what goes with it."""

    fit: str
    said: str
    because: tuple[str, ...] = ()
    notes: tuple[tuple[str, str], ...] = ()


def fit_words(calibration: Calibration) -> FitWords:
    """What the file of a calibration says of its fit, with what no verdict shows."""
    notes = [("unverified", UNVERIFIED.partition(": ")[2])] if calibration.unverified else []
    if calibration.uncertainty_scaled is not None:
        notes.append(("note", f"all standard uncertainties were multiplied by {calibration.uncertainty_scaled:.3g}"))
    if calibration.method in NOISE_ALONE:
        notes.append(("note", NOISE_ALONE[calibration.method]))
    if calibration.fit == "accepted":
        notes.append(("note", NOT_SEEN))
    reasons = tuple(calibration.fit_reasons)
    return FitWords(calibration.fit or "not known", _said(calibration), reasons, tuple(notes))


def _said(calibration: Calibration) -> str:
    if calibration.fit is None:
        return "not known"
    factor = calibration.variance_factor
    figures = "" if factor is None else f" (variance factor {factor:.3g})"
    return f"{fit_word(calibration.fit)}: {MEANING[calibration.fit]}{figures}"


def trust_rows(calibration: Calibration) -> list[str]:
    """The verdict in one line, and whether the calibration is unverified."""
    return [f"fit: {_said(calibration)}", *([UNVERIFIED] if calibration.unverified else [])]


def unverified_key(calibration: Calibration) -> dict[str, str]:
    """The key of a file that says that its calibration is unverified."""
    key, text = UNVERIFIED.split(": ")
    return {key: text} if calibration.unverified else {}


def provenance_rows(calibration: Calibration) -> list[str]:
    """What a calibration was made from, as far as its file says."""
    made = calibration.provenance
    return [f"{words}: {made[key]}" for key, words in PROVENANCE.items() if key in made]


def fit_word(fit: str) -> str:
    return fit.upper() if fit == "rejected" else fit
