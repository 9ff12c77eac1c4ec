"""Kinds of sources: a serial port, two instruments together, several heads on one instrument."""

import itertools
import json
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from acquiring import Listener, fast, scenario
from terminals import needs_terminal

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.acquire import acquire, instrument_of
from stepdiag.acquisition.options import AcquireOptions
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.acquisition.triggers import KeyTrigger
from stepdiag.instruments.instrument import InstrumentError
from stepdiag.instruments.joined import JoinedInstruments
from stepdiag.io.data_files import read_measurement
from stepdiag.scenario.description import Scenario, parse_scenario, simulate_scenario
from stepdiag.twin.server import Twin

PLAN = 'lines = ["ppp", "npp"]\nsteps = 1'
PSD = 'layout = "psd"\npsd_distance_mm = 80.0'
IDEAL = 'layout = "ideal"'


class Moving(Listener):
    """The machine moves when a reading is wanted."""

    def __init__(self, described: Scenario, *moves: Callable[[np.ndarray], None]) -> None:
        super().__init__()
        plan = described.known.plan
        self._points = iter([point for line in plan.lines for point in plan.points(line)])
        self._moves = moves

    def confirm(self, text: str) -> None:
        super().confirm(text)
        point = next(self._points)
        for move in self._moves:
            move(point)


@pytest.fixture
def real(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twins are taken for instruments, which nobody tells where they are."""
    monkeypatch.setattr("stepdiag.instruments.ids3010_instrument.TWIN", "nothing")


@contextmanager
def adapter(header: dict[str, object], sample: Callable[[], dict[str, object]]) -> Iterator[str]:
    """A program that sends lines to whom connects. Its address."""
    ended = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            client, _ = server.accept()
            with client:
                try:
                    client.sendall(json.dumps(header).encode() + b"\n")
                    while not ended.is_set():
                        client.sendall(json.dumps(sample()).encode() + b"\n")
                        time.sleep(0.002)
                except OSError:
                    return

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        host, port = server.getsockname()
        yield f"lines://{host}:{port}"
        ended.set()
        thread.join(5.0)


@needs_terminal
def test_serial_port_gives_lines_as_a_socket_does(tmp_path: Path) -> None:
    """A device on a serial line; a pseudo-terminal here. It may send a part of a line first."""
    described = scenario(plan='lines = ["ppp"]\nsteps = 1', head=IDEAL)
    ours, theirs = os.openpty()
    ended = threading.Event()
    with Twin(described, protocol="lines") as twin:
        names = [column.name for column in twin.instrument.columns]

        def send() -> None:
            header = json.dumps({"stepdiag_lines": 1, "channels": names}).encode() + b"\r\n"
            os.write(ours, header[20:])  # its beginning was sent before anybody listened
            for number in itertools.count():
                if ended.is_set():
                    return
                if number % 50 == 10:
                    os.write(ours, header)
                alpha, beta = (1e6 * (value or 0.0) for value in twin.instrument.values()[1:])
                sample = dict(zip(names, (twin.instrument.values()[0], alpha, beta), strict=True))
                os.write(ours, json.dumps(sample).encode() + b"\r\n")
                time.sleep(0.01)

        thread = threading.Thread(target=send, daemon=True)
        thread.start()
        result = acquire(
            described,
            f"serial:{os.ttyname(theirs)}?baud=115200",
            tmp_path / "run.csv",
            trigger=KeyTrigger(),
            options=fast(),
            operator=Moving(described, twin.instrument.move_to),
        )
        ended.set()
        thread.join(5.0)
    assert result.complete
    simulated = simulate_scenario(described)
    assert np.allclose(
        read_measurement(tmp_path / "run.csv").channels["beta"], simulated.channels["beta"], rtol=0.0, atol=1e-12
    )


def test_serial_port_that_is_not_there_is_named() -> None:
    known = scenario(head=IDEAL).known
    with pytest.raises(InstrumentError, match="serial:/dev/nowhere: cannot be opened"):
        instrument_of("serial:/dev/nowhere", known, AcquireOptions(), print).__enter__()
    for wrong in ("serial:", "serial:/dev/ttyS0?baud=fast"):
        with pytest.raises(InvalidArgument, match="expected serial:PORT"):
            instrument_of(wrong, known, AcquireOptions(), print)


@pytest.mark.usefixtures("real")
def test_distance_of_an_ids3010_and_spot_of_an_adapter_are_one_head(tmp_path: Path) -> None:
    described, distances = scenario(plan=PLAN, head=PSD), scenario(plan=PLAN, head=IDEAL)
    with Twin(distances) as ids, Twin(described, protocol="lines") as spots:
        visits = [(0, "ppp"), (1, "npp")]

        def spot() -> dict[str, object]:
            _, x, y = spots.instrument.values()
            return {"spot_x_mm": x, "spot_y_mm": y, "time": time.time()}

        operator = Moving(described, ids.instrument.move_to, spots.instrument.move_to)
        header = {"stepdiag_lines": 1, "channels": ["spot_y_mm", "spot_x_mm"]}
        told = operator.tell

        def tell(text: str) -> None:
            told(text)
            for number, line in visits:
                if text.startswith(f"set-up {number + 1} of") and line in text:
                    spots.instrument.visit(number + 1)
                    ids.instrument.visit(number + 1)

        operator.tell = tell  # type: ignore[method-assign]
        with adapter(header, spot) as address:
            result = acquire(
                described,
                f"{ids.source} + {address}",
                tmp_path / "run.csv",
                trigger=KeyTrigger(),
                options=fast(),
                operator=operator,
            )
    assert result.complete
    run, simulated = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    for name in ("distance", "spot_x", "spot_y"):
        assert np.allclose(run.channels[name], simulated.channels[name], rtol=0.0, atol=1e-9), name
    assert [column.name for column in read_raw(tmp_path / "run.raw.jsonl").header.read_columns] == [
        "distance_pm",
        "spot_x_mm",
        "spot_y_mm",
    ]


def test_two_instruments_read_a_spot_or_tilts_only() -> None:
    beams = 'layout = "multi_beam"\nbeam_offsets_mm = [[15.0, 0.0], [-7.5, 13.0], [-7.5, -13.0]]'
    with pytest.raises(InvalidArgument, match="has beams"):
        instrument_of("ids3010://h + lines://127.0.0.1:1", scenario(head=beams).known, AcquireOptions(), print)
    joined = instrument_of("ids3010://h + lines://127.0.0.1:1", scenario(head=PSD).known, AcquireOptions(), print)
    assert isinstance(joined, JoinedInstruments)


HEADS = """
[volume]
x_mm = 80.0
y_mm = 60.0
z_mm = 50.0
[machine]
chain = "[w X' b Y Z t]"
[plan]
lines = ["ppp", "npp"]
steps = 1
[line.ppp]
head = "left"
[line.npp]
head = "right"
[head.left]
layout = "ideal"
channels = {left}
[head.right]
layout = "ideal"
channels = {right}
[plausible.inputs]
reading_s = {{inner = [0.0, 60.0]}}
"""


def heads(left: list[str], right: list[str]) -> Scenario:
    return parse_scenario(HEADS.format(left=json.dumps(left), right=json.dumps(right)))


def test_each_line_is_read_by_its_own_head_of_one_adapter(tmp_path: Path) -> None:
    left, right = ([f"{side}_{name}" for name in ("distance_mm", "alpha_urad", "beta_urad")] for side in ("l", "r"))
    described = heads(left, right)
    values = dict(zip([*left, *right], (100.0, 1.0, 2.0, 200.0, 3.0, 4.0), strict=True))
    with adapter({"stepdiag_lines": 1, "channels": [*right, *left]}, lambda: values) as address:
        acquire(described, address, tmp_path / "run.csv", trigger=KeyTrigger(), options=fast(), operator=Listener())
    run = read_measurement(tmp_path / "run.csv")
    assert run.channels["distance"].tolist() == [100.0] * 4 + [200.0] * 4
    assert np.allclose(run.channels["beta"] * 1e6, [2.0] * 4 + [4.0] * 4)


@pytest.mark.usefixtures("real")
def test_each_line_is_read_by_its_own_axis_of_an_ids3010(tmp_path: Path) -> None:
    described = heads(["1"], ["3"])
    with Twin(scenario(plan=PLAN)) as twin:  # three beams: its axes differ
        operator = Moving(described, twin.instrument.move_to)
        acquire(described, twin.source, tmp_path / "run.csv", trigger=KeyTrigger(), options=fast(), operator=operator)
        third = [reading.read for reading in read_raw(tmp_path / "run.raw.jsonl").readings().values()]
    assert len(third) == 8
    simulated = simulate_scenario(scenario(plan=PLAN))
    run = read_measurement(tmp_path / "run.csv").channels["distance"]
    assert np.allclose(run[:4], simulated.channels["d1"][:4], rtol=0.0, atol=1e-9)


def test_channels_of_heads_that_make_no_sense_are_named() -> None:
    for left, message in ((["x"], "head.left.channels: expected axes of the IDS3010"), (["4"], "head.left.channels")):
        with pytest.raises(InvalidArgument, match=message):
            instrument_of("ids3010://h", heads(left, ["1"]).known, AcquireOptions(), print)
    known = heads(["1"], ["2"]).known
    with pytest.raises(InvalidArgument, match="axes: the scenario says"):
        instrument_of("ids3010://h", known, AcquireOptions(axes=(1,)), print)
