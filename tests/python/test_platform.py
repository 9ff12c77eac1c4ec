"""What differs between operating systems has one home: python/stepdiag/platform.py, cpp/src/core/platform.*."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import ROOT

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
