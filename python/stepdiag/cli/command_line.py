"""The command line: all commands, and the exit codes.

Imports inside the commands keep the other commands fast.
"""

import errno
import io
import os
import sys
from importlib import import_module
from typing import Any, Final

import click

from stepdiag._core import InvalidArgument, ReplayMismatch, __version__
from stepdiag.memory import NotEnoughMemory

EPILOG = """\b
See everything at once:
  stepdiag demo
Simulate and evaluate a run (uncomment [machine.random] in the scenario for a machine with errors):
  stepdiag init -o machine
  stepdiag simulate machine/scenario.toml -o run.csv
  stepdiag evaluate machine/scenario.toml run.csv -o calibration.csv
For your own measurement fill in machine/measurement.csv and evaluate it instead of run.csv.
To see what a plan can determine before you measure: stepdiag observe machine/scenario.toml
"""

# In the order in which a new user needs them. Name -> module, and what the list of commands says.
COMMANDS: Final = {
    "demo": ("simulate", "Simulate and evaluate the machine of the method's paper."),
    "init": ("files", "Start with your own machine: a scenario and a sheet of points."),
    "observe": ("evaluate", "Report what a plan and a head can determine, before measuring."),
    "plan": ("plan", "Choose the plan for the available time."),
    "uncertainty": ("uncertainty", "Report how uncertain a calibration would be."),
    "study": ("study", "Report the uncertainty over a grid of scenarios."),
    "nc": ("export", "Write the measuring program for a controller."),
    "align": ("at_machine.align", "Align head and mirror of each line."),
    "acquire": ("at_machine.acquire", "Record readings from an instrument."),
    "twin": ("at_machine.acquire", "Simulate the instrument."),
    "import": ("files", "Read a measurement from a spreadsheet."),
    "simulate": ("simulate", "Simulate the run of a scenario."),
    "evaluate": ("evaluate", "Calibrate the machine from a run."),
    "plot": ("plot", "Draw a calibration, a measurement and other files."),
    "report": ("calibrations", "Summarise a calibration."),
    "volume": ("volume", "Report the error of the tool in the volume, and whether it is within a limit."),
    "verify": ("calibrations", "Test a calibration with readings from which it was not made."),
    "recheck": ("calibrations", "Test whether the machine has changed since its calibration."),
    "compare": ("calibrations", "Compare two calibrations."),
    "positions": ("positions", "Evaluate or predict positioning tests (ISO 230-2, 230-6)."),
    "export": ("export", "Write a calibration for a controller."),
    "check": ("files", "Check files, and whether a scenario and a run belong together."),
    "selftest": ("files", "Compare this installation with known truths."),
    "app": ("book", "Open the machine book in the browser."),
    "book": ("book", "Keep machines, their runs, calibrations and reports."),
    "head": ("head", "Draw and check descriptions of laser heads."),
}

# Words of other programs -> command.
_MEANT: Final = {
    "adjust": "evaluate",
    "analyse": "evaluate",
    "analyze": "evaluate",
    "calibrate": "evaluate",
    "compensate": "export",
    "fit": "evaluate",
    "gcode": "nc",
    "gui": "app",
    "measure": "acquire",
    "new": "init",
    "validate": "verify",
    "web": "app",
}


class Commands(click.Group):
    """Imports a command when it is used: their list, and the other commands, do not wait for it."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        module, short_help = COMMANDS[name]
        commands = vars(import_module(f"stepdiag.cli.{module}"))
        command: click.Command = commands.get(name) or commands[f"{name}_"]  # import is a word of Python
        command.short_help = short_help
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """An unknown command is named with the one that is meant."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError:
            from difflib import get_close_matches

            word = args[0].lower()
            near = [_MEANT[word]] if word in _MEANT else get_close_matches(word, COMMANDS, n=1)
            if not near or word.startswith("-"):
                raise
            raise click.UsageError(f"No such command {args[0]!r}: did you mean {near[0]}?", ctx) from None

    def invoke(self, ctx: click.Context) -> Any:
        """At the end what was written, also of a command whose result is not to be used."""
        from stepdiag.cli.options import say_outputs

        try:
            result = super().invoke(ctx)
        except click.exceptions.Exit:
            say_outputs(ctx)
            raise
        say_outputs(ctx)
        return result

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, short_help) for name, (_, short_help) in COMMANDS.items()])


@click.group(
    cls=Commands, epilog=EPILOG, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(__version__, message="stepdiag %(version)s")
def cli() -> None:
    """Calibrate three-axis machine tools by the laser step-diagonal method."""


def _complain(message: str) -> None:
    from stepdiag.cli.options import tell

    tell("error", message)


def _words_of(error: OSError) -> str:
    """Where it has no file, it was standard output: files are written by functions that name them."""
    if error.filename is None and error.errno in (errno.ENOSPC, errno.EIO, errno.EBADF, errno.EFBIG):
        why = os.strerror(error.errno)
        null = os.open(
            os.devnull, os.O_WRONLY
        )  # what is still in the buffer goes nowhere, instead of failing once more
        os.dup2(null, 1)
        os.close(null)
        return f"standard output: {why}: what the command says was not written, what it wrote to files was"
    return str(error)


def run(arguments: list[str] | None) -> int:
    """Run the command line and return the exit code. None: the arguments of the process.

    0: done. 1: internal error. 2: error of the user, in a file, or of too little memory. 3: done,
    but the result must not be used. 130: interrupted. 143: ended by SIGTERM."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without µ shows the rest of the line
    try:
        result = cli.main(arguments, prog_name="stepdiag", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except click.Abort:
        return 130
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        return 0
    except click.UsageError as error:
        hint = f' (see "{error.ctx.command_path} --help")' if error.ctx else ""
        _complain(error.format_message() + hint)
    except (InvalidArgument, click.ClickException) as error:
        _complain(error.format_message() if isinstance(error, click.ClickException) else str(error))
    except ReplayMismatch as error:
        _complain(f"{error}; nothing was written (verified_share = 1 traces every pose)")
        return 1
    except OSError as error:
        _complain(_words_of(error))
    except MemoryError as error:
        _complain(str(error) if isinstance(error, NotEnoughMemory) else "the memory does not suffice")
    return 2
