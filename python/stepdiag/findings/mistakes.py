"""Mistakes that would explain a run, in words."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class FoundMistake:
    """A mistake that would explain a run.

    entry: its name in the catalogue; of two at once both.
    text, edit: what happened, and what to change; without a full stop.
    fit, variance_factor: verdict of the adjustment with the mistake undone.
    variance_factor_before: with it; None where the readings could not be adjusted.
    alternatives: of the first of a list: how many more there are that the readings do not distinguish from it, and
    that are not in the list.
    or_faults: the faults of readings that the adjustment found explain as much, and are as likely: they are few, on few
    lines, and the mistake has a number that was chosen for the fit, as they have."""

    entry: str
    text: str
    edit: str
    fit: str
    variance_factor: float
    variance_factor_before: float | None
    alternatives: int = 0
    or_faults: bool = False


def change_rows(found: Sequence[FoundMistake]) -> Iterator[tuple[str, str]]:
    """What to change, with a label; several are alternatives."""
    for one in found:
        yield f"to change{'' if len(found) == 1 else ' if so'}", one.edit


def mistake_text(found: Sequence[FoundMistake]) -> str:
    """One sentence of all alternatives, without a full stop."""
    texts = [one.text for one in found]
    best = found[0]
    if best.alternatives:
        texts.append(f"one of {best.alternatives} more")
    said = texts[0] if len(texts) == 1 else f"either {'; or '.join(texts)}"
    if best.or_faults:
        said += ", or the faults that were found happened instead (the readings do not distinguish them)"
    before = "" if best.variance_factor_before is None else f" in place of {best.variance_factor_before:.3g}"
    return f"{said}; with that undone the fit is {best.fit} (variance factor {best.variance_factor:.3g}{before})"
