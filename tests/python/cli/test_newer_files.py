"""A file whose format is newer than the program says so when it is refused, whatever else is new in it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import netCDF4
import pytest
from places import SHIPPED_HEADS
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.instruments.line_instrument import parse_header

NEWER = f": it is for a newer stepdiag than {sd.__version__}; install that one"


def in_toml(path: Path) -> None:
    """With a section that this version does not know."""
    text = re.sub(r"^format = 1\n", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    path.write_text(f"format = 2\n{text}\n[not_yet_known]\nkey = 1\n", encoding="utf-8")


def in_leading_line(path: Path) -> None:
    """With a column that this version does not know. Measurements are written without the line."""
    text = path.read_text(encoding="utf-8")
    stated = re.compile(r"^(# format=stepdiag [a-z ]+) 1$", re.MULTILINE)
    text = stated.sub(r"\1 2", text) if stated.search(text) else f"# format=stepdiag measurement 2\n{text}"
    path.write_text(re.sub(r"^(\w+,)", r"not_yet_known,\1", text, flags=re.MULTILINE), encoding="utf-8")


def in_attribute(path: Path) -> None:
    """With the checksum left out, for it would have to be made anew."""
    with netCDF4.Dataset(path, "a") as file:
        file.format = re.sub(r"\d+$", "10", file.format)  # as a text, 10 is less than 9
        del file.sha256


def in_first_line(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"stepdiag checkpoint 1\n", b"stepdiag checkpoint 2\n"))


def in_header(path: Path) -> None:
    path.write_text('{"record":"header","format":"stepdiag raw readings","version":4,"not_yet_known":0}\n')


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        Path("scenario.toml").write_text(SCENARIO)
        Path("study.toml").write_text('[study]\nscenario = "scenario.toml"\n[grid]\nplan.steps = [5, 6]\n')
        shutil.copy(SHIPPED_HEADS / "three_beams.toml", "head.toml")
        for command in (
            "simulate scenario.toml -o run.csv",
            "simulate scenario.toml -o run.nc",
            "evaluate scenario.toml run.csv -o a.csv",
            "evaluate scenario.toml run.csv -o b.nc",
            "compare a.csv b.nc -o c.csv",
            "compare a.csv b.nc -o c.nc",
            "uncertainty scenario.toml -o u.nc",
            "uncertainty scenario.toml -o u.csv",
        ):
            assert main(command.split()) == 0
        sd.read_scenario("scenario.toml").machine().errors.write("map.csv")
        Path("raw.jsonl").touch()
        Path("saved.checkpoint").write_bytes(b"stepdiag checkpoint 1\n")
    return folder


@pytest.mark.parametrize(
    ("file", "newer", "command", "place"),
    [
        ("scenario.toml", in_toml, "check scenario.toml", "scenario.toml: format: expected 1, got 2"),
        ("scenario.toml", in_toml, "simulate scenario.toml -o new.csv", "scenario.toml: format: expected 1, got 2"),
        ("scenario.toml", in_toml, "check study.toml", "scenario.toml: format: expected 1, got 2"),
        ("head.toml", in_toml, "head check head.toml", "head.toml: format: expected 1, got 2"),
        ("study.toml", in_toml, "study study.toml -o new.nc", "study.toml: format: expected 1, got 2"),
        ("run.csv", in_leading_line, "check run.csv", 'run.csv, line 1: format: expected "stepdiag measurement 1"'),
        ("run.csv", in_leading_line, "evaluate scenario.toml run.csv -o new.csv", "run.csv, line 1: format: expected"),
        ("run.nc", in_attribute, "check run.nc", 'run.nc: attribute format: expected "stepdiag measurement 1"'),
        ("map.csv", in_leading_line, "check map.csv", 'map.csv, line 1: format: expected "stepdiag error map 1"'),
        (
            "a.csv",
            in_leading_line,
            "check a.csv",
            'a.csv, line 1: format: expected "stepdiag error map 1" or "stepdiag',
        ),
        ("a.csv", in_leading_line, "export a.csv --to linuxcnc-kins -o new.csv", "a.csv, line 1: format: expected"),
        (
            "b.nc",
            in_attribute,
            "report b.nc",
            'b.nc: attribute format: expected "stepdiag calibration 1", got "stepdiag',
        ),
        ("c.csv", in_leading_line, "plot c.csv -o new.png", 'c.csv: format: expected "stepdiag comparison 1", got'),
        ("c.nc", in_attribute, "plot c.nc -o new.png", 'c.nc: attribute format: expected "stepdiag comparison 1", got'),
        ("u.csv", in_leading_line, "plot u.csv -o new.png", 'u.csv: format: expected "stepdiag uncertainty 1", got'),
        (
            "u.nc",
            in_attribute,
            "plot u.nc -o new.png",
            'u.nc: attribute format: expected "stepdiag uncertainty 1", got',
        ),
        ("u.nc", in_attribute, "report b.nc --uncertainty u.nc -o new.html", "u.nc: attribute format: expected"),
        ("raw.jsonl", in_header, "check raw.jsonl", "raw.jsonl, line 1: version: expected 3 or less, got 4"),
        (
            "saved.checkpoint",
            in_first_line,
            "uncertainty scenario.toml -n 1000 --checkpoint saved.checkpoint --resume",
            "saved.checkpoint: expected \"stepdiag checkpoint 1\", got 'stepdiag checkpoint 2'",
        ),
    ],
)
def test_file_of_a_newer_format_is_refused_in_one_line_that_says_so(
    file: str,
    newer: Callable[[Path], None],
    command: str,
    place: str,
    made: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    newer(Path(file))
    capsys.readouterr()
    assert main(command.split()) == 2
    said = capsys.readouterr().err
    assert place in said
    assert said.endswith(f"{NEWER}\n")
    assert said.count("\n") == 1
    assert not list(Path().glob("new.*"))


def test_adapter_of_a_newer_protocol_is_refused_with_the_reason() -> None:
    with pytest.raises(ValueError, match="newer stepdiag") as refusal:
        parse_header(b'{"stepdiag_lines": 2, "channels": ["distance_mm"]}')
    assert str(refusal.value).endswith(NEWER)


@pytest.mark.parametrize(("given", "shown"), [("0", "0"), ('"2"', '"2"'), ("true", "true"), ("1.0", "1.0")])
def test_format_that_is_no_known_number_is_no_newer_one(
    given: str, shown: str, made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(f"format = {given}\n{SCENARIO}")
    assert main(["check", str(file)]) == 2
    assert f"scenario.toml: format: expected the number 1, got {shown}" in capsys.readouterr().err


def test_format_1_is_what_a_file_without_it_has(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    runs = []
    for text in (SCENARIO, f"format = 1\n{SCENARIO}"):
        file.write_text(text)
        runs.append(sd.read_scenario(file))
    assert runs[0].known.keys == runs[1].known.keys
