"""One clear line for whatever is wrong with a scenario's keys: file, key, what was expected, what came."""

import difflib
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from stepdiag._core import InvalidArgument
from stepdiag.scenario_keys import BY_LINE, ScenarioKeys


def explain(error: ValidationError, content: Mapping[str, Any], file: str) -> InvalidArgument:
    """The first thing wrong; unknown keys come first, for a misspelt key is also a missing one."""
    details = sorted(error.errors(include_url=False), key=lambda detail: detail["type"] != "extra_forbidden")
    others = len({place_of(_follow(detail["loc"])[0]) for detail in details}) - 1
    more = "" if others == 0 else f" (and {others} more)"
    return InvalidArgument(f"{file}: {_sentence(details[0], content)}{more}")


def suggest(name: str, known: Sequence[str]) -> str:
    """The nearest known name, or all of them where none is near."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    return f"did you mean {near[0]}?" if near else f"expected one of {', '.join(known)}"


def show(value: Any, longest: int = 60) -> str:
    """A value much as TOML writes it, shortened."""
    text = _toml(value)
    return text if len(text) <= longest else text[: longest - 3] + "..."


def _sentence(detail: ErrorDetails, content: Mapping[str, Any]) -> str:
    names, field, section = _follow(detail["loc"])
    place = place_of(names)
    if detail["type"] == "extra_forbidden":
        known = [name for name in section.model_fields if name != BY_LINE]
        what = "key" if len(names) > 1 else "section"
        return f"{place}: unknown {what}; {suggest(names[-1], known)}"
    expected = expectation(field) if field is not None else f"a section [{place}]"
    value: Any = content
    for name in names:
        if name not in value:
            return f"{place}: missing; expected {expected}"
        value = value[name]
    return f"{place}: expected {expected}, got {show(value)}"


def place_of(names: Sequence[str]) -> str:
    """The key as the file has it: plan.steps, misalignment.ppp.laser_urad."""
    return ".".join(name for level, name in enumerate(names) if (level, name) != (1, BY_LINE))


def expectation(field: FieldInfo) -> str:
    extra = field.json_schema_extra
    return str(extra["expected"]) if isinstance(extra, dict) else "a section"


def model_of(annotation: Any) -> type[BaseModel] | None:
    """The model of a field that is a section, or a dictionary of sections."""
    for candidate in (annotation, *getattr(annotation, "__args__", ())):
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            return candidate
    return None


def _follow(location: tuple[int | str, ...]) -> tuple[list[str], FieldInfo | None, type[BaseModel]]:
    """Names of the sections and the key that `location` leads to, without pydantic's branches and indices."""
    names: list[str] = []
    section: type[BaseModel] = ScenarioKeys
    parts = list(location)
    while parts:
        name = str(parts.pop(0))
        names.append(name)
        field = section.model_fields.get(name)
        if field is None:
            return names, None, section
        below = model_of(field.annotation)
        if below is None:
            return names, field, section
        section = below
        if name == BY_LINE and parts:
            names.append(str(parts.pop(0)))
    return names, None, section


def _toml(value: Any) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            return '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
        case list() | tuple():
            return "[" + ", ".join(_toml(item) for item in value) + "]"
        case dict():
            return "{" + ", ".join(f"{name} = {_toml(item)}" for name, item in value.items()) + "}"
        case _:
            return str(value)
