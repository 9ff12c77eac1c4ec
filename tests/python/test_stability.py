"""What docs/stability.md promises is still there: tests/data/stable lists it, one thing a line."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import click
import pytest
from places import DATA, ROOT
from public_names import public_names

from stepdiag.cli.command_line import cli
from stepdiag.config.head_keys import HeadFile
from stepdiag.config.key_reference import keys, sections
from stepdiag.config.key_types import Section
from stepdiag.config.scenario_keys import ScenarioKeys

STABLE = DATA / "stable"


def python_names() -> Iterator[str]:
    yield from public_names()


def cpp_headers() -> Iterator[str]:
    include = ROOT / "cpp" / "include"
    yield from (str(path.relative_to(include)) for path in include.rglob("*.h*"))


def command_options() -> Iterator[str]:
    """`evaluate -o` for every spelling of every option; a command by itself."""
    context = click.Context(cli)
    for name in cli.list_commands(context):
        command = cli.get_command(context, name)
        assert command is not None
        yield from _options(name, command)


def _options(name: str, command: click.Command) -> Iterator[str]:
    yield name
    for parameter in command.params:
        if isinstance(parameter, click.Option) and not parameter.hidden:
            yield from (f"{name} {spelling}" for spelling in (*parameter.opts, *parameter.secondary_opts))
    if isinstance(command, click.Group):
        for below, its in command.commands.items():
            yield from _options(f"{name} {below}", its)


def _keys(root: type[Section]) -> Iterator[str]:
    yield from (name for name, _ in keys(root))
    for part in sections(root):
        yield from (f"[{part.title}] {name}" for name, _ in keys(part.model))


def scenario_keys() -> Iterator[str]:
    yield from _keys(ScenarioKeys)


def head_keys() -> Iterator[str]:
    yield from _keys(HeadFile)


KINDS = [python_names, cpp_headers, command_options, scenario_keys, head_keys]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_nothing_that_is_stable_is_gone(kind: Callable[[], Iterator[str]]) -> None:
    file = STABLE / f"{kind.__name__}.txt"
    listed, found = file.read_text(encoding="utf-8").splitlines(), {*kind()}
    gone = [one for one in listed if one not in found]
    assert not gone, (
        f"{', '.join(gone)}: removed or renamed, and others use it (docs/stability.md). Keep it with a warning for one "
        f"minor version at least; with a new major version remove it, and its line in {file.relative_to(ROOT)}"
    )
    new = sorted(found - {*listed})
    assert not new, (
        f"{', '.join(new)}: new, and stable from the next release on. If it is meant to be public, add it to "
        f"{file.relative_to(ROOT)}"
    )
    assert listed == sorted(listed)
