"""A Windows program at a console of Wine's, which a pseudo-terminal shows: colours, and Ctrl-C.

STEPDIAG_CONSOLE is the program with its first arguments; cross/test_windows runs this."""

import os
import pty
import select
import shlex
import shutil
import signal
import time
from pathlib import Path

PROGRAM = shlex.split(os.environ["STEPDIAG_CONSOLE"])
EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "uncertainty.toml"
PATIENCE = 120.0  # s


def at_console(arguments: list[str], interrupt_after: bytes | None = None) -> tuple[int, str]:
    """The status of a command, and what the console showed; Ctrl-C is pressed when that appears."""
    child, terminal = pty.fork()
    if child == 0:
        os.execvp(PROGRAM[0], [*PROGRAM, *arguments])
    shown, end = b"", time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if not select.select([terminal], [], [], 1.0)[0]:
            continue
        try:
            shown += os.read(terminal, 65536)
        except OSError:  # the program has ended
            break
        if interrupt_after is not None and interrupt_after in shown:
            os.write(terminal, b"\x03")
            interrupt_after = None
    else:
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    os.close(terminal)
    return os.waitstatus_to_exitcode(status), shown.decode()


def test_mistake_is_shown_in_colour() -> None:
    status, shown = at_console(["evaluate"])
    assert status == 2
    assert "error:" in shown
    assert "\x1b[31m" in shown, "red"


def test_ctrl_c_ends_with_one_line_and_what_was_computed_is_kept(tmp_path: Path) -> None:
    shutil.copy(EXAMPLE, tmp_path)
    command = ["uncertainty", str(tmp_path / EXAMPLE.name), "-n", "1e7", "-o", str(tmp_path / "u.csv")]
    status, shown = at_console(command, interrupt_after=b"k/10.0M")
    assert status == 130
    assert "stepdiag: interrupted: " in shown
    assert (tmp_path / "u.csv.checkpoint").is_file()
    assert not (tmp_path / "u.csv").exists()
