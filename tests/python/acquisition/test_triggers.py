"""Readings are taken when they are wanted: by a controller, by the operator, or where the mirror comes to rest."""

import contextlib
import errno
import itertools
import os
import selectors
import socket
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from acquiring import Controller, Listener, fast, points_of, scenario

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.acquire import Acquired, acquire
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.acquisition.settle_trigger import SettleTrigger
from stepdiag.acquisition.settling import Settling
from stepdiag.acquisition.tcp_trigger import TcpTrigger
from stepdiag.acquisition.triggers import KeyTrigger, Stopped, Trigger
from stepdiag.instruments.instrument import InstrumentError
from stepdiag.io.data_files import read_measurement
from stepdiag.scenario.description import Scenario, simulate_scenario
from stepdiag.twin.instrument import TwinBehaviour
from stepdiag.twin.server import Twin

LINE = 'lines = ["ppp"]\nsteps = 1'


@contextmanager
def acquiring_from(
    described: Scenario, twin: Twin, output: Path, trigger: Trigger, **options: Any
) -> Iterator[tuple[Future[Acquired], Listener]]:
    operator = Listener()
    with ThreadPoolExecutor(1) as pool:
        yield (
            pool.submit(
                acquire, described, twin.source, output, trigger=trigger, options=fast(**options), operator=operator
            ),
            operator,
        )


def test_only_the_next_point_is_read(tmp_path: Path) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    with Twin(described) as twin, acquiring_from(described, twin, tmp_path / "run.csv", trigger) as (running, operator):
        with Controller(described, twin.address, trigger.address) as controller:
            assert controller.ask("READ 1 1") == "FAIL expected visit 1 point 0, got visit 1 point 1"
            assert controller.ask("READ 2 0") == "FAIL expected visit 1 point 0, got visit 2 point 0"
            controller.run(0, 2)
            assert controller.ask("READ 1 0") == "FAIL expected visit 1 point 2, got visit 1 point 0"
            controller.run(2)
        assert running.result(10).complete
    assert sum("refused a request" in text for text in operator.told) == 3


def test_last_point_is_read_again_for_a_controller_that_had_no_answer(tmp_path: Path) -> None:
    described, trigger = scenario(noise="distance_um = 0.1\nseed = 3"), TcpTrigger()
    with Twin(described) as twin, acquiring_from(described, twin, tmp_path / "run.csv", trigger) as (running, _):
        with Controller(described, twin.address, trigger.address) as controller:
            for index in range(28):
                controller.run(index, index + 1)
                if index in (0, 3, 6, 13):  # the last of a visit and of a set-up too
                    controller.run(index, index + 1)
        assert running.result(10).complete
    assert sum(record.record == "reading" for record in read_raw(tmp_path / "run.raw.jsonl").records) == 32
    run, expected = read_measurement(tmp_path / "run.csv"), simulate_scenario(described)
    assert np.array_equal(run.channels["d1"], np.round(expected.channels["d1"] * 1e9) / 1e9)


@pytest.mark.parametrize(
    "line",
    [
        "",
        "READ",
        "READ 1",
        "read 1 0",
        "READ 1 0 0",
        "READ 1 -1",
        "READ 1 0.0",
        "READ 1 ²",
        "READ 1 " + "9" * 50,
        "\0\x7f",
    ],
)
def test_lines_of_another_kind_fail(tmp_path: Path, line: str) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    with Twin(described) as twin, acquiring_from(described, twin, tmp_path / "run.csv", trigger) as (running, _):
        with Controller(described, twin.address, trigger.address) as controller:
            assert controller.ask(line).startswith("FAIL expected READ <visit> <point>, got ")
            controller.run()
        assert running.result(10).complete


def test_line_without_an_end_is_hung_up_on(tmp_path: Path) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    with Twin(described) as twin, acquiring_from(described, twin, tmp_path / "run.csv", trigger) as (running, _):
        with socket.create_connection(trigger.address, 5.0) as client, client.makefile("rb") as file:
            client.sendall(b"x" * 1000)
            assert file.readline() == b"FAIL expected READ <visit> <point>, got a line without an end\n"
            assert file.readline() == b""
        with Controller(described, twin.address, trigger.address) as controller:
            controller.run()
        assert running.result(10).complete


def test_clients_come_and_go_and_each_gets_its_answer(tmp_path: Path) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    with Twin(described) as twin, acquiring_from(described, twin, tmp_path / "run.csv", trigger) as (running, _):
        with Controller(described, twin.address, trigger.address) as one:
            with Controller(described, twin.address, trigger.address) as other:
                assert one.read(*one.points[0]) == "DONE 1 0"
                assert other.read(*other.points[1]) == "DONE 1 1"
            with socket.create_connection(trigger.address, 5.0) as gone:
                gone.sendall(b"READ 1")  # and hangs up in the middle of a line
            one.run(2)
        assert running.result(10).complete


def test_client_that_floods_does_not_keep_others_waiting(tmp_path: Path) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    with (
        Twin(described) as twin,
        acquiring_from(described, twin, tmp_path / "run.csv", trigger) as (running, _),
        socket.create_connection(trigger.address, 10.0) as flood,
    ):
        flood.sendall(b"x\n" * 3000)
        with Controller(described, twin.address, trigger.address) as controller:
            controller.run()
        assert running.result(10).complete
        flood.settimeout(10.0)
        assert flood.recv(20) == b"FAIL expected READ <"


def test_flood_of_wrong_requests_is_told_in_a_few_lines_and_hung_up_on(tmp_path: Path) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    with Twin(described) as twin, acquiring_from(described, twin, tmp_path / "run.csv", trigger) as (running, operator):
        for _ in range(20):
            with socket.create_connection(trigger.address, 10.0) as flood, flood.makefile("rb") as file:
                with contextlib.suppress(OSError):
                    flood.sendall(b"READ 9 9\n" * 3000)
                with contextlib.suppress(OSError):
                    assert sum(1 for _ in file) <= TcpTrigger.WRONG + 1
        with Controller(described, twin.address, trigger.address) as controller:
            controller.run()
        assert running.result(10).complete
    assert sum("refused a request" in text for text in operator.told) < 50  # of 2000; five in five seconds


def test_clients_beyond_a_few_are_refused(tmp_path: Path) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    with Twin(described) as twin, acquiring_from(described, twin, tmp_path / "run.csv", trigger) as (running, operator):
        with contextlib.ExitStack() as clients:
            for _ in range(TcpTrigger.CLIENTS):
                clients.enter_context(socket.create_connection(trigger.address, 10.0))
            with socket.create_connection(trigger.address, 10.0) as one, one.makefile("rb") as file:
                assert file.readline() == b"FAIL 4 clients already\n"
                assert file.readline() == b""
        with Controller(described, twin.address, trigger.address) as controller:
            controller.run()
        assert running.result(10).complete
    assert "refused a client beside 4 others" in operator.told


def test_trigger_does_not_spin_where_no_more_files_may_be_open(monkeypatch: pytest.MonkeyPatch) -> None:
    trigger, tries = TcpTrigger(), []

    class Full:
        """A socket on which somebody waits who cannot be accepted."""

        def accept(self) -> None:
            tries.append(time.monotonic())
            raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

        def fileno(self) -> int:
            return trigger_socket.fileno()

        def close(self) -> None:
            pass

    trigger_socket = trigger._server
    trigger._selector.unregister(trigger_socket)
    full = Full()
    trigger._selector.register(full, selectors.EVENT_READ)
    monkeypatch.setattr(trigger, "_server", full)
    with socket.create_connection(trigger.address, 5.0):
        for _ in range(10):
            assert trigger._next_line(0.05) is None
    trigger_socket.close()
    assert len(tries) >= 1
    assert all(later - earlier >= TcpTrigger.NO_FILES for earlier, later in itertools.pairwise(tries))


def test_answer_comes_when_the_reading_is_on_the_disk(tmp_path: Path) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    with Twin(described) as twin, acquiring_from(described, twin, tmp_path / "run.csv", trigger) as (running, _):
        with Controller(described, twin.address, trigger.address) as controller:
            for count, (visit, point, position) in enumerate(controller.points, start=1):
                controller.read(visit, point, position)
                assert len(read_raw(tmp_path / "run.raw.jsonl").readings()) == count
        assert running.result(10).complete


def test_reading_that_never_settles_is_done_and_lost(tmp_path: Path) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    settling = Settling(count=3, limit_um=0.001, average=2, interval=0.0, timeout=0.05)
    with (
        Twin(described, behaviour=TwinBehaviour(sampling_noise_um=1.0)) as twin,
        acquiring_from(described, twin, tmp_path / "run.csv", trigger, settling=settling) as (running, operator),
    ):
        with Controller(described, twin.address, trigger.address) as controller:
            controller.run()
        result = running.result(10)
    assert (result.readings, result.lost) == (4, 4)
    assert np.all(np.isnan(read_measurement(tmp_path / "run.csv").channels["d1"]))
    assert any("did not settle within 0.05 s" in text for text in operator.told)


def test_instrument_that_goes_away_fails_the_reading_and_keeps_the_others(tmp_path: Path) -> None:
    described, trigger = scenario(plan=LINE), TcpTrigger()
    twin = Twin(described)
    with acquiring_from(described, twin, tmp_path / "run.csv", trigger, timeout=0.6, attempts=2) as (running, _):
        with twin, Controller(described, twin.address, trigger.address) as controller:
            controller.run(0, 2)
            twin.instrument.positions = hang  # type: ignore[method-assign]
            visit, point, _ = controller.points[2]
            answer = controller.ask(f"READ {visit} {point}")
            assert answer.startswith("FAIL ids3010://127.0.0.1:")
            assert "no answer within 0.6 s" in answer
        with pytest.raises(InstrumentError, match="no answer within"):
            running.result(10)
    assert len(read_measurement(tmp_path / "run.csv")) == 2


def hang() -> tuple[list[int], list[int]]:
    time.sleep(1.5)
    return [0, 0, 0], [0, 0, 0]


def test_nobody_is_waited_for_without_end(tmp_path: Path) -> None:
    described = scenario(plan=LINE)
    with Twin(described) as twin:
        for trigger, told in ((TcpTrigger(), "no request within 0.1 s"), (SettleTrigger(), "did not arrive")):
            with pytest.raises(Stopped, match=told):
                acquire(
                    described,
                    twin.source,
                    tmp_path / f"{type(trigger).__name__}.csv",
                    trigger=trigger,
                    options=fast(wait_timeout=0.1),
                    operator=Listener(),
                )


def test_trigger_that_cannot_listen_says_so() -> None:
    trigger = TcpTrigger()
    with pytest.raises(InvalidArgument, match=r"trigger: cannot listen on 127\.0\.0\.1:"):
        TcpTrigger(*trigger.address)
    trigger.close()


def test_operator_asks_for_every_reading(tmp_path: Path) -> None:
    described = scenario()
    with Twin(described) as twin:
        points = [position for _, _, position in points_of(described)]

        class Moving(Listener):
            def confirm(self, text: str) -> None:
                super().confirm(text)
                twin.instrument.move_to(points[len(self.asked) - 1])

        operator = Moving()
        result = acquire(
            described, twin.source, tmp_path / "run.csv", trigger=KeyTrigger(), options=fast(), operator=operator
        )
    assert result.complete
    assert len(operator.asked) == 28
    assert operator.asked[8] == "read visit 2 (line ppp, run 1, backward), point 5 at X80 Y60 Z25"
    expected = simulate_scenario(described).channels["d1"]
    assert np.array_equal(read_measurement(tmp_path / "run.csv").channels["d1"], np.round(expected * 1e9) / 1e9)
    placements = [text for text in operator.told if text.startswith("set-up")]
    # The corner that the line begins in, with the tool (3, -2, 40): 100 mm before it the head.
    assert placements[0] == (
        "set-up 1 of 2, line ppp: head at the front left low corner, its beam from X-68.6 Y-55.7 Z-4.7 mm, "
        "looking along X+, turned 36.9° to the left, 26.6° up; mirror in the spindle at X3.0 Y-2.0 Z40.0 mm, "
        "facing the head, along X-, turned 36.9° to the left, 26.6° down"
    )
    assert placements[1] == "set-up 1 stays as it is: run 1, backward"
    assert placements[2].startswith(
        "set-up 2 of 2, line npp: head at the front right low corner, its beam from X154.6 "
    )
