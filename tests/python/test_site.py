"""The site has every public name and header; CITATION.cff is that of this version. `./run docs` builds the site."""

import re
from operator import attrgetter

import pytest
import yaml
from places import DOCS, ROOT
from public_names import public_names

import stepdiag as sd

REFERENCE = DOCS / "reference"
NAMES = [*public_names()]


def test_every_public_name_stands_once_in_the_reference() -> None:
    pages = "\n".join(page.read_text(encoding="utf-8") for page in (REFERENCE / "python").glob("*.md"))
    documented = re.findall(r"^\.\. auto(?:class|function|exception):: (?:stepdiag\.)?([\w.]+)$", pages, re.M)
    assert sorted(documented) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_has_a_docstring(name: str) -> None:
    assert (attrgetter(name)(sd).__doc__ or "").strip()


def test_every_room_of_public_headers_has_a_page() -> None:
    rooms = {folder.name for folder in (ROOT / "cpp" / "include" / "stepdiag").iterdir() if folder.is_dir()}
    pages = {page.stem: page.read_text(encoding="utf-8") for page in (REFERENCE / "cpp").glob("*.md")}
    assert pages.keys() == rooms
    assert all(f"```{{headers}} {room}\n" in text for room, text in pages.items())


def test_the_citation_is_that_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == sd.__version__
    assert citation["license"] == "BSD-3-Clause"
    assert [reference["doi"] for reference in citation["references"]] == [
        "10.5604/01.3001.0012.0928",
        "10.1063/1.1290504",
    ]
