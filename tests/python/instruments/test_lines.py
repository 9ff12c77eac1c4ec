"""An adapter that sends JSON lines is an instrument: its samples become a measurement, and nothing else does."""

import contextlib
import json
import os
import shlex
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from acquiring import BEAMS, IDEAL, LINES, Listener, fast, points_of, scenario
from hypothesis import given, settings
from hypothesis import strategies as st
from places import EXAMPLES, SHIPPED_HEADS

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.acquire import Acquired, acquire
from stepdiag.acquisition.options import AcquireOptions
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.acquisition.settling import Settling
from stepdiag.acquisition.triggers import KeyTrigger
from stepdiag.instruments.instrument import InstrumentError, Sample
from stepdiag.instruments.line_instrument import LineInstrument, parse_header, parse_sample
from stepdiag.instruments.line_streams import LONGEST
from stepdiag.io.data_files import read_measurement
from stepdiag.scenario.description import Scenario, adjust_scenario, simulate_scenario
from stepdiag.twin.instrument import TwinBehaviour
from stepdiag.twin.server import Twin

PSD = 'layout = "psd"\npsd_distance_mm = 80.0'
DESCRIBED = f'description = "{SHIPPED_HEADS / "beam_and_psd.toml"}"'
LINE = 'lines = ["ppp"]\nsteps = 1'
NOISE = "distance_um = 0.1\ntilt_urad = 1.0\nspot_um = 1.0\nseed = 3"
NAMES = ["distance_mm", "spot_x_mm", "spot_y_mm"]
HEADER = {"stepdiag_lines": 1, "instrument": "test", "channels": NAMES}
SAMPLE = {"distance_mm": 100.0, "spot_x_mm": 0.25, "spot_y_mm": -0.5}
ONE = Settling(count=2, average=1, interval=0.0, retries=1, retry_wait=0.0)


def text(*objects: object) -> bytes:
    return b"".join(json.dumps(content).encode() + b"\n" for content in objects)


class Pipe:
    """What a test writes to is what an instrument reads."""

    name = "pipe"

    def __init__(self) -> None:
        self._end, self.writer = os.pipe()
        os.set_blocking(self._end, False)
        self.sent: list[bytes] = []

    def write(self, *objects: object) -> None:
        os.write(self.writer, text(*objects))

    def fileno(self) -> int:
        return self._end

    def read(self, size: int) -> bytes:
        return os.read(self._end, size)

    def send(self, line: bytes) -> None:
        self.sent.append(line)

    def ended(self) -> str:
        return "the pipe ended"

    def close(self) -> None:
        os.close(self._end)


@contextlib.contextmanager
def piped(*objects: object, timeout: float = 5.0, head: str = PSD) -> Iterator[tuple[Pipe, LineInstrument]]:
    """An instrument that has sent these lines."""
    pipe = Pipe()
    pipe.write(*objects)
    try:
        with LineInstrument(lambda: pipe, scenario(head=head).known, timeout=timeout) as instrument:
            yield pipe, instrument
    finally:
        os.close(pipe.writer)


@contextlib.contextmanager
def adapter(serve: Callable[[socket.socket], None]) -> Iterator[str]:
    """The source of an adapter that serves one client so."""

    def run() -> None:
        with contextlib.suppress(OSError):
            client, _ = server.accept()
            with client:
                serve(client)

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        yield f"lines://127.0.0.1:{server.getsockname()[1]}"
        with contextlib.suppress(OSError):
            server.shutdown(socket.SHUT_RDWR)
    thread.join(10.0)


def sending(*values: object) -> Callable[[socket.socket], None]:
    """A header, then the last of these over and over."""

    def serve(client: socket.socket) -> None:
        client.sendall(text(*values[:-1]))
        while True:
            client.sendall(text(values[-1]))
            time.sleep(0.001)

    return serve


class Moving(Listener):
    """An operator who moves the machine of a twin to each point before it is read."""

    def __init__(self, twin: Twin, described: Scenario) -> None:
        super().__init__()
        self._twin, self._points = twin, [position for _, _, position in points_of(described)]

    def confirm(self, text: str) -> None:
        self._twin.instrument.move_to(self._points[len(self.asked)])
        super().confirm(text)


def acquired(described: Scenario, source: str, output: Path, *, options: AcquireOptions | None = None) -> Acquired:
    return acquire(described, source, output, trigger=KeyTrigger(), options=options or fast(), operator=Listener())


@pytest.mark.slow
@pytest.mark.parametrize("head", [PSD, IDEAL, BEAMS, DESCRIBED], ids=["psd", "ideal", "multi_beam", "described"])
def test_run_of_any_layout_is_the_simulated_one_and_is_evaluated(tmp_path: Path, head: str) -> None:
    described = scenario(plan=LINES, head=head, noise=NOISE)
    with Twin(described, protocol="lines") as twin:
        operator = Moving(twin, described)
        result = acquire(
            described,
            twin.source,
            tmp_path / "run.csv",
            trigger=KeyTrigger(),
            options=fast(settling=ONE),
            operator=operator,
        )
    assert (result.complete, result.lost) == (True, 0)
    run, expected = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    for name in described.known.signals:
        sent = 1e-12 if name in ("alpha", "beta") else 1e-9  # the last digit that the twin sends
        assert np.max(np.abs(run.channels[name] - expected.channels[name])) < 0.501 * sent
    assert adjust_scenario(described, run).verdict.fit == adjust_scenario(described, expected).verdict.fit


def test_number_that_was_sent_is_the_number_in_the_file(tmp_path: Path) -> None:
    sent = {"distance_mm": 123.45678901234567, "alpha_urad": 12.3456789, "beta_urad": -1e-7}
    described = scenario(plan=LINE, head=IDEAL)
    with adapter(sending(HEADER | {"channels": list(sent)}, sent)) as source:
        acquired(described, source, tmp_path / "run.csv", options=fast(settling=ONE))
    header, row, *_ = (tmp_path / "run.csv").read_text().splitlines()
    written = dict(zip(header.split(","), row.split(","), strict=True))
    assert {name: float(written[name]) for name in sent} == sent
    content = read_raw(tmp_path / "run.raw.jsonl")
    assert content.header.columns == list(sent)
    assert all(reading.read == list(sent.values()) for reading in content.readings().values())


def test_distance_alone_will_do_for_an_ideal_head(tmp_path: Path) -> None:
    described = scenario(plan=LINE, head=IDEAL)
    with adapter(sending(HEADER | {"channels": NAMES[:1]}, {"distance_mm": 7})) as source:
        acquired(described, source, tmp_path / "run.csv")
    assert np.array_equal(read_measurement(tmp_path / "run.csv").channels["distance"], [7.0] * 4)


def test_columns_are_known_by_their_names_not_by_their_order() -> None:
    with piped(HEADER | {"channels": NAMES[::-1]}) as (pipe, instrument), later(pipe, SAMPLE):
        assert [column.name for column in instrument.columns] == NAMES
        assert instrument.read().values == (100.0, 0.25, -0.5)


@contextlib.contextmanager
def later(pipe: Pipe, *objects: object) -> Iterator[None]:
    """Lines that come, one after the other, while somebody waits."""

    def send() -> None:
        for content in objects:
            time.sleep(0.05)
            pipe.write(content)

    thread = threading.Thread(target=send)
    thread.start()
    yield
    thread.join()


def test_samples_from_before_are_not_read() -> None:
    old, new = SAMPLE | {"distance_mm": 1.0}, SAMPLE | {"distance_mm": 2.0}
    with piped(HEADER, *[old] * 100) as (pipe, instrument):
        for _ in range(3):
            os.write(pipe.writer, text(*[old] * 100) + text(old)[:10])  # and the beginning of another
            waiting = threading.Timer(0.05, lambda: os.write(pipe.writer, text(old)[10:] + text(new)))
            waiting.start()
            assert instrument.read().values[0] == 2.0
            waiting.join()


def test_sample_with_a_time_before_it_was_asked_for_is_not_read() -> None:
    past = SAMPLE | {"distance_mm": 1.0, "time": "2026-01-31T12:00:00+01:00"}
    with piped(HEADER) as (pipe, instrument):
        with later(pipe, past, past, SAMPLE | {"time": time.time() + 5.0}):
            sample = instrument.read()
        assert sample.values[0] == 100.0
        assert sample.time is not None
    behind = r"no new sample within 1 s: .*do the clocks agree\?"
    with (
        piped(HEADER, timeout=1.0) as (pipe, instrument),
        later(pipe, past, past),
        pytest.raises(InstrumentError, match=behind),
    ):
        instrument.read()


def test_value_that_is_null_is_lost_with_its_reason(tmp_path: Path) -> None:
    described = scenario(plan=LINE, head=PSD)
    with adapter(sending(HEADER, SAMPLE | {"spot_x_mm": None, "why": "too dark"})) as source:
        result = acquired(described, source, tmp_path / "run.csv")
    assert result.lost == 4
    run = read_measurement(tmp_path / "run.csv")
    assert np.isnan(run.channels["spot_x"]).all()
    assert np.array_equal(run.channels["spot_y"], [-0.5] * 4)
    lost = [reading.lost for reading in read_raw(tmp_path / "run.raw.jsonl").readings().values()]
    assert lost == [{"spot_x": "no value (too dark)"}] * 4


def test_spots_settle_by_a_limit_of_their_own(tmp_path: Path) -> None:
    described = scenario(plan=LINE, head=PSD)
    behaviour = TwinBehaviour(sampling_noise_um=1.0)
    for limit, timeout, lost in ((50.0, 20.0, 0), (0.01, 0.2, 4)):
        settling = Settling(count=3, average=2, interval=0.0, limit_um=50.0, limit_spot_um=limit, timeout=timeout)
        with Twin(described, protocol="lines", behaviour=behaviour) as twin:
            result = acquired(described, twin.source, tmp_path / f"{lost}.csv", options=fast(settling=settling))
        assert result.lost == lost
    why = next(iter(read_raw(tmp_path / "4.raw.jsonl").readings().values())).lost
    assert why["spot_x"].startswith("did not settle within 0.2 s (last values apart: spot_x ")


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        (["distance_mm"], "without spot_x_mm, spot_y_mm"),
        ([*NAMES, "alpha_urad"], "with alpha_urad"),
        (["distance_mm", "spot_x_um", "spot_y_mm"], "without spot_x_mm and with spot_x_um"),
        (["d1_mm", "d2_mm", "d3_mm"], "without distance_mm, spot_x_mm, spot_y_mm and with d1_mm, d2_mm, d3_mm"),
        (["distance_mm"] * 3, "expected different names"),
        ([], "expected a list of names"),
        ("distance_mm", "expected a list of names"),
        ([1, 2, 3], "expected a list of names"),
    ],
)
def test_channels_that_are_not_the_heads_are_refused(channels: object, message: str) -> None:
    with pytest.raises(InstrumentError) as error, piped(HEADER | {"channels": channels}):
        pass
    assert str(error.value).startswith("pipe: line 1: channels: ")
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (b"", "expected a header such as"),
        (b"READY", "expected a header such as"),
        (b"[]", "expected a header such as"),
        (b'{"stepdiag_lines": 2, "channels": ["distance_mm"]}', "expected a header such as"),
        (b'{"stepdiag_lines": true, "channels": ["distance_mm"]}', "expected a header such as"),
        (b'{"stepdiag_lines": 1, "channels": ["distance_mm"], "visits": 1}', "visits: expected true or false"),
        (b'{"stepdiag_lines": 1, "channels": ["distance_mm"], "serial": 17}', "'serial': expected a text"),
        (b'{"stepdiag_lines": 1, "stepdiag_lines": 1, "channels": ["distance_mm"]}', "(a key twice)"),
        (b"\xff\xfe", "expected a header such as"),
    ],
)
def test_line_that_is_no_header_is_refused(line: bytes, message: str) -> None:
    with pytest.raises(ValueError) as error:  # noqa: PT011 (the message is below)
        parse_header(line)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (b"", "expected a value for each of distance_mm, spot_x_mm, spot_y_mm, got ''"),
        (b"100.0 0.25 -0.5", "expected a value for each of"),
        (b'{"distance_mm": 1.0, "spot_x_mm": 2.0', "expected a value for each of"),
        (b'{"distance_mm": 1.0, "spot_x_mm": 2.0}', "spot_y_mm: expected a number or null, got none"),
        (text(SAMPLE | {"spot_x_mm": "0.25"}), "spot_x_mm: expected a number of at most 1e+09 or null, got '0.25'"),
        (text(SAMPLE | {"spot_x_mm": True}), "spot_x_mm: expected a number"),
        (text(SAMPLE | {"spot_x_mm": 1e10}), "spot_x_mm: expected a number"),
        (text(SAMPLE | {"spot_x_mm": float("nan")}), "NaN is no number of JSON: a lost value is null"),
        (text(SAMPLE).replace(b"0.25", b"1e999"), "spot_x_mm: expected a number"),
        (text(SAMPLE).replace(b"0.25", b"9" * 5000), "expected a value for each of"),
        (text(SAMPLE).replace(b"0.25", b"[" * 5000), "expected a value for each of"),
        (
            text(SAMPLE | {"d1_mm": 1.0}),
            "spot_y_mm, time, why and signal only, got 'd1_mm'",
        ),
        (text(SAMPLE | {"why": 3}), "why: expected a text"),
        (text(SAMPLE | {"time": "noon"}), "time: expected seconds since 1970"),
        (text(SAMPLE | {"time": "2026-01-31T12:00:00"}), "time: expected seconds since 1970"),
        (text(SAMPLE | {"time": 1e300}), "time: expected seconds since 1970"),
        (text(SAMPLE | {"time": 3.25e10}), "time: expected one that is past"),
        (text({"visit": 1.5}), "visit: expected a whole number"),
        (text({"error": "the port was closed"}), "the adapter says: 'the port was closed'"),
    ],
)
def test_line_that_is_no_sample_stops_the_acquisition_with_its_reason(line: bytes, message: str) -> None:
    with pytest.raises(ValueError) as error:  # noqa: PT011 (the message is below)
        parse_sample(line.removesuffix(b"\n"), NAMES)
    assert message in str(error.value)
    with piped(HEADER) as (pipe, instrument):
        os.write(pipe.writer, line.removesuffix(b"\n") + b"\r\n")
        with pytest.raises(InstrumentError) as stopped:
            instrument.read()
    assert message in str(stopped.value)
    assert str(stopped.value).startswith("pipe: line 2: ")
    assert len(str(stopped.value)) < 300


def test_line_without_an_end_is_not_kept() -> None:
    with piped(HEADER) as (pipe, instrument):
        os.write(pipe.writer, b" " * 60_000)
        with later(pipe, "x" * 10_000), pytest.raises(InstrumentError, match=rf"line 2: expected at most {LONGEST}"):
            instrument.read()


def test_adapter_that_stops_is_not_waited_for(tmp_path: Path) -> None:
    silent = pytest.raises(InstrumentError, match=r"pipe: no sample within 0\.1 s")
    with piped(HEADER, SAMPLE, timeout=0.1) as (_, instrument), silent:
        instrument.read()
    with pytest.raises(InstrumentError, match="the connection was closed"), adapter(lambda _: None) as source:
        acquired(scenario(head=PSD), source, tmp_path / "run.csv")


@pytest.mark.slow
def test_adapter_that_sends_without_end_is_stopped(tmp_path: Path) -> None:
    """`yes` writes faster than lines can be taken: nothing is kept, and the reason is told."""
    script = f"echo {shlex.quote(json.dumps(HEADER))}; exec yes {shlex.quote(json.dumps(SAMPLE))}"
    source = f"program:{shlex.join(['sh', '-c', script])}"
    with pytest.raises(InstrumentError, match=r"program sh: sends faster than it can be read \([0-9]+ lines so far\)"):
        acquired(scenario(head=PSD), source, tmp_path / "run.csv")


PROGRAM = """
import json, os, sys, time
with open("pid", "w") as file:
    file.write(str(os.getpid()))
print(json.dumps({"stepdiag_lines": 1, "channels": ["distance_mm"]}))
while True:
    print(json.dumps({"distance_mm": 5.0}))
    time.sleep(0.002)
"""


def test_program_is_ended_with_the_acquisition(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    source = f"program:{shlex.join([sys.executable, '-c', PROGRAM])}"
    assert acquired(scenario(plan=LINE, head=IDEAL), source, Path("run.csv")).complete
    with pytest.raises(ProcessLookupError):
        os.kill(int(Path("pid").read_text()), 0)


def test_program_that_fails_is_quoted(tmp_path: Path) -> None:
    program = [sys.executable, "-c", "raise SystemExit('no such port: /dev/ttyUSB0')"]
    with pytest.raises(InstrumentError, match=r"the program ended, status 1; it said: no such port: /dev/ttyUSB0$"):
        acquired(scenario(head=PSD), f"program:{shlex.join(program)}", tmp_path / "run.csv")


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("lines://127.0.0.1", "expected lines://127.0.0.1:PORT"),
        ("lines://127.0.0.1:0", "expected lines://127.0.0.1:PORT"),
        ("lines://127.0.0.1:99999", "expected lines://127.0.0.1:PORT"),
        ("lines://127.0.0.1:1/x", "expected lines://127.0.0.1:PORT"),
        ("program:", "expected program:COMMAND, got no command"),
        ("program:'", "No closing quotation"),
        ("program:no-such-program", "no-such-program: cannot be started: No such file"),
        ("serial:", "expected serial:PORT"),
        ("usb:1", "expected ids3010://HOST, lines://127.0.0.1:PORT, serial:PORT or program:COMMAND"),
    ],
)
def test_sources_that_make_no_sense_are_refused(tmp_path: Path, source: str, message: str) -> None:
    with pytest.raises(InvalidArgument, match="source: ") as error:
        acquired(scenario(head=PSD), source, tmp_path / "run.csv")
    assert message in str(error.value)


def test_adapter_elsewhere_is_warned_of(tmp_path: Path) -> None:
    operator = Listener()
    with pytest.raises(InstrumentError, match="cannot be reached"):
        acquire(
            scenario(head=PSD),
            "lines://no-such-host.invalid:1",
            tmp_path / "run.csv",
            trigger=KeyTrigger(),
            options=fast(),
            operator=operator,
        )
    assert "not on this computer" in operator.told[0]


def test_run_is_not_continued_by_another_instrument(tmp_path: Path) -> None:
    described, output = scenario(plan=LINE), tmp_path / "run.csv"
    with Twin(described) as twin:
        acquired(described, twin.source, output)
    with (
        Twin(described, protocol="lines") as twin,
        pytest.raises(InvalidArgument, match="begun with another instrument"),
    ):
        acquire(described, twin.source, output, trigger=KeyTrigger(), options=fast(), resume="line")


def test_twin_of_another_plan_is_refused(tmp_path: Path) -> None:
    with (
        Twin(scenario(head=PSD), protocol="lines") as twin,
        pytest.raises(InstrumentError, match="visit: the twin has another plan or head"),
    ):
        acquired(scenario(plan=LINE, head=PSD), twin.source, tmp_path / "run.csv")


def test_adapter_that_asks_for_it_is_told_of_visits() -> None:
    with piped(HEADER | {"visits": True}) as (pipe, instrument):
        with later(pipe, SAMPLE, {"visit": 3}):
            instrument.visit(3, 2, "digest")
        assert [json.loads(line) for line in pipe.sent] == [{"visit": 3, "place": 2, "digest": "digest"}]
    silent = pytest.raises(InstrumentError, match="expected the answer")
    with piped(HEADER | {"visits": True}, timeout=0.1) as (pipe, instrument), later(pipe, {"visit": 4}), silent:
        instrument.visit(3, 0, "digest")
    with piped(HEADER) as (pipe, instrument):
        instrument.visit(3, 0, "digest")  # of others, nothing
        assert pipe.sent == []


@given(st.binary(max_size=300))
def test_no_line_does_more_than_be_refused(line: bytes) -> None:
    for parse in (parse_header, lambda data: parse_sample(data, NAMES)):
        with contextlib.suppress(ValueError):
            parse(line)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from([*NAMES, "time", "why"]), inner),
    max_leaves=6,
)


@given(st.dictionaries(st.sampled_from([*NAMES, "time", "why", "visit", "error", "x"]), VALUES))
def test_sample_is_whole_or_refused(content: dict[str, object]) -> None:
    try:
        sample = parse_sample(json.dumps(content).encode(), NAMES)
    except ValueError:
        return
    if isinstance(sample, Sample):
        assert len(sample.values) == len(sample.reasons) == 3
        assert all(value is None or np.isfinite(value) for value in sample.values)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.binary(max_size=200) | st.just(text(SAMPLE)), max_size=6), st.booleans())
def test_whatever_comes_an_acquisition_ends(pieces: list[bytes], with_header: bool) -> None:
    pipe = Pipe()
    os.write(pipe.writer, (text(HEADER) if with_header else b"") + b"".join(pieces))
    sender = threading.Timer(0.01, lambda: os.close(pipe.writer))
    sender.start()

    def read_all() -> None:
        with LineInstrument(lambda: pipe, scenario(head=PSD).known, timeout=5.0) as instrument:
            while True:
                assert isinstance(instrument.read(), Sample)

    with pytest.raises(InstrumentError, match="pipe: ") as error:
        read_all()
    assert str(error.value).isascii()
    assert len(str(error.value)) < 600  # 60 bytes shown, each as six
    sender.join()


def test_example_reads_a_device_on_a_serial_port(tmp_path: Path) -> None:
    described, ended = scenario(plan=LINE, head=PSD), threading.Event()
    device, port = os.openpty()
    os.set_blocking(device, False)

    def send() -> None:
        while not ended.wait(0.002):
            with contextlib.suppress(BlockingIOError):  # nobody reads it yet
                os.write(device, b"100.125 250.0 -\r\n")

    sender = threading.Thread(target=send)
    sender.start()
    program = shlex.join([sys.executable, str(EXAMPLES / "serial_adapter.py"), os.ttyname(port)])
    try:
        result = acquired(described, f"program:{program}", tmp_path / "run.csv")
    finally:
        ended.set()
        sender.join()
        os.close(device)
        os.close(port)
    assert (result.readings, result.lost) == (4, 4)  # of spot_y
    run = read_measurement(tmp_path / "run.csv")
    assert np.array_equal(run.channels["distance"], [100.125] * 4)
    assert np.array_equal(run.channels["spot_x"], [0.25] * 4)
