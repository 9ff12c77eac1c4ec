"""A scenario with the files that it names inside: a plain value, from which any machine makes the same model."""

import json
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from stepdiag._core import InvalidArgument
from stepdiag.config.toml_text import located
from stepdiag.head.description import find_head, shipped_heads
from stepdiag.io.whole_files import read_bytes
from stepdiag.scenario.description import Scenario, scenario_of


@dataclass(frozen=True)
class PackedScenario:
    """`content`: the tables of the file as JSON, in which `files` (name, bytes) have the names that they have here.
    `path` names the scenario in messages."""

    path: str
    content: str
    files: tuple[tuple[str, bytes], ...]


def pack_scenario(content: Mapping[str, Any], path: str | PathLike[str]) -> PackedScenario:
    """The tables of a scenario that has been checked (scenario_of). Raises InvalidArgument for a file that cannot be
    read."""
    tables = deepcopy(dict(content))
    folder = Path(path).parent
    packed: dict[Path, tuple[str, bytes]] = {}

    def take(section: dict[str, Any], key: str, place: str) -> None:
        name = section[key]
        if key == "description" and name in shipped_heads():
            return
        with located(f"{path}: {place}.{key}"):
            file = find_head(name, folder) if key == "description" else folder / name
            if file not in packed:
                packed[file] = f"file{len(packed)}{file.suffix}", read_bytes(file)
        # A head's name is a path by what is in it.
        section[key] = f"./{packed[file][0]}"

    if "errors" in tables["machine"]:
        take(tables["machine"], "errors", "machine")
    heads = {"head": tables["head"]}
    heads |= {f"head.{name}": own for name, own in tables["head"].items() if isinstance(own, dict)}
    for place, head in heads.items():
        if isinstance(head.get("description"), str):
            take(head, "description", place)
    return PackedScenario(str(path), json.dumps(tables), tuple(packed.values()))


@contextmanager
def unpacked(packed: PackedScenario) -> Iterator[Scenario]:
    """The scenario; its files are there inside the block. Messages name the scenario as it was named at home."""
    with tempfile.TemporaryDirectory(prefix="stepdiag-") as name:
        folder = Path(name)
        for file, content in packed.files:
            (folder / file).write_bytes(content)
        path = folder / Path(packed.path).name
        try:
            yield scenario_of(json.loads(packed.content), path)
        except InvalidArgument as error:
            raise InvalidArgument(str(error).replace(str(path), packed.path)) from None
