"""Objects of --json with hostile names of files: one line, of its schema, and nothing that a terminal obeys."""

import os
from pathlib import Path

import pytest
from json_objects import checked
from small_scenario import SCENARIO

from stepdiag.cli import main

# A surrogate is how Python shows a byte that is no UTF-8.
HOSTILE = {
    "escapes": "\x1b]0;owned\x07\x1b[31m",
    "turned": "\u202egnp.exe\u2066",
    "quotes": '"}],\\"\'`$(id)',
    "markup": "<script>alert(1)<|script>&amp;",
    "lines": "a\nb\r\nc\u2028d\u2029e",
    "not UTF-8": "\udcff\udcfe\udcc3",
    "long": "x" * 200,
    "outside the BMP": "\U0001f600\U000e0041",
    "number": "1e999",
}

ACTING = ("\x1b", "\x07", "\u202e", "\u2028")


@pytest.mark.slow
@pytest.mark.parametrize("kind", HOSTILE)
def test_names_and_texts_stay_texts(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = HOSTILE[kind]
    if os.name == "nt" and (set(text) & set('<>:"/\\|?*\n\x1b') or kind == "not UTF-8"):
        pytest.skip("no name of a file on Windows")
    if os.name == "nt" and len(str(tmp_path / text)) > 250:
        pytest.skip("a path that Windows takes where its owner allows it")
    scenario, run, calibration = (f"{text}{ending}" for ending in (".toml", "-run.csv", ".nc"))
    Path(scenario).write_text(SCENARIO)
    assert main(["simulate", scenario, "-o", run]) == 0
    assert main(["evaluate", scenario, run, "-o", calibration]) in (0, 3)
    for name, words in (
        ("evaluation", ["evaluate", scenario, run, "-o", calibration]),
        ("check", ["check", scenario, run, calibration]),
        ("volume", ["volume", calibration]),
        ("comparison", ["compare", calibration, calibration]),
        ("observation", ["observe", scenario]),
    ):
        capsys.readouterr()
        assert main([*words, "--json"]) in (0, 3)
        said = capsys.readouterr()
        checked(name, said.out)
        assert said.out.isascii()
        assert not any(mark in said.err for mark in ACTING)
    missing = main(["check", f"{text}.missing", "--json"])
    assert missing == 2
    said = capsys.readouterr()
    assert said.out.isascii()
    assert not any(mark in said.err for mark in ACTING)
