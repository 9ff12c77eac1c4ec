"""A night with nobody there: heads that stay installed, a program that never stops, a recheck, a line in the book."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from acquiring import Controller

from stepdiag.acquisition.live_state import control_path, live_path, read_live
from stepdiag.cli import main
from stepdiag.scenario.description import read_scenario
from stepdiag.twin.server import Twin

SCENARIO = """
[volume]
x_mm = 80.0
y_mm = 60.0
z_mm = 50.0
[machine]
chain = "[w X' b Y Z t]"
[machine.random]
seed = 7
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
scale_lines = ["p00", "0p0", "00p"]
steps = 3
[head]
layout = "multi_beam"
beam_offsets_mm = [[15.0, 0.0], [-7.5, 13.0], [-7.5, -13.0]]
[noise]
distance_um = 0.01
seed = {seed}
[plausible.inputs]
reading_s = {{inner = [0.0, 60.0]}}
"""
FAST = ("--settle-count", "2", "--average", "1", "--interval-ms", "0")


@pytest.mark.parametrize("seed", [4])
def test_night(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], seed: int) -> None:
    monkeypatch.chdir(tmp_path)
    Path("vmc.toml").write_text(SCENARIO.format(seed=3))
    assert main(["simulate", "vmc.toml", "-o", "first.csv"]) == 0
    Path("night.toml").write_text(SCENARIO.format(seed=seed))
    assert main(["book", "new", "VMC", "--book", "book"]) == 0
    for name in ("vmc.toml", "first.csv"):
        assert main(["book", "add", name, "--machine", "VMC", "--book", "book"]) == 0
    of_book = ["--machine", "VMC", "--book", "book"]
    assert main(["evaluate", *of_book]) in (0, 3)
    assert main(["nc", "night.toml", "--no-stops", "-o", "night.ngc"]) == 0
    assert "\nM0\n" not in Path("night.ngc").read_text()
    assert main(["book", "add", "night.toml", *of_book]) == 0
    capsys.readouterr()
    described = read_scenario("night.toml")
    with Twin(described) as twin:
        command = [sys.executable, "-m", "stepdiag", "acquire", *of_book, "night.toml", "--source", twin.source]
        process = subprocess.Popen(
            [*command, "--trigger", "tcp://127.0.0.1:0", *FAST, "--watched", "-o", "night.csv"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        host, _, port = process.stdout.readline().split()[2].partition(":")
        with Controller(described, twin.address, (host, int(port))) as controller:
            controller.run()
        said, _ = process.communicate(timeout=60.0)
        assert process.returncode == 0, said
    raw = Path("book/machines/VMC/runs/night.raw.jsonl")
    state = read_live(live_path(raw))
    assert state is not None
    assert (state["doing"], state["readings"], state["lost"], state["failure"]) == ("ended", state["planned"], 0, "")
    assert control_path(raw).exists()
    assert main(["recheck", *of_book, "night.toml", "night.csv", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found
    assert main(["book", "show", "VMC", "--book", "book"]) == 0
    assert "night.csv" in capsys.readouterr().out
