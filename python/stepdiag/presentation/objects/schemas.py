"""The JSON Schema of an object, made from its types.

`python -m stepdiag.presentation.objects.schemas evaluation` prints one; docs/json has them all; a test compares."""

import json
import sys
from collections.abc import Iterator
from importlib import import_module
from types import UnionType
from typing import Any, Final, get_args

from pydantic import ConfigDict, TypeAdapter
from typing_extensions import is_typeddict

# Name of the schema -> module and type.
OBJECTS: Final = {
    "check": ("stepdiag.presentation.objects.check", "CheckObject"),
    "comparison": ("stepdiag.presentation.objects.comparison", "ComparisonObject"),
    "evaluation": ("stepdiag.presentation.objects.evaluation", "EvaluationObject"),
    "export": ("stepdiag.presentation.objects.export", "ExportObject"),
    "observation": ("stepdiag.presentation.objects.observation", "ObservationObject"),
    "positions": ("stepdiag.presentation.objects.positions", "PositionsObject"),
    "recheck": ("stepdiag.presentation.objects.recheck", "RecheckObject"),
    "report": ("stepdiag.presentation.objects.report", "ReportObject"),
    "selftest": ("stepdiag.presentation.objects.selftest", "SelftestObject"),
    "verification": ("stepdiag.presentation.objects.verification", "VerificationObject"),
    "volume": ("stepdiag.presentation.objects.volume", "VolumeObject"),
}


def schema_text(name: str) -> str:
    """The schema of an object as the text of its file."""
    module, kind = OBJECTS[name]
    described = getattr(import_module(module), kind)
    types = {one.__name__: one for one in _types(described, set())}
    for one in types.values():
        one.__pydantic_config__ = ConfigDict(use_attribute_docstrings=True)  # a string below a key describes it
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema"} | TypeAdapter(described).json_schema()
    for one_name, one in schema["$defs"].items():
        for base in filter(is_typeddict, types[one_name].__orig_bases__):  # descriptions are not inherited
            for key, inherited in TypeAdapter(base).json_schema()["properties"].items():
                one["properties"][key].update({k: v for k, v in inherited.items() if k == "description"})
    return json.dumps(_without_titles(schema), indent=2, ensure_ascii=False) + "\n"


def _without_titles(schema: Any) -> Any:
    """The schema without the titles that pydantic makes of keys and types."""
    if isinstance(schema, list):
        return [_without_titles(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    return {key: _without_titles(one) for key, one in schema.items() if not (key == "title" and isinstance(one, str))}


def _types(described: Any, found: set[Any]) -> Iterator[Any]:
    """A TypedDict, and all that its keys have."""
    if is_typeddict(described) and described not in found:
        found.add(described)
        yield described
        for base in described.__orig_bases__:
            yield from _types(base, found)
        for part in described.__annotations__.values():
            yield from _types(part, found)
    elif isinstance(described, UnionType) or get_args(described):
        for part in get_args(described):
            yield from _types(part, found)


if __name__ == "__main__":
    sys.stdout.write(schema_text(sys.argv[1]))
