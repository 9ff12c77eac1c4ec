"""The raw file outlasts whatever ends an acquisition, which goes on where it stopped."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import acquiring
import numpy as np
import pytest
from acquiring import Controller, Listener, acquire_through, fast, points_of, scenario
from hypothesis import given, settings
from hypothesis import strategies as st

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.acquire import raw_path
from stepdiag.acquisition.raw_file import RawFile, read_raw
from stepdiag.acquisition.run_from_raw import measurement_of, set_back
from stepdiag.acquisition.tcp_trigger import TcpTrigger
from stepdiag.acquisition.triggers import Stopped
from stepdiag.io.data_files import read_measurement
from stepdiag.presentation.file_check import examine
from stepdiag.scenario.description import Scenario, simulate_scenario
from stepdiag.scenario.order_of_run import Visit
from stepdiag.twin.server import Twin

CHANNELS = ("d1", "d2", "d3")


def readings(path: Path) -> list[str]:
    """The rows of a run without the time of day."""
    rows = [row.split(",") for row in path.read_text().splitlines()]
    return [",".join(field for name, field in zip(rows[0], row, strict=True) if name != "time_s") for row in rows]


class Stopping(TcpTrigger):
    """Stops after so many readings, as it does when nobody asks on."""

    def __init__(self, readings: int) -> None:
        super().__init__()
        self._left = readings

    def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
        if self._left == 0:
            raise Stopped("nobody asked for it")
        self._left -= 1
        return super().wait(visit, index, nominal)


def stop_after(described: Scenario, twin: Twin, output: Path, end: int, *, begin: int = 0, **others: Any) -> None:
    """An acquisition that nobody asks on."""
    with pytest.raises(Stopped, match="nobody asked for it"):
        acquire_through(described, twin, output, begin=begin, end=end, trigger=Stopping(end - begin), **others)


@pytest.fixture(scope="module")
def acquired(tmp_path_factory: pytest.TempPathFactory) -> Path:
    described, folder = scenario(), tmp_path_factory.mktemp("whole")
    with Twin(described) as twin:
        acquire_through(described, twin, folder / "whole.csv")
    return folder


@pytest.fixture
def whole(acquired: Path, tmp_path: Path) -> Path:
    """The run, acquired without a break; its raw file is beside it."""
    for file in acquired.iterdir():
        shutil.copy(file, tmp_path)
    return tmp_path / "whole.csv"


@pytest.mark.parametrize("end", [1, 6, 7, 10, 27])
def test_resumed_run_is_the_run_without_a_break(tmp_path: Path, whole: Path, end: int) -> None:
    described, output, operator = scenario(), tmp_path / "run.csv", Listener()
    with Twin(described) as twin:
        stop_after(described, twin, output, end)
        assert len(read_measurement(output)) == end  # what is complete can be evaluated
        result = acquire_through(described, twin, output, begin=end, resume="point", operator=operator)
    assert result.complete
    assert readings(output) == readings(whole)
    visit, point, _ = points_of(described)[end]
    assert f"continuing with visit {visit} " in operator.told[0]
    assert f"point {point} " in operator.told[0]


def test_line_and_set_up_can_be_read_once_more(tmp_path: Path, whole: Path) -> None:
    described, output = scenario(), tmp_path / "run.csv"
    with Twin(described) as twin:
        stop_after(
            described, twin, output, 24
        )  # in visit 4, which begins with reading 21 and has the set-up of visit 3
        stop_after(described, twin, output, 23, begin=21, resume="line")
        assert len(read_measurement(output)) == 23
        acquire_through(described, twin, output, begin=14, resume="set-up")
    assert readings(output) == readings(whole)
    content = read_raw(tmp_path / "run.raw.jsonl")
    assert sum(1 for record in content.records if record.record == "reading") == 24 + 2 + 14  # nothing is taken away


def test_beam_lost_in_a_break_is_not_read_with_another_constant(tmp_path: Path) -> None:
    described, output = scenario(), tmp_path / "run.csv"
    with Twin(described) as twin:
        stop_after(described, twin, output, 3)
        twin.instrument.stop()
        with pytest.raises(OSError, match="would change the constant of this set-up: use `restart_set_up`"):
            acquire_through_to_failure(described, twin, output, 3)
        assert twin.instrument.mode == "system idle"
        assert acquire_through(described, twin, output, resume="set-up").complete


def acquire_through_to_failure(described: Scenario, twin: Twin, output: Path, begin: int) -> None:
    trigger = TcpTrigger()
    with acquiring.ThreadPoolExecutor(1) as pool:
        running = pool.submit(
            acquiring.acquire, described, twin.source, output, trigger=trigger, options=fast(), resume="point"
        )
        with Controller(described, twin.address, trigger.address) as controller:
            visit, point, position = controller.points[begin]
            assert controller.read(visit, point, position).startswith("FAIL ")
            running.result(10.0)


def test_point_whose_answer_was_lost_with_the_process_is_read_again(tmp_path: Path, whole: Path) -> None:
    described, output = scenario(), tmp_path / "run.csv"
    with Twin(described) as twin:
        stop_after(described, twin, output, 10)
        assert acquire_through(described, twin, output, begin=9, resume="point").complete
    assert readings(output) == readings(whole)


def test_complete_run_has_nothing_to_go_on_with(tmp_path: Path, whole: Path) -> None:
    operator = Listener()
    whole.unlink()
    result = acquiring.acquire(
        scenario(), "ids3010://127.0.0.1:1", whole, trigger=TcpTrigger(), resume="point", operator=operator
    )
    assert result.complete
    assert operator.told == ["all points of the plan have been read"]
    assert len(read_measurement(whole)) == 28


def test_raw_file_is_never_written_over(whole: Path) -> None:
    before = whole.with_suffix(".raw.jsonl").read_bytes()
    with pytest.raises(InvalidArgument, match=r"whole.raw.jsonl: exists already: `resume` continues it"):
        acquiring.acquire(scenario(), "ids3010://127.0.0.1:1", whole, trigger=TcpTrigger())
    assert whole.with_suffix(".raw.jsonl").read_bytes() == before


def test_run_is_resumed_as_it_was_begun(whole: Path) -> None:
    other = scenario(plan=acquiring.SMALL.replace("steps = 2", "steps = 3"))
    for described, options, message in (
        (other, fast(), "another plan, head or channels"),
        (scenario(), fast(axes=(3, 2, 1)), "another axes"),
        (scenario(), fast(sign=-1), "another sign"),
    ):
        with pytest.raises(InvalidArgument, match=f"was begun with {message}"):
            acquiring.acquire(
                described, "ids3010://127.0.0.1:1", whole, trigger=TcpTrigger(), options=options, resume="point"
            )


def test_two_acquisitions_do_not_write_one_file(whole: Path) -> None:
    file, _ = RawFile.resume(whole.with_suffix(".raw.jsonl"))
    with file, pytest.raises(InvalidArgument, match="another acquisition is writing it"):
        acquiring.acquire(scenario(), "ids3010://127.0.0.1:1", whole, trigger=TcpTrigger(), resume="point")


def test_torn_line_is_cut_and_told(tmp_path: Path, whole: Path) -> None:
    described, output, operator = scenario(), tmp_path / "run.csv", Listener()
    raw = tmp_path / "run.raw.jsonl"
    with Twin(described) as twin:
        stop_after(described, twin, output, 9)
        with raw.open("ab") as file:
            file.write(b'{"visit":2,"line":"ppp","ru\0\0\0\0')
        assert "torn (31 bytes without an end)" in str(read_raw(raw).torn)
        result = acquire_through(described, twin, output, begin=9, resume="point", operator=operator)
    assert result.complete
    assert readings(output) == readings(whole)
    assert "the last line was torn (31 bytes" in operator.told[0]
    assert read_raw(raw).torn is None


def test_wherever_a_power_cut_falls_the_readings_before_it_are_there(whole: Path) -> None:
    raw = whole.with_suffix(".raw.jsonl")
    data = raw.read_bytes()
    header = data.index(b"\n") + 1
    complete = measurement_of(read_raw(raw))
    cut = raw.with_name("cut.raw.jsonl")

    @settings(max_examples=60)
    @given(end=st.integers(0, len(data)))
    def check(end: int) -> None:
        cut.write_bytes(data[:end])
        if end < header:
            with pytest.raises(InvalidArgument):
                read_raw(cut)
            return
        content = read_raw(cut)
        whole_lines = data[:end].count(b'"record":"reading"') - (b'"record":"reading"' in data[:end].split(b"\n")[-1])
        assert len(content.readings()) == whole_lines
        if whole_lines:
            part = measurement_of(content)
            for name in CHANNELS:
                assert np.array_equal(part.channels[name], complete.channels[name][:whole_lines])

    check()


def test_damaged_raw_files_are_refused_with_their_line(whole: Path) -> None:
    raw = whole.with_suffix(".raw.jsonl")
    data = raw.read_bytes()
    bad = raw.with_name("bad.raw.jsonl")

    @settings(max_examples=150)
    @given(at=st.integers(0, len(data) - 1), byte=st.integers(0, 255))
    def check(at: int, byte: int) -> None:
        bad.write_bytes(data[:at] + bytes([byte]) + data[at + 1 :])
        told = complaint(bad)
        assert told is None or (str(bad) in told and "\n" not in told)

    check()


def complaint(path: Path) -> str | None:
    try:
        measurement_of(read_raw(path))
    except InvalidArgument as error:
        return str(error)
    return None


def replaced(key: str, value: object) -> bytes:
    reading = {
        "visit": 1,
        "line": "ppp",
        "run": 0,
        "direction": "forward",
        "point": 0,
        "position_mm": [0.0, 0.0, 0.0],
        "record": "reading",
        "time": "2026-11-22T01:02:03.000004Z",
        "read": [1, 2, 3],
        "sd": [0.0, 0.0, 0.0],
        "values": 2,
        "lost": {},
    }
    return json.dumps(reading | {key: value}).encode()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (b"", "Invalid JSON"),
        (b"garbage", "Invalid JSON"),
        (b"[" * 100_000, "Invalid JSON"),
        (b"17", "got 17"),
        (b"{}", "record"),
        (b'{"record": "other"}', "record"),
        (b'{"record": "again", "visit": 1}', "time"),
        (replaced("visit", "1"), "visit: Input should be a valid integer, got '1'"),
        (replaced("read", [1, 2, 3.5]), "read: d3_pm: expected whole picometres, got 3.5"),
        (replaced("read", [2**70, 2, 3]), "read.0"),
        (replaced("read", [True, 2, 3]), "read.0"),
        (replaced("time", "yesterday"), "time"),
        (replaced("time", "2026-11-22T01:02:03"), "time"),
        (replaced("sd", [float("nan"), 0.0, 0.0]), "sd.0"),
        (replaced("unknown", 1), "unknown"),
        (replaced("values", -1), "values"),
    ],
)
def test_lines_that_are_no_records_are_refused(whole: Path, line: bytes, message: str) -> None:
    raw = whole.with_suffix(".raw.jsonl")
    lines = raw.read_bytes().split(b"\n")
    lines.insert(3, line)
    raw.write_bytes(b"\n".join(lines))
    with pytest.raises(InvalidArgument, match="line 4") as error:
        read_raw(raw)
    assert message in str(error.value)


def test_readings_that_are_not_in_the_plan_are_refused(whole: Path) -> None:
    raw = whole.with_suffix(".raw.jsonl")
    sound = raw.read_bytes()
    for line, message in (
        (replaced("visit", 9), "visit 9, point 0: not in the plan"),
        (replaced("point", 99), "visit 1, point 99: not in the plan"),
        (replaced("read", [1, 2]), "expected 3 values"),
    ):
        raw.write_bytes(sound + line + b"\n")
        with pytest.raises(InvalidArgument, match=message):
            measurement_of(read_raw(raw))


@pytest.mark.parametrize(
    "content", [b"\0" * 100, b"no raw file", b"{}\n", b'{"record":"again","time":"2026-11-22T01:02:03Z","visit":1}\n']
)
def test_files_that_are_no_raw_files_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.raw.jsonl"
    path.write_bytes(content)
    with pytest.raises(InvalidArgument, match=r"run.raw.jsonl"):
        read_raw(path)


def test_check_knows_a_raw_file(tmp_path: Path) -> None:
    described, output = scenario(), tmp_path / "run.csv"
    with Twin(described) as twin:
        stop_after(described, twin, output, 9)
    found = examine(tmp_path / "run.raw.jsonl")
    assert (found.kind, found.summary) == ("raw readings", "9 of 28 readings of d1, d2, d3, 0 lost")
    with (tmp_path / "run.raw.jsonl").open("ab") as file:
        file.write(b"{")
    assert "was torn (1 bytes" in examine(tmp_path / "run.raw.jsonl").warnings[0]


def test_killed_acquisition_goes_on_in_another_process(tmp_path: Path, whole: Path) -> None:
    described = scenario()
    (tmp_path / "scenario.toml").write_text(
        acquiring.SCENARIO.format(plan=acquiring.SMALL, head=acquiring.BEAMS, noise="")
    )
    command = [sys.executable, "-m", "stepdiag"]
    options = ["--settle-count", "2", "--average", "2", "--interval-ms", "0", "-o", "run.csv"]
    processes: list[subprocess.Popen[str]] = []

    def started(*arguments: str) -> tuple[subprocess.Popen[str], tuple[str, int]]:
        process = subprocess.Popen([*command, *arguments], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
        processes.append(process)
        assert process.stdout is not None
        words = process.stdout.readline().split()
        assert words[:2] == ["listening", "on"], words
        host, _, port = words[2].partition(":")
        return process, (host, int(port))

    try:
        _, twin = started("twin", "scenario.toml", "--port", "0")
        source = f"ids3010://{twin[0]}:{twin[1]}"
        acquire = ["acquire", "scenario.toml", "--source", source, "--trigger", "tcp://127.0.0.1:0", *options]
        first, address = started(*acquire)
        with Controller(described, twin, address) as controller:
            controller.run(0, 17)
            os.kill(first.pid, signal.SIGKILL)
            first.wait()
        assert len(read_raw(tmp_path / "run.raw.jsonl").readings()) == 17
        second, address = started(*acquire, "--resume")
        with Controller(described, twin, address) as controller:
            controller.run(17)
        assert second.wait(20) == 0
    finally:
        for process in processes:
            process.kill()
            process.communicate()
    assert readings(tmp_path / "run.csv") == readings(whole)


def as_version_1(raw: Path) -> None:
    """Rewrite a raw file of an IDS3010 as earlier programs wrote it."""
    lines = []
    for line in raw.read_text().splitlines():
        record = json.loads(line)
        if record["record"] == "header":
            record |= {"version": 1, "channels": [name.removesuffix("_pm") for name in record.pop("columns")]}
        for new, old in (("read", "pm"), ("sd", "sd_pm")):
            if new in record:
                record[old] = record.pop(new)
        lines.append(json.dumps(record) + "\n")
    raw.write_text("".join(lines))


def test_raw_file_of_version_1_is_read_and_continued(tmp_path: Path) -> None:
    described, output = scenario(), tmp_path / "run.csv"
    raw = tmp_path / "run.raw.jsonl"
    with Twin(described) as twin:
        with pytest.raises(Stopped):
            acquire_through(described, twin, output, end=9, options=fast(wait_timeout=0.2))
        as_version_1(raw)
        earlier = read_raw(raw)
        assert (earlier.header.version, len(earlier.readings())) == (1, 9)
        acquire_through(described, twin, output, begin=9, resume="point")
    assert read_raw(raw).readings().items() >= earlier.readings().items()
    expected = np.round(simulate_scenario(described).channels["d1"] * 1e9) / 1e9
    assert np.array_equal(read_measurement(output).channels["d1"], expected)


# --- the clock -------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("seconds", "is_told"), [(-3600, True), (-1, False), (3600, False)])
def test_clock_that_is_set_during_a_run(whole: Path, seconds: int, *, is_told: bool) -> None:
    """Set back, it is known, and the run has no times; set forward it looks like a pause."""
    raw = raw_path(whole)
    changed, count = [], 0
    for line in raw.read_text().splitlines():
        record = json.loads(line)
        count += record.get("record") == "reading"
        if count > 10 and "time" in record:
            record["time"] = (datetime.fromisoformat(record["time"]) + timedelta(seconds=seconds)).isoformat()
        changed.append(json.dumps(record))
    raw.write_text("\n".join(changed) + "\n")
    content = read_raw(raw)
    found = measurement_of(content)
    assert ("time" in found.channels) != is_told
    assert set_back(content) == (
        "the clock was set back by 3600 s before line ppp, point 3: the run has no times (time_s)" if is_told else ""
    )
    np.testing.assert_array_equal(found.channels["d1"], read_measurement(whole).channels["d1"])
