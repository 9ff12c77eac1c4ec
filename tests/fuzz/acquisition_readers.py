"""What an acquisition reads from files and sockets, for python_readers.py: raw files, requests to a twin, replies of an
instrument, and the lines of a controller that wants readings."""

from __future__ import annotations

import json
import socket
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stepdiag.acquisition.acquire import acquire, raw_path
from stepdiag.acquisition.options import AcquireOptions
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.acquisition.run_from_raw import measurement_of
from stepdiag.acquisition.settling import Settling
from stepdiag.acquisition.tcp_trigger import _expectation
from stepdiag.acquisition.triggers import KeyTrigger
from stepdiag.instruments.ids3010 import Ids3010
from stepdiag.instruments.ids3010_messages import JsonStream
from stepdiag.instruments.instrument import InstrumentError
from stepdiag.instruments.line_instrument import parse_header, parse_sample
from stepdiag.scenario.description import parse_scenario
from stepdiag.scenario.order_of_run import Visit
from stepdiag.twin.instrument import TwinInstrument
from stepdiag.twin.server import Answers, Twin

SCENARIO = parse_scenario(
    """
[volume]
x_mm = 80.0
y_mm = 60.0
z_mm = 50.0
[machine]
chain = "[w X' b Y Z t]"
[machine.random]
seed = 7
[plan]
lines = ["ppp"]
steps = 1
scale_lines = ["p00"]
[head]
layout = "multi_beam"
beam_offsets_mm = [[10.0, 0.0], [-5.0, 8.0], [-5.0, -8.0]]
"""
)


# --- raw files ---


def read_raw_file(path: Path) -> None:
    content = read_raw(path)
    measurement_of(content, zero="first", uncertainties=True)


def raw_files() -> list[bytes]:
    """That of a run with a lost point, and the same taken up again."""
    with tempfile.TemporaryDirectory() as folder, Twin(SCENARIO) as twin:

        class Mover(KeyTrigger):
            def wait(self, visit: Visit, index: int, nominal: Sequence[float]) -> bool:
                twin.instrument.move_to(visit.positions[index])
                return True

        output = Path(folder) / "run.csv"
        options = AcquireOptions(settling=Settling(count=2, average=1, interval=0.0))
        acquire(SCENARIO, twin.source, output, trigger=Mover(), options=options)
        once = raw_path(output).read_bytes()
        acquire(SCENARIO, twin.source, output, trigger=Mover(), options=options, resume="line")
        return [once, raw_path(output).read_bytes()]


# --- requests to a twin ---


INSTRUMENT = TwinInstrument(SCENARIO)


def answer_requests(path: Path) -> None:
    answers = Answers(INSTRUMENT)
    for request in objects_in(path.read_bytes()):
        json.dumps(answers.answer(request), allow_nan=False)


def objects_in(data: bytes) -> list[dict[str, Any]]:
    """As they come from a socket, in two pieces. The stream says what is wrong by ValueError."""
    stream = JsonStream()
    try:
        return stream.feed(data[: len(data) // 3]) + stream.feed(data[len(data) // 3 :])
    except ValueError:
        return []


def requests() -> list[bytes]:
    calls: list[tuple[str, list[Any]]] = [
        ("com.attocube.ids.system.getCurrentMode", []),
        ("com.attocube.ids.system.startMeasurement", []),
        ("com.attocube.ids.displacement.getAbsolutePositions", []),
        ("com.attocube.ids.displacement.getAbsolutePosition", [2]),
        ("com.attocube.ids.displacement.getAxisDisplacement", [0]),
        ("com.attocube.system.errorNumberToString", [0, 9001]),
        ("stepdiag.twin.moveTo", [1.0, 2.5, -3e-3]),
        ("stepdiag.twin.setUp", [2]),
        ("stepdiag.twin.visit", [1, 0]),
        ("stepdiag.twin.state", []),
    ]
    objects = [
        json.dumps({"jsonrpc": "2.0", "method": method, "params": params, "id": i, "api": 2}).encode()
        for i, (method, params) in enumerate(calls)
    ]
    return [*objects, b"\r\n".join(objects)]


# --- replies of an instrument ---


class Replies:
    """A socket that gives the same bytes to whatever is asked, and then is closed."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    def recv(self, size: int) -> bytes:
        data, self._data = self._data[:size], self._data[size:]
        return data

    def sendall(self, data: bytes) -> None:
        pass

    def settimeout(self, seconds: float) -> None:
        pass

    def close(self) -> None:
        pass


class Connected(Ids3010):
    def __init__(self, data: bytes) -> None:
        super().__init__("127.0.0.1", 9, attempts=1)
        self._data = data

    def _connected(self) -> socket.socket:
        self._id = 6  # so that the next request is the seventh, as the replies are
        return Replies(self._data)  # type: ignore[return-value]


def read_replies(path: Path) -> None:
    data = path.read_bytes()
    for ask in (
        lambda instrument: instrument.read((0, 1, 2)),
        lambda instrument: instrument.read((1,)),
        lambda instrument: instrument.mode(),
        lambda instrument: instrument.describe(),
        lambda instrument: instrument.error_text(3),
    ):
        try:
            ask(Connected(data))
        except InstrumentError as error:
            if not str(error).startswith("ids3010://"):
                raise AssertionError("a message names the instrument") from error


def replies() -> list[bytes]:
    results: list[Any] = [
        [0, 123456789012, -5, 7],
        [0, 123456789012],
        [9001, 0, 0, 0],
        [0, "measurement running"],
        [17],
        [0, 1.5, 1e300, None],
    ]
    good = [{"jsonrpc": "2.0", "result": result, "id": 7} for result in results]
    error = {"jsonrpc": "2.0", "error": {"code": -32601, "message": "method not found"}, "id": 7}
    return [json.dumps(reply).encode() + b"\r\n" for reply in [*good, error, {"id": 3, "result": [0]}]]


# --- lines of an adapter ---


def read_lines(path: Path) -> None:
    names: tuple[str, ...] = ()
    for line in path.read_bytes().split(b"\n"):
        try:
            if names:
                parse_sample(line, names)
            else:
                names = parse_header(line).columns
        except ValueError:
            continue


def lines() -> list[bytes]:
    header = b'{"stepdiag_lines": 1, "instrument": "x", "channels": ["distance_mm", "spot_x_mm"], "visits": true}\n'
    sample = b'{"distance_mm": 100.5, "spot_x_mm": null, "why": "dark", "time": 1738324800.25}\n'
    return [header + sample, header + sample.replace(b"1738324800.25", b'"2026-01-31T12:00:00Z"') + b'{"visit": 3}\n']


# --- lines of a controller ---


def read_wishes(path: Path) -> None:
    for line in path.read_bytes().split(b"\n"):
        wrong = _expectation((1, 2), line)
        assert wrong.isascii(), wrong
        assert len(wrong) < 200, wrong


def wishes() -> list[bytes]:
    return [b"READ 1 2\n", b"READ 1 2\r\nREAD 1 3\n", b"READ 0001 2\n", b"STOP\n"]
