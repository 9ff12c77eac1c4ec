"""Text for people: on a terminal verdicts and warnings have a colour, and sentences fit the width."""

import os
import re
import sys
from typing import Any, Final

import click

WIDEST: Final = 100  # columns
_GOOD: Final = {"fg": "green"}
_UNSURE: Final = {"fg": "yellow"}
_BAD: Final = {"fg": "red", "bold": True}
_STYLES: Final[dict[str, dict[str, Any]]] = {
    "accepted": _GOOD,
    "unchecked": _UNSURE,
    "doubtful": _UNSURE,
    "rejected": _BAD,
    "within": _GOOD,
    "not within": _BAD,
    "undecided": _UNSURE,
    "improved": _GOOD,
    "worse": _BAD,
    "warning:": _UNSURE,
    "error:": _BAD,
}
# What has a colour: group 2.
_COLOURED: Final = (
    re.compile(r"(\bfit(?::| is)? )(accepted|unchecked|doubtful|rejected)\b", re.IGNORECASE),
    re.compile(r"^()(doubtful|rejected)(?= because )"),
    re.compile(r"^(verdict: )(within|not within|undecided)\b"),
    re.compile(r"( )(improved|worse)$"),
    re.compile(r"^((?:stepdiag: |[^ ]+: )?)(warning:|error:)"),
)


def say(line: str, *, err: bool = False) -> None:
    """Write a line. Files and pipes get it as it is."""
    stream = sys.stderr if err else sys.stdout
    lines = _wrapped(line) if stream.isatty() else [line]
    colour = wants_colour(stream)
    click.echo("\n".join(map(_painted, lines) if colour else lines), err=err, color=colour)


def wants_colour(stream: Any) -> bool:
    """Whether to write colours: on a terminal that is not dumb, without NO_COLOR, and with FORCE_COLOR anywhere."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return os.environ.get("TERM") != "dumb" and bool(stream.isatty())


def _painted(line: str) -> str:
    for pattern in _COLOURED:
        line = pattern.sub(lambda m: f"{m[1]}{click.style(m[2], **_STYLES[m[2].lower()])}", line)
    return line


def _wrapped(line: str) -> list[str]:
    """Sentences in lines of the terminal's width, at most 100; rows of tables, which have gaps, as they are."""
    import shutil  # slow, as textwrap
    import textwrap

    width = min(shutil.get_terminal_size().columns, WIDEST)
    if len(line) <= width or re.search(r"\S {2,}\S", line):
        return [line]
    indent = " " * (len(line) - len(line.lstrip()))
    return textwrap.wrap(
        line.strip(),
        max(width, 20),
        initial_indent=indent,
        subsequent_indent=f"{indent}  ",
        break_long_words=False,
        break_on_hyphens=False,
    )
