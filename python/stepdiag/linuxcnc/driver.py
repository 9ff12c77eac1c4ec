#!/usr/bin/python3
"""Runs inside LinuxCNC as its display and executes the requests of a session (session.py).

Requests are JSON objects, one per line, on a Unix socket. LinuxCNC ends when this program ends. It
runs with Debian's own Python, which has LinuxCNC's modules, and imports nothing else of this
package.
"""

import contextlib
import json
import os
import socket
import sys
import time
from collections.abc import Callable
from typing import Any

import hal  # type: ignore[import-not-found]
import linuxcnc  # type: ignore[import-not-found]

POLL = 0.001  # s between polls of the status; it does not change within a servo period
LATE = 0.2  # s to wait for further messages: motion and task report an error one after the other


class Trouble(Exception):
    pass


class Driver:
    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.command = linuxcnc.command()
        self.status = linuxcnc.stat()
        self.errors = linuxcnc.error_channel()
        self.messages: list[str] = []  # of the current move or program
        self.code = ""  # of the current MDI move
        # Only a component can read pins; this one has none of its own.
        self.component = hal.component("stepdiag-session")
        self.component.ready()
        self.status.poll()
        self.kinematic_joints = self.status.joints

    # --- waiting ---
    def end_if_alone(self) -> None:
        """Exit if the session is gone, for example after a crash. This ends LinuxCNC."""
        try:
            if not self.connection.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT):  # type: ignore[attr-defined, unused-ignore]  # not on Windows
                sys.exit(1)
        except BlockingIOError:
            pass

    def complaints(self) -> list[str]:
        """LinuxCNC's messages since the last call: errors and messages of the program."""
        said = []
        while entry := self.errors.poll():
            kind, text = entry
            is_error = kind in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR)
            said.append(("error: " if is_error else "message: ") + text.strip())
        return said

    def take_complaints(self, what: str, fail_on_error: bool = True) -> None:
        said = self.complaints()
        failed = fail_on_error and any(line.startswith("error: ") for line in said)
        if failed:
            time.sleep(LATE)
            said += self.complaints()
        self.messages += said
        if failed:
            raise Trouble(f"{what}: " + "; ".join(said))

    def wait_for(self, what: str, reached: Callable[[], bool], timeout: float, *, fail_on_error: bool = True) -> None:
        end = time.monotonic() + timeout
        while True:
            self.end_if_alone()
            self.status.poll()
            if reached():
                return
            self.take_complaints(what, fail_on_error)
            if time.monotonic() > end:
                raise Trouble(f"{what}: not reached within {timeout:g} s")
            time.sleep(POLL)

    def received(self) -> bool:
        return bool(self.status.echo_serial_number >= self.command.serial)

    def done(self, what: str, timeout: float) -> None:
        """Wait until the last command is executed.

        LinuxCNC's wait_complete cannot be interrupted."""
        self.wait_for(what, lambda: self.received() and self.status.state != linuxcnc.RCS_EXEC, timeout)
        if self.status.state == linuxcnc.RCS_ERROR:
            time.sleep(LATE)
            raise Trouble(f"{what}: " + ("; ".join(self.complaints()) or "refused by LinuxCNC"))

    def idle(self) -> bool:
        s = self.status
        return bool(s.interp_state == linuxcnc.INTERP_IDLE and s.inpos and s.queue == 0 and not s.delay_left)

    def switch_to(self, mode: int, timeout: float) -> None:
        self.status.poll()
        if self.status.task_mode != mode:
            self.command.mode(mode)
            self.done("change of mode", timeout)
            self.wait_for("change of mode", lambda: self.status.task_mode == mode, timeout)

    # --- requests of a session ---
    def turn_on(self, home: bool = True, timeout: float = 20.0) -> None:
        self.wait_for("status", lambda: self.status.joints > 0, timeout)
        # Commands sent before LinuxCNC's task has started are lost.
        end = time.monotonic() + timeout
        while True:
            self.command.state(linuxcnc.STATE_ESTOP_RESET)
            try:
                self.wait_for("emergency stop released", self.received, 0.5)
                break
            except Trouble:
                if time.monotonic() > end:
                    raise
        self.done("emergency stop released", timeout)
        self.command.state(linuxcnc.STATE_ON)
        self.done("machine on", timeout)
        self.wait_for("machine on", lambda: self.status.task_state == linuxcnc.STATE_ON, timeout)
        self.kinematic_joints = self.status.joints
        if home:
            self.home(timeout)

    def turn_off(self, timeout: float = 20.0) -> None:
        self.command.state(linuxcnc.STATE_OFF)
        self.wait_for("machine off", lambda: self.status.task_state != linuxcnc.STATE_ON, timeout)

    def home(self, timeout: float = 20.0) -> None:
        self.switch_to(linuxcnc.MODE_MANUAL, timeout)
        self.command.home(-1)
        joints = self.kinematic_joints
        self.wait_for("homing", lambda: all(self.status.homed[:joints]), timeout)
        self.switch_to(linuxcnc.MODE_MDI, timeout)

    def jog_joint(self, joint: int, distance: float, speed: float, world: bool, timeout: float = 60.0) -> None:
        """Move one joint in joint mode."""
        self.messages = []
        self.switch_to(linuxcnc.MODE_MANUAL, timeout)
        self.free(True, timeout)
        goal = self.motors()[joint] + distance
        self.command.jog(linuxcnc.JOG_INCREMENT, True, joint, speed, distance)
        self.wait_for("jog", lambda: abs(self.motors()[joint] - goal) < 1e-3, timeout)
        self.at_rest(timeout)
        if world:
            self.free(False, timeout)
            self.switch_to(linuxcnc.MODE_MDI, timeout)

    def free(self, joints: bool, timeout: float) -> None:
        """Switch to joint mode or to world mode."""
        mode = linuxcnc.TRAJ_MODE_FREE if joints else linuxcnc.TRAJ_MODE_TELEOP
        self.command.teleop_enable(not joints)
        self.wait_for("joint or world mode", lambda: self.status.motion_mode == mode, timeout)

    def mdi(self, code: str, timeout: float = 60.0) -> None:
        self.start_mdi(code, timeout)
        self.finish_mdi(timeout)

    def start_mdi(self, code: str, timeout: float = 60.0) -> None:
        self.messages = []
        self.code = code
        self.switch_to(linuxcnc.MODE_MDI, timeout)
        self.command.mdi(code)
        self.wait_for(code, self.received, timeout)

    def finish_mdi(self, timeout: float = 60.0) -> None:
        self.done(self.code, timeout)
        self.wait_for(self.code, self.idle, timeout)
        self.take_complaints(self.code)

    def visit(self, points: list[list[float]], timeout: float = 60.0) -> list[list[float]]:
        """Go to each point by G53 G0; return the joints' commands there (joint.N.motor-pos-cmd)."""
        seen = []
        for x, y, z in points:
            self.mdi(f"G53 G0 X{x:.17f} Y{y:.17f} Z{z:.17f}", timeout)
            seen.append(self.at_rest(timeout))
        return seen

    def at_rest(self, timeout: float = 10.0) -> list[float]:
        """The joints' commands, after they were constant for 6 servo cycles.

        The interpolation between trajectory points lasts for 4 cycles after the end of a move.
        Afterwards the status is newer than that."""
        end = time.monotonic() + timeout
        started, last = self.clock(), self.motors()
        while self.clock() - started < 6.5:
            time.sleep(POLL)
            now = self.motors()
            if now != last:
                started, last = self.clock(), now
            if time.monotonic() > end:
                raise Trouble(f"joints: not at rest within {timeout:g} s")
        self.command.debug(self.status.debug)  # changes nothing, but yields a new status
        self.wait_for("status", self.received, timeout)
        return last

    def clock(self) -> float:
        """Number of servo periods since the start."""
        return float(hal.get_value("session-clock.out"))

    def motors(self) -> list[float]:
        return [float(hal.get_value(f"joint.{j}.motor-pos-cmd")) for j in range(self.kinematic_joints)]

    def program(self, path: str, timeout: float = 600.0) -> dict[str, Any]:
        self.messages = []
        self.switch_to(linuxcnc.MODE_AUTO, timeout)
        self.command.program_open(path)
        self.done("opening the program", timeout)
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self.wait_for("start of the program", self.received, timeout)
        return self.until_pause(timeout)

    def resume(self, timeout: float = 600.0) -> dict[str, Any]:
        self.command.auto(linuxcnc.AUTO_RESUME)
        # Do not wait for the end of the pause: the next pause may begin before the next poll.
        self.wait_for("resume", self.received, timeout)
        return self.until_pause(timeout)

    def until_pause(self, timeout: float) -> dict[str, Any]:
        """Wait until the program ends or pauses (M0, M1, M60)."""

        def stands() -> bool:
            s = self.status
            return self.idle() or bool(s.interp_state == linuxcnc.INTERP_PAUSED and s.inpos)

        self.wait_for("program", stands, timeout)
        self.take_complaints("program")
        paused = self.status.interp_state == linuxcnc.INTERP_PAUSED
        return {"paused": paused, "line": self.status.motion_line, "messages": self.messages}

    def abort(self, timeout: float = 20.0) -> None:
        self.command.abort()
        self.wait_for("abort", self.idle, timeout, fail_on_error=False)

    def state(self) -> dict[str, Any]:
        s = self.status
        s.poll()
        return {
            "position": s.position,
            "actual_position": s.actual_position,
            "joint_position": s.joint_position[: s.joints],
            "joint_actual_position": s.joint_actual_position[: s.joints],
            "homed": [bool(h) for h in s.homed[: s.joints]],
            "on": s.task_state == linuxcnc.STATE_ON,
            "messages": self.complaints(),
        }

    def pin(self, name: str) -> float | int | bool:
        value: float | int | bool = hal.get_value(name)
        return value

    def pins(self, names: list[str]) -> list[float | int | bool]:
        return [self.pin(name) for name in names]

    def wait_for_pin(self, name: str, value: float | int | bool, timeout: float) -> None:
        self.wait_for(f"{name} = {value}", lambda: bool(self.pin(name) == value), timeout)

    def set_pin(self, name: str, value: float | int | bool) -> None:
        hal.set_p(name, str(int(value)) if isinstance(value, bool) else repr(value))

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        verb = request.pop("do")
        try:
            return {"result": getattr(self, verb)(**request)}
        except (Trouble, linuxcnc.error, hal.error, RuntimeError) as error:
            return {"error": str(error) or type(error).__name__}


VERBS = {
    *(
        "turn_on",
        "turn_off",
        "home",
        "jog_joint",
        "mdi",
        "start_mdi",
        "finish_mdi",
        "visit",
        "at_rest",
        "motors",
        "program",
        "resume",
        "abort",
    ),
    *("state", "pin", "pins", "wait_for_pin", "set_pin"),
}


def serve(connection: socket.socket) -> None:
    driver = Driver(connection)
    with connection.makefile("rw", encoding="utf-8") as lines:
        for line in lines:
            request = json.loads(line)
            if request["do"] == "end":
                break
            answer = driver.answer(request) if request["do"] in VERBS else {"error": f"unknown: {request['do']}"}
            lines.write(json.dumps(answer) + "\n")
            lines.flush()


if __name__ == "__main__":
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as to_session:  # type: ignore[attr-defined, unused-ignore]  # not on Windows
        to_session.connect(os.environ["STEPDIAG_SESSION_SOCKET"])
        with contextlib.suppress(OSError, KeyboardInterrupt):  # the session is gone
            serve(to_session)
