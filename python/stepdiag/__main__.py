"""Runs the command line by `python -m stepdiag`."""

import sys

from stepdiag.cli import main

sys.exit(main())
