"""A page as PDF, printed by Chromium without a screen."""

import shutil
import subprocess
import tempfile
from functools import partial
from pathlib import Path
from typing import Final

from stepdiag._core import InvalidArgument
from stepdiag.interruption import at_end
from stepdiag.io.whole_files import write_whole
from stepdiag.platform import is_administrator, kill_descendants

BROWSERS: Final = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
LONGEST: Final = 120  # seconds; a page takes a few
# The virtual time that scripts of the page get before it is printed, milliseconds.
BUDGET: Final = 20_000


def find_browser() -> str:
    """The path of a Chromium. Raises InvalidArgument if there is none."""
    for name in BROWSERS:
        found = shutil.which(name)
        if found is not None:
            return found
    raise InvalidArgument(
        f"a PDF needs Chromium, and none of {', '.join(BROWSERS)} is on the PATH: write a page (.html), and print it "
        "from a browser"
    )


def write_pdf(page: str, path: Path) -> None:
    """Print a page into a file. Raises InvalidArgument if there is no Chromium, or it fails."""
    browser = find_browser()
    with tempfile.TemporaryDirectory(prefix="stepdiag-") as folder, at_end(partial(_abandon, folder)):
        source, printed = Path(folder) / "report.html", Path(folder) / "report.pdf"
        source.write_text(page, encoding="utf-8")
        command = [
            browser,
            "--headless",
            f"--user-data-dir={folder}/profile",
            "--no-first-run",
            "--disable-background-networking",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--enable-unsafe-swiftshader",
            "--no-pdf-header-footer",
            f"--virtual-time-budget={BUDGET}",
            f"--print-to-pdf={printed}",
            *(["--no-sandbox"] if is_administrator() else []),
            f"{source.as_uri()}#print",
        ]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise InvalidArgument(f"{path}: {browser} could not print it: {error}") from None
        if done.returncode != 0 or not printed.is_file() or not printed.read_bytes().startswith(b"%PDF-"):
            said = (done.stderr.strip().splitlines() or ["it wrote nothing"])[-1]
            raise InvalidArgument(f"{path}: {browser} could not print it: {said}")
        write_whole(path, printed.read_bytes())


def _abandon(folder: str) -> None:
    """For an interruption: end the browser and remove its files."""
    kill_descendants()
    shutil.rmtree(folder, ignore_errors=True)
