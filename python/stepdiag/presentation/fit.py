"""The verdict of a fit, in blocks."""

from collections.abc import Iterable, Iterator

from stepdiag.findings.meaning import FitWords
from stepdiag.findings.mistakes import FoundMistake, change_rows
from stepdiag.presentation.blocks import Block, RowBlock, VerdictBlock


def fit_blocks(words: FitWords, mistakes: Iterable[FoundMistake] = ()) -> Iterator[Block]:
    """The verdict with its reasons, what goes with it, and what to change if a mistake explains it."""
    yield VerdictBlock("fit", words.fit, words.said, because=words.because)
    yield from (RowBlock(label, text) for label, text in words.notes)
    yield from (RowBlock(*row) for row in change_rows(list(mistakes)))
