"""What the commands of the command line have in common."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., None])
PATH = click.Path(path_type=Path)


def out_file(meaning: str) -> Callable[[Command], Command]:
    return click.option("-o", "output", required=True, type=PATH, metavar="FILE", help=meaning)


class InOrder(click.Group):
    """Lists its commands in the order in which they were added, not by the alphabet."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(self.commands)


def tell(what: str, message: str) -> None:
    """One line to standard error."""
    line = " ".join(message.split())
    click.echo(f"stepdiag: {what}: {line}", err=True)
