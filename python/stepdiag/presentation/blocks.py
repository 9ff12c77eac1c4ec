"""What is said of a result, as one list of blocks: as text on a terminal, as HTML on a page (page/html.py), as data in
the JSON object."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final, Literal, NotRequired, TypeAlias

from typing_extensions import TypedDict

from stepdiag.presentation.text_columns import text_columns


@dataclass(frozen=True)
class HeadingBlock:
    """Of the blocks below it."""

    text: str


@dataclass(frozen=True)
class VerdictBlock:
    """What was decided of something, such as the machine or the fit.

    verdict: one of its closed words. headline: the same in words; why: a sentence. because: the reasons, if there are
    several. None of them has a full stop."""

    about: str
    verdict: str
    headline: str
    why: str = ""
    because: tuple[str, ...] = ()


@dataclass(frozen=True)
class RowBlock:
    """A name and what it says; without a full stop."""

    label: str
    text: str


@dataclass(frozen=True)
class TableBlock:
    """Cells by row, all of one length; no columns: a table without a heading. left: columns of words, to the left;
    all others have numbers."""

    rows: tuple[tuple[str, ...], ...]
    columns: tuple[str, ...] = ()
    title: str = ""
    left: tuple[int, ...] = (0,)


@dataclass(frozen=True)
class FigureBlock:
    """A picture that a page draws. text: what it shows, for those who do not see it."""

    name: str
    text: str


@dataclass(frozen=True)
class NoteBlock:
    """A sentence without a full stop. indented: it belongs to the block before it."""

    text: str
    indented: bool = False


Block: TypeAlias = HeadingBlock | VerdictBlock | RowBlock | TableBlock | FigureBlock | NoteBlock


class BlockObject(TypedDict):
    """A part of the report. All sentences are without a full stop."""

    kind: Literal["heading", "verdict", "row", "table", "figure", "note"]
    text: NotRequired[str]
    """Of a heading, row, figure, note."""
    label: NotRequired[str]
    """Of a row: its name."""
    about: NotRequired[str]
    """Of a verdict: the machine, the fit, ..."""
    verdict: NotRequired[str]
    """One of its closed words."""
    headline: NotRequired[str]
    why: NotRequired[str]
    because: NotRequired[list[str]]
    """Of a verdict: the reasons."""
    title: NotRequired[str]
    """Of a table."""
    columns: NotRequired[list[str]]
    """Of a table: headings, if it has them."""
    rows: NotRequired[list[list[str]]]
    name: NotRequired[str]
    """Of a figure."""
    indented: NotRequired[bool]
    """Of a note: it belongs to the block before it."""


_KINDS: Final = {
    HeadingBlock: "heading",
    VerdictBlock: "verdict",
    RowBlock: "row",
    TableBlock: "table",
    FigureBlock: "figure",
    NoteBlock: "note",
}


def text_of(blocks: Iterable[Block]) -> Iterator[str]:
    """The lines of a report on a terminal. Pictures are left out."""
    for block in blocks:
        match block:
            case HeadingBlock(text):
                yield ""
                yield text
            case VerdictBlock(about, verdict, headline, why, because):
                yield ": ".join(filter(None, (about, headline, why)))
                yield from (f"{verdict} because {reason}" for reason in because)
            case RowBlock(label, text):
                yield f"{label}: {text}"
            case TableBlock(rows, columns, title, left):
                if title:
                    yield f"{title}:"
                if rows:
                    yield from text_columns([columns, *rows] if columns else rows, left=left)
            case NoteBlock(text, indented):
                yield f"  {text}" if indented else text


def data_of(blocks: Iterable[Block]) -> list[Any]:
    """The same for the JSON object: each block's kind, and its fields but for how a terminal aligns them."""
    return [
        {"kind": _KINDS[type(block)], **{key: value for key, value in vars(block).items() if key != "left"}}
        for block in blocks
    ]
