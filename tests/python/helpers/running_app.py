"""`stepdiag app` as a process."""

import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

# That of Windows, under Wine: cross/test_windows.
WINDOWS = shlex.split(os.environ.get("STEPDIAG_PROGRAM", ""))
PROGRAM = WINDOWS or [sys.executable, "-m", "stepdiag"]
PATIENCE = 30_000 * (4 if WINDOWS else 1)  # ms, for what starts a command; Wine starts Python in ten seconds


class Running:
    """`stepdiag app` on a book."""

    def __init__(self, book: Path) -> None:
        start = time.monotonic()
        command = [*PROGRAM, "app", str(book), "--no-browser"]
        self.process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, env={**os.environ, "TZ": "UTC"}
        )
        assert self.process.stdout is not None
        said = self.process.stdout.readline()
        self.took = time.monotonic() - start
        found = re.search(r"http://\S+", said)
        assert found is not None, said
        self.address = found[0]

    def end(self) -> None:
        """By Ctrl-C, which Wine passes on to consoles alone."""
        self.process.send_signal(signal.SIGTERM if WINDOWS else signal.SIGINT)
        status = self.process.wait(20.0)
        assert status == 130 or WINDOWS
