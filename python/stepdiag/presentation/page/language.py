"""The language of a page. Pages are written in English; a catalogue has the same in another language.

A catalogue is a TOML file beside this one, such as de.toml: a text of a page and its translation. `{}` stands for any
words, which are translated in turn. A full stop or comma at the end and a capital at the beginning need no entry of
their own. What no entry has stays English, and is marked so for those who listen.
"""

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib.resources import files
from typing import Any, Final

LANGUAGES: Final = ("en", "de")
_THOUSANDS: Final = re.compile(r"(?<=\d),(?=\d{3}(?!\d))")
_DECIMAL: Final = re.compile(r"(?<![\d.])(\d+)\.(\d+)(?!\.?\d)")
_ENDS: Final = ".,;:"
_INSIDE: Final = re.compile(rf"(\s*)(.*?)([{_ENDS}]?\s*)", re.DOTALL)
_BETWEEN: Final = (r"(?<=[.?!]) (?=[A-Z0-9])", r"(?<=;) ", r"(?<=:) ", r"(?<=,) ")
# Entries with fewer letters between their {} fit many sentences by chance: they are for short texts.
_LITERAL: Final = 8
_SHORT: Final = 60
_ENGLISH: Final = re.compile(r"\b(?:the|of|is|are|and|not|to|with|no|on|in|by|it|this|that)\b", re.IGNORECASE)


class Catalogue:
    """Texts and what they are in a language."""

    def __init__(self, language: str, entries: Mapping[str, str]) -> None:
        self.language = language
        entries = {text.rstrip(_ENDS): said.rstrip(_ENDS) for text, said in entries.items()}
        self._exact = {text: said for text, said in entries.items() if "{}" not in text}
        self._patterns = [
            (len(text.replace("{}", "")), re.compile("(.+?)".join(map(re.escape, text.split("{}"))), re.DOTALL), said)
            for text, said in entries.items()
            if "{}" in text
        ]
        self._patterns.sort(key=lambda pattern: -pattern[0])

    def said(self, text: str) -> str | None:
        """A text in the language; None where a part of it has no entry. Blanks and commas around it stay."""
        match = _INSIDE.fullmatch(text)
        if match is None:
            return None
        before, inside, after = match.groups()
        found = (
            next(filter(None, map(self._exact.get, _forms(inside))), None)
            or self._in_parts(inside, _BETWEEN[:2])
            or self._by_pattern(inside)
            or self._in_parts(inside, _BETWEEN[2:])
            or (self._by_pattern(inside, short=True) if len(inside) <= _SHORT else None)
        )
        if found is None:
            return None
        begins = inside[:1].isupper() and inside not in self._exact
        return f"{before}{found[:1].upper() + found[1:] if begins else found}{after}"

    def _by_pattern(self, text: str, *, short: bool = False) -> str | None:
        for length, pattern, translation in self._patterns:
            match = next(filter(None, map(pattern.fullmatch, _forms(text))), None)
            if match is not None and (length < _LITERAL) == short:
                return translation.format(*(self.said(part) or part for part in match.groups()))
        return None

    def _in_parts(self, text: str, separators: Sequence[str]) -> str | None:
        """Each part in the language; one without English words, such as a name or a number, stays."""
        for separator in separators:
            parts = re.split(separator, text)
            found = [self.said(part) for part in parts] if len(parts) > 1 else []
            if any(found) and all(one or not _ENGLISH.search(part) for one, part in zip(found, parts, strict=True)):
                return " ".join(one or part for one, part in zip(found, parts, strict=True))
        return None


def _forms(text: str) -> Iterator[str]:
    """The text, and the same with a small letter at its beginning."""
    yield text
    yield text[:1].lower() + text[1:]


_NOW: ContextVar[Catalogue | None] = ContextVar("catalogue", default=None)


@cache
def catalogue(language: str) -> Catalogue | None:
    """None for English."""
    if language == LANGUAGES[0]:
        return None
    text = (files("stepdiag.presentation.page") / f"{language}.toml").read_text(encoding="utf-8")
    return Catalogue(language, tomllib.loads(text))


@contextmanager
def in_language(language: str) -> Iterator[None]:
    """Pages that are made inside are in this language."""
    token = _NOW.set(catalogue(language))
    try:
        yield
    finally:
        _NOW.reset(token)


def language() -> str:
    """That of the page that is being made."""
    now = _NOW.get()
    return LANGUAGES[0] if now is None else now.language


def said(text: str) -> str:
    """A text of the page in its language, with its decimal sign."""
    now = _NOW.get()
    return text if now is None else _DECIMAL.sub(r"\1,\2", _THOUSANDS.sub("\u202f", now.said(text) or text))


def is_foreign(text: str) -> bool:
    """Whether a text stays an English sentence on a page of another language."""
    now = _NOW.get()
    return now is not None and _ENGLISH.search(text) is not None and now.said(text) is None


def figure_in_language(content: Any) -> Any:
    """A figure, or a part of it, whose titles and names are in the language of the page."""
    if isinstance(content, Mapping):
        return {
            key: said(value) if key in ("text", "name") and isinstance(value, str) else figure_in_language(value)
            for key, value in content.items()
        }
    return [figure_in_language(part) for part in content] if isinstance(content, list) else content
