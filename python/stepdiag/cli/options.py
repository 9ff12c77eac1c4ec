"""Option types, messages and exit codes that the commands share."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar

import click
from click.shell_completion import CompletionItem

from stepdiag.io.outputs import FileKind, OutputFile

Command = TypeVar("Command", bound=Callable[..., None])
NOT_TO_BE_TRUSTED: Final = 3  # exit code: done and written, but not to be used
PATH = click.Path(path_type=Path)  # for input files; output files have the type Writes
SHORT_FLAGS = {"samples": "-n", "output": "-o"}


class Writes(click.ParamType):  # type: ignore[type-arg]  # click 8.1 takes none
    """A file to write, of one of these kinds, or a folder. The value is an OutputFile to claim."""

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
    """Lists its commands in the order in which they were added."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(self.commands)


def in_flags(message: str) -> str:
    """Write the package's `restart_set_up` in messages as --restart-set-up."""
    return re.sub(r"`(\w+)`", lambda name: SHORT_FLAGS.get(name[1], "--" + name[1].replace("_", "-")), message)


def tell(what: str, message: str) -> None:
    """Write to standard error. A warning begins with "warning:", which scripts can search."""
    line = " ".join(in_flags(message).split())
    click.echo(f"warning: {line}" if what == "warning" else f"stepdiag: {what}: {line}", err=True)


def tell_fit(context: click.Context, path: Path, fit: str | None) -> None:
    """Warn if the fit of a calibration is not accepted.

    A rejected fit ends the command with code 3."""
    if fit == "rejected":
        tell("warning", f"{path}: the fit is rejected: do not use this calibration")
        context.exit(NOT_TO_BE_TRUSTED)
    if fit == "doubtful":
        tell("warning", f"{path}: the fit is doubtful: do not rely on the stated uncertainties")
    if fit == "unchecked":
        tell("warning", f"{path}: the fit is unchecked: nothing controlled the readings of this calibration")
