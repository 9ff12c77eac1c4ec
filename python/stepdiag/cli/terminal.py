"""Text for people: on a terminal verdicts and warnings have a colour, and sentences fit the width."""

import os
import re
import sys
from typing import Any, Final

import click

from stepdiag.display import visible

WIDEST: Final = 100  # columns
LONGEST: Final = 2000  # characters; no line of ours is longer, but a file may have a line of 50 MB
_SAID_AT_THE_END: Final = 500  # of these: what was expected, as a rule
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
    re.compile(r"^(machine: )(within|not within|undecided)\b"),
    re.compile(r"( )(improved|worse)$"),
    re.compile(r"^((?:stepdiag: |[^ ]+: )?)(warning:|error:)"),
)


def say(line: str, *, err: bool = False) -> None:
    """Write a line, or several with line feeds between them: plain and not too long. Only a terminal has it wrapped."""
    stream = sys.stderr if err else sys.stdout
    lines = [plain(one) for one in line.split("\n")]
    if stream.isatty():
        lines = [part for one in lines for part in _wrapped(one)]
    colour = wants_colour(stream)
    click.echo("\n".join(map(_painted, lines) if colour else lines), err=err, color=colour)


def plain(text: str) -> str:
    """The text with its control characters escaped, such as \\x1b, and at most LONGEST characters of it."""
    if len(text) > LONGEST:
        text = f"{text[: LONGEST - _SAID_AT_THE_END - 3]} … {text[-_SAID_AT_THE_END:]}"
    return visible(text)


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
