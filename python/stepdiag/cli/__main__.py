"""Runs the command line by `python -m stepdiag.cli`."""

import sys

from stepdiag.cli.command_line import main

sys.exit(main())
