"""One clear line for whatever is wrong with the keys of a TOML file: file, key, what was expected, what came."""

import difflib
from collections.abc import Mapping, Sequence
from typing import Any, Final, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from stepdiag._core import InvalidArgument
from stepdiag.config.key_types import Section

# Where tables of the user's own names are kept: [misalignment.ppp] under misalignment.by_line. Files never have these.
BY_LINE: Final = "by_line"
BY_HEAD: Final = "by_head"
KEPT_UNDER: Final = (BY_LINE, BY_HEAD)

# The type of pydantic's errors whose context says where below their key something is wrong, and what.
OWN_WORDS: Final = "own_words"


def explain(error: ValidationError, content: Mapping[str, Any], file: str, root: type[Section]) -> InvalidArgument:
    """The first thing wrong; unknown keys come first, for a misspelt key is also a missing one."""
    details = sorted(error.errors(include_url=False), key=lambda detail: detail["type"] != "extra_forbidden")
    others = len({place_of(_follow(detail["loc"], root)[0]) for detail in details}) - 1
    more = "" if others == 0 else f" (and {others} more)"
    return InvalidArgument(f"{file}: {_sentence(details[0], content, root)}{more}")


def suggest(name: str, known: Sequence[str]) -> str:
    """The nearest known name, or all of them where none is near."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    if near:
        return f"did you mean {near[0]}?"
    return f"expected one of {', '.join(known)}" if known else "expected none here"


def show(value: Any, longest: int = 60) -> str:
    """A value much as TOML writes it, shortened."""
    text = _toml(value)
    return text if len(text) <= longest else text[: longest - 3] + "..."


def _sentence(detail: ErrorDetails, content: Mapping[str, Any], root: type[Section]) -> str:
    names, field, section = _follow(detail["loc"], root)
    if detail["type"] in ("union_tag_not_found", "union_tag_invalid"):
        names, field = [*names, section.tag], section.model_fields[section.tag]
    place = place_of(names)
    if detail["type"] == "extra_forbidden":
        known = [name for name in section.model_fields if name not in KEPT_UNDER]
        what = "section" if len(names) == 1 and isinstance(content[names[0]], dict) else "key"
        return f"{place}: unknown {what}; {suggest(names[-1], known)}"
    if detail["type"] == OWN_WORDS:
        return f"{place}{detail['ctx']['below']}: {detail['ctx']['said']}"
    expected = expectation(field) if field is not None else f"a section [{place}]"
    value: Any = content
    for name in names:
        if name not in value:
            return f"{place}: missing; expected {expected}"
        value = value[name]
    return f"{place}: expected {expected}, got {show(value)}"


def place_of(names: Sequence[str]) -> str:
    """The key as the file has it: plan.steps, misalignment.ppp.laser_urad."""
    return ".".join(name for level, name in enumerate(names) if level != 1 or name not in KEPT_UNDER)


def expectation(field: FieldInfo) -> str:
    extra = field.json_schema_extra
    return str(extra["expected"]) if isinstance(extra, dict) and "expected" in extra else "a section"


def models_of(annotation: Any) -> list[type[Section]]:
    """The model of a field that is a section, or a dictionary of sections; several where a tag decides."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation] if issubclass(annotation, Section) else []
    return [model for candidate in get_args(annotation) for model in models_of(candidate)]


def has_named_tables(field: FieldInfo) -> bool:
    """Whether the field is a dictionary of sections."""
    return get_origin(field.annotation) is dict


def _follow(location: tuple[int | str, ...], root: type[Section]) -> tuple[list[str], FieldInfo | None, type[Section]]:
    """Names of the sections and the key that `location` leads to, without pydantic's branches and indices."""
    names: list[str] = []
    section = root
    parts = list(location)
    while parts:
        name = str(parts.pop(0))
        names.append(name)
        field = section.model_fields.get(name)
        if field is None:
            return names, None, section
        alternatives = models_of(field.annotation)
        if not alternatives:
            return names, field, section
        section = alternatives[0]
        if has_named_tables(field) and parts:
            names.append(str(parts.pop(0)))
        if section.tag and parts:
            section = {tag_value(model): model for model in alternatives}[str(parts.pop(0))]
    return names, None, section


def tag_value(model: type[Section]) -> str:
    """What the tag of this alternative says, such as "plate"."""
    (value,) = get_args(model.model_fields[model.tag].annotation)
    return str(value)


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
