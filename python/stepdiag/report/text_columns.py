"""Tables of text: columns as wide as their cells."""

from collections.abc import Collection, Iterator, Sequence


def text_columns(rows: Sequence[Sequence[str]], left: Collection[int] = (0,)) -> Iterator[str]:
    """The rows, with the columns `left` to the left and all others, of numbers, to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        sized = enumerate(zip(row, widths, strict=True))
        cells = [cell.ljust(width) if k in left else cell.rjust(width) for k, (cell, width) in sized]
        yield f"  {'  '.join(cells)}".rstrip()
