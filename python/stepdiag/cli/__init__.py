"""The command line, one module per group of commands.

Only here are flags, output and exit codes.
"""

from stepdiag.cli.interrupts import interruptible


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return the exit code, see `stepdiag.cli.command_line.run`.

    Without arguments it is the program itself, with those of the process: Ctrl-C and SIGTERM then
    end the process, from before the commands are imported."""
    if arguments is not None:
        from stepdiag.cli.command_line import run

        return run(arguments)
    with interruptible():
        from stepdiag.cli.command_line import run

        return run(None)


__all__ = ["main"]
