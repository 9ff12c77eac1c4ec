"""Text made from the scenario's keys: the table in docs/scenario.md, and the commented new scenario.

`python -m stepdiag.scenario_text` prints the table."""

import textwrap
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from stepdiag.scenario_errors import expectation, model_of, show
from stepdiag.scenario_keys import BY_LINE, ScenarioKeys


def key_table() -> str:
    """Every section and key of a scenario file, in Markdown."""
    parts = []
    for name, section in sections():
        optional = "" if _is_required(name) else " (optional)"
        parts.append(f"## `[{name}]`{optional}\n\n{_paragraphs(section)}\n")
        parts.append("| Key | Expected | Default | Meaning |\n|---|---|---|---|")
        parts += [
            f"| `{key}` | {expectation(field)} | {_default(field)} | {field.description} |"
            for key, field in keys(section)
        ]
        parts.append("")
    return "\n".join(parts)


def template() -> str:
    """A complete scenario with a comment on every key; optional keys are commented out."""
    lines = [
        "# A scenario for stepdiag: machine, plan and head. The end of a key is its unit.",
        "",
    ]
    for name, section in sections():
        active = _is_required(name)
        lines += [*_comment(_paragraphs(section)), f"{'' if active else '# '}[{name}]"]
        for key, field in keys(section):
            required = active and field.is_required()
            lines += _comment(f"{field.description} Expected: {expectation(field)}.")
            lines.append(f"{'' if required or _is_offered(name, key) else '# '}{key} = {show_full(_example(field))}")
        lines.append("")
    return "\n".join(lines)


def sections() -> Iterator[tuple[str, type[BaseModel]]]:
    """The sections in the order of the file, [machine.random] after [machine]."""

    def below(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, type[BaseModel]]]:
        for name, field in model.model_fields.items():
            section = model_of(field.annotation)
            if section is not None and name != BY_LINE:
                yield prefix + name, section
                yield from below(section, f"{prefix}{name}.")

    return below(ScenarioKeys, "")


def keys(section: type[BaseModel]) -> list[tuple[str, FieldInfo]]:
    return [(name, field) for name, field in section.model_fields.items() if model_of(field.annotation) is None]


def show_full(value: Any) -> str:
    """A value as TOML writes it."""
    return show(value, longest=10_000)


def _is_required(section: str) -> bool:
    field = ScenarioKeys.model_fields.get(section)
    return field is not None and field.is_required()


def _is_offered(section: str, key: str) -> bool:
    # A new scenario has scale lines: without them the slopes of the positioning errors stay unknown.
    return (section, key) == ("plan", "scale_lines")


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**required**"
    return "-" if field.default is None else f"`{show_full(field.default)}`"


def _example(field: FieldInfo) -> Any:
    extra = field.json_schema_extra
    example = extra.get("example") if isinstance(extra, dict) else None
    return field.default if example is None else example


def _paragraphs(section: type[BaseModel]) -> str:
    return textwrap.dedent("    " + (section.__doc__ or "")).strip()


def _comment(text: str) -> list[str]:
    plain = text.replace("**", "").replace("`", "")
    return [f"# {line}" for paragraph in plain.split("\n\n") for line in textwrap.wrap(paragraph, 110)]


if __name__ == "__main__":
    print(key_table())
