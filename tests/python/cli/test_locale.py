"""A decimal comma of the environment, or of the program around stepdiag, changes no file and no figure."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from small_scenario import SCENARIO

LOCALE = "de_DE.UTF-8"
COMMANDS = """
import locale, sys
if sys.argv[1] != "C":
    locale.setlocale(locale.LC_ALL, sys.argv[1])
    assert locale.localeconv()["decimal_point"] == ","
from stepdiag.cli import main
for words in (
    "simulate s.toml -o run.csv",
    "evaluate s.toml run.csv -o c.nc",
    "evaluate s.toml run.csv -o c.csv",
    "export c.csv --to isg -o isg.csv --incomplete",
    "export c.csv --to csv-grid -o grid.csv --step 50 --incomplete",
    "nc s.toml -o run.ngc",
    "volume c.nc",
    "report c.nc -o r.html",
    "selftest",
):
    status = main(words.split())
    assert status in (0, 3), (words, status)
"""


@pytest.fixture(scope="module")
def locales(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("locales")
    tool = shutil.which("localedef")
    if tool is None or not Path("/usr/share/i18n/locales/de_DE").exists():
        pytest.skip("no sources of locales")
    subprocess.run([tool, "-i", "de_DE", "-f", "UTF-8", str(folder / LOCALE)], check=True, capture_output=True)
    return folder


@pytest.mark.slow
def test_decimal_comma_changes_nothing(tmp_path: Path, locales: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1795252980")
    monkeypatch.setenv("LOCPATH", str(locales))
    found = {}
    for name in ("C", LOCALE):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "s.toml").write_text(SCENARIO)
        done = subprocess.run(
            [sys.executable, "-c", COMMANDS, name], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        files = {path.name: path.read_bytes() for path in sorted(folder.iterdir())}
        found[name] = (done.stdout, files)
    assert found["C"] == found[LOCALE]
