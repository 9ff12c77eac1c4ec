"""The command line, one module per group of commands.

Only here are flags, output and exit codes.
"""

import gc
import os
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
    for name, value in WITHOUT.items():
        os.environ.setdefault(name, value)
    gc.set_threshold(100_000)  # most of what a short command makes are its imports: no garbage
    with interruptible():
        from stepdiag.cli.command_line import run

        status = run(None)
    gc.freeze()  # the memory goes with the process: Python need not search it for cycles first
    return status


__all__ = ["main"]
