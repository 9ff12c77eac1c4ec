"""One list of blocks is the report of a command, its key in the JSON object, and HTML."""

import json
from pathlib import Path
from typing import Any

import pytest
from json_objects import printed
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.presentation.blocks import (
    Block,
    FigureBlock,
    HeadingBlock,
    NoteBlock,
    RowBlock,
    TableBlock,
    VerdictBlock,
    data_of,
    text_of,
)
from stepdiag.presentation.page.html import html_of

BLOCKS: list[Block] = [
    VerdictBlock("machine", "not within", "not within 20 µm", "the largest error is above 21 µm", ("a < b", "c")),
    HeadingBlock("figures"),
    RowBlock("rms error", "3 µm"),
    TableBlock((("EXX", "1.2"), ("EYY", "13")), ("", "µm"), "largest"),
    FigureBlock("figure-EXX", "EXX over X"),
    NoteBlock("at X 80", indented=True),
]


def test_text_has_a_line_for_each_part() -> None:
    assert list(text_of(BLOCKS)) == [
        "machine: not within 20 µm: the largest error is above 21 µm",
        "not within because a < b",
        "not within because c",
        "",
        "figures",
        "rms error: 3 µm",
        "largest:",
        "        µm",
        "  EXX  1.2",
        "  EYY   13",
        "  at X 80",
    ]


def test_html_is_escaped_and_has_whole_sentences() -> None:
    page = html_of(BLOCKS)
    assert "<strong>Not within 20 µm.</strong> The largest error is above 21 µm." in page
    assert "<li>a &lt; b</li>" in page
    assert "<dt>Rms error</dt><dd>3 µm.</dd>" in page
    assert page.count("<td>") == 2
    assert "EXX over X" not in page, "a page draws its own pictures"


def test_data_name_the_kind_and_leave_out_how_a_terminal_aligns() -> None:
    found = json.loads(json.dumps(data_of(BLOCKS)))
    assert [block["kind"] for block in found] == ["verdict", "heading", "row", "table", "figure", "note"]
    assert found[0]["because"] == ["a < b", "c"]
    assert found[3] == {
        "kind": "table",
        "rows": [["EXX", "1.2"], ["EYY", "13"]],
        "columns": ["", "µm"],
        "title": "largest",
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("evaluation", "evaluate scenario.toml run.csv -o again.nc"),
        ("report", "report c.nc"),
        ("volume", "volume c.nc --limit 20"),
        ("comparison", "compare c.nc d.nc"),
        ("positions", "positions c.nc"),
        ("observation", "observe scenario.toml --steps 5"),
        ("verification", "verify c.nc scenario.toml other.csv"),
        ("recheck", "recheck c.nc scenario.toml other.csv"),
    ],
)
def test_report_of_each_command_is_in_its_object(
    name: str, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    for run, calibration, seed in (("run.csv", "c.nc", 3), ("other.csv", "d.nc", 4)):
        sd.simulate(sd.parse_scenario(SCENARIO.replace("seed = 3", f"seed = {seed}"))).write(run)
        assert main(["evaluate", "scenario.toml", run, "-o", calibration]) == 0
    capsys.readouterr()
    status = main(command.split())
    lines = capsys.readouterr().out.splitlines()
    said = printed(name, capsys, *command.split(), status=status)["report"]
    assert list(text_of(_block(one) for one in said)) != []
    words = " ".join(lines)
    for block in said:
        for text in (block.get("text"), block.get("headline"), block.get("title")):
            assert text is None or text in words


def _block(data: dict[str, Any]) -> Block:
    kinds = {"heading": HeadingBlock, "verdict": VerdictBlock, "row": RowBlock, "table": TableBlock, "note": NoteBlock}
    return kinds[data["kind"]](**{key: value for key, value in data.items() if key != "kind"})  # type: ignore[no-any-return, arg-type]
