"""What the commands of the command line have in common."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem

from stepdiag.outputs import Kind, Output

Command = TypeVar("Command", bound=Callable[..., None])
PATH = click.Path(path_type=Path)  # of what a command reads; what it writes is of the type Writes


class Writes(click.ParamType):  # type: ignore[type-arg]  # click 8.1 takes none
    """A file to write, of one of these kinds, or a folder. Its value is an Output, which a command has to claim."""

    name = "path"

    def __init__(self, *kinds: Kind) -> None:
        self.kinds = kinds

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Output:
        return value if isinstance(value, Output) else Output(Path(value), self.kinds)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return [CompletionItem(incomplete, type="file")]


def out_file(meaning: str, *kinds: Kind) -> Callable[[Command], Command]:
    return click.option("-o", "output", required=True, type=Writes(*kinds), metavar="FILE", help=meaning)


class InOrder(click.Group):
    """Lists its commands in the order in which they were added, not by the alphabet."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(self.commands)


def tell(what: str, message: str) -> None:
    """One line to standard error."""
    line = " ".join(message.split())
    click.echo(f"stepdiag: {what}: {line}", err=True)
