"""Texts that came from somewhere do not act where they go: on a page, in a table, on a terminal."""

import errno
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from small_scenario import SCENARIO

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.display import visible
from stepdiag.exporting.formats import FORMATS

HOSTILE = "\x1b[31mred\x07\x00\u202egnp.exe\u2066\x9b2J"
UNSEEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


@pytest.fixture
def calibrated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(SCENARIO)
    assert main(["simulate", "scenario.toml", "-o", "run.csv"]) == 0
    assert main(["evaluate", "scenario.toml", "run.csv", "-o", "c.csv"]) in (0, 3)
    return tmp_path


def hostile_copy() -> Path:
    """The calibration with escapes in what is said of how it was made. Its checksum is that of other bytes."""
    lines = Path("c.csv").read_text().splitlines(keepends=True)
    keys = ("# date=", "# program=", "# options=", "# run_sha256=", "# scenario_sha256=")
    made = [line.rstrip("\n") + "\x1b[31m\u202e\n" if line.startswith(keys) else line for line in lines]
    Path("hostile.csv").write_text("".join(made))
    return Path("hostile.csv")


def test_texts_of_the_command_line_do_not_act_on_a_page(calibrated: Path) -> None:
    customer = HOSTILE.replace("\x00", "")  # no argument of a process can have it
    assert main(["report", "c.csv", "--customer", customer, "-o", "page.html"]) in (0, 3)
    page = Path("page.html").read_text()
    assert "\\x1b[31mred" in page
    own = page.replace(max(re.findall(r"<script>.*?</script>", page, re.DOTALL), key=len), "")  # Plotly's
    assert not UNSEEN.search(own)


@pytest.mark.parametrize("to", [to for to in FORMATS if to != "position-error"])
def test_texts_of_a_calibration_do_not_act_in_a_table(calibrated: Path, to: str) -> None:
    hostile = hostile_copy()
    kind = FORMATS[to].file
    out = Path("table" if kind is None else f"table{kind.endings[0]}")
    assert main(["export", str(hostile), "--to", to, "-o", str(out), "--incomplete"]) in (0, 3)
    written = [
        path for path in calibrated.rglob("*") if path.is_file() and "table" in str(path.relative_to(calibrated))
    ]
    assert written
    for path in written:
        assert not UNSEEN.search(path.read_text()), path


def test_what_is_seen_stays() -> None:
    text = "Grüße, 12 µm\tà côté\n中文 עברית"
    assert visible(text, lines=True) == text
    assert visible("a\nb") == "a\\nb"
    assert not UNSEEN.search(visible(HOSTILE, lines=True))


def test_full_standard_output_is_named(calibrated: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "stepdiag", "report", "c.csv"]
        plain = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, env=buffered)
    assert plain.returncode == 2
    assert plain.stderr.startswith(
        f"stepdiag: error: standard output: {os.strerror(errno.ENOSPC)}: what the command says"
    )


def test_set_points_that_are_read_back_are_targets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Five targets, read back up to 0.1 µm apart."""
    nominal = [0.0, 100.0, 200.0, 300.0, 400.0]
    jitter = [0.00005, -0.00004, 0.00003, -0.00002, 0.00001, -0.00005]
    rows, plain = ["target_mm,direction,cycle,deviation_um"], ["target_mm,direction,cycle,deviation_um"]
    count = 0
    for cycle in range(1, 6):
        for target in nominal:
            for direction in "+-":
                off = jitter[count % len(jitter)]
                value = 0.5 * target / 100.0 + (0.3 if direction == "+" else 0.0) + 0.01 * (count * 7 % 11)
                rows.append(f"{target + off:.5f},{direction},{cycle},{value:.3f}")
                plain.append(f"{target:.5f},{direction},{cycle},{value:.3f}")
                count += 1
    for name, content in (("read.csv", rows), ("plain.csv", plain)):
        (tmp_path / name).write_text("\n".join(content) + "\n")
    read, exact = (sd.positions.read_positions(tmp_path / name) for name in ("read.csv", "plain.csv"))
    assert read.targets == exact.targets == tuple(nominal)
    assert read.deviations == exact.deviations
    assert read.apart == pytest.approx(5e-5)
    assert exact.apart == 0.0
    assert main(["positions", str(tmp_path / "read.csv")]) == 0
    assert "set-points up to 0.05 µm from their target" in capsys.readouterr().out
    (tmp_path / "twice.csv").write_text("\n".join([*rows, "100.00002,+,3,1.0"]) + "\n")
    with pytest.raises(sd.InvalidArgument, match="line 52: target 100 mm, direction \\+, cycle 3 is given twice"):
        sd.positions.read_positions(tmp_path / "twice.csv")
