#!/usr/bin/python3
"""HAL component between a measuring program in LinuxCNC and `stepdiag acquire --trigger`. It requests a reading while
the program waits.

    loadusr -Wn stepdiag-bridge /usr/bin/python3 stepdiag_bridge.py --acquire 127.0.0.1:7000

    net visit   motion.analog-out-00   => stepdiag-bridge.visit
    net point   motion.analog-out-01   => stepdiag-bridge.point
    net wanted  motion.digital-out-00  => stepdiag-bridge.request
    net stored  stepdiag-bridge.done   => motion.digital-in-00

When `request` rises, the component sends "READ <visit> <point>" to the acquisition. The answer "DONE" sets `done` until
`request` falls. A "FAIL", a broken connection or a timeout sets `failed` until `request` falls, and prints the reason.

In simulation, --twin HOST:PORT first moves a virtual machine (`stepdiag twin`) to the position of the joints (pins
joint-x, -y, -z), as soon as they are at rest. They are at rest if they have not changed for --rest servo cycles. The
pin `clock` gives the time in s; without it, a cycle is --period of real time.
"""

import argparse
import json
import math
import signal
import socket
import sys
import time

import hal

POLL = 0.001  # s


class Failure(Exception):
    pass


def address(text: str) -> tuple[str, int]:
    host, _, port = text.removeprefix("tcp://").rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65536:
        raise argparse.ArgumentTypeError(f"expected HOST:PORT, got {text!r}")
    return host, int(port)


class Peer:
    """A connection that is opened on first use, and opened again after a failure."""

    def __init__(self, name: str, where: tuple[str, int], timeout: float) -> None:
        self.name, self.where, self.timeout = name, where, timeout
        self.socket: socket.socket | None = None
        self.received = b""

    def send(self, data: bytes) -> None:
        try:
            if self.socket is None:
                self.socket = socket.create_connection(self.where, self.timeout)
                self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self.received = b""
            self.socket.sendall(data)
        except OSError as error:
            self.fail(str(error))

    def line(self) -> bytes:
        end = time.monotonic() + self.timeout
        while b"\n" not in self.received:
            try:
                self.socket.settimeout(max(0.001, end - time.monotonic()))
                data = self.socket.recv(65536)
            except OSError as error:
                self.fail(f"no answer: {error}")
            if not data or len(self.received) > 1_000_000:
                self.fail("the connection ended" if not data else "an answer without end")
            self.received += data
        line, _, self.received = self.received.partition(b"\n")
        return line.strip()

    def fail(self, why: str) -> None:
        self.close()
        raise Failure(f"{self.name} {self.where[0]}:{self.where[1]}: {why}")

    def close(self) -> None:
        if self.socket is not None:
            self.socket.close()
            self.socket = None


class Bridge:
    def __init__(self, component: "hal.component", options: argparse.Namespace) -> None:
        self.pins = component
        self.options = options
        self.acquisition = Peer("acquisition", options.acquire, options.timeout)
        self.twin = Peer("twin", options.twin, options.timeout) if options.twin else None
        self.call_number = 0

    def joints(self) -> list[float]:
        return [self.pins[f"joint-{axis}"] for axis in "xyz"]

    def joints_at_rest(self) -> list[float]:
        end = time.monotonic() + self.options.timeout
        last, counted = self.joints(), self.cycles()
        while self.cycles() - counted < self.options.rest + 0.5:
            time.sleep(POLL)
            now = self.joints()
            if now != last:
                last, counted = now, self.cycles()
            if time.monotonic() > end:
                raise Failure("the joints do not come to rest")
        return last

    def cycles(self) -> float:
        clock = self.pins["clock"]
        return (clock if clock > 0.0 else time.monotonic()) / self.options.period

    def move_twin(self) -> None:
        self.call_number += 1
        call = {
            "jsonrpc": "2.0",
            "method": "stepdiag.twin.moveTo",
            "params": self.joints_at_rest(),
            "id": self.call_number,
            "api": 2,
        }
        self.twin.send(json.dumps(call).encode() + b"\r\n")
        line = self.twin.line()
        try:
            answer = json.loads(line)
            told = answer.get("error") or (answer["result"][0] and answer["result"])
        except (ValueError, KeyError, IndexError, TypeError, AttributeError):
            self.twin.fail(f"expected a JSON-RPC answer, got {line[:200]!r}")
        if told:
            raise Failure(f"twin: {told}")

    def read(self) -> None:
        visit, point = self.pins["visit"], self.pins["point"]
        if not (math.isfinite(visit) and math.isfinite(point)):
            raise Failure(f"visit and point: expected numbers, got {visit} and {point}")
        wanted = f"{round(visit)} {round(point)}"
        if self.twin:
            self.move_twin()
        self.acquisition.send(f"READ {wanted}\n".encode())
        answer = self.acquisition.line().decode("utf-8", "replace")
        if answer != f"DONE {wanted}":
            if not answer.startswith("FAIL"):
                self.acquisition.close()
            raise Failure(f"acquisition: visit {round(visit)}, point {round(point)}: {answer}")

    def serve(self) -> None:
        """Serves requests until the component is unloaded."""
        pins, handled = self.pins, False
        while True:
            if not pins["request"]:
                pins["done"] = pins["failed"] = handled = False
            elif not handled:
                handled = True
                try:
                    self.read()
                    pins["readings"] += 1
                    pins["done"] = True
                except Failure as failure:
                    print(f"stepdiag-bridge: {failure}", file=sys.stderr, flush=True)
                    pins["failed"] = True
            time.sleep(POLL)


def make_component(name: str) -> "hal.component":
    component = hal.component(name)
    for pin in ("request", "done", "failed"):
        component.newpin(pin, hal.HAL_BIT, hal.HAL_IN if pin == "request" else hal.HAL_OUT)
    for pin in ("visit", "point", "joint-x", "joint-y", "joint-z", "clock"):
        component.newpin(pin, hal.HAL_FLOAT, hal.HAL_IN)
    component.newpin("readings", hal.HAL_U32, hal.HAL_OUT)
    component.ready()
    return component


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--acquire", type=address, required=True, metavar="HOST:PORT", help="`stepdiag acquire --trigger`"
    )
    parser.add_argument("--twin", type=address, metavar="HOST:PORT", help="`stepdiag twin`, in simulation only")
    parser.add_argument("--timeout", type=float, default=60.0, metavar="S", help="for each answer (60)")
    parser.add_argument("--rest", type=int, default=6, metavar="N", help="servo cycles at rest, with --twin (6)")
    parser.add_argument("--period", type=float, default=0.001, metavar="S", help="servo period, with --twin (0.001)")
    parser.add_argument("--name", default="stepdiag-bridge", help="of the component (stepdiag-bridge)")
    options = parser.parse_args()
    # Unloading sends SIGTERM; the component must then release HAL's shared memory.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    component = make_component(options.name)
    try:
        Bridge(component, options).serve()
    finally:
        component.exit()
    return 0


if __name__ == "__main__":
    sys.exit(main())
