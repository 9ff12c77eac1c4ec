"""What the tests of acquisition share: scenarios, a controller that moves and asks, instruments that misbehave."""

import json
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stepdiag.acquisition.acquire import Acquired, acquire
from stepdiag.acquisition.options import AcquireOptions
from stepdiag.acquisition.settling import Settling
from stepdiag.acquisition.tcp_trigger import TcpTrigger
from stepdiag.instruments.ids3010 import Ids3010
from stepdiag.scenario.description import Scenario, parse_scenario
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.twin.server import Twin

BEAMS = 'layout = "multi_beam"\nbeam_offsets_mm = [[15.0, 0.0], [-7.5, 13.0], [-7.5, -13.0]]'
IDEAL = 'layout = "ideal"'
SCENARIO = """
[volume]
x_mm = 80.0
y_mm = 60.0
z_mm = 50.0
[machine]
chain = "[w X' b Y Z t]"
tool_mm = [3.0, -2.0, 40.0]
[machine.random]
seed = 7
[plan]
{plan}
[head]
{head}
[misalignment]
reflector_urad = [100.0, 300.0]
[noise]
{noise}
[plausible.inputs]
reading_s = {{inner = [0.0, 60.0]}} # nothing has to settle
"""
LINES = 'lines = ["ppp", "npp", "pnp", "nnp"]\nscale_lines = ["p00", "0p0", "00p"]\nsteps = 4'
SMALL = 'lines = ["ppp", "npp"]\nsteps = 2\nbackward = true'  # visits 1 and 2, 3 and 4, of 7 points each

# Nothing here moves but the twin, which is at rest at once.
FAST = Settling(count=2, average=2, interval=0.0, retries=1, retry_wait=0.0)


def scenario(*, plan: str = SMALL, head: str = BEAMS, noise: str = "") -> Scenario:
    return parse_scenario(SCENARIO.format(plan=plan, head=head, noise=noise))


def fast(**options: Any) -> AcquireOptions:
    return AcquireOptions(**({"settling": FAST, "wait_timeout": 20.0} | options))


def points_of(described: Scenario) -> list[tuple[int, int, list[float]]]:
    """Visit, point and position of all readings in order."""
    return [
        (visit.number, int(point), [float(x) for x in position])
        for visit in visits_of(described.known)
        for point, position in zip(visit.points, visit.positions, strict=True)
    ]


@dataclass
class Listener:
    """An operator who notes what is told, and is always ready."""

    told: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def tell(self, text: str) -> None:
        self.told.append(text)

    def confirm(self, text: str) -> None:
        self.asked.append(text)

    def repeats(self, text: str) -> bool:
        self.told.append(text)
        return False


class Controller:
    """Moves the twin through the plan and asks for readings, as a bridge of a controller does."""

    def __init__(self, described: Scenario, twin: tuple[str, int], trigger: tuple[str, int]) -> None:
        self.points = points_of(described)
        self._twin = Ids3010(*twin)
        self._socket = socket.create_connection(trigger, 10.0)
        self._file = self._socket.makefile("rw", newline="\n")

    def __enter__(self) -> "Controller":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        self._socket.close()
        self._twin.close()

    def ask(self, line: str) -> str:
        """The answer to a line; empty where the connection ends."""
        try:
            self._file.write(line + "\n")
            self._file.flush()
            return self._file.readline().strip()
        except OSError:
            return ""

    def read(self, visit: int, point: int, position: list[float]) -> str:
        self._twin.ask("stepdiag.twin.moveTo", position)
        return self.ask(f"READ {visit} {point}")

    def run(self, begin: int = 0, end: int | None = None) -> None:
        """Reads these points of the plan; all of them are wanted."""
        for visit, point, position in self.points[begin:end]:
            answer = self.read(visit, point, position)
            assert answer == f"DONE {visit} {point}", answer


def acquire_through(
    described: Scenario,
    twin: Twin,
    output: Path,
    *,
    begin: int = 0,
    end: int | None = None,
    trigger: TcpTrigger | None = None,
    operator: Listener | None = None,
    options: AcquireOptions | None = None,
    **others: Any,
) -> Acquired:
    """An acquisition with a controller that asks for these points of the plan."""
    trigger = trigger or TcpTrigger()
    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(
            acquire,
            described,
            twin.source,
            output,
            trigger=trigger,
            options=options or fast(),
            operator=operator or Listener(),
            **others,
        )
        with Controller(described, twin.address, trigger.address) as controller:
            controller.run(begin, end)
            return running.result(30.0)


Answer = Callable[[dict[str, Any]], bytes | None]


@contextmanager
def instrument(answer: Answer) -> Iterator[tuple[str, int]]:
    """An instrument that answers every request by `answer`: bytes as they are, or None, upon which it hangs up."""
    server = socket.create_server(("127.0.0.1", 0))
    ended = threading.Event()
    clients: list[socket.socket] = []

    def serve(client: socket.socket) -> None:
        decoder, text = json.JSONDecoder(), ""
        try:
            while data := client.recv(4096):
                text += data.decode()
                while text:
                    request, end = decoder.raw_decode(text)
                    text = text[end:].lstrip()
                    reply = answer(request)
                    if reply is None:
                        client.close()
                        return
                    client.sendall(reply)
        except OSError:
            return

    def accept() -> None:
        while not ended.is_set():
            try:
                client, _ = server.accept()
            except OSError:
                return
            clients.append(client)
            threading.Thread(target=serve, args=(client,), daemon=True).start()

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    try:
        yield server.getsockname()[:2]
    finally:
        ended.set()
        with suppress(OSError):  # Windows: it is not connected; to close it is enough
            server.shutdown(socket.SHUT_RDWR)
        server.close()
        for client in clients:
            client.close()
        thread.join()


def reply(request: dict[str, Any], *result: Any) -> bytes:
    return json.dumps({"jsonrpc": "2.0", "result": list(result), "id": request["id"]}).encode() + b"\r\n"


def sound(request: dict[str, Any]) -> bytes:
    """What an instrument at rest answers."""
    method = request["method"].rsplit(".", 1)[-1]
    if method == "getCurrentMode":
        return reply(request, 0, "measurement running")
    if method == "getAbsolutePositions":
        return reply(request, 0, 100_000_000_001, 100_000_000_002, 100_000_000_003)
    if method == "getAbsolutePosition":
        return reply(request, 0, 100_000_000_001 + request["params"][0])
    return reply(request, 0, "a text")
