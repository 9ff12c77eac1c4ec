"""A simulated machine run by LinuxCNC without a display, for programs: start, move, read, stop.

    with LinuxcncSession() as session:
        session.mdi("G0 X100 Y20")
        print(session.joints(), session.position())

LinuxCNC's Python modules belong to Debian's /usr/bin/python3. There driver.py runs as LinuxCNC's
display and executes the requests that it receives on a Unix socket. Only one LinuxCNC can run on a
computer; a lock enforces this.
"""

import contextlib
import os
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from stepdiag.linuxcnc.configuration import MachineConfiguration, copy_configuration, write_configuration
from stepdiag.linuxcnc.processes import LinuxcncError, end_all_of, linuxcnc_lock, refuse_a_running_one
from stepdiag.linuxcnc.requests import LinuxcncRequests
from stepdiag.platform import NO_LINUXCNC, end_group, is_administrator

PYTHON = "/usr/bin/python3"
PACKAGES = ("linuxcnc-uspace", "linuxcnc-uspace-dev")
MODULE = Path("/usr/lib/linuxcnc/modules/stepdiagkins.so")  # of Debian's LinuxCNC, whose programs are in /usr/bin
NOBODY = 65534

__all__ = ["LinuxcncError", "LinuxcncSession", "linuxcnc_lock"]


def missing_programs() -> list[str]:
    """What of LinuxCNC is not installed."""
    missing = [name for name in ("linuxcnc", "halrun", "rtapi_app") if shutil.which(name) is None]
    return missing if Path(PYTHON).exists() else [*missing, PYTHON]


def lacks_module() -> bool:
    """Whether Debian's LinuxCNC is there without the kinematics `stepdiagkins`."""
    return shutil.which("linuxcnc") == "/usr/bin/linuxcnc" and not MODULE.is_file()


class LinuxcncSession(LinuxcncRequests):
    """A simulated machine: starts LinuxCNC in a temporary folder on entry, ends it on exit.

    Lengths are in mm, speeds in mm/s. Raises LinuxcncError.

    Args:
        table: calibration for the kinematics `stepdiagkins`.
        chain: chain of the machine for these kinematics, such as "wX'bYZt".
        options: their further arguments, such as {"outside": "refuse", "margin": 5}.
        kinematics: other kinematics, used without `table`.
        configuration: a user's INI file; a copy of its folder is used, and the options of the
            machine are ignored.
        comp_files: {joint: file} for LinuxCNC's screw compensation, of type `comp_type`.
        record: pins to record in every servo period; `recorded` returns the values.
        hal: further HAL lines.
        ini: further INI keys, by section. Other arguments: see MachineConfiguration.
    """

    def __init__(
        self,
        *,
        table: str | os.PathLike[str] | None = None,
        chain: str | None = None,
        options: Mapping[str, str | float] | None = None,
        kinematics: str | None = None,
        configuration: str | os.PathLike[str] | None = None,
        comp_files: Mapping[int, str | os.PathLike[str]] | None = None,
        comp_type: int = 0,
        tools: Mapping[int, tuple[float, float, float]] | None = None,
        limits: tuple[float, float] = (-10000.0, 10000.0),
        speed: float = 20000.0,
        acceleration: float = 2e6,
        servo_period: int = 1000000,
        record: Sequence[str] = (),
        hal: Sequence[str] = (),
        ini: Mapping[str, Mapping[str, str | float | int]] | None = None,
        home: bool = True,
        start_timeout: float = 60.0,
    ) -> None:
        self._table, self._chain, self._options = table, chain, dict(options or {})
        self._kinematics = kinematics
        self._configuration = None if configuration is None else Path(configuration)
        self._comp_files = dict(comp_files or {})
        self._machine: dict[str, Any] = {
            "limits": limits,
            "speed": speed,
            "acceleration": acceleration,
            "servo_period": servo_period,
            "compensation_type": comp_type,
            "tools": dict(tools or {}),
            "record": tuple(record),
            "hal": tuple(hal),
            "ini": dict(ini or {}),
        }
        self._home, self._start_timeout = home, start_timeout
        self._stack = contextlib.ExitStack()

    # --- start and end ---
    def __enter__(self) -> Self:
        if NO_LINUXCNC:
            raise LinuxcncError(NO_LINUXCNC)
        if missing := missing_programs():
            raise LinuxcncError(f"LinuxCNC is not installed ({', '.join(missing)} missing): "
                                f"apt-get install {' '.join(PACKAGES)}")  # fmt: skip
        if self._table is not None and lacks_module():
            raise LinuxcncError(f"{MODULE} is missing: install stepdiag's Debian package stepdiag-linuxcnc, "
                                "or use controllers/linuxcnc/install in the source folder")  # fmt: skip
        try:
            self._start()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError, LinuxcncError, AttributeError, subprocess.TimeoutExpired):
            if kind is None:
                self._lines.write('{"do": "end"}\n')
                self._lines.flush()
            else:  # perhaps within a request, which the driver abandons without a session
                self._connection.shutdown(socket.SHUT_RDWR)
            self._process.wait(15)
        self._stack.close()

    def _start(self) -> None:
        self._stack.enter_context(linuxcnc_lock())
        refuse_a_running_one()
        self.folder = Path(tempfile.mkdtemp(prefix="stepdiag-linuxcnc-"))
        self._stack.callback(shutil.rmtree, self.folder, ignore_errors=True)
        self._log_path = self.folder / "log.txt"
        self._stack.callback(self._keep_log)
        if self._configuration is None:
            ini = write_configuration(self.folder, self._configured(), "./display")
        else:
            ini = copy_configuration(self.folder, self._configuration, "./display")
        self._write_display()
        self.folder.chmod(0o1777 if is_administrator() else 0o755)  # for another user's process

        socket_path = self.folder / "session"
        listener = self._stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))  # type: ignore[attr-defined, unused-ignore]  # not on Windows
        listener.bind(str(socket_path))
        listener.listen(1)
        self._environment = self._make_environment(socket_path)
        with self._log_path.open("wb") as log:
            self._process = subprocess.Popen(
                ["linuxcnc", "-r", str(ini)],
                cwd=self.folder,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self._stack.callback(self._end_processes)
        connection = self._stack.enter_context(self._accept(listener))
        self._connection = connection
        self._lines = self._stack.enter_context(connection.makefile("rw", encoding="utf-8"))
        if self._machine["record"]:
            self._start_recording()
        try:
            self._ask("turn_on", self._start_timeout, home=self._home)
        except LinuxcncError as error:
            raise LinuxcncError(f"the machine could not be turned on: {error}\n{self.log}") from error

    def _start_recording(self) -> None:
        with (self.folder / "record.txt").open("wb") as record:
            recorder = subprocess.Popen(
                ["stdbuf", "-oL", "halsampler", "-t"], env=self._environment, stdout=record, cwd=self.folder
            )
        self._stack.callback(recorder.wait)
        self._stack.callback(recorder.terminate)

    def _make_environment(self, socket_path: Path) -> dict[str, str]:
        environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "PYTHONPATH")}
        environment |= {
            "STEPDIAG_SESSION_SOCKET": str(socket_path),
            "RTAPI_FIFO_PATH": str(self.folder / "rtapi"),
            "HOME": str(self.folder),  # LinuxCNC writes files there
            "LANG": "C.UTF-8",
        }
        if is_administrator():  # LinuxCNC's real-time process refuses to run as root
            environment["RTAPI_UID"] = str(NOBODY)
        return environment

    def _configured(self) -> MachineConfiguration:
        comp = {}
        for joint, path in self._comp_files.items():
            shutil.copyfile(path, self.folder / f"joint-{joint}.comp")
            comp[joint] = f"joint-{joint}.comp"
        kinematics = self._kinematics or "trivkins coordinates=XYZ"
        if self._table is not None:
            arguments = {"table": self._own_table(), **self._options}
            if self._chain is not None:
                arguments["chain"] = self._chain.replace("'", "").replace(" ", "").strip("[]")
            kinematics = " ".join(["stepdiagkins", *(f"{key}={value}" for key, value in arguments.items())])
        return MachineConfiguration(kinematics=kinematics, compensation=comp, **self._machine)

    def _own_table(self) -> str:
        """A copy of the table that the real-time process may read as any user.

        A missing file stays missing."""
        assert self._table is not None
        own = self.folder / "table.csv"
        if Path(self._table).is_file():
            shutil.copyfile(self._table, own)
            own.chmod(0o644)
        return str(own)

    def _write_display(self) -> None:
        display = self.folder / "display"
        driver = self.folder / "driver.py"
        shutil.copyfile(Path(__file__).with_name("driver.py"), driver)
        display.write_text(f'#!/bin/sh\nexec {PYTHON} -P "{driver}" "$@"\n', encoding="utf-8")
        display.chmod(0o755)

    def _accept(self, listener: socket.socket) -> socket.socket:
        """Wait for the driver's connection: it exists when LinuxCNC has started."""
        end = time.monotonic() + self._start_timeout
        listener.settimeout(0.1)
        while time.monotonic() < end:
            with contextlib.suppress(TimeoutError):
                connection, _ = listener.accept()
                return connection
            if self._process.poll() is not None:
                raise LinuxcncError(f"LinuxCNC did not start:\n{self.log}")
        raise LinuxcncError(f"LinuxCNC did not start within {self._start_timeout:g} s:\n{self.log}")

    def _end_processes(self) -> None:
        """End the processes left by a crash or a hang; after an orderly end there are none."""
        if self._process.poll() is None:
            end_group(self._process, patience=8.0)
        end_all_of(str(self.folder), self._environment)

    def _keep_log(self) -> None:
        self._kept_log = self.log

    @property
    def log(self) -> str:
        """LinuxCNC's complete output."""
        with contextlib.suppress(OSError):
            return self._log_path.read_text(encoding="utf-8", errors="replace")
        return getattr(self, "_kept_log", "")
