"""Kills what takes part in a run that is watched, again and again: nothing that was read is gone.

    ./run python tests/faults/live.py [KILLS]

First the acquisition is killed (SIGKILL) at random moments while a controller asks for readings, and goes on with
--resume. What the controller got a DONE for must be in the raw file. Then the application is killed while another
acquisition runs and a page watches it: the acquisition must read every point without a pause. The seeds are fixed.
"""

import http.client
import os
import random
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Final

from stepdiag.acquisition.live_state import live_path
from stepdiag.acquisition.raw_file import read_raw
from stepdiag.scenario.description import Scenario, read_scenario
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.twin.server import Twin

SCENARIO: Final = """
[volume]
x_mm = 80.0
y_mm = 60.0
z_mm = 50.0
[machine]
chain = "[w X' b Y Z t]"
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
steps = {steps}
[head]
layout = "multi_beam"
beam_offsets_mm = [[15.0, 0.0], [-7.5, 13.0], [-7.5, -13.0]]
[plausible.inputs]
reading_s = {{inner = [0.0, 60.0]}}
"""
COMMAND: Final = [sys.executable, "-m", "stepdiag"]
FAST: Final = ("--settle-count", "2", "--average", "1", "--interval-ms", "0")


def acquisition(twin: Twin, port: int, *more: str) -> subprocess.Popen[bytes]:
    source = ("--source", twin.source, "--trigger", f"tcp://127.0.0.1:{port}")
    words = [*COMMAND, "acquire", "vmc.toml", *source, *FAST, "--watched", "-o", "run.csv", *more]
    return subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


class Controller(threading.Thread):
    """Asks for the points that are left, until the other side goes away."""

    def __init__(self, described: Scenario, twin: Twin, port: int, done: set[tuple[int, int]]) -> None:
        super().__init__(daemon=True)
        self._described, self._twin, self._port, self.done = described, twin, port, done
        self.is_over = False  # nobody will answer
        self.start()

    def run(self) -> None:
        while not self.is_over:
            try:
                client = socket.create_connection(("127.0.0.1", self._port))
                break
            except OSError:
                time.sleep(0.01)
        else:
            return
        with client, client.makefile() as answers:
            for visit in visits_of(self._described.known):
                for position, point in zip(visit.positions, visit.points, strict=True):
                    key = (visit.number, int(point))
                    if key in self.done:
                        continue
                    self._twin.instrument.move_to(position)
                    try:
                        client.sendall(f"READ {key[0]} {key[1]}\n".encode())
                        answer = answers.readline()
                    except OSError:
                        return
                    if answer != f"DONE {key[0]} {key[1]}\n":
                        return
                    self.done.add(key)


def kill_acquisitions(kills: int, pick: random.Random) -> None:
    described = read_scenario("vmc.toml")
    raw, done, killed = Path("run.raw.jsonl"), set[tuple[int, int]](), 0
    planned = sum(len(visit.points) for visit in visits_of(described.known))
    with Twin(described) as twin:
        while len(done) < planned:
            port = free_port()
            process = acquisition(twin, port, *(["--resume"] if raw.exists() else []))
            controller = Controller(described, twin, port, done)
            if killed < kills:
                time.sleep(pick.uniform(0.0, 1.6))
                process.kill()
                killed += 1
            process.wait()
            controller.is_over = True
            controller.join()
            if not raw.exists():
                continue
            kept = read_raw(raw).readings() if raw.stat().st_size else {}
            lost = done - kept.keys()
            assert not lost, f"after {killed} kills: {sorted(lost)} had been read"
            done |= kept.keys()  # on the disk, and nobody got the answer
    assert killed >= kills // 2, f"the plan was read after {killed} kills"
    print(f"acquisition killed {killed} times: {planned} of {planned} readings, none lost")


def kill_servers(kills: int, pick: random.Random) -> None:
    described = read_scenario("vmc.toml")
    subprocess.run([*COMMAND, "book", "new", "VMC", "--book", "book"], check=True, stdout=subprocess.DEVNULL)
    runs = Path("book/machines/VMC/runs").absolute()
    runs.mkdir(exist_ok=True)
    ended = threading.Event()
    planned = sum(len(visit.points) for visit in visits_of(described.known))
    with Twin(described) as twin:
        port = free_port()
        source = ("--source", twin.source, "--trigger", f"tcp://127.0.0.1:{port}")
        words = [*COMMAND, "acquire", "vmc.toml", *source, *FAST, "--watched", "-o", str(runs / "run.csv")]
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        client: list[socket.socket] = []

        def ask() -> None:
            """At a pace at which the kills end first."""
            while not client:
                try:
                    client.append(socket.create_connection(("127.0.0.1", port)))
                except OSError:
                    time.sleep(0.05)
            with client[0].makefile() as answers:
                for visit in visits_of(described.known):
                    for position, point in zip(visit.positions, visit.points, strict=True):
                        twin.instrument.move_to(position)
                        client[0].sendall(f"READ {visit.number} {int(point)}\n".encode())
                        assert answers.readline().startswith("DONE")
                        if not ended.is_set():
                            time.sleep(0.05)

        asking = threading.Thread(target=ask, daemon=True)
        asking.start()
        seen = 0
        for _ in range(kills):
            server = subprocess.Popen([*COMMAND, "app", "book", "--no-browser"], stdout=subprocess.PIPE, text=True)
            assert server.stdout is not None
            found = re.search(r"http://127.0.0.1:(\d+)(/enter\S+)", server.stdout.readline())
            assert found is not None
            page = http.client.HTTPConnection("127.0.0.1", int(found[1]))
            page.request("GET", found[2])
            answer = page.getresponse()
            cookie = (answer.getheader("set-cookie") or "").split(";")[0]
            answer.read()
            page.request("GET", "/machines/VMC/live/run/events", headers={"Cookie": cookie})
            seen += page.getresponse().readline().startswith(b"event: ")
            time.sleep(pick.uniform(0.0, 0.3))
            server.kill()
            server.wait()
            page.close()
        ended.set()
        asking.join()
        assert process.wait(60.0) == 0
    assert live_path(runs / "run.raw.jsonl").exists()
    readings = read_raw(runs / "run.raw.jsonl").readings()
    assert len(readings) == planned
    assert not any(reading.is_lost for reading in readings.values())
    print(f"application killed {kills} times, {seen} pages had seen the run: {planned} readings, none lost")


def main() -> None:
    kills = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        Path("vmc.toml").write_text(SCENARIO.format(steps=8 * kills))
        kill_acquisitions(kills, random.Random(1))
        kill_servers(kills, random.Random(2))


if __name__ == "__main__":
    main()
