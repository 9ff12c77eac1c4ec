"""A twin reads the virtual machine as the instrument would read a real one."""

import contextlib
import json
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal

import numpy as np
import pytest
from acquiring import IDEAL, LINES, scenario
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stepdiag._core import InvalidArgument, VirtualReadout
from stepdiag.instruments.ids3010 import Ids3010
from stepdiag.instruments.instrument import InstrumentError
from stepdiag.scenario.description import Scenario, simulate_scenario
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.twin.instrument import TwinBehaviour
from stepdiag.twin.server import CLIENTS, Twin


def readout(described: Scenario, line: str) -> VirtualReadout:
    return VirtualReadout(
        described.machine(),
        described.known.plan,
        described.known.head,
        line,
        misalignment=dict(described.truth.misalignment),
        noise=described.truth.noise,
    )


def test_readout_at_the_plans_points_is_the_simulated_run() -> None:
    described = scenario(plan=LINES + "\nbackward = true", noise="distance_um = 0.1\nseed = 5")
    run = simulate_scenario(described)
    row = 0
    for visit in visits_of(described.known):
        head = readout(described, visit.line)
        approach = "".join("-" if sign < 0 else "+" for sign in visit.approach)
        for position in visit.positions:
            signals = head.read(position, approach, row=row)
            assert [run.channels[f"d{i + 1}"][row] for i in range(3)] == list(signals)  # the same bits
            row += 1


def test_readout_moves_on_between_the_plans_points() -> None:
    described = scenario(noise="")
    head = readout(described, "ppp")
    along = described.known.plan.frame("ppp")[:, 2]
    near, far = head.read((10.0, 20.0, 30.0)), head.read((10.001, 20.0, 30.0))
    # The slope of the machine's errors is below 1e-3, of the mirror's tilt too.
    assert np.allclose(far - near, 0.001 * along[0], rtol=0.0, atol=2e-6)


def test_readout_refuses_what_it_cannot_be() -> None:
    described = scenario()
    with pytest.raises(InvalidArgument, match='"pnn" is not in the plan'):
        readout(described, "pnn")
    head = readout(described, "ppp")
    for arguments, words, message in (
        (((1.0, 2.0),), {}, "position: expected 3 numbers"),
        (((1.0, 2.0, np.nan),), {}, "position: expected three finite numbers"),
        (((1.0, 2.0, 3.0), "++"), {}, "approach"),
        (((1.0, 2.0, 3.0),), {"row": -1}, "row"),
    ):
        with pytest.raises(InvalidArgument, match=message):
            head.read(*arguments, **words)


def test_twin_counts_picometres_of_the_beams() -> None:
    described = scenario()
    with Twin(described) as twin, Ids3010(*twin.address) as ids:
        ids.ask("stepdiag.twin.setUp", [2])
        ids.ask("stepdiag.twin.moveTo", [70.0, 12.5, 3.25])
        expected = readout(described, "npp").read((70.0, 12.5, 3.25), "-++")
        assert ids.read((0, 1, 2)).pm == tuple(round(float(d) * 1e9) for d in expected)


def test_axes_come_from_where_they_last_moved() -> None:
    described = scenario()
    with Twin(described) as twin, Ids3010(*twin.address) as ids:
        approaches = []
        for position in ([5, 5, 5], [4, 5, 6], [4, 4, 6], [4, 4, 6], [9, 4, 6]):
            ids.ask("stepdiag.twin.moveTo", [float(p) for p in position])
            approaches.append(ids.ask("stepdiag.twin.state")[1]["approach"])
    assert approaches == ["+++", "-++", "--+", "--+", "+-+"]


def test_one_axis_reads_the_distance_of_the_ideal_head() -> None:
    described = scenario(head=IDEAL)
    with Twin(described) as twin, Ids3010(*twin.address) as ids:
        ids.ask("stepdiag.twin.moveTo", [1.0, 2.0, 3.0])
        expected = round(float(readout(described, "ppp").read((1.0, 2.0, 3.0))[0]) * 1e9)
        assert ids.ask("displacement.getAbsolutePositions") == [0, expected, 0, 0]
        assert ids.read((0,)).pm == (expected,)


def test_mirror_that_is_missed_is_a_beam_that_stays_lost() -> None:
    described = scenario(head=IDEAL + "\nmirror_mm = [95.0, 95.0]", plan='lines = ["ppp"]\nsteps = 4')
    with Twin(described) as twin, Ids3010(*twin.address) as ids:
        assert ids.read((0,)).warnings == (0,)
        ids.ask("stepdiag.twin.moveTo", [80.0, -500.0, 0.0])
        assert ids.read((0,)).pm == (None,)
        ids.ask("stepdiag.twin.moveTo", [0.0, 0.0, 0.0])
        assert ids.read((0,)).pm == (None,)
        assert ids.error_text(ids.read((0,)).warnings[0]).endswith("the beam was interrupted")
        assert ids.ask("com.attocube.ids.system.getDeviceType")[1] == "IDS3010 (stepdiag twin)"
        ids.start(1.0)
        assert ids.read((0,)).pm[0] is not None


def test_measurement_starts_and_stops_as_the_instruments() -> None:
    with Twin(scenario()) as twin, Ids3010(*twin.address) as ids:
        ids.ask("system.stopMeasurement")
        assert ids.mode() == "system idle"
        assert ids.read((0, 1, 2)).pm == (None, None, None)
        with pytest.raises(InstrumentError, match="the measurement is not running"):
            ids.ask("system.restartMeasurement")
        ids.start(1.0)
        assert ids.ask("displacement.getMeasurementEnabled") == [0, True]
        assert ids.ask("displacement.getAxesDisplacement") == [0, 0, 0, 0]
        before = ids.read((2,)).pm[0] or 0
        ids.ask("stepdiag.twin.moveTo", [1.0, 1.0, 1.0])
        moved = (ids.read((2,)).pm[0] or 0) - before
        assert ids.ask("displacement.getAxisDisplacement", [2]) == [0, moved]


def test_noise_is_drawn_with_a_move_not_with_a_value() -> None:
    described = scenario(noise="distance_um = 0.1\nseed = 3")
    with Twin(described) as twin, Ids3010(*twin.address) as ids:
        read = []
        for _ in range(3):
            ids.ask("stepdiag.twin.moveTo", [1.0, 2.0, 3.0])
            values = {ids.read((0, 1, 2)).pm for _ in range(4)}
            assert len(values) == 1
            read.append(values.pop())
        assert len(set(read)) == 3


def test_visit_that_is_begun_again_draws_other_noise() -> None:
    described = scenario(noise="distance_um = 0.1\nseed = 3")
    with Twin(described) as twin, Ids3010(*twin.address) as ids:
        read = []
        for _ in range(2):
            ids.ask("stepdiag.twin.visit", [1])
            read.append(ids.read((0, 1, 2)).pm)
    assert read[0] != read[1]


def test_moves_ring_out() -> None:
    with Twin(scenario(), behaviour=TwinBehaviour(settling=0.5)) as twin:
        rest = twin.instrument.positions()[1][0]
        twin.instrument.move_to([1.0, 0.0, 0.0])
        moving = [twin.instrument.positions()[1][0] for _ in range(50)]
    assert len(set(moving)) > 1
    assert abs(moving[0] - rest) < 0.5 * 1e9 * 1.0


def test_several_clients_read_at_once() -> None:
    def read(twin: Twin) -> list[tuple[int | None, ...]]:
        with Ids3010(*twin.address) as ids:
            return [ids.read((0, 1, 2)).pm for _ in range(100)]

    with Twin(scenario()) as twin, ThreadPoolExecutor(4) as pool:
        results = [pool.submit(read, twin) for _ in range(4)]
        assert len({pm for result in results for pm in result.result(20)}) == 1


def exchange(twin: Twin, data: bytes) -> dict[str, Any]:
    with socket.create_connection(twin.address, 5.0) as client:
        client.sendall(data)
        with client.makefile("rb") as file:
            answer = json.loads(file.readline())
    assert isinstance(answer, dict)
    return answer


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", "expected a JSON-RPC request"),
        (b'{"jsonrpc": "2.0", "id": 1}', "method not found: None"),
        (b'{"method": "com.attocube.ids.system.fly", "id": 1}', "method not found: 'com.attocube.ids.system.fly'"),
        (b'{"method": ["a"], "id": 1}', "method not found"),
        (b'{"method": "stepdiag.twin.moveTo", "params": {"x": 1}, "id": 1}', "params: expected a list"),
        (b'{"method": "stepdiag.twin.moveTo", "params": [1, 2], "id": 1}', "expected the positions of X, Y and Z"),
        (b'{"method": "stepdiag.twin.moveTo", "params": [1, 2, "3"], "id": 1}', "expected the positions of X, Y and Z"),
        (b'{"method": "stepdiag.twin.moveTo", "params": [1, 2, 1e999], "id": 1}', "expected three finite numbers"),
        (b'{"method": "stepdiag.twin.moveTo", "params": [1, 2, 1' + b"0" * 400 + b'], "id": 1}', "too large"),
        (b'{"method": "stepdiag.twin.setUp", "params": [0], "id": 1}', "setUp: expected 1 to 2, got 0"),
        (b'{"method": "stepdiag.twin.setUp", "params": [], "id": 1}', "setUp: expected the number of a set-up"),
        (b'{"method": "stepdiag.twin.visit", "params": [9], "id": 1}', "visit: expected 1 to 4, got 9"),
        (b'{"method": "stepdiag.twin.visit", "params": [1, 7], "id": 1}', "visit: expected a place from 0 to 6, got 7"),
        (
            b'{"method": "stepdiag.twin.visit", "params": [1, 0, "x"], "id": 1}',
            "visit: the twin has another plan or head",
        ),
        (b'{"method": "stepdiag.twin.visit", "params": [1, 0, 5], "id": 1}', "visit: expected a digest as a text"),
        (b'{"method": "com.attocube.ids.displacement.getAxisDisplacement", "id": 1}', "expected the number of an axis"),
    ],
)
def test_bad_requests_are_answered_with_an_error(data: bytes, message: str) -> None:
    with Twin(scenario()) as twin:
        answer = exchange(twin, data)
        assert message in answer["error"]["message"]
        assert exchange(twin, b'{"method": "com.attocube.ids.system.getCurrentMode", "id": 2}')["result"][0] == 0


@pytest.fixture(scope="module")
def shared() -> Any:
    with Twin(scenario()) as twin:
        yield twin


ANY = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=5,
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    name=st.sampled_from(["moveTo", "setUp", "visit", "state"]) | st.text(max_size=5),
    params=st.lists(ANY, max_size=4) | ANY,
)
def test_any_request_is_answered(shared: Twin, name: str, params: Any) -> None:
    request = {"jsonrpc": "2.0", "method": f"stepdiag.twin.{name}", "params": params, "id": 1}
    data = json.dumps(request).encode()
    if b"NaN" in data or b"Infinity" in data:
        return
    answer = exchange(shared, data)
    assert "result" in answer or "error" in answer


def test_twin_that_cannot_listen_says_so() -> None:
    with Twin(scenario()) as twin:
        host, port = twin.address
        with pytest.raises(InvalidArgument, match=f"cannot listen on {host}:{port}"):
            Twin(scenario(), host=host, port=port)


@pytest.mark.parametrize("given", [{"settling": -1.0}, {"sampling_noise_um": float("nan")}])
def test_behaviour_that_makes_no_sense_is_refused(given: dict[str, float]) -> None:
    with pytest.raises(InvalidArgument, match=next(iter(given))):
        TwinBehaviour(**given)


def test_traced_head_reads_as_in_its_simulated_run() -> None:
    described = scenario(plan='lines = ["ppp"]\nsteps = 2', head='description = "three_beams"')
    run = simulate_scenario(described)
    with Twin(described) as twin, Ids3010(*twin.address) as ids:
        ids.ask("stepdiag.twin.visit", [1])
        for row, position in enumerate(run.position):
            if row:
                ids.ask("stepdiag.twin.moveTo", [float(p) for p in position])
            expected = tuple(round(float(run.channels[f"d{i + 1}"][row]) * 1e9) for i in range(3))
            assert ids.read((0, 1, 2)).pm == expected


def test_twin_that_plays_stands_at_the_point_where_a_visit_is_begun() -> None:
    """Before it answers: a client that goes on in the middle of a visit reads at once."""
    described = scenario()
    visit = list(visits_of(described.known))[1]
    with Twin(described, play=1000.0) as twin, Ids3010(*twin.address) as client:
        client.ask("stepdiag.twin.visit", [visit.number, 4])
        _, state = client.ask("stepdiag.twin.state")
    np.testing.assert_array_equal(state["position_mm"], visit.positions[4])


@pytest.mark.slow
@pytest.mark.parametrize("protocol", ["ids3010", "lines"])
def test_clients_beyond_a_few_are_refused_until_others_leave(protocol: Literal["ids3010", "lines"]) -> None:
    def first_line() -> bytes:
        with socket.create_connection(twin.address, 10.0) as client, client.makefile("rb") as file:
            client.sendall(b'{"method": "none"}\n')
            return file.readline()

    with Twin(scenario(), protocol=protocol) as twin:
        with contextlib.ExitStack() as clients:
            for _ in range(CLIENTS):
                clients.enter_context(socket.create_connection(twin.address, 10.0))
            assert first_line() == b'{"error": "the twin has 16 clients already"}\r\n'
        deadline = time.monotonic() + 10.0
        while b"clients already" in first_line():
            assert time.monotonic() < deadline
