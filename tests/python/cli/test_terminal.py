"""Colours and widths on a terminal; files and pipes get plain text."""

import io
import os
import re
import select
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from small_scenario import SCENARIO
from terminals import needs_terminal

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.cli.at_machine.acquire import acquire
from stepdiag.cli.evaluate import evaluate
from stepdiag.cli.options import Grouped
from stepdiag.cli.terminal import LONGEST, WIDEST, say
from stepdiag.cli.uncertainty import uncertainty

ANSI = re.compile(r"\x1b\[[0-9;]*m")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def no_wishes(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR", "COLUMNS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")


def said(monkeypatch: pytest.MonkeyPatch, line: str, stream: io.StringIO | None = None) -> str:
    shown = Terminal() if stream is None else stream
    with monkeypatch.context() as patched:
        patched.setattr(sys, "stdout", shown)
        say(line)
    return shown.getvalue()


@pytest.mark.parametrize(
    ("line", "word"),
    [
        ("fit: accepted: the readings agree", "accepted"),
        ("fit: doubtful: the readings scatter", "doubtful"),
        ("fit: REJECTED: the readings contradict", "REJECTED"),
        ("calibration: adjustment, 21 of 21 parameters, fit rejected", "rejected"),
        ("warning: c.csv: the fit is rejected: do not use it", "rejected"),
        ("rejected because the readings scatter", "rejected"),
        ("warning: 3 points lack a reading", "warning:"),
        ("run.csv: warning: 3 points lack a reading", "warning:"),
        ("stepdiag: error: run.csv: cannot be read", "error:"),
        ("machine: not within 20 µm", "not within"),
    ],
)
def test_verdicts_and_warnings_have_a_colour(monkeypatch: pytest.MonkeyPatch, line: str, word: str) -> None:
    shown = said(monkeypatch, line)
    assert re.search(rf"\x1b\[[0-9;]*m{word}\x1b\[0m", re.sub(r"(m)\x1b\[1m", r"\1", shown)), repr(shown)
    assert ANSI.sub("", shown) == f"{line}\n"


def test_rest_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    for line in ("method: adjustment", "  positioning       1.18 µm    (EXX at 400 mm)", "the fit of a head"):
        assert said(monkeypatch, line) == f"{line}\n"


def test_file_gets_the_line_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    line = "fit: accepted: " + "the readings agree with each other " * 10
    assert said(monkeypatch, line, io.StringIO()) == f"{line}\n"


def test_controls_are_shown_escaped_everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    line = "method: \x1b[31mred\x1b[0m\rbell\x07 \x9b2J \u202etxt\ttab"
    for stream in (io.StringIO(), Terminal()):
        shown = said(monkeypatch, line, stream)
        assert shown == "method: \\x1b[31mred\\x1b[0m\\rbell\\x07 \\x9b2J \\u202etxt\\ttab\n"


@pytest.mark.parametrize("command", ["check", "report", "compare", "evaluate"])
def test_no_command_lets_the_controls_of_a_file_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    assert main(["simulate", "scenario.toml", "-o", "run.csv"]) == 0
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", "c.csv"]) == 0
    for path in map(Path, ("c.csv", "run.csv")):
        text = path.read_text().replace("method=adjustment", "method=\x1b[31mX\x1b]0;title\x07", 1)
        path.write_text(text.replace("\nppp,", "\np\x1b[2Jp,", 1))
    commands = {"evaluate": ["scenario.toml", "run.csv", "-o", "d.csv"], "compare": ["c.csv", "c.csv"]}
    main([command, *commands.get(command, ["c.csv"])])
    shown = "".join(capsys.readouterr())
    assert "\\x1b[" in shown
    assert not set(shown) & {"\x1b", "\x07"}


@pytest.mark.parametrize("arguments", [["check"], ["check", "--json"], ["report"]])
def test_message_about_a_long_line_is_short(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    path = tmp_path / "map.csv"
    path.write_text(f"parameter,position_mm,value,unit,standard_uncertainty\nEXX,{'A' * 10**6},1,um,\n")
    assert main([*arguments, str(path)]) == 2
    out, err = capsys.readouterr()
    assert "line 2" in err
    assert " … " in err
    assert len(out) + len(err) < 3 * LONGEST


@pytest.mark.parametrize(
    ("environment", "is_terminal", "coloured"),
    [
        ({}, True, True),
        ({}, False, False),
        ({"NO_COLOR": "1"}, True, False),
        ({"NO_COLOR": ""}, True, True),
        ({"FORCE_COLOR": "1"}, False, True),
        ({"FORCE_COLOR": ""}, False, False),
        ({"NO_COLOR": "1", "FORCE_COLOR": "1"}, True, False),
        ({"TERM": "dumb"}, True, False),
        ({"TERM": "dumb", "FORCE_COLOR": "1"}, True, True),
    ],
)
def test_colour_is_as_the_environment_wishes(
    monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], is_terminal: bool, coloured: bool
) -> None:
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    shown = said(monkeypatch, "fit: accepted", Terminal() if is_terminal else io.StringIO())
    assert bool(ANSI.search(shown)) == coloured


@pytest.mark.parametrize("columns", [40, 80, 100, 250])
def test_sentence_fits_the_terminal_and_a_table_stays(monkeypatch: pytest.MonkeyPatch, columns: int) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    sentence = "note: " + " ".join(["word"] * 60)
    lines = said(monkeypatch, sentence).splitlines()
    assert max(map(len, lines)) <= min(columns, WIDEST)
    assert " ".join(line.strip() for line in lines) == sentence
    assert all(line.startswith("  ") for line in lines[1:])
    row = "  npp    " + "101.9(30)  " * 12
    assert said(monkeypatch, row) == f"{row}\n"


def in_terminal(*arguments: str) -> str:
    """What a command writes to a real terminal."""
    master, slave = os.openpty()
    environment = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "FORCE_COLOR")}
    process = subprocess.Popen(
        [sys.executable, "-m", "stepdiag", *arguments], stdout=slave, stderr=slave, env=environment | {"TERM": "xterm"}
    )
    os.close(slave)
    shown = b""
    while select.select([master], [], [], 60.0)[0]:
        try:
            part = os.read(master, 4096)
        except OSError:  # Linux: the other end is closed
            break
        if not part:
            break
        shown += part
    process.wait(60.0)
    os.close(master)
    return shown.decode()


@needs_terminal
def test_command_has_colours_on_a_terminal_and_none_in_a_pipe(tmp_path: Path) -> None:
    scenario, run = tmp_path / "scenario.toml", tmp_path / "run.csv"
    scenario.write_text(SCENARIO)
    sd.simulate(sd.read_scenario(scenario)).write(run)
    arguments = ("check", str(scenario), str(run))
    shown = in_terminal(*arguments)
    piped = subprocess.run([sys.executable, "-m", "stepdiag", *arguments], capture_output=True, text=True, check=True)
    assert "\x1b" not in piped.stdout
    assert ANSI.search(shown)
    plain = ANSI.sub("", shown).replace("\r\n", "\n")
    assert " ".join(plain.split()) == " ".join(piped.stdout.split())


@needs_terminal
def test_json_has_no_colour_on_a_terminal(tmp_path: Path) -> None:
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(SCENARIO)
    assert "\x1b" not in in_terminal("check", str(scenario), "--json")


def test_package_is_a_command() -> None:
    ended = subprocess.run([sys.executable, "-m", "stepdiag", "--version"], capture_output=True, text=True, check=True)
    assert ended.stdout == f"stepdiag {sd.__version__}\n"


@pytest.mark.parametrize("command", [evaluate, uncertainty, acquire], ids=lambda command: command.name)
def test_every_option_of_a_long_help_is_in_a_group(command: Grouped) -> None:
    grouped = [name for names in command.groups.values() for name in names]
    options = [param.name for param in command.params if isinstance(param, click.Option)]
    assert sorted(grouped) == sorted(filter(None, options))
    shown = CliRunner().invoke(command, ["--help"]).output
    for param in command.params:
        if isinstance(param, click.Option):
            assert len(re.findall(rf"^  {re.escape(param.opts[0])}\b", shown, re.MULTILINE)) == 1
    titles = re.findall(r"^([A-Z][\w ]+):$", shown, re.MULTILINE)
    assert titles == [*command.groups, "Options"]
