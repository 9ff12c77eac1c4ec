"""The command line, one module per group of commands.

Only here are flags, output and exit codes.
"""

from stepdiag.cli.command_line import main

__all__ = ["main"]
