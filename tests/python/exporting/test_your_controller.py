"""docs/your-controller.md names every format, for whom it is, and how it was tested, as the command does."""

import re
from pathlib import Path

from stepdiag.exporting.formats import FORMATS

PAGE = Path(__file__).parents[3] / "docs" / "your-controller.md"


def test_the_table_is_that_of_the_command() -> None:
    rows = re.findall(r"(?m)^\| (.+?) \| `([\w-]+)` \| (.+?) \| (.+?) \| (.+?) \|$", PAGE.read_text(encoding="utf-8"))
    found = {name: (controllers, tested) for controllers, name, _, _, tested in rows}
    assert found == {name: (one.controllers, one.tested) for name, one in FORMATS.items()}
