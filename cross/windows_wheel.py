"""Packs dist/stepdiag-*-win_amd64.whl of an extension that was built for Windows.

    python cross/windows_wheel.py EXTENSION LIBRARY LICENCES

scikit-build-core makes the metadata; it cannot build for another system.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from scikit_build_core.build import prepare_metadata_for_build_wheel

ROOT = Path(__file__).resolve().parents[1]


def main(extension: Path, library: Path, licences: Path) -> None:
    (tag,) = re.findall(r"\.(cp\d+)-(win_amd64)\.pyd$", extension.name)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        metadata = folder / prepare_metadata_for_build_wheel(name)
        lines = (metadata / "WHEEL").read_text().splitlines()
        kept = [line for line in lines if line and not line.startswith("Tag:")]
        (metadata / "WHEEL").write_text("\n".join([*kept, f"Tag: {tag[0]}-{tag[0]}-{tag[1]}"]) + "\n")
        listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "python/stepdiag"]
        for file in subprocess.run(listed, cwd=ROOT, capture_output=True, check=True, text=True).stdout.split("\0"):
            if file:
                place = folder / Path(file).relative_to("python")
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / file, place)
        shutil.copy(extension, folder / "stepdiag" / extension.name)
        shutil.copy(library, folder / "stepdiag")  # where Windows looks for what an extension links
        shutil.copytree(licences, metadata / "licenses", dirs_exist_ok=True)
        (ROOT / "dist").mkdir(exist_ok=True)
        subprocess.run([sys.executable, "-m", "wheel", "pack", name, "-d", str(ROOT / "dist")], check=True)


if __name__ == "__main__":
    main(*(Path(one) for one in sys.argv[1:]))
