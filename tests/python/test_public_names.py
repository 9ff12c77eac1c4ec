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


def imported(nodes: list[ast.stmt]) -> dict[str, str]:
    """Name -> module, of `from stepdiag.MODULE import NAME`."""
    found = {}
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("stepdiag."):
            found |= {alias.name: node.module.removeprefix("stepdiag.") for alias in node.names}
    return found


@pytest.mark.parametrize("name", sd.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(sd, name) is not None
    assert name in dir(sd)


def test_type_checkers_see_what_is_loaded_later() -> None:
    (for_checkers,) = [node for node in TREE.body if isinstance(node, ast.If)]
    later = imported(for_checkers.body)
    assert later == sd._MODULE_OF
    assert set(sd.__all__) == {*later, *imported(TREE.body)} - {
        "displays",
        "methods",
        "reason_texts",
        "to_xarray",
        "undetermined_text",
        "unseen_texts",
        "word_findings_with",
        "word_reasons_with",
        "word_unseen_faults_with",
    }
    assert sd.__all__ == sorted(sd.__all__)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_documents_use_public_names_alone(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    assert not re.findall(r"(?:from|import) stepdiag\.\S+", text)
    assert {*re.findall(r"\bsd\.(\w+)", text), *re.findall(r"from stepdiag import (\w+)", text)} <= {*sd.__all__}


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'stepdiag' has no attribute 'nothing'"):
        _ = sd.nothing  # type: ignore[attr-defined]


def test_import_loads_nothing_that_takes_time() -> None:
    heavy = ["numpy", "pydantic", "xarray", "matplotlib", "netCDF4", "click"]
    code = f"import sys, stepdiag; print([name for name in {heavy} if name in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert said.strip() == "[]"
