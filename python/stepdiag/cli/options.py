"""Option types, messages and exit codes that the commands share."""

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import Field, dataclass, fields
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol, TypeVar, Union, get_args, get_origin, get_type_hints

import click
from click.shell_completion import CompletionItem

from stepdiag.cli.terminal import say
from stepdiag.io.outputs import FileKind, OutputFile

if TYPE_CHECKING:
    from stepdiag._core import Measurement
    from stepdiag.scenario.description import Scenario
    from stepdiag.scenario.known import Known

Command = TypeVar("Command", bound=Callable[..., None])
Options = TypeVar("Options")
NOT_TO_BE_TRUSTED: Final = 3  # exit code: done and written, but not to be used
PATH = click.Path(path_type=Path)  # for input files; output files have the type Writes
SHORT_FLAGS = {"samples": "-n", "output": "-o"}


_OUTPUTS: Final = "stepdiag.outputs"  # in a context's meta: by path


@dataclass
class _Output:
    """A file that a command may write: what it was before, the command's parameters, what is said of it."""

    before: tuple[int, int] | None
    parameters: Mapping[str, Any]
    what: str = ""


def _state(path: Path) -> tuple[int, int] | None:
    """That changes when a file is written."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def watched(context: click.Context, output: OutputFile) -> OutputFile:
    """The same; if it is written, say_outputs says so."""
    context.meta.setdefault(_OUTPUTS, {})[output.path] = _Output(_state(output.path), context.params)
    return output


def say_of_output(path: Path, what: str) -> None:
    """What is said of a file beside its name, when the command is done."""
    click.get_current_context().meta[_OUTPUTS][path].what = what


def say_outputs(context: click.Context) -> None:
    """Say which files a command wrote; where standard output is an object, on standard error. Folders have named their
    files."""
    for path, output in context.meta.get(_OUTPUTS, {}).items():
        if path.is_file() and _state(path) != output.before:
            say(f"wrote {path}{output.what}", err=bool(output.parameters.get("as_json")))


class Writes(click.ParamType):  # type: ignore[type-arg]  # click 8.1 takes none
    """A file to write, of one of these kinds, or a folder. The value is an OutputFile to claim."""

    name = "path"

    def __init__(self, *kinds: FileKind) -> None:
        self.kinds = kinds

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> OutputFile:
        output = value if isinstance(value, OutputFile) else OutputFile(Path(value), self.kinds)
        return output if ctx is None else watched(ctx, output)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return [CompletionItem(incomplete, type="file")]


class PointInMm(click.ParamType):  # type: ignore[type-arg]
    """Three lengths, X,Y,Z."""

    name = "X,Y,Z"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(word) for word in value.split(","))
        except ValueError:
            numbers = ()
        if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
            self.fail(f"expected X,Y,Z in mm, such as 400,300,250, got {value!r}", param, ctx)
        return numbers


def out_file(meaning: str, *kinds: FileKind) -> Callable[[Command], Command]:
    return click.option("-o", "output", required=True, type=Writes(*kinds), metavar="FILE", help=meaning)


# --- options from the fields of an option class (option_field.py) ---
def options_of(*classes: type, only: Collection[str] = ()) -> Callable[[Command], Command]:
    """Decorator of a command: an option for each field with a meaning, or for these alone."""

    def decorate(command: Command) -> Command:
        for kind in reversed(classes):
            types = get_type_hints(kind)
            for field in reversed([one for one in _described(kind) if not only or one.name in only]):
                command = _option(field, types[field.name])(command)
        return command

    return decorate


def made_of(kind: type[Options], given: dict[str, Any], **others: Any) -> Options:
    """The class from the options of a command, as far as it has them, and from other fields."""
    values = {field.name: _value(field, given[_name(field)]) for field in _described(kind) if _name(field) in given}
    return kind(**values, **others)


def _described(kind: type) -> Iterator[Field[Any]]:
    return (field for field in fields(kind) if "meaning" in field.metadata)


def _name(field: Field[Any]) -> str:
    return field.metadata["name"] or field.name


def _option(field: Field[Any], hint: Any) -> Callable[[Command], Command]:
    about, flag, default = field.metadata, f"--{_name(field).replace('_', '-')}", field.default
    kind = _kind(hint)
    if kind is bool:
        names = f"{flag}/--no-{flag.removeprefix('--')}" if default else flag
        return click.option(names, is_flag=True, default=default, show_default=bool(default), help=about["meaning"])
    if about["words"]:
        default = next(word for word, value in about["words"].items() if value == default)
    elif kind is float and default is not None:
        default = default / about["factor"]
    count = len(get_args(kind)) if get_origin(kind) is tuple and about["parse"] is None else 1
    return click.option(
        flag,
        type=_type(about, get_args(kind)[0] if count > 1 else kind),
        nargs=count,
        default=default,
        show_default=default not in (None, ""),
        metavar=about["metavar"],
        help=about["meaning"],
    )


def _kind(hint: Any) -> Any:
    """The type of a field beside None."""
    kinds = [one for one in get_args(hint) if one is not NoneType] if get_origin(hint) in (Union, UnionType) else [hint]
    return kinds[0]


def _type(about: Any, kind: Any) -> Any:
    least, above = about["least"], about["above"]
    if about["words"]:
        return click.Choice(list(about["words"]))
    if get_origin(kind) is Literal:
        return click.Choice(list(get_args(kind)))
    if kind is Path:
        return PATH
    if kind is int:
        return int if least is None else click.IntRange(least)
    if kind is float and (least, above) == (None, None):
        return float
    if kind is float:
        return click.FloatRange(min=least if above is None else above, min_open=above is not None)
    return str


def _value(field: Field[Any], given: Any) -> Any:
    about = field.metadata
    if about["words"]:
        return about["words"][given]
    if about["parse"]:
        return None if given is None else about["parse"](given)
    return given * about["factor"] if isinstance(given, float) else given


class Grouped(click.Command):
    """Shows its options in groups: title -> names of parameters. Those in no group come last, as "Options"."""

    def __init__(self, *arguments: Any, groups: Mapping[str, Sequence[str]], **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.groups = groups

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        left = {p.name: p for p in self.get_params(ctx) if isinstance(p, click.Option)}
        for title, names in self.groups.items():
            records = [left.pop(name).get_help_record(ctx) for name in names]
            with formatter.section(title):
                formatter.write_dl([record for record in records if record is not None])
        records = [option.get_help_record(ctx) for option in left.values()]
        with formatter.section("Options"):
            formatter.write_dl([record for record in records if record is not None])


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
    say(f"warning: {line}" if what == "warning" else f"stepdiag: {what}: {line}", err=True)


def tell_inputs(scenario: "Scenario") -> None:
    """Warn of what a scenario states and no workshop has."""
    for sentence in scenario.known.implausible:
        tell("warning", f"{scenario.path}: {sentence}")


def input_warnings(known: "Known", run: Path, measurement: "Measurement") -> list[str]:
    """What scenario and run say that no workshop has, each with its file."""
    from stepdiag.scenario.plausible_inputs import implausible_columns, limits_of

    of_run = implausible_columns(limits_of(known.keys), measurement)
    return [f"{known.path}: {said}" for said in known.implausible] + [f"{run}: {said}" for said in of_run]


def json_option(command: Command) -> Command:
    """Add --json: the command prints the text of its object (room objects) instead of its report."""
    option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of the report.")
    return option(command)


class HasFit(Protocol):
    """A calibration, or what stands for one in a result."""

    @property
    def fit(self) -> str | None: ...
    @property
    def unverified(self) -> bool: ...


def is_untrusted(*calibrations: HasFit) -> bool:
    """Whether one of them is not to be used: its fit is rejected, or it is unverified."""
    return any(one.fit == "rejected" or one.unverified for one in calibrations)


def trust_warnings(path: Path, calibration: HasFit) -> list[str]:
    """What to warn of if the fit of a calibration is not accepted, or if it is unverified."""
    from stepdiag.findings.meaning import UNVERIFIED

    fit = calibration.fit
    meaning = {
        "rejected": "do not use this calibration",
        "doubtful": "do not rely on the stated uncertainties",
        "unchecked": "the readings do not test this calibration",
    }
    warnings = [f"{path}: the fit is {fit}: {meaning[fit]}"] if fit in meaning else []
    return [*warnings, f"{path}: {UNVERIFIED}"] if calibration.unverified else warnings


def tell_trust(context: click.Context, path: Path, calibration: HasFit) -> None:
    """Warn of a calibration as `trust_warnings` does.

    One that is not to be used ends the command with code 3."""
    for warning in trust_warnings(path, calibration):
        tell("warning", warning)
    if is_untrusted(calibration):
        context.exit(NOT_TO_BE_TRUSTED)
