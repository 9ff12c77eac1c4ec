"""`import stepdiag` offers what documentation uses, and loads it when it is asked for."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
from places import DOCS, EXAMPLES, ROOT

import stepdiag as sd

DOCUMENTS = [ROOT / "README.md", *sorted(DOCS.glob("*.md")), *sorted(EXAMPLES.glob("*.py"))]
TREE = ast.parse(Path(sd.__file__).read_text(encoding="utf-8"))
ROOMS = ["live", "methods", "montecarlo", "optics", "positions", "results"]  # of specialists
MOST_NAMES = 60


def imported(nodes: list[ast.stmt]) -> dict[str, str]:
    """Name -> module, of `from stepdiag.MODULE import NAME`."""
    found = {}
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("stepdiag."):
            found |= {alias.name: node.module.removeprefix("stepdiag.") for alias in node.names if not alias.asname}
    return found


@pytest.mark.parametrize("name", sd.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(sd, name) is not None
    assert name in dir(sd)


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_of_specialists_show_their_names_alone(room: str) -> None:
    module = getattr(sd, room)
    assert dir(module) == sorted(module.__all__)
    for name in module.__all__:
        assert getattr(module, name) is not None
        assert name not in sd.__all__ or getattr(module, name) is not getattr(sd, name), f"{name}: in two places"


def test_few_names_are_public_and_nothing_else_is_shown() -> None:
    assert dir(sd) == sd.__all__ == sorted(sd.__all__)
    assert len(sd.__all__) <= MOST_NAMES


def test_type_checkers_see_what_is_loaded_later() -> None:
    (for_checkers,) = [node for node in TREE.body if isinstance(node, ast.If)]
    later = imported(for_checkers.body)
    assert later == sd._MODULE_OF
    assert set(sd.__all__) == {*later, *imported(TREE.body), *ROOMS}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_documents_use_public_names_alone(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    assert not re.findall(r"(?:from|import) stepdiag\.\S+", text)
    for name, inside in re.findall(r"\bsd\.(\w+)(?:\.(\w+))?", text):
        assert name in sd.__all__
        assert name not in ROOMS or not inside or inside in getattr(sd, name).__all__
    assert {*re.findall(r"from stepdiag import (\w+)", text)} <= {*sd.__all__}


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'stepdiag' has no attribute 'nothing'"):
        _ = sd.nothing  # type: ignore[attr-defined]


def test_import_loads_nothing_that_takes_time() -> None:
    heavy = ["numpy", "pydantic", "xarray", "matplotlib", "netCDF4", "click"]
    code = f"import sys, stepdiag; print([name for name in {heavy} if name in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert said.strip() == "[]"
