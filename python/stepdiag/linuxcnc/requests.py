"""Requests to a machine run by LinuxcncSession: moves, programs, joints, pins."""

import json
import os
import shutil
import socket
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Self, TextIO

from stepdiag.linuxcnc.processes import LinuxcncError

Setting = float | int | bool


class LinuxcncRequests:
    """The requests of a started session. Lengths in mm, times in s. They raise LinuxcncError."""

    folder: Path
    _connection: socket.socket
    _lines: TextIO

    @property
    def log(self) -> str:
        """LinuxCNC's complete output."""
        raise NotImplementedError

    def _ask(self, verb: str, patience: float = 60.0, /, **arguments: Any) -> Any:
        request = {"do": verb, **arguments}
        self._connection.settimeout(patience + 10.0)  # after the driver's own limit
        try:
            self._lines.write(json.dumps(request) + "\n")
            self._lines.flush()
            line = self._lines.readline()
        except OSError as error:
            raise LinuxcncError(f"LinuxCNC does not answer ({verb}): {error}\n{self.log}") from error
        if not line:
            raise LinuxcncError(f"LinuxCNC has ended ({verb}):\n{self.log}")
        answer = json.loads(line)
        if "error" in answer:
            raise LinuxcncError(answer["error"])
        return answer["result"]

    def mdi(self, code: str, timeout: float = 60.0) -> None:
        """Execute a line of G-code; return when the machine stands still."""
        self._ask("mdi", timeout, code=code, timeout=timeout)

    def start_mdi(self, code: str) -> None:
        """Start a line of G-code; `finish_mdi` waits for its end."""
        self._ask("start_mdi", code=code)

    def finish_mdi(self, timeout: float = 60.0) -> None:
        self._ask("finish_mdi", timeout, timeout=timeout)

    def jog_joint(self, joint: int, distance: float, speed: float = 100.0, *, world: bool = True) -> None:
        """Move a joint by `distance` mm without kinematics; return to world mode if `world`."""
        self._ask("jog_joint", joint=joint, distance=distance, speed=speed, world=world)

    def run_program(
        self,
        path: str | os.PathLike[str],
        on_pause: Callable[[Self, int, list[str]], None] | None = None,
        timeout: float = 600.0,
    ) -> list[str]:
        """Run a program to its end; return its messages.

        At each stop (M0) `on_pause(session, line, messages since the last stop)` is called. Then
        the program continues."""
        own = self.folder / Path(path).name
        shutil.copyfile(path, own)
        said: list[str] = []
        outcome = self._ask("program", timeout, path=str(own), timeout=timeout)
        while True:
            new = outcome["messages"][len(said) :]
            said = outcome["messages"]
            if not outcome["paused"]:
                return said
            if on_pause is not None:
                on_pause(self, outcome["line"], new)
            outcome = self._ask("resume", timeout, timeout=timeout)

    def visit(self, points: Sequence[Sequence[float]], timeout: float = 60.0) -> list[list[float]]:
        """Go to machine positions and return the joints' commands at each, mm.

        Commands are motor-pos-cmd: they include screw compensation."""
        rows = [[float(v) for v in point] for point in points]
        joints: list[list[float]] = self._ask("visit", timeout * max(1, len(rows)), points=rows, timeout=timeout)
        return joints

    def joints(self) -> list[float]:
        """joint.N.motor-pos-cmd in mm, when the joints stand still."""
        joints: list[float] = self._ask("at_rest")
        return joints

    def joint_commands(self) -> list[float]:
        """joint.N.pos-cmd in mm: without LinuxCNC's screw compensation."""
        return [float(v) for v in self.pins([f"joint.{j}.pos-cmd" for j in range(3)])]

    def position(self) -> list[float]:
        """LinuxCNC's tool position X, Y, Z in machine coordinates, mm, by the joints' feedback."""
        self._ask("at_rest")
        return [float(v) for v in self.state()["actual_position"][:3]]

    def recorded(self, timeout: float = 20.0) -> list[list[float]]:
        """The recording so far: number and pin values of each servo period."""
        wanted, end = int(self.pin("sampler.0.sample-num")), time.monotonic() + timeout
        while True:
            *lines, _ = (self.folder / "record.txt").read_text(encoding="ascii").split("\n")
            if lines and int(lines[-1].split()[0]) >= wanted - 1:
                return [[float(value) for value in line.split()] for line in lines]
            if time.monotonic() > end:
                raise LinuxcncError(f"recording: period {wanted} not written within {timeout:g} s")
            time.sleep(0.02)

    def state(self) -> dict[str, Any]:
        state: dict[str, Any] = self._ask("state")
        return state

    def pin(self, name: str) -> Setting:
        value: Setting = self._ask("pin", name=name)
        return value

    def pins(self, names: Sequence[str]) -> list[Setting]:
        values: list[Setting] = self._ask("pins", names=list(names))
        return values

    def wait_for_pin(self, name: str, value: Setting, timeout: float = 20.0) -> None:
        self._ask("wait_for_pin", timeout, name=name, value=value, timeout=timeout)

    def set_pin(self, name: str, value: Setting) -> None:
        self._ask("set_pin", name=name, value=value)

    def turn_on(self, *, home: bool = True) -> None:
        self._ask("turn_on", home=home)

    def turn_off(self) -> None:
        self._ask("turn_off")

    def abort(self) -> None:
        self._ask("abort")
