"""What the commands of the command line have in common."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar

import click
from click.shell_completion import CompletionItem

from stepdiag.io.outputs import FileKind, OutputFile

Command = TypeVar("Command", bound=Callable[..., None])
NOT_TO_BE_TRUSTED: Final = 3  # exit status: done and written, but not to be used
PATH = click.Path(path_type=Path)  # of what a command reads; what it writes is of the type Writes
SHORT_FLAGS = {"samples": "-n", "output": "-o"}


class Writes(click.ParamType):  # type: ignore[type-arg]  # click 8.1 takes none
    """A file to write, of one of these kinds, or a folder. Its value is an OutputFile, which a command has to claim."""

    name = "path"

    def __init__(self, *kinds: FileKind) -> None:
        self.kinds = kinds

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> OutputFile:
        return value if isinstance(value, OutputFile) else OutputFile(Path(value), self.kinds)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return [CompletionItem(incomplete, type="file")]


def out_file(meaning: str, *kinds: FileKind) -> Callable[[Command], Command]:
    return click.option("-o", "output", required=True, type=Writes(*kinds), metavar="FILE", help=meaning)


class InOrder(click.Group):
    """Lists its commands in the order in which they were added, not by the alphabet."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(self.commands)


def in_flags(message: str) -> str:
    """What is said of `rows` and `restart_set_up` in the package is said of --rows and --restart-set-up here."""
    return re.sub(r"`(\w+)`", lambda name: SHORT_FLAGS.get(name[1], "--" + name[1].replace("_", "-")), message)


def tell(what: str, message: str) -> None:
    """One line to standard error. A warning begins with "warning:", as scripts that look for one expect."""
    line = " ".join(in_flags(message).split())
    click.echo(f"warning: {line}" if what == "warning" else f"stepdiag: {what}: {line}", err=True)


def tell_fit(context: click.Context, path: Path, fit: str | None) -> None:
    """Warns where the fit of a calibration is not accepted; a rejected one ends the command with status 3."""
    if fit == "rejected":
        tell("warning", f"{path}: the fit is rejected: do not use this calibration")
        context.exit(NOT_TO_BE_TRUSTED)
    if fit == "doubtful":
        tell("warning", f"{path}: the fit is doubtful: do not rely on the stated uncertainties")
