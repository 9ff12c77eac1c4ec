"""Mistakes that would explain a run, in words."""

from collections.abc import Iterator, Sequence

from stepdiag.mistakes.search import FoundMistake


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
