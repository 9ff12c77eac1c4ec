"""Which COMP_FILEs belong to one export: fingerprints in the INI lines beside them.

A COMP_FILE ends at its first line that is no triplet, and so holds no comment that could say it.
"""

import hashlib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from stepdiag._core import InvalidArgument
from stepdiag.io.whole_files import read_bytes, read_text


def fingerprint_rows(tables: Mapping[str, str]) -> Iterator[str]:
    """Comments with the SHA-256 of each table, by the name of its file."""
    for name, text in tables.items():
        yield f"# sha256 of {name}: {hashlib.sha256(text.encode()).hexdigest()}"


def check_set(companion: Path) -> tuple[int, bool]:
    """Compare the tables beside a companion with the fingerprints in it.

    Returns their number, and whether they were made from an unverified calibration.

    Raises InvalidArgument for one that is missing or is not of the same export."""
    text = read_text(companion)
    fingerprints = re.findall(r"(?m)^# sha256 of (joint\d\.comp): ([0-9a-f]{64})$", text)
    for name, expected in fingerprints:
        table = companion.parent / name
        if hashlib.sha256(read_bytes(table)).hexdigest() != expected:
            raise InvalidArgument(f"{table}: is not the table that {companion.name} was written with: export again")
    return len(fingerprints), bool(re.search("(?m)^# unverified: ", text))
