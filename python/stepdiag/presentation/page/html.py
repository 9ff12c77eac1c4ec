"""HTML from Python: elements whose text and attributes are escaped."""

import html
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Final

from stepdiag.display import visible
from stepdiag.presentation.blocks import Block, HeadingBlock, NoteBlock, RowBlock, TableBlock, VerdictBlock
from stepdiag.presentation.page.language import is_foreign, said

_MOST_REASONS: Final = 6
_SAID: Final = ("aria-label", "alt", "title", "placeholder")  # attributes that are words
_TEXTS: Final = ("p", "li", "dd", "dt", "td", "th", "strong", "figcaption", "caption", "h2", "h3", "summary")


def _escaped(text: str) -> str:
    return html.escape(visible(text, lines=True))


class Markup(str):
    """Text that is HTML already; any other text is escaped where it is put into an element."""

    __slots__ = ()


def as_given(text: str) -> Markup:
    """A text that is no word of ours, such as a name: escaped, and the same in every language."""
    return Markup(_escaped(text))


def markup(*content: object) -> Markup:
    """The contents one after the other: what is not Markup is escaped, None is left out."""
    return _joined(content)


def _joined(content: Iterable[object], *, foreign: bool = False) -> Markup:
    """foreign: sentences that stay English on a page of another language are marked."""
    parts: list[str] = []
    for part in content:
        if isinstance(part, Markup):
            parts.append(part)
        elif part is not None:
            text = _escaped(said(str(part)))
            parts.append(f'<span lang="en">{text}</span>' if foreign and is_foreign(str(part)) else text)
    return Markup("".join(parts))


def element(name: str, /, *content: object, **attributes: object) -> Markup:
    """An element. `class_` and `aria_label` stand for class and aria-label; True is an attribute without a value, None
    and False are none."""
    given = []
    for key, value in attributes.items():
        if value is None or value is False:
            continue
        key = key.removesuffix("_").replace("_", "-")
        words = said(str(value)) if key in _SAID else str(value)
        given.append(f" {key}" if value is True else f' {key}="{_escaped(words)}"')
    opening = f"<{name}{''.join(given)}>"
    if name in ("meta", "img", "input", "link", "br", "hr"):
        return Markup(opening)
    if name in ("code", "pre"):
        return Markup(f"{opening}{''.join(p if isinstance(p, Markup) else _escaped(str(p)) for p in content)}</{name}>")
    return Markup(f"{opening}{_joined(content, foreign=name in _TEXTS)}</{name}>")


def table(
    caption: object,
    heading: Sequence[object],
    rows: Iterable[Sequence[object]],
    class_: str | None = None,
    *,
    under: str = "",
) -> Markup:
    """A data table; the first cell of each row is its heading. Without a caption, its name for those who do not see it
    is the heading that it stands under."""
    head = element("thead", element("tr", *(element("th", cell, scope="col") for cell in heading))) if heading else None
    body = [
        element("tr", element("th", first, scope="row"), *(element("td", cell) for cell in others))
        for first, *others in rows
    ]
    named = element("caption", caption) if caption else element("caption", under, class_="unseen")
    return element(
        "div",
        element("table", named, head, element("tbody", *body), class_=class_),
        class_="scroll",
        tabindex="0",
        role="region",
        aria_label=caption or under,
    )


def listed(items: Iterable[object], class_: str | None = None) -> Markup:
    """An unordered list."""
    return element("ul", *(element("li", item) for item in items), class_=class_)


def definitions(pairs: Iterable[tuple[object, object]], class_: str | None = None) -> Markup:
    """Names with what they say."""
    return element(
        "dl", *(element("div", element("dt", name), element("dd", value)) for name, value in pairs), class_=class_
    )


def sentence(text: str) -> str:
    """A sentence of a block as a page has it. A symbol at its beginning keeps its case: u is not U."""
    return f"{text if text.split()[0] == 'u' else text[0].upper() + text[1:]}." if text else ""


def html_of(blocks: Iterable[Block]) -> Markup:
    """Blocks as a page has them. Pictures are left out: a page draws its own."""
    parts: list[Markup] = []
    above = ""  # the heading above
    for kind, group in groupby(blocks, type):
        if kind is RowBlock:
            said = [row for row in group if isinstance(row, RowBlock)]
            named = [(sentence(row.label)[:-1], sentence(row.text)) for row in said if row.label != "note"]
            if named:
                parts.append(definitions(named, "lines"))
            parts += [element("p", sentence(row.text), class_="note") for row in said if row.label == "note"]
            continue
        for block in group:
            match block:
                case HeadingBlock(text):
                    above = sentence(text)[:-1]
                    parts.append(element("h3", above))
                case VerdictBlock(verdict=verdict, headline=headline, why=why, because=because):
                    parts.append(element("p", element("strong", sentence(headline)), f" {sentence(why)}"))
                    parts += _reasons(verdict, because)
                case TableBlock(rows, columns, title):
                    parts.append(table(title, columns, rows, under=above))
                case NoteBlock(text):
                    parts.append(element("p", sentence(text), class_="note"))
    return markup(*parts)


def _reasons(verdict: str, because: Sequence[str]) -> list[Markup]:
    """A list, of which the first are shown at once."""
    if not because:
        return []
    first, others = because[:_MOST_REASONS], because[_MOST_REASONS:]
    parts = [element("p", element("strong", f"{verdict} because:".capitalize())), listed(first)]
    if others:
        parts.append(element("details", element("summary", f"{len(others)} more reasons"), listed(others)))
    return parts


def section(identifier: str, title: object, *content: object, class_: str | None = None) -> Markup:
    """A part of the page with its heading."""
    heading = element("h2", title, id=f"{identifier}-heading")
    return element("section", heading, *content, id=identifier, aria_labelledby=f"{identifier}-heading", class_=class_)
