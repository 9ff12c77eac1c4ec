"""What differs between operating systems has one home: python/stepdiag/platform.py, cpp/src/core/platform.*."""

import ast
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import ROOT

from stepdiag.platform import command_line, fingerprint_commands, words_of

PACKAGE = ROOT / "python" / "stepdiag"
LINUX_ALONE = PACKAGE / "linuxcnc"  # LinuxCNC is one
NAMES = {"sys.platform", "os.name", "os.uname", "platform.system", "sys.getwindowsversion"}
MODULES = {"fcntl", "grp", "msvcrt", "pwd", "resource", "termios", "winreg", "_winapi"}
# Functions that one system lacks: a Python there fails at them.
CALLS = {
    "os.fchmod",
    "os.fork",
    "os.geteuid",
    "os.getuid",
    "os.killpg",
    "os.mkfifo",
    "os.posix_fallocate",
    "os.pread",
    "os.pwrite",
    "os.set_blocking",
    "os.setsid",
    "os.startfile",
    "os.waitpid",
    "select.poll",
    "signal.SIGBREAK",
    "signal.SIGHUP",
    "signal.SIGKILL",
    "signal.pthread_sigmask",
}
# How a compiler says which system or processor it compiles for.
MACROS = re.compile(r"_WIN(32|64)|__linux|__unix|__APPLE__|__MINGW|_MSC_VER|__x86_64__|__aarch64__|__ARM_|__i386__")


def python_files() -> Iterator[Path]:
    for path in PACKAGE.rglob("*.py"):
        if path != PACKAGE / "platform.py" and LINUX_ALONE not in path.parents:
            yield path


def test_no_other_module_asks_which_system_this_is() -> None:
    found = []
    for path in python_files():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            named = []
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                named = [f"{node.value.id}.{node.attr}"]
            elif isinstance(node, ast.Import):
                named = [one.name for one in node.names]
            elif isinstance(node, ast.ImportFrom):
                named = [str(node.module), *(f"{node.module}.{one.name}" for one in node.names)]
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                named = ["/proc" for _ in re.findall(r"^/(?:proc|dev/shm|sys)/", node.value)]
            found += [
                f"{path.relative_to(ROOT)}: {name}" for name in named if name in NAMES | MODULES | CALLS | {"/proc"}
            ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("folder", ["cpp/src", "cpp/include"])
def test_no_other_source_asks_which_system_this_is(folder: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}, line {number}: {line.strip()}"
        for path in (ROOT / folder).rglob("*.[ch]*")
        if not path.name.startswith("platform")
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if line.lstrip().startswith("#") and MACROS.search(line)
    ]
    assert not found, "\n".join(found)


def test_headers_of_one_system_stay_there() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {line}"
        for path in (ROOT / "cpp").rglob("*.[ch]pp")
        if not path.name.startswith("platform")
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.match(r"#include <(unistd|fcntl|poll|windows|sched|sys/(?!types))", line)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "words",
    [["program"], ["a b", "c"], ['say "this"', "x"], ["C:\\Users\\a b\\", "--name=c d"], ["", "it's", "µ"], ["a\\\\b"]],
)
def test_words_of_a_command_line_are_those_that_it_was_made_of(words: list[str]) -> None:
    assert words_of(command_line(words)) == words


def test_a_quotation_without_an_end_is_no_command() -> None:
    with pytest.raises(ValueError, match="quotation"):
        words_of('program "one two')


def test_fingerprints_are_those_that_the_command_prints(tmp_path: Path) -> None:
    (tmp_path / "a b.csv").write_bytes(b"abc")
    (command,) = fingerprint_commands(["a b.csv"])
    done = subprocess.run(words_of(command), cwd=tmp_path, capture_output=True, check=True, text=True)
    if os.name == "nt" and not done.stdout:
        pytest.skip("Wine's certutil does nothing")
    # FIPS 180-2, appendix B.1
    assert "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad" in done.stdout
