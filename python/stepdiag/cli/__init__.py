"""The command line, one module per group of commands.

Only here are flags, output and exit codes.
"""

import gc
import os
import sys
from typing import Final

from stepdiag.cli.interrupts import interruptible

# What libraries do as they are imported, a tenth of a short command's time each, and no command needs: NumPy's threads
# for linear algebra, and pydantic's search of all installed packages for plugins.
WITHOUT: Final = {"OPENBLAS_NUM_THREADS": "1", "PYDANTIC_DISABLE_PLUGINS": "__all__"}


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return the exit code, see `stepdiag.cli.command_line.run`.

    Without arguments it is the program itself, with those of the process: Ctrl-C and SIGTERM then
    end the process, from before the commands are imported."""
    if arguments is not None:
        from stepdiag.cli.command_line import run

        return run(arguments)
    open_standard_streams()
    for name, value in WITHOUT.items():
        os.environ.setdefault(name, value)
    gc.set_threshold(100_000)  # most of what a short command makes are its imports: no garbage
    with interruptible():
        from stepdiag.cli.command_line import run

        status = run(None)
    gc.freeze()  # the memory goes with the process: Python need not search it for cycles first
    return status


def open_standard_streams() -> None:
    """Connect closed standard streams with /dev/null, as daemons and cron may start a program without them.

    Otherwise Python has no stream to write to, and the next file that is opened gets the number of a closed one: what
    a library then writes to standard output or error would go into that file."""
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            os.set_inheritable(number, True)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, mode, encoding="utf-8", errors="replace", closefd=False))  # noqa: SIM115


__all__ = ["main"]
