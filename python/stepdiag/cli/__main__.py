"""`python -m stepdiag.cli` is the command stepdiag."""

import sys

from stepdiag.cli.command_line import main

sys.exit(main())
