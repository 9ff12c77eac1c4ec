"""Mistakes that would explain a run, in words; and what no reading shows."""

from collections.abc import Iterator, Sequence

from stepdiag._core import InvalidArgument, Measurement
from stepdiag.display import point_text
from stepdiag.mistakes.search import FoundMistake, find_mistakes
from stepdiag.scenario.known import Known


def mistake_rows(found: Sequence[FoundMistake]) -> Iterator[str]:
    """What may have happened, and what to change; several are alternatives."""
    if not found:
        return
    yield f"mistake: {mistake_text(found)}"
    for one in found:
        yield f"to change{'' if len(found) == 1 else ' if so'}: {one.edit}"


def mistake_text(found: Sequence[FoundMistake]) -> str:
    """One sentence of all alternatives, without a full stop."""
    texts = [one.text for one in found]
    best = found[0]
    said = texts[0] if len(texts) == 1 else f"either {'; or '.join(texts)}"
    before = "" if best.variance_factor_before is None else f" in place of {best.variance_factor_before:.3g}"
    return f"{said}; with that undone the fit is {best.fit} (variance factor {best.variance_factor:.3g}{before})"


def with_mistake(error: InvalidArgument, known: Known, measurement: Measurement) -> InvalidArgument:
    """The refusal of a run, with the mistake that explains it, if one does."""
    try:
        found = find_mistakes(known, measurement, refused=True)
    except InvalidArgument:  # the run does not belong to the plan at all
        return error
    return InvalidArgument(f"{error}\n{chr(10).join(mistake_rows(found))}") if found else error


def unchecked_row(known: Known) -> str:
    """What no reading shows, with the values that were used, so that a person can check them."""
    heads = list(known.heads.values())
    standoffs = ", ".join(dict.fromkeys(f"{head.standoff:g}" for head in heads))
    wavelengths = ", ".join(dict.fromkeys(f"{head.wavelength:g}" for head in heads))
    return (
        f"check by hand, as no reading shows it: chain {known.chain.name}, tool offset {point_text(known.tool)}, "
        f"standoff {standoffs} mm, wavelength {wavelengths} nm, and the index of air and the temperature that all "
        "distances were reduced with"
    )
