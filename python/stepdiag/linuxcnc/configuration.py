"""Configuration files of a simulated three-axis machine for LinuxCNC (used by session.py)."""

import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

AXES = "XYZ"

RECORD_DEPTH = 8000  # servo periods kept until they are read

# Counts servo periods: each one adds the offset to the last output.
CLOCK = """\
loadrt offset names=session-clock
addf session-clock.update-output servo-thread
setp session-clock.offset 1
net session-clock session-clock.out => session-clock.in
"""

HAL = """\
loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS num_dio=8 num_aio=8
addf motion-command-handler servo-thread
addf motion-controller servo-thread
net estop-loop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net tool-prepared iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net tool-changed iocontrol.0.tool-change => iocontrol.0.tool-changed
"""


@dataclass(frozen=True)
class MachineConfiguration:
    """The simulated machine. Lengths in mm, speeds in mm/s; faster than any machine by default."""

    kinematics: str = "trivkins"  # [KINS]KINEMATICS: module and its arguments
    limits: tuple[float, float] = (-10000.0, 10000.0)  # of every axis; joints have 10 mm more at each end
    speed: float = 20000.0
    acceleration: float = 2e6
    servo_period: int = 1000000  # ns
    compensation: Mapping[int, str] = field(default_factory=dict)  # joint -> COMP_FILE
    compensation_type: int = 0
    tools: Mapping[int, tuple[float, float, float]] = field(default_factory=dict)  # tool number -> offset, mm
    record: Sequence[str] = ()  # numeric pins to record in every servo period
    hal: Sequence[str] = ()  # lines added after those of the machine
    ini: Mapping[str, Mapping[str, str | float | int]] = field(default_factory=dict)  # section -> further keys


def write_configuration(folder: Path, machine: MachineConfiguration, display: str) -> Path:
    """Write the configuration into a folder. Returns its INI file."""
    (folder / "machine.hal").write_text(_hal(machine), encoding="utf-8")
    (folder / "tool.tbl").write_text(_tools(machine), encoding="utf-8")
    (folder / "linuxcnc.var").write_text("5161\t0\n", encoding="utf-8")
    ini = folder / "machine.ini"
    ini.write_text(_ini(machine, display), encoding="utf-8")
    return ini


def copy_configuration(folder: Path, configuration: Path, display: str) -> Path:
    """Copy a user's configuration folder, with this display and a clock. Returns its INI file."""
    shutil.copytree(configuration.parent, folder, dirs_exist_ok=True)
    ini = folder / configuration.name
    text = re.sub(r"(?m)^DISPLAY *=.*$", f"DISPLAY = {display}", ini.read_text(encoding="utf-8"))
    ini.write_text(re.sub(r"(?m)^\[HAL\]\n((?:.+\n)*)", r"[HAL]\n\1HALFILE = session.hal\n", text), encoding="utf-8")
    (folder / "session.hal").write_text(CLOCK, encoding="utf-8")
    return ini


def _hal(machine: MachineConfiguration) -> str:
    loops = [f"net joint-{j} joint.{j}.motor-pos-cmd => joint.{j}.motor-pos-fb" for j in range(3)]
    recorder = []
    if machine.record:
        recorder = [
            f"loadrt sampler depth={RECORD_DEPTH} cfg={'f' * len(machine.record)}",
            "addf sampler.0 servo-thread",
        ]
    for column, pin in enumerate(machine.record):
        own = [f"joint-{j}" for j in range(3) if pin == f"joint.{j}.motor-pos-cmd"]  # already has a signal
        recorder.append(f"net {own[0] if own else f'record-{column} {pin}'} => sampler.0.pin.{column}")
    return HAL + CLOCK + "\n".join([*loops, *recorder, *machine.hal]) + "\n"


def _tools(machine: MachineConfiguration) -> str:
    return "".join(f"T{n} P{n} X{x:.9f} Y{y:.9f} Z{z:.9f}\n" for n, (x, y, z) in machine.tools.items())


def _ini(machine: MachineConfiguration, display: str) -> str:
    low, high = machine.limits
    moves = {"MAX_VELOCITY": machine.speed, "MAX_ACCELERATION": machine.acceleration}
    sections: dict[str, dict[str, str | float | int]] = {
        "EMC": {"VERSION": "1.1", "MACHINE": "stepdiag", "DEBUG": 0},
        "DISPLAY": {"DISPLAY": display},
        "TASK": {"TASK": "milltask", "CYCLE_TIME": 0.001},
        "RS274NGC": {"PARAMETER_FILE": "linuxcnc.var"},
        "EMCMOT": {"EMCMOT": "motmod", "COMM_TIMEOUT": 4.0, "SERVO_PERIOD": machine.servo_period},
        "EMCIO": {"EMCIO": "io", "CYCLE_TIME": 0.01, "TOOL_TABLE": "tool.tbl"},
        "HAL": {"HALFILE": "machine.hal"},
        "KINS": {"KINEMATICS": machine.kinematics, "JOINTS": 3},
        "TRAJ": {
            "COORDINATES": "XYZ",
            "LINEAR_UNITS": "mm",
            "ANGULAR_UNITS": "degree",
            "DEFAULT_LINEAR_VELOCITY": machine.speed,
            "MAX_LINEAR_VELOCITY": machine.speed,
            "MAX_LINEAR_ACCELERATION": machine.acceleration,
            "NO_FORCE_HOMING": 0,
        },
    }
    for joint, axis in enumerate(AXES):
        sections[f"AXIS_{axis}"] = {"MIN_LIMIT": low, "MAX_LIMIT": high, **moves}
        sections[f"JOINT_{joint}"] = {
            "TYPE": "LINEAR",
            "MIN_LIMIT": low - 10.0,
            "MAX_LIMIT": high + 10.0,
            **moves,
            "FERROR": 1000.0,  # a simulated joint only lags by a servo period, at any speed
            "MIN_FERROR": 1000.0,
            "HOME": 0.0,
            "HOME_OFFSET": 0.0,
            "HOME_SEARCH_VEL": 0.0,  # homes at its present position
            "HOME_LATCH_VEL": 0.0,
            "HOME_SEQUENCE": 0,
        }
        if joint in machine.compensation:
            sections[f"JOINT_{joint}"]["COMP_FILE"] = machine.compensation[joint]
            sections[f"JOINT_{joint}"]["COMP_FILE_TYPE"] = machine.compensation_type
    for name, keys in machine.ini.items():
        sections.setdefault(name, {}).update(keys)
    return "\n".join(
        "\n".join([f"[{name}]", *(f"{key} = {value}" for key, value in keys.items())]) + "\n"
        for name, keys in sections.items()
    )
