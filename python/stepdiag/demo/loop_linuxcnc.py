"""LinuxCNC in the loop: it runs the measuring program, and its joints move a virtual machine.

    program --handshake--> bridge --moveTo--> twin (virtual machine, head and instrument)
                             |                  ^ JSON-RPC
                             +------READ-----> acquire --> run.csv

After the run the points follow in the same way as one more visit, for which the joints' positions
are stored.
"""

import shutil
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from stepdiag._core import InvalidArgument
from stepdiag.acquisition.acquire import acquire
from stepdiag.acquisition.options import AcquireOptions
from stepdiag.acquisition.settling import Settling
from stepdiag.acquisition.tcp_trigger import TcpTrigger
from stepdiag.acquisition.triggers import Context, Silent
from stepdiag.demo.loop_cases import CHAIN, RANGE
from stepdiag.demo.loop_job import PATIENCE, FloatArray, Job, Say
from stepdiag.linuxcnc.processes import LinuxcncError
from stepdiag.linuxcnc.session import MODULE, LinuxcncSession, lacks_module, missing_programs
from stepdiag.platform import NO_LINUXCNC
from stepdiag.program.gcode import HANDSHAKE, Writer
from stepdiag.scenario.order_of_run import Visit, visits_of
from stepdiag.twin.server import Twin

SOURCE_FOLDER: Final = Path(__file__).resolve().parents[3]
# The first that exists: of the source folder, or of the Debian package stepdiag-linuxcnc.
BRIDGES: Final = (
    SOURCE_FOLDER / "controllers" / "linuxcnc" / "stepdiag_bridge.py",
    Path("/usr/share/stepdiag-linuxcnc/stepdiag_bridge.py"),
)
# The twin is at rest when it is asked, and exact: two values that agree, and one to take.
SETTLING: Final = Settling(count=2, limit_um=0.001, average=1, interval=0.0)
# Faster than any machine, to wait for nothing: mm/s and mm/s^2.
SPEED: Final = 1e6
ACCELERATION: Final = 1e9


TASK_CYCLE: Final = 0.0002  # s: most of a reading's time is the program's waiting for its turn


class LoopError(LinuxcncError):
    """The loop failed: a reading was not stored, or the program stopped."""


class Linuxcnc:
    """Starts LinuxCNC once for each job. Raises InvalidArgument if something of it is not installed."""

    name = "LinuxCNC"

    def __init__(self) -> None:
        if NO_LINUXCNC:
            raise InvalidArgument(NO_LINUXCNC)
        bridges = [bridge for bridge in BRIDGES if bridge.is_file()]
        missing = missing_programs() + [str(MODULE)] * lacks_module() + [str(BRIDGES[-1])] * (not bridges)
        if missing:
            raise InvalidArgument(
                f"the loop in LinuxCNC lacks {', '.join(missing)}: install stepdiag's Debian package "
                "stepdiag-linuxcnc, or use ./run in the source folder, or `controller` calculated"
            )
        self._bridge = bridges[0]

    def do(self, job: Job, say: Say) -> FloatArray:
        listening = _Listening()
        try:
            # HAL's files take no path with a space.
            with Twin(job.scenario) as twin, tempfile.TemporaryDirectory(prefix="stepdiag-bridge-") as folder:
                bridge = shutil.copy(self._bridge, folder)
                with LinuxcncSession(**self._configuration(job, bridge, twin, listening)) as session:
                    return self._run(job, say, session, _Recorder(job, twin, listening))
        finally:
            listening.end()

    def _run(self, job: Job, say: Say, session: LinuxcncSession, recorder: "_Recorder") -> FloatArray:
        recorder.start()  # of an interrupted loop it may go on waiting for somebody to ask; it ends by itself
        go_on = _go_on(recorder, say)
        session.run_program(job.program, on_pause=go_on, timeout=1800.0)
        if len(job.points):
            say(f"go to {len(job.points)} points")
            session.run_program(self._points_program(job), on_pause=go_on, timeout=1800.0)
        recorder.join(PATIENCE)
        return recorder.result()

    def _configuration(self, job: Job, bridge: str, twin: Twin, listening: "_Listening") -> dict[str, Any]:
        acquisition = ":".join(map(str, listening.address))
        options: dict[str, str | float] = {"ramp": 0}
        sensors = []
        if job.temperature is not None:
            options["temperatures"] = ",".join(f"{limit:g}" for limit in RANGE)
            sensors = [
                f"setp stepdiagkins.temperature-{axis} {one!r}"
                for axis, one in zip("xyz", job.temperature, strict=True)
            ]
            sensors.append("setp stepdiagkins.temperature-enable 1")
        compensation = {} if job.table is None else {"table": job.table, "chain": CHAIN, "options": options}
        return {
            **compensation,
            "ini": {"TASK": {"CYCLE_TIME": TASK_CYCLE}},
            "speed": SPEED,
            "acceleration": ACCELERATION,
            "hal": [
                *sensors,
                f"loadusr -Wn stepdiag-bridge /usr/bin/python3 -P {bridge} --acquire {acquisition} "
                f"--twin {twin.address[0]}:{twin.address[1]} --timeout {PATIENCE:g}",
                *(f"net joint-{joint} => stepdiag-bridge.joint-{axis}" for joint, axis in enumerate("xyz")),
                "net reading-visit motion.analog-out-00 => stepdiag-bridge.visit",
                "net reading-point motion.analog-out-01 => stepdiag-bridge.point",
                "net reading-wanted motion.digital-out-00 => stepdiag-bridge.request",
                "net reading-stored stepdiag-bridge.done => motion.digital-in-00",
            ],
        }

    def _points_program(self, job: Job) -> Path:
        """Write the program for the points.

        It requests a reading at each point, as those of one more visit."""
        path = job.run.with_name("points.ngc")
        writer = Writer("linuxcnc", 12, "G53")
        number = _points_visit(job).number
        lines = ["(Measuring program of the loop's points)", "G21 G90 G94 G17 G40 G49 G80 G61.1"]
        lines += [line.format(timeout=f"{PATIENCE:g}") for line in HANDSHAKE]
        for index, point in enumerate(job.points):
            lines.append(writer.move(dict(zip("XYZ", map(float, point), strict=True))))
            lines.append(f"o<reading> call [{number}] [{index}]")
        path.write_text("\n".join([*lines, "M2"]) + "\n")
        return path


class _Listening(TcpTrigger):
    """A trigger that remains open after the acquisition."""

    def close(self) -> None:
        pass

    def end(self) -> None:
        super().close()


class _Recorder(threading.Thread):
    """Records the readings of the run, then the joints' positions at the points."""

    def __init__(self, job: Job, twin: Twin, trigger: _Listening) -> None:
        super().__init__(name="stepdiag-loop", daemon=True)
        self._job, self._twin, self._trigger = job, twin, trigger
        self._joints: list[Sequence[float]] = []
        self.error: Exception | None = None

    def run(self) -> None:
        job = self._job
        job.run.unlink(missing_ok=True)
        job.run.with_suffix(".raw.jsonl").unlink(missing_ok=True)
        source = f"ids3010://{self._twin.address[0]}:{self._twin.address[1]}"
        options = AcquireOptions(settling=SETTLING, wait_timeout=6 * PATIENCE)
        try:
            acquire(job.scenario.known, source, job.run, trigger=self._trigger, options=options)
            self._points()
        except Exception as error:  # for the thread that waits for it
            self.error = error
            self._trigger.failed(str(error))

    def _points(self) -> None:
        visit = _points_visit(self._job)
        self._trigger.start(Context(self._no_reading, (), SETTLING, 6 * PATIENCE, 1, Silent()))
        for index in range(len(visit.points)):
            while not self._trigger.wait(visit, index, []):  # the one before once more
                self._trigger.stored(visit, index, ())
            self._joints.append(self._twin.instrument.state()["position_mm"])
            self._trigger.stored(visit, index, ())

    def _no_reading(self) -> Any:
        raise AssertionError("points are not read")

    def result(self) -> FloatArray:
        """Joint positions, (n, 3), mm."""
        if self.error is not None:
            raise LoopError(f"acquisition: {self.error}") from self.error
        if len(self._joints) != len(self._job.points):
            raise LoopError(f"points: expected {len(self._job.points)}, got {len(self._joints)}")
        return np.array(self._joints).reshape(-1, 3)


def _points_visit(job: Job) -> Visit:
    last = list(visits_of(job.scenario.known))[-1]
    return Visit(
        number=last.number + 1,
        set_up=last.set_up + 1,
        run=0,
        line="ppp",
        direction="forward",
        is_scale_line=False,
        points=np.arange(len(job.points)),
        positions=job.points,
        approach=np.ones(3, dtype=int),
    )


def _go_on(recorder: _Recorder, say: Say) -> Any:
    """Continue after a stop: nothing has to be mounted. A missing reading ends the loop."""

    def stopped(session: LinuxcncSession, line: int, messages: list[str]) -> None:
        if recorder.error is not None:
            raise LoopError(f"acquisition: {recorder.error}") from recorder.error
        for message in messages:
            if "no reading" in message:
                raise LoopError(f"LinuxCNC: {message}\n{session.log}")
            if "set-up" in message:
                say(message.removeprefix("message: ").removesuffix(", then cycle start"))

    return stopped
