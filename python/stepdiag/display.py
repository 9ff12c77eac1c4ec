"""How values show themselves: one line in a console (`repr`), a small table in a notebook (`_repr_html_`)."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

# What is said of a value: label and text each, the most important first.
Facts = Sequence[tuple[str, str]]

LONGEST_LINE: Final = 200
_SHOWN_ENTRIES: Final = 3


def one_line(name: str, facts: Facts) -> str:
    """The name and as many facts as fit into a line of 200 characters."""
    line = f"<{name}"
    for k, (label, text) in enumerate(facts):
        more = f"{'; ' if k else ': '}{label} {text}"
        if len(line) + len(more) + len("; ...>") > LONGEST_LINE:
            return f"{line}{'; ' if k else ': '}...>"
        line += more
    return f"{line}>"


def html_table(name: str, facts: Facts) -> str:
    """The facts as a table of two columns with a caption; all texts are escaped."""
    from html import escape

    left = 'style="text-align: left"'
    rows = "".join(
        f'<tr><th scope="row" {left}>{escape(label)}</th><td {left}>{escape(text)}</td></tr>' for label, text in facts
    )
    return f"<table><caption {left}><b>{escape(name)}</b></caption><tbody>{rows}</tbody></table>"


class Displayed:
    """A value that shows its facts; `_facts` returns them."""

    def _facts(self) -> Facts:
        raise NotImplementedError

    def __repr__(self) -> str:
        return one_line(type(self).__name__, self._facts())

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self._facts())


def facts_of_properties(value: object) -> Facts:
    """All properties of a value of a compiled class, in native units; large ones by their size."""
    names = [name for name, member in vars(type(value)).items() if isinstance(member, property)]
    return [(name, text_of(getattr(value, name))) for name in names]


def text_of(value: Any) -> str:
    """One value in a few words."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if value is None:
        return "none"
    if isinstance(value, bool | int | str):
        return str(value)
    shape = getattr(value, "shape", None)
    if isinstance(shape, tuple):
        if value.size <= _SHOWN_ENTRIES:
            return f"({', '.join(text_of(one) for one in value.ravel().tolist())})"
        return f"array of {' x '.join(map(str, shape))}"
    if isinstance(value, Mapping | list | tuple):
        plain = not isinstance(value, Mapping) and all(isinstance(one, float | int | str) for one in value)
        if plain and 0 < len(value) <= _SHOWN_ENTRIES:
            return ", ".join(map(text_of, value))
        return f"{len(value)} entries"
    return f"a {type(value).__name__}"


def point_text(point: Any) -> str:
    """A position or an offset: (0, 0, 30) mm."""
    return f"({', '.join(f'{x:g}' for x in point)}) mm"


def lengths_text(lengths: Any) -> str:
    """Edges: 800 x 600 x 500 mm."""
    return f"{' x '.join(f'{length:g}' for length in lengths)} mm"


def scale_lines_text(plan: Any) -> str:
    """The scale lines of a plan and where they are read: "p00, 0p0 at every step"; "none"."""
    return ", ".join(plan.scale_lines) + _read_at(plan) if plan.scale_lines else "none"


def lines_text(plan: Any) -> str:
    """How many lines a plan has: "4 lines of 50 steps, 3 scale lines at every step"."""
    in_blocks = f" in blocks of {plan.block}" if plan.block > 1 else ""
    return (
        f"{len(plan.lines)} lines of {plan.steps} steps{in_blocks}, {len(plan.scale_lines)} scale lines{_read_at(plan)}"
    )


def _read_at(plan: Any) -> str:
    return " at every step" if plan.scale_points == "steps" else ""


# Control characters, which a terminal obeys, and those that turn the direction of writing. They come from files.
_DIRECTIONS: Final = "\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
_UNSEEN: Final = re.compile(f"[\x00-\x1f{_DIRECTIONS}]")
_UNSEEN_IN_TEXTS: Final = re.compile(f"[\x00-\x08\x0b\x0c\x0e-\x1f{_DIRECTIONS}]")


def visible(text: str, *, lines: bool = False) -> str:
    """A text that leaves the program, for a terminal, a page or a file: what nobody would see stands escaped, such as
    \\x1b. lines: line feeds and tabulators stay."""
    unseen = _UNSEEN_IN_TEXTS if lines else _UNSEEN
    return unseen.sub(lambda found: found[0].encode("unicode_escape").decode(), text)
