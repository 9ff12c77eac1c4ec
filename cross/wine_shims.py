"""Makes packages for Windows run in Debian 12's Wine, for tests alone: what Wine lacks comes from wine_shim.c.

python cross/wine_shims.py CLANG PYTHON SITE-PACKAGES
"""

import subprocess
import sys
from pathlib import Path

import pefile

SHIM = Path(__file__).with_name("wine_shim.c")
RUNTIME = "api-ms-win-crt-runtime-l1-1-0.dll"
INSTEAD = "stepdiag-crt-runtime-for-wine.dll"  # as long: it is written over the other
OWN = {"feholdexcept", "fesetenv"}


def main(clang: str, python: Path, packages: Path) -> None:
    def library(name: str, exports: list[str]) -> None:
        definition = python / f"{name}.def"
        definition.write_text("\n".join([f"LIBRARY {name}", "EXPORTS", *exports]) + "\n")
        command = [clang, "-shared", SHIM, definition, "-ladvapi32", "-o", python / name]
        subprocess.run(command, check=True)

    runtime = pefile.PE(str(python / "python311.dll")).DIRECTORY_ENTRY_EXPORT.symbols
    library("python3.dll", [f"{one.name.decode()}=python311.{one.name.decode()}" for one in runtime if one.name])
    library("bcryptprimitives.dll", ["ProcessPrng"])
    used: set[str] = set()
    for path in packages.rglob("hdf5-*.dll"):
        binary = pefile.PE(str(path), fast_load=True)
        binary.parse_data_directories([pefile.DIRECTORY_ENTRY["IMAGE_DIRECTORY_ENTRY_IMPORT"]])
        for imported in binary.DIRECTORY_ENTRY_IMPORT:
            if imported.dll.decode() in (RUNTIME, INSTEAD):
                used |= {one.name.decode() for one in imported.imports}
        binary.close()
        path.write_bytes(path.read_bytes().replace(RUNTIME.encode(), INSTEAD.encode()))
    forwards = [f"{name}=stepdiag_{name}" if name in OWN else f"{name}=ucrtbase.{name}" for name in sorted(used)]
    library(INSTEAD, forwards)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
