"""Completion in interactive shells, as docs/terminal.md sets it up."""

import os
import re
import select
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import DOCS
from terminals import needs_terminal

pty = pytest.importorskip("pty")  # not on Windows
pytestmark = needs_terminal

SHELLS = {
    "bash": ["bash", "--norc", "--noprofile", "-i"],
    "zsh": ["zsh", "-f", "-i"],
    "fish": ["fish", "--no-config", "-i"],
}
PAGE = (DOCS / "terminal.md").read_text(encoding="utf-8")
# By the shell's section of the page.
SET_UP = {shell: re.search(rf"^- {shell}, .*\n\n((?:      .*\n)+)", PAGE, re.MULTILINE) for shell in SHELLS}


class Shell:
    """An interactive shell in a terminal of its own."""

    def __init__(self, command: list[str], folder: Path) -> None:
        environment = {
            "PATH": f"{folder}:{os.environ['PATH']}",
            "HOME": str(folder),
            "TERM": "xterm",
            "LC_ALL": "C.UTF-8",
        }
        self.process, self.terminal = pty.fork()
        if self.process == 0:
            os.chdir(folder)
            os.execvpe(command[0], command, environment)
        self.shown = ""

    def type(self, text: str) -> None:
        os.write(self.terminal, text.encode())

    def wait_for(self, pattern: str) -> None:
        """Fails where a minute does not show it; a second does as a rule."""
        end = time.monotonic() + 60.0
        while not re.search(pattern, self.shown):
            assert time.monotonic() < end, self.shown
            if select.select([self.terminal], [], [], 1.0)[0]:
                self.shown += os.read(self.terminal, 4096).decode(errors="replace")
        self.shown = ""

    def close(self) -> None:
        os.close(self.terminal)  # hangs up
        os.waitpid(self.process, 0)


@pytest.fixture(params=SHELLS)
def shell(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Shell]:
    name: str = request.param
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not installed")
    program = tmp_path / "stepdiag"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m stepdiag "$@"\n')
    program.chmod(0o755)
    set_up = SET_UP[name]
    assert set_up is not None
    session = Shell(SHELLS[name], tmp_path)
    for line in set_up[1].splitlines():
        session.type(f"{line.strip()}\n")
    session.type("echo re''ady\n")
    session.wait_for("ready")
    yield session
    session.close()


def test_command_and_choice_are_completed(shell: Shell) -> None:
    shell.type("stepdiag evalu\t")
    shell.wait_for("evaluate")
    shell.type("-m enh\t")
    shell.wait_for("enhanced")


def test_file_is_completed(shell: Shell, tmp_path: Path) -> None:
    (tmp_path / "a_scenario.toml").touch()
    shell.type("stepdiag check a_sce\t")
    shell.wait_for("a_scenario.toml")
