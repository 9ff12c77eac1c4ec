"""Tables of text."""

from stepdiag.presentation.text_columns import WIDEST, text_columns


def test_columns_are_as_wide_as_their_cells() -> None:
    assert [*text_columns([["", "a"], ["ppp", "1.5"], ["np", "12.5"]])] == ["          a", "  ppp   1.5", "  np   12.5"]


def test_table_that_fits_is_one_table() -> None:
    row = ["name", *["x" * 22] * 4]  # 2 + 4 + 4 * 24 = 102, and with one character less twice, 100
    assert len([*text_columns([row])]) == 2
    row[1:3] = ["x" * 21] * 2
    (line,) = text_columns([row])
    assert len(line) == WIDEST


def test_wide_table_is_continued_below_with_its_first_column() -> None:
    rows = [["", *(f"column {k}" for k in range(30))], ["ppp", *map(str, range(30))], ["npp", *map(str, range(30))]]
    lines = [*text_columns(rows)]
    assert max(map(len, lines)) <= WIDEST
    assert len(lines) % 3 == 0
    assert [cell for line in lines if line.split()[0] == "npp" for cell in line.split()[1:]] == rows[2][1:]


def test_single_column_that_is_too_wide_stands_by_itself() -> None:
    assert len([*text_columns([["ppp", "x" * 200, "1"]])]) == 2
