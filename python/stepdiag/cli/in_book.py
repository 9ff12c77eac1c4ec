"""Commands that work on a machine of the book: `--machine NAME` takes their files from there and keeps the results.

With --machine a command's files are names in the book. Those that are left out are the latest ones: of a calibration,
of a run, and the scenario with which that run was made. Results get a free name, and a record says how they were made.
"""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from stepdiag._core import InvalidArgument
from stepdiag.cli.options import NOT_TO_BE_TRUSTED, PATH, Grouped, Writes, tell, watched
from stepdiag.interruption import at_end
from stepdiag.io.outputs import OutputFile

if TYPE_CHECKING:
    from stepdiag.book.book import Entry, MachineFolder

_IN_BOOK: Final = "stepdiag.in_book"  # key of a context: the machine is named
# The kind of file (file_kind.py) that a parameter of a command takes, by its name.
KINDS: Final = {
    "calibration": "calibration",
    "calibrations": "calibration",
    "baseline": "calibration",
    "b": "calibration",  # of two the latest one
    "a": "calibration",
    "run": "measurement",
    "scenario": "scenario",
}
_GO_ON: Final = ("resume", "restart_line", "restart_set_up")  # options that continue an output
# Parameters of a command -> what machine.toml says of them.
_OF_ABOUT: Final = {
    "limit": "limit_um",
    "machine_type": "title",
    "serial_number": "serial_number",
    "customer": "customer",
}
BOOK: Final = click.option(
    "--book",
    type=PATH,
    metavar="DIR",
    help="The machine book.  [default: STEPDIAG_BOOK, or that around the working folder]",
)
_MACHINE: Final = click.option(
    "--machine", metavar="NAME", help="Machine of the book: take files from there, and keep the results there."
)


@dataclass(frozen=True)
class Kept:
    """Where a result is kept. ending: of its name where the user gives none; empty: only written if named.

    A function of the command's parameters decides where it depends on them; "/" is a folder."""

    folder: str
    ending: str | Callable[[Mapping[str, Any]], str] = ""


class OfMachine(Grouped):
    """A command that can work on a machine of the book.

    makes: parameter -> where its file is kept. other_run: the run is one from which the calibration was not made.
    about: options that are not given have the values of machine.toml."""

    def __init__(
        self,
        *arguments: Any,
        makes: Mapping[str, Kept] | None = None,
        other_run: bool = False,
        about: bool = False,
        groups: Mapping[str, Sequence[str]] | None = None,
        **options: Any,
    ) -> None:
        super().__init__(*arguments, groups={**(groups or {}), "Machine book": ["machine", "book"]}, **options)
        for decorate in (_MACHINE, BOOK):
            decorate(self)
        self.makes, self.other_run, self.about = makes or {}, other_run, about

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        named = args[: args.index("--")] if "--" in args else args
        ctx.meta[_IN_BOOK] = any(word == "--machine" or word.startswith("--machine=") for word in named)
        ctx.meta[f"{_IN_BOOK}.words"] = ("stepdiag", *ctx.command_path.split()[1:], *args)
        return super().parse_args(ctx, args)

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """With a machine all arguments are names in the book, and none is required."""
        params = super().get_params(ctx)
        if not ctx.meta.get(_IN_BOOK):
            return params
        optional = [copy.copy(one) for one in params if isinstance(one, click.Option)]
        for one in optional:
            one.required = False
        return [click.Argument(["names"], nargs=-1), *optional]

    def invoke(self, ctx: click.Context) -> Any:
        machine, book = ctx.params.pop("machine"), ctx.params.pop("book")
        if machine is None:
            if book is not None:
                raise InvalidArgument("--book: goes with --machine")
            return super().invoke(ctx)
        from stepdiag.book.book import find_book

        use = _Use(self, ctx, find_book(book).machine(machine))
        with at_end(use.give_up), use:
            return super().invoke(ctx)


class _Use:
    """One use of a machine by a command: its files, and the record of what it makes."""

    def __init__(self, command: OfMachine, ctx: click.Context, machine: "MachineFolder") -> None:
        from stepdiag.book.layout import release

        self.command, self.ctx, self.machine = command, ctx, machine
        self._release = release  # not imported at the end, see `at_end`
        self.inputs: list[Entry] = []
        self.outputs: list[Path] = []
        self.record: Path | None = None

    def __enter__(self) -> None:
        try:
            self._find_inputs()
            self._take_outputs()
        except BaseException:
            self.give_up()
            raise
        if self.inputs:
            tell("note", f"{self.machine.name}: with {', '.join(one.file for one in self.inputs)}")

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        status = error.exit_code if isinstance(error, click.exceptions.Exit) else 0 if error is None else 2
        if status not in (0, NOT_TO_BE_TRUSTED):
            self.give_up()
        elif self.record is not None:
            self.machine.finish(self.record, status, [path for path in self.outputs if path.exists()])
            for path in self.outputs:
                tell("note", f"kept as {path.relative_to(self.machine.folder).as_posix()}")

    def give_up(self) -> None:
        """After an error or an interruption: what was taken and not written is given back."""
        for path in self.outputs:
            self._release(path)
        if self.record is not None and not any(path.exists() for path in self.outputs):
            self.record.unlink(missing_ok=True)

    # --- inputs -----------------------------------------------------------------------------------------------------
    def _find_inputs(self) -> None:
        params = self.ctx.params
        arguments = [one for one in self.command.params if isinstance(one, click.Argument)]
        wanted = [(str(one.name), one.nargs) for one in arguments]
        given: dict[str, list[Entry]] = {name: [] for name, _ in wanted}
        for name in params.pop("names"):
            entry = self.machine.entry(name)
            place = next(
                (
                    one
                    for one, count in wanted
                    if entry.kind in (KINDS[one], "error map" if one in ("a", "b") else None)
                    and (count == -1 or not given[one])
                ),
                None,
            )
            if place is None:
                kinds = " and ".join(dict.fromkeys(f"a {KINDS[one]}" for one, _ in wanted))
                raise InvalidArgument(f"{name}: is {_a(entry)}; this command takes {kinds}")
            given[place].append(entry)
        for name in sorted(given, key=lambda one: list(KINDS).index(one)):
            if not given[name] and params.get("from_raw") is None:
                given[name].append(self._latest(KINDS[name], given))
        self._of_options(given)
        if self.command.about and params.get("output", True) is not None:
            for name, key in _OF_ABOUT.items():
                if name in params and params[name] is None:
                    params[name] = getattr(self.machine.about, key)
        for name, count in wanted:
            paths = [self._used(one) for one in given[name]]
            params[name] = tuple(paths) if count == -1 else paths[0] if paths else None

    def _latest(self, kind: str, given: Mapping[str, Sequence["Entry"]]) -> "Entry":
        """What a person who does not name a file means."""
        others = [entry for entries in given.values() for entry in entries]
        origins = [origin for one in others for origin in self.machine.origins(one)]
        if kind == "scenario":
            runs = [one for one in (*others, *origins) if one.kind == "measurement"]
            of_run = [origin for run in runs for origin in self.machine.origins(run)]
            for one in of_run:
                if one.kind == kind and not one.removed:
                    return one
        apart = [one.file for one in others] + [one.file for one in origins if self.command.other_run]
        found = self.machine.last(kind, apart_from=apart)
        if found is None:
            other = "another " if apart and kind != "scenario" else "a "
            raise InvalidArgument(f"{self.machine.name}: expected {other}{kind} in the book: `stepdiag book add`")
        return found

    def _of_options(self, given: Mapping[str, Sequence["Entry"]]) -> None:
        """Options that name input files: names in the book, or paths. A page finds its scenario and run."""
        params = self.ctx.params
        for option in self.command.params:
            name = str(option.name)
            if not isinstance(option, click.Option) or option.type is not PATH or name not in params:
                continue
            if params[name] is not None and not params[name].exists():
                params[name] = self._used(self.machine.entry(str(params[name])))
            elif params[name] is None and name in KINDS and params.get("output") is not None:
                origins = [o for entries in given.values() for one in entries for o in self.machine.origins(one)]
                entry = next((one for one in origins if one.kind == KINDS[name]), None)
                params[name] = None if entry is None else self._used(entry)

    def _used(self, entry: "Entry") -> Path:
        from stepdiag.book.layout import main_file

        if entry not in self.inputs:
            self.inputs.append(entry)
        return main_file(entry.path)

    # --- outputs ----------------------------------------------------------------------------------------------------
    def _take_outputs(self) -> None:
        from stepdiag.io.data_files import date_of_today

        params = self.ctx.params
        for name, kept in self.command.makes.items():
            given: OutputFile | None = params.get(name)
            ending = kept.ending if isinstance(kept.ending, str) else kept.ending(params)
            if given is None and not ending:
                continue
            if given is not None and given.path.name != str(given.path):
                raise InvalidArgument(f"{given.path}: expected a name without folders, for {self.machine.name}")
            if given is not None and any(params.get(name) for name in _GO_ON):
                params[name] = watched(
                    self.ctx, OutputFile(self.machine.folder / kept.folder / given.path.name, given.kinds)
                )
                self.outputs.append(params[name].path)
                continue
            as_folder = ending == "/"
            named = str(given.path) if given else f"{date_of_today()[:10]}{'' if as_folder else ending}"
            path = self.machine.take(kept.folder, named, exactly=given is not None, as_folder=as_folder)
            self.outputs.append(path)
            kinds = next(one.type for one in self.command.params if one.name == name)
            assert isinstance(kinds, Writes)
            params[name] = watched(self.ctx, OutputFile(path, kinds.kinds))
        if "overwrite" in params:
            params["overwrite"] = False
        if self.outputs:
            words = self.ctx.meta[f"{_IN_BOOK}.words"]
            self.record = self.machine.begin(words, [one.path for one in self.inputs], self.outputs)


def _a(entry: "Entry") -> str:
    kind = entry.kind or "file that stepdiag does not read"
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"
