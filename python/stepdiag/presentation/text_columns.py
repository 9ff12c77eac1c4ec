"""Tables of text: columns as wide as their cells."""

from collections.abc import Collection, Iterator, Sequence
from typing import Final

WIDEST: Final = 100


def text_columns(rows: Sequence[Sequence[str]], left: Collection[int] = (0,)) -> Iterator[str]:
    """The rows, with the columns `left` to the left and all others, of numbers, to the right.

    What is wider than 100 columns is continued in a table below, whose rows begin with the same first column."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    parts: list[list[int]] = [[0]]
    for k in range(1, len(widths)):
        if 2 + sum(widths[one] + 2 for one in (*parts[-1], k)) - 2 > WIDEST and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(k)
    for part in parts:
        for row in rows:
            cells = [row[k].ljust(widths[k]) if k in left else row[k].rjust(widths[k]) for k in part]
            yield f"  {'  '.join(cells)}".rstrip()
