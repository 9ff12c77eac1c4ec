"""The command line, one module a group of commands. Flags, output and exit codes are here and nowhere else."""

from stepdiag.cli.command_line import main

__all__ = ["main"]
