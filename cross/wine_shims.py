"""Makes packages for Windows run in Debian 12's Wine, for tests alone: what Wine lacks comes from wine_shim.c.

python cross/wine_shims.py CLANG PYTHON SITE-PACKAGES
"""

import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pefile

SHIM = Path(__file__).with_name("wine_shim.c")
# Wine 8 has no CopyFile2, which shutil of Python 3.12 and later takes where there is one.
AT_START = "import _winapi\n\nif hasattr(_winapi, 'CopyFile2'):\n    del _winapi.CopyFile2\n"
INSTEAD = "stepdiag-crt-{}-for-wine.dll"  # as long as the name of Microsoft's: it is written over that
OF_C = re.compile(r"api-ms-win-crt-(math|runtime)-l1-1-0\.dll|stepdiag-crt-(math|runtime)-for-wine\.dll")


def imports_of(path: Path) -> Iterator[tuple[str, set[str]]]:
    """The libraries that a file needs, and the functions of each."""
    binary = pefile.PE(str(path), fast_load=True)
    binary.parse_data_directories([pefile.DIRECTORY_ENTRY["IMAGE_DIRECTORY_ENTRY_IMPORT"]])
    for imported in getattr(binary, "DIRECTORY_ENTRY_IMPORT", []):
        yield imported.dll.decode(), {one.name.decode() for one in imported.imports if one.name}
    binary.close()


def main(clang: str, python: Path, packages: Path) -> None:
    compiled = subprocess.run([clang, "-E", "-P", SHIM], capture_output=True, check=True, text=True).stdout
    own = set(re.findall(r"\bstepdiag_(\w+)", compiled))

    def library(name: str, exports: list[str]) -> None:
        with tempfile.TemporaryDirectory() as folder:
            definition = Path(folder) / "exports.def"
            definition.write_text("\n".join([f"LIBRARY {name}", "EXPORTS", *exports]) + "\n")
            command = [clang, "-shared", SHIM, definition, "-ladvapi32", "-o", python / name]
            subprocess.run(command, check=True)

    (packages / "sitecustomize.py").write_text(AT_START)
    (runtime,) = python.glob("python3?*.dll")
    exported = [one.name.decode() for one in pefile.PE(str(runtime)).DIRECTORY_ENTRY_EXPORT.symbols if one.name]
    library("python3.dll", [f"{name}={runtime.stem}.{name}" for name in exported])
    library("bcryptprimitives.dll", ["ProcessPrng"])
    used: dict[str, set[str]] = defaultdict(set)
    for path in (*packages.rglob("*.pyd"), *packages.rglob("*.dll")):
        for name, functions in list(imports_of(path)):
            if (found := OF_C.fullmatch(name)) and functions & own:
                part = found[1] or found[2]
                used[part] |= functions
                path.write_bytes(path.read_bytes().replace(name.encode(), INSTEAD.format(part).encode()))
    for part, names in used.items():
        library(
            INSTEAD.format(part),
            [f"{name}=stepdiag_{name}" if name in own else f"{name}=ucrtbase.{name}" for name in sorted(names)],
        )


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
