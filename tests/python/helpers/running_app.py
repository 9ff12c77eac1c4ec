"""`stepdiag app` as a process."""

import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

# That of another system, under Wine: cross/test_windows.
PROGRAM = shlex.split(os.environ.get("STEPDIAG_PROGRAM", "")) or [sys.executable, "-m", "stepdiag"]


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

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(20.0)
