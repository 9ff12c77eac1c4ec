"""Who may import whom: the rooms of the package stepdiag, read from the source of every module."""

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import pytest

PYTHON = Path(__file__).parents[2] / "python"

# The rooms directly below each room; a room may import these, whatever is below them, and the extension.
BELOW: dict[str, set[str]] = {
    "units": set(),
    "parameters": {"units"},
    "setup_quantities": {"units"},
    "style": set(),
    "display": set(),
    "progress": set(),
    "platform": set(),
    "interruption": {"platform"},
    "memory": {"platform"},
    "config": {"setup_quantities"},
    "wrong_arguments": set(),
    "option_field": set(),
    "findings": {"parameters", "setup_quantities"},
    "calibration": {"findings", "style", "display", "wrong_arguments"},
    "io": {"config", "calibration", "display", "interruption", "memory"},
    "positions": {"io"},
    "head": {"io"},
    "scenario": {"head"},
    "importing": {"scenario", "positions"},
    "uncertainty": {"scenario"},
    "planning": {"uncertainty", "rechecking"},
    "program": {"planning", "exporting"},
    "exporting": {"io", "option_field"},
    "mistakes": {"scenario"},
    "evaluation": {"mistakes"},
    "rechecking": {"scenario"},
    "instruments": {"scenario"},
    "acquisition": {"instruments", "mistakes", "planning", "option_field"},
    "alignment": {"acquisition"},
    "twin": {"acquisition"},
    "linuxcnc": {"platform"},
    "figures": {"planning"},
    "selftest": {"uncertainty", "importing", "exporting"},
    "presentation": {"figures", "acquisition", "positions", "evaluation", "exporting", "selftest"},
    "book": {"presentation"},
    "app": {"book", "platform"},
    "demo": {"presentation", "program", "linuxcnc", "twin"},
    "cli": {"demo", "progress", "importing", "app", "alignment"},
    # What the package shows to specialists.
    "optics": {"head"},
    "methods": {"planning"},
    "montecarlo": {"uncertainty", "progress"},
    "live": {"twin", "linuxcnc"},
    "results": {"evaluation"},
    "__main__": {"cli"},
}
MOST_OF_A_FOLDER = 20  # modules beside __init__, of more than which nobody keeps count


class Import(NamedTuple):
    line: int
    module: str  # stepdiag.io.netcdf; other packages by their whole name


def modules() -> dict[str, Path]:
    """Every module by its name; packages by that of their folder."""
    found = {}
    for file in sorted((PYTHON / "stepdiag").rglob("*.py")):
        parts = file.relative_to(PYTHON).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


MODULES = modules()


def imports_of(module: str) -> Iterator[Import]:
    """All imports of a module: also those inside functions, and those for type checkers alone."""
    for node in ast.walk(ast.parse(MODULES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (Import(node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{module}:{node.lineno}: imports here name the whole module"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                is_module = whole in MODULES or whole == "stepdiag._core"
                yield Import(node.lineno, whole if is_module else str(node.module))


def room_of(module: str) -> str:
    """`io` of stepdiag.io.netcdf; empty for the package itself."""
    return [*module.split("."), ""][1]


def may_import(room: str) -> set[str]:
    return {room}.union(*(may_import(lower) for lower in BELOW[room]))


def circles(graph: Mapping[str, set[str]]) -> list[tuple[str, ...]]:
    """Every module from which a way leads back to it, with those on the way, as sorted groups."""

    def reached(start: str) -> set[str]:
        found: set[str] = set()
        left = [start]
        while left:
            for module in graph[left.pop()] - found:
                found.add(module)
                left.append(module)
        return found

    reach = {module: reached(module) for module in graph}
    groups = {tuple(sorted(m for m in reach[start] if start in reach[m])) for start in graph if start in reach[start]}
    return sorted(groups)


def test_every_room_is_in_the_table() -> None:
    assert {room_of(module) for module in MODULES} - {""} == set(BELOW)


@pytest.mark.parametrize("room", BELOW)
def test_room_imports_only_rooms_below(room: str) -> None:
    allowed = may_import(room) | {"_core"}
    offences = [
        f"{MODULES[module].relative_to(PYTHON)}:{line}: imports {imported}"
        for module in MODULES
        if room_of(module) == room
        for line, imported in imports_of(module)
        # "" is the package itself, which offers what all rooms have: nothing inside it may ask it.
        if imported.split(".")[0] == "stepdiag" and room_of(imported) not in allowed
    ]
    assert not offences, "\n".join(offences)


def test_no_module_imports_itself_by_a_circle() -> None:
    graph = {module: {i.module for i in imports_of(module) if i.module in MODULES} for module in MODULES}
    assert circles(graph) == []


def test_circles_are_found() -> None:
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}) == [("b", "c")]


def test_flags_and_output_are_those_of_the_command_line_alone() -> None:
    offences = [
        f"{MODULES[module].relative_to(PYTHON)}:{line}: imports click"
        for module in MODULES
        if room_of(module) != "cli"
        for line, imported in imports_of(module)
        if imported.split(".")[0] == "click"
    ]
    assert not offences, "\n".join(offences)


FOLDERS = sorted({file.parent for file in MODULES.values()} - {PYTHON / "stepdiag"})


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_folder_is_of_a_size_that_one_keeps_in_mind(folder: Path) -> None:
    own = [file.stem for file in MODULES.values() if file.parent == folder and file.stem != "__init__"]
    assert len(own) <= MOST_OF_A_FOLDER, own
    assert not [name for name in own if name.startswith(f"{folder.name}_")], "repeats the room's name"


def test_messages_of_the_package_name_no_flags() -> None:
    """Rooms below say `rows`, which the command line turns into --rows (cli/options.py)."""
    offences = [
        f"{MODULES[module].relative_to(PYTHON)}:{node.lineno}: {text}"
        for module in MODULES
        if room_of(module) != "cli"
        for raised in ast.walk(ast.parse(MODULES[module].read_text(encoding="utf-8")))
        if isinstance(raised, ast.Raise)
        for node in ast.walk(raised)
        if isinstance(node, ast.Constant) and isinstance(text := node.value, str) and re.search("--([a-z]|$)", text)
    ]
    assert not offences, "\n".join(offences)


def test_classes_of_one_name_are_one_class() -> None:
    """Nor has the package a class that is called as one of the extension's."""
    stub = (PYTHON / "stepdiag" / "_core.pyi").read_text(encoding="utf-8")
    named = [("_core", name) for name in re.findall(r"^class (\w+)", stub, re.MULTILINE)]
    for module, file in MODULES.items():
        tree = ast.parse(file.read_text(encoding="utf-8"))
        named += [
            (module, node.name) for node in ast.walk(tree) if isinstance(node, ast.ClassDef) and node.name[0] != "_"
        ]
    names = [name for _, name in named]
    assert not [(module, name) for module, name in named if names.count(name) > 1]
