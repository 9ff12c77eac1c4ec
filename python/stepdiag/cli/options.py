"""What the commands of the command line have in common."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import click

from stepdiag._core import InvalidArgument

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


def keep_apart(output: Path, *inputs: Path) -> None:
    """Raises InvalidArgument where a command would write over what it reads."""
    for path in inputs:
        if _same_file(output, path):
            raise InvalidArgument(f"{output}: is also an input; give the output another name")


def keep_map(output: Path, error_map: Path | None) -> None:
    """Raises InvalidArgument where a command would write over the scenario's error map."""
    # By name too: a result that fills the place of a missing map would be taken for the machine's errors.
    if error_map is not None and (output.resolve() == error_map.resolve() or _same_file(output, error_map)):
        raise InvalidArgument(f"{output}: is the scenario's machine.errors; give the output another name")


def _same_file(one: Path, other: Path) -> bool:
    return one.exists() and other.exists() and one.samefile(other)
