"""A run that is watched: delay from reading to page, load and memory of its processes.

    ./run python benchmarks/live_run.py [POINTS]

A twin that sends 500 samples a second, `stepdiag acquire` in a process of its own, `stepdiag app` in another one, and
two pages, which are clients of its stream. A controller asks for one reading after the other, as fast as they come. For
the delay a hand is held into the beam: it is seen when the stream says that there is no beam. A browser adds what it
takes to paint a page. The answers are checked: every point is read, both pages have the same readings, none is lost.
"""

import http.client
import json
import os
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, Final

from stepdiag.acquisition.control import ask_for
from stepdiag.acquisition.live_state import control_path
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.scenario.description import read_scenario
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.twin.server import Twin

SCENARIO: Final = """
[volume]
x_mm = 800.0
y_mm = 600.0
z_mm = 500.0
[machine]
chain = "[w X' b Y Z t]"
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
steps = {steps}
[head]
layout = "ideal"
[plausible.inputs]
reading_s = {{inner = [0.0, 60.0]}}
"""
HOURS: Final = 8.0
SECONDS_A_READING: Final = 3.0  # of a machine
TRIES: Final = 40


class Watching(threading.Thread):
    """A page: a client of the stream."""

    def __init__(self, port: int, cookie: str, address: str) -> None:
        super().__init__(daemon=True)
        self._connection = http.client.HTTPConnection("127.0.0.1", port)
        self._connection.request("GET", f"{address}/events", headers={"Cookie": cookie})
        self._answer = self._connection.getresponse()
        self.state: dict[str, Any] = {}
        self.dark: list[float] = []  # when the beam was seen to go
        self.readings = 0
        self.start()

    def run(self) -> None:
        name = ""
        for raw in self._answer:
            line = raw.decode().rstrip("\n")
            if line.startswith("event: "):
                name = line.removeprefix("event: ")
            elif line.startswith("data: "):
                content = json.loads(line.removeprefix("data: "))
                if name == "state":
                    was = bool(self.state.get("reasons"))
                    self.state = content
                    if content["reasons"] and not was:
                        self.dark.append(time.monotonic())
                elif name == "readings":
                    self.readings += len(content)


def used(process: int) -> tuple[float, float]:
    """CPU time, s, and resident memory, MB."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(") ", 1)[1].split()
    ticks = int(fields[11]) + int(fields[12])
    resident = re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{process}/status").read_text())
    return ticks / os.sysconf("SC_CLK_TCK"), int(resident[1]) / 1024.0 if resident else 0.0


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


def main() -> None:
    points = int(sys.argv[1]) if len(sys.argv) > 1 else round(HOURS * 3600.0 / SECONDS_A_READING)
    with tempfile.TemporaryDirectory() as temporary:
        measure(Path(temporary), (points // 4 - 1) // 3)


def measure(folder: Path, steps: int) -> None:
    os.chdir(folder)
    Path("vmc.toml").write_text(SCENARIO.format(steps=steps))
    command = [sys.executable, "-m", "stepdiag"]
    subprocess.run([*command, "book", "new", "VMC", "--book", "book"], check=True, stdout=subprocess.DEVNULL)
    add = [*command, "book", "add", "vmc.toml", "--machine", "VMC", "--book", "book"]
    subprocess.run(add, check=True, stdout=subprocess.DEVNULL)
    app = subprocess.Popen([*command, "app", "book", "--no-browser"], stdout=subprocess.PIPE, text=True)
    assert app.stdout is not None
    found = re.search(r"http://127.0.0.1:(\d+)(/enter\S+)", app.stdout.readline())
    assert found is not None
    port = int(found[1])
    entrance = http.client.HTTPConnection("127.0.0.1", port)
    entrance.request("GET", found[2])
    cookie = (entrance.getresponse().getheader("set-cookie") or "").split(";")[0]
    known = read_scenario("vmc.toml").known
    places = [(visit, index) for visit in visits_of(known) for index in range(len(visit.points))]
    asked = free_port()
    with Twin("vmc.toml", protocol="lines") as twin:
        acquire = subprocess.Popen(
            [
                *(*command, "acquire", "--machine", "VMC", "--book", "book", "vmc.toml", "--source", twin.source),
                *("--trigger", f"tcp://127.0.0.1:{asked}", "--settle-count", "2", "--average", "1"),
                *("--interval-ms", "0", "--watched", "-o", "run.csv"),
            ],
            stdout=subprocess.DEVNULL,
        )
        raw = folder / "book/machines/VMC/runs/run.raw.jsonl"
        while not control_path(raw).exists():
            time.sleep(0.05)
        pages = [Watching(port, cookie, "/machines/VMC/live/run") for _ in range(2)]
        while pages[0].state.get("doing") != "waits":
            time.sleep(0.05)
        controller = socket.create_connection(("127.0.0.1", asked))
        answers = controller.makefile()

        def read(index: int) -> None:
            visit, place = places[index]
            twin.instrument.move_to(visit.positions[place])
            controller.sendall(f"READ {visit.number} {int(visit.points[place])}\n".encode())
            answer = answers.readline()
            assert answer.startswith("DONE"), answer

        read(0)
        delays = []
        for _ in range(TRIES):
            before = len(pages[0].dark)
            began = time.monotonic()
            twin.instrument.block(True)
            while len(pages[0].dark) == before:
                time.sleep(0.0005)
            delays.append(pages[0].dark[-1] - began)
            twin.instrument.block(False)
            while pages[0].state["reasons"]:
                time.sleep(0.001)
        start, before = time.monotonic(), [used(acquire.pid), used(app.pid)]
        early = min(1000, len(places) // 4)
        memory = [before]
        for index in range(1, len(places) - 1):
            read(index)
            if index == early:
                memory.append([used(acquire.pid), used(app.pid)])
        took, after = time.monotonic() - start, [used(acquire.pid), used(app.pid)]
        while pages[1].readings < len(places) - 1 or pages[0].readings < len(places) - 1:
            time.sleep(0.05)
        ask_for(control_path(raw), "stop")
        acquire.wait()
    app.send_signal(signal.SIGINT)
    app.wait()
    readings = read_raw(raw).readings()
    assert len(readings) == len(places) - 1
    assert not any(reading.is_lost for reading in readings.values())
    count = len(places) - 2
    print(f"from beam to page: median {1e3 * statistics.median(delays):.0f} ms, longest {1e3 * max(delays):.0f} ms")
    hours = count * SECONDS_A_READING / 3600.0
    print(f"{count / took:.0f} readings a second, {count} in all ({hours:.1f} h of a machine)")
    for k, name in enumerate(("acquire", "app, two pages")):
        load = (after[k][0] - before[k][0]) / took
        sizes = ", ".join(f"{one[k][1]:.0f}" for one in (*memory, after))
        print(
            f"{name}: {100.0 * load:.0f} % of a core; {sizes} MB at the beginning, after {early} readings, at the end"
        )


if __name__ == "__main__":
    main()
