"""The simulated configuration that is shipped starts, compensates, takes tools and asks for readings by the bridge."""

import json
import shutil
import socketserver
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linuxcnc_machine import CHAIN, KINS

from stepdiag import Compensator
from stepdiag.linuxcnc.session import LinuxcncError, LinuxcncSession

CONTROLLER = Path(__file__).parents[2] / "controllers" / "linuxcnc"
ARITHMETIC = 1e-11  # mm: see test_kinematics.py
READ = """\
o<read> sub
M68 E0 Q#1
M68 E1 Q#2
M64 P0
M66 P0 L3 Q{timeout}
o100 if [#5399 LT 0]
  M65 P0
  (MSG, no reading)
  M2
o100 endif
M65 P0
M66 P0 L4 Q5
o<read> endsub
G21 G90 F6000
"""


class Peer(socketserver.ThreadingTCPServer):
    """An acquisition that stores all but visit 9, or a twin that goes where it is sent; each notes what it is asked."""

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.asked: list[Any] = []
        self.port = int(self.server_address[1])

    def __enter__(self) -> "Peer":
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()
        self.server_close()


class Handler(socketserver.StreamRequestHandler):
    server: Peer

    def handle(self) -> None:
        for line in self.rfile:
            if line.startswith(b"READ"):
                _, visit, point = line.decode().split()
                self.server.asked.append((int(visit), int(point)))
                answer = "FAIL no beam\n" if visit == "9" else f"DONE {visit} {point}\n"
            else:
                request = json.loads(line)
                self.server.asked.append(request)
                answer = json.dumps({"jsonrpc": "2.0", "result": [0], "id": request["id"]}) + "\r\n"
            self.wfile.write(answer.encode())


@pytest.fixture(scope="module")
def acquisition() -> Iterator[Peer]:
    with Peer() as peer:
        yield peer


@pytest.fixture(scope="module")
def twin() -> Iterator[Peer]:
    with Peer() as peer:
        yield peer


@pytest.fixture(scope="module")
def session(acquisition: Peer, twin: Peer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LinuxcncSession]:
    folder = tmp_path_factory.mktemp("configuration")
    shutil.copytree(CONTROLLER / "simulated", folder / "simulated")
    ini, reading = folder / "simulated" / "stepdiag.ini", folder / "simulated" / "reading.hal"
    ini.write_text(ini.read_text().replace("#HALFILE = reading.hal", "HALFILE = reading.hal"))
    reading.write_text(
        reading.read_text()
        .replace("../stepdiag_bridge.py", "stepdiag_bridge.py --timeout 5")
        .replace("127.0.0.1:7000", f"127.0.0.1:{acquisition.port} --twin 127.0.0.1:{twin.port}")
    )
    shutil.copyfile(CONTROLLER / "stepdiag_bridge.py", folder / "simulated" / "stepdiag_bridge.py")
    with LinuxcncSession(configuration=ini) as session:
        yield session


def compensator(**options: Any) -> Compensator:
    return Compensator(CONTROLLER / "simulated" / "calibration.csv", CHAIN, outside="linear", margin=10.0, **options)


def test_it_compensates(session: LinuxcncSession) -> None:
    points = [(400.0, 300.0, 200.0), (-9.0, 120.0, 50.0)]
    assert np.abs(session.visit(points) - compensator().command(points)).max() < ARITHMETIC


def test_it_takes_the_length_of_the_tool_where_it_is_told_to(session: LinuxcncSession) -> None:
    session.set_pin(KINS + "use-tool", True)
    session.mdi("T2 M6")
    session.mdi("G43")
    session.wait_for_pin(KINS + "tool-z", -60.0)
    joints = session.visit([(100.0, 100.0, 100.0)])
    assert np.abs(joints - compensator().command([(100.0, 100.0, 100.0)], tool=(0.0, 0.0, -60.0))).max() < ARITHMETIC
    session.mdi("G49")
    session.wait_for_pin(KINS + "tool-z", 0.0)
    session.set_pin(KINS + "use-tool", False)
    session.wait_for_pin(KINS + "tool-z", -150.0)


def test_readings_are_taken_where_the_joints_stand(
    session: LinuxcncSession, acquisition: Peer, twin: Peer, tmp_path: Path
) -> None:
    acquisition.asked.clear()
    twin.asked.clear()
    points = [(10.0 * k, 100.0, 50.0 + k) for k in range(6)]
    moves = [f"G53 G1 X{x} Y{y} Z{z}\no<read> call [3] [{k}]" for k, (x, y, z) in enumerate(points)]
    program = tmp_path / "read.ngc"
    program.write_text("\n".join([READ.format(timeout=20), *moves, "M2", ""]), encoding="ascii")
    session.run_program(program)
    assert acquisition.asked == [(3, k) for k in range(6)]
    assert {(request["method"], request["api"]) for request in twin.asked} == {("stepdiag.twin.moveTo", 2)}
    sent = np.array([request["params"] for request in twin.asked])
    assert np.abs(sent - compensator().command(points)).max() < ARITHMETIC
    assert session.pin("stepdiag-bridge.readings") == 6
    assert session.pins([f"stepdiag-bridge.{pin}" for pin in ("request", "done", "failed")]) == [False] * 3


def test_a_reading_that_fails_stops_the_program(session: LinuxcncSession, acquisition: Peer, tmp_path: Path) -> None:
    program = tmp_path / "fail.ngc"
    program.write_text(READ.format(timeout=1) + "o<read> call [9] [0]\nG53 G1 X50\nM2\n", encoding="ascii")
    session.mdi("G53 G0 X10 Y10 Z10")
    before = session.joints()
    assert "message: no reading" in session.run_program(program)
    assert session.joints() == before
    assert "stepdiag-bridge: acquisition: visit 9, point 0: FAIL no beam" in session.log


def test_the_bridge_tells_when_nobody_answers(session: LinuxcncSession, acquisition: Peer) -> None:
    readings = session.pin("stepdiag-bridge.readings")
    acquisition.asked.clear()
    with pytest.raises(LinuxcncError):
        session.mdi("M64 P99")
    session.mdi("M68 E0 Q9")
    session.mdi("M64 P0")
    session.wait_for_pin("stepdiag-bridge.failed", True)
    session.mdi("M65 P0")
    session.wait_for_pin("stepdiag-bridge.failed", False)
    assert session.pin("stepdiag-bridge.readings") == readings
