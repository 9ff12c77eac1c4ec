"""Mistakes that would explain a run, in words; and what no reading shows."""

from collections.abc import Iterator, Sequence

from stepdiag._core import InvalidArgument, Measurement
from stepdiag.calibration.finding_text import mistake_reason
from stepdiag.display import point_text
from stepdiag.mistakes.search import FoundMistake, MistakeSearch
from stepdiag.scenario.known import Known


def change_rows(found: Sequence[FoundMistake]) -> Iterator[str]:
    """What to change; several are alternatives."""
    for one in found:
        yield f"to change{'' if len(found) == 1 else ' if so'}: {one.edit}"


def mistake_text(found: Sequence[FoundMistake]) -> str:
    """One sentence of all alternatives, without a full stop."""
    texts = [one.text for one in found]
    best = found[0]
    if best.alternatives:
        texts.append(f"one of {best.alternatives} more")
    said = texts[0] if len(texts) == 1 else f"either {'; or '.join(texts)}"
    if best.or_faults:
        said += ", or it is the faults that were found, which no reading tells from that"
    before = "" if best.variance_factor_before is None else f" in place of {best.variance_factor_before:.3g}"
    return f"{said}; with that undone the fit is {best.fit} (variance factor {best.variance_factor:.3g}{before})"


def searchable(known: Known, measurement: Measurement) -> MistakeSearch | None:
    """The search for mistakes in a run; None where the run does not belong to the plan at all."""
    try:
        return MistakeSearch(known, measurement)
    except InvalidArgument:
        return None


def with_mistake(
    error: InvalidArgument, search: MistakeSearch | None, found: Sequence[FoundMistake] = ()
) -> InvalidArgument:
    """The refusal of a run, with the mistake that explains it, if one does. `found`: what is known of that already."""
    if search is not None and not found:
        found = search.after(None, refused=True)
    if not found:
        return error
    return InvalidArgument("; ".join([str(error), mistake_reason(mistake_text(found)), *change_rows(found)]))


def unchecked_row(known: Known) -> str:
    """What no reading shows, with the values that were used, so that a person can check them."""
    heads = list(known.heads.values())
    standoffs = ", ".join(dict.fromkeys(f"{head.standoff:g}" for head in heads))
    wavelengths = ", ".join(dict.fromkeys(f"{head.wavelength:g}" for head in heads))
    scales = ""
    if known.expansion is not None:
        numbers = dict.fromkeys(f"{1e6 * c:g}" for c in known.expansion.expansion.coefficient)
        scales = f", expansion of the scales {', '.join(numbers)} µm/(m·K)"
    return (
        f"check by hand, as no reading shows it: place of b in the chain {known.chain.name}, tool offset "
        f"{point_text(known.tool)}, standoff {standoffs} mm, wavelength {wavelengths} nm{scales}, and the index of air "
        "and the temperature that all distances were reduced with"
    )
