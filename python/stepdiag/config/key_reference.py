"""Markdown made from the keys of our TOML files, for docs/scenario.md and docs/head.md.

`python -m stepdiag.config.key_reference scenario` prints the lists of the first, with `head` those of the second."""

import sys
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass

from pydantic.fields import FieldInfo

from stepdiag.config.key_errors import KEPT_UNDER, expectation, has_named_tables, models_of, show, tag_value
from stepdiag.config.key_types import Section


@dataclass(frozen=True)
class Part:
    """A section of the file as documentation shows it."""

    title: str  # as in [title], with NAME for names of the user's own; empty: the keys above all sections
    model: type[Section]
    required: bool


def key_list(root: type[Section]) -> str:
    """Every section and key of a file, in Markdown."""
    lines = []
    if keys(root):
        lines += [*_list(root, keys(root)), ""]
    for part in sections(root):
        optional = "" if part.required else " (optional)"
        heading = f"## `[{part.title}]`{optional}"
        if is_alternative(part.model):
            heading = f"### `{part.model.tag} = {show(tag_value(part.model))}` in `[{part.title}]`"
        lines += [heading, "", *_list(part.model, keys(part.model)), ""]
    return "\n".join(lines)


def sections(root: type[Section]) -> Iterator[Part]:
    """The sections in the order of the file, [machine.random] after [machine]; alternatives one after the other."""

    def below(model: type[Section], prefix: str) -> Iterator[Part]:
        for name, field in model.model_fields.items():
            if name in KEPT_UNDER:
                continue
            title = f"{prefix}{name}" + (f".{placeholder(field)}" if has_named_tables(field) else "")
            models = models_of(field.annotation)
            if len(models) > 1:
                yield Part(title, _base_of(models[0]), field.is_required())
            for section in models:
                yield Part(title, section, field.is_required())
                yield from below(section, f"{title}.")

    return below(root, "")


def placeholder(field: FieldInfo) -> str:
    """What documentation puts for a name of the user's own."""
    extra = field.json_schema_extra
    return str(extra["placeholder"]) if isinstance(extra, dict) else ""


def keys(section: type[Section]) -> list[tuple[str, FieldInfo]]:
    """The keys that are no sections; of an alternative its own ones only."""
    common = {*_base_of(section).model_fields, section.tag} if is_alternative(section) else {}
    return [
        (name, field)
        for name, field in section.model_fields.items()
        if not models_of(field.annotation) and name not in common
    ]


def is_alternative(section: type[Section]) -> bool:
    return section.tag in section.model_fields


def _base_of(alternative: type[Section]) -> type[Section]:
    """What all alternatives have in common: the class that names their tag."""
    return next(base for base in alternative.__mro__ if "tag" in vars(base))


def paragraphs(section: type[Section]) -> str:
    return textwrap.dedent("    " + (section.__doc__ or "")).strip()


def show_full(value: object) -> str:
    """A value as TOML writes it."""
    return show(value, longest=10_000)


def _list(section: type[Section], rows: list[tuple[str, FieldInfo]]) -> Iterator[str]:
    yield from ("\n\n".join(_wrapped(text) for text in paragraphs(section).split("\n\n")), "")
    for name, field in rows:
        item = f"- `{name}`: {field.description} Expected: {expectation(field)}. {_default(field)}"
        yield _wrapped(item.rstrip(), below="  ")


def _wrapped(text: str, below: str = "") -> str:
    """In lines of 100 columns, with `below` before all but the first."""
    return textwrap.fill(text, 100, subsequent_indent=below, break_long_words=False, break_on_hyphens=False)


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**Required.**"
    return "" if field.default is None else f"Default: `{show_full(field.default)}`."


if __name__ == "__main__":
    from stepdiag.config.head_keys import HeadFile
    from stepdiag.config.scenario_keys import ScenarioKeys

    roots: dict[str, type[Section]] = {"scenario": ScenarioKeys, "head": HeadFile}
    print(key_list(roots[sys.argv[1]]))
