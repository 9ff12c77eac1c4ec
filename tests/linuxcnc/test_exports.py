"""What LinuxCNC makes of exported files: its motors go where the virtual machine's errors are gone.

motor-pos-cmd at commanded points is what moves the virtual machine, whose truth the exporter has not seen but for the
calibration.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from exported import CHAINS, TOOL, VOLUME, calibration_of, export, machine_of, points_in, random_calibration
from simple_exports import settings

import stepdiag as sd
from stepdiag.linuxcnc.session import PYTHON, LinuxcncError, LinuxcncSession

AT = (31.0, 12.0, 44.0)
# What an exact inverse at the rows leaves between them: an error of 24 µm, slopes that change by 8 mm/m.
BETWEEN_ROWS = 24e-3 * 8e-3
# LinuxCNC computes the trim last in the cycle before a joint stands, at most acceleration · (1 ms)² before the end:
# 2 mm with the session's own acceleration, 2.5 µm with that of a real machine; slopes are below 0.01.
REAL = {"speed": 1000.0, "acceleration": 2500.0}  # mm/s, mm/s²
AT_ROWS = 2.5e-3 * 0.01


def comp_files(folder: Path) -> dict[int, Path]:
    return {n: folder / f"joint{n}.comp" for n in range(3)}


def motors(session: LinuxcncSession, points: Sequence[Sequence[float]]) -> np.ndarray:
    return np.array(session.visit([list(point) for point in points]))


def lines_of(axis: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of an axis's line, every other one a row of the table; those from which to come in either direction."""
    line = np.tile(AT, (15, 1)).astype(float)
    line[:, axis] = np.linspace(0.0, VOLUME[axis], 15)
    before, beyond = line[0].copy(), line[-1].copy()
    before[axis] -= 5.0
    beyond[axis] += 5.0
    return line, before, beyond


@pytest.mark.parametrize("chain", CHAINS[:2])
def test_comp_files_take_the_positioning_error_from_the_lines_in_both_directions(tmp_path: Path, chain: str) -> None:
    calibration = random_calibration(11, chain, reversal=True)
    export(calibration, "linuxcnc-comp", tmp_path / "comp", at=AT)
    machine = machine_of(calibration)

    def left(motor: np.ndarray, line: np.ndarray, axis: int, sign: str) -> np.ndarray:
        on_line = line.copy()  # the other motors' trims do not belong to this line
        on_line[:, axis] = motor[:, axis]
        home = line[:1].copy()
        home[:, axis] = 0.0
        approach = "".join(sign if k == axis else "+" for k in range(3))
        error: np.ndarray = (on_line - line + machine.error(on_line, approach) - machine.error(home))[:, axis]
        return np.abs(error)

    turned = []
    with LinuxcncSession(comp_files=comp_files(tmp_path / "comp"), **REAL) as session:
        for axis in range(3):
            line, before, beyond = lines_of(axis)
            there = motors(session, [before, *line])[1:]
            back = motors(session, [beyond, *line[::-1]])[:0:-1]
            for sign, other, motor in (("+", "-", there), ("-", "+", back)):
                assert np.max(np.abs(motor[:, axis] - line[:, axis])) > 1e-3  # it does something
                error = left(motor, line, axis, sign)
                # LinuxCNC takes the direction from the last velocity that is not 0, which rounding may turn: then the
                # trim is that of the other direction, to the last digit.
                wrong = (error > BETWEEN_ROWS) & (left(motor, line, axis, other) < BETWEEN_ROWS)
                turned.append(np.mean(wrong))
                assert np.max(error[~wrong]) < BETWEEN_ROWS
                assert np.max(error[::2][~wrong[::2]]) < AT_ROWS
    assert np.mean(turned) < 0.1


def pitch_error(nodes: int) -> sd.Calibration:
    """A machine with nothing but a pitch error in X that has a node each millimetre."""
    functions = {f"E{c}{a}": ([0.0], [0.0]) for a in "XYZ" for c in "XYZABC"}
    position = np.arange(float(nodes))
    pitch = 0.01 * np.sin(0.9 * position) * np.sin(0.013 * position)
    errors = sd.ErrorMap(functions | {"EXX": (position, pitch)}, dict.fromkeys(("C0Y", "B0Z", "A0Z"), 0.0))
    return calibration_of(errors, CHAINS[1], (float(nodes - 1), 60.0, 50.0), TOOL)


def test_a_file_of_256_rows_is_taken_whole(tmp_path: Path) -> None:
    calibration = pitch_error(256)
    export(calibration, "linuxcnc-comp", tmp_path / "comp")
    file = tmp_path / "comp/joint0.comp"
    rows = np.loadtxt(file)
    assert len(rows) == 256
    with LinuxcncSession(comp_files={0: file}, **REAL) as session:
        assert "too many" not in session.log
        some = rows[5::10]  # the last one included
        motor = motors(session, [(float(p), 0.0, 0.0) for p in some[:, 0]])[:, 0]
    assert np.max(np.abs(motor - (2.0 * some[:, 0] - some[:, 1]))) < AT_ROWS


def test_a_row_more_is_what_linuxcnc_complains_about(tmp_path: Path) -> None:
    calibration = pitch_error(256)
    export(calibration, "linuxcnc-comp", tmp_path / "comp")
    file = tmp_path / "comp/joint0.comp"
    file.write_text(file.read_text() + "256.000000000 256.100000000 256.100000000\n")
    try:
        with LinuxcncSession(comp_files={0: file}, **REAL) as session:
            motor = motors(session, [(250.0, 0.0, 0.0), (256.0, 0.0, 0.0)])[-1, 0]
            log = session.log
    except LinuxcncError as error:  # newer ones refuse to start
        log, motor = str(error), 256.0
    assert "too many compensation entries" in log
    assert abs(motor - 255.9) > 0.05  # the 257th row is not in force


def test_a_finer_table_is_resampled_and_leaves_what_was_said(tmp_path: Path) -> None:
    calibration = pitch_error(700)
    (loss,) = [
        float(line.split("by at most ")[1].split()[0])
        for line in export(calibration, "linuxcnc-comp", tmp_path / "comp")
        if line.startswith("joint 0")
    ]
    machine = machine_of(calibration)
    positions = np.zeros((60, 3))
    positions[:, 0] = np.sort(np.random.default_rng(1).uniform(1.0, 699.0, 60))
    with LinuxcncSession(comp_files=comp_files(tmp_path / "comp"), **REAL) as session:
        motor = motors(session, positions)
    left = motor + machine.error(motor) - positions
    assert np.max(np.abs(left[:, 0])) * 1e3 < 1.06 * loss  # said with two digits
    assert np.max(np.abs(machine.error(positions)[:, 0])) * 1e3 > 3.0 * loss


@pytest.mark.parametrize("chain", CHAINS)
def test_the_kinematics_table_takes_all_errors_from_the_volume(tmp_path: Path, chain: str) -> None:
    calibration = random_calibration(21, chain)
    origin = (100.0, -20.0, -300.0)
    report = export(calibration, "linuxcnc-kins", tmp_path / "table.csv", origin=origin)
    (line,) = [line for line in report if "KINEMATICS" in line]
    arguments = dict(word.split("=", 1) for word in line.split("stepdiagkins ")[1].split())
    points = points_in(VOLUME, 40) + origin
    with LinuxcncSession(
        table=arguments["table"], chain=arguments["chain"], options={"origin": arguments["origin"]}
    ) as session:
        motor = motors(session, points.tolist())
    machine = machine_of(calibration)
    error = motor + machine.error(motor - origin) - points
    assert np.max(np.abs(machine.error(points - origin))) > 0.02
    # The exact inverse, to the bound that the compensator states (below 1e-9 mm).
    assert np.max(np.abs(error)) < 1e-9


def test_one_direction_of_a_table_with_two_is_in_force(tmp_path: Path) -> None:
    calibration = random_calibration(8, CHAINS[1], reversal=True)
    report = export(calibration, "linuxcnc-kins", tmp_path / "table.csv", approach="negative")
    assert any("approach=negative" in line for line in report)
    points = points_in(VOLUME, 20)
    with LinuxcncSession(table=tmp_path / "table.csv", chain=CHAINS[1], options={"approach": "negative"}) as session:
        motor = motors(session, points.tolist())
    assert np.max(np.abs(motor + machine_of(calibration).error(motor, "---") - points)) < 1e-9


# A component with the parameters of a kinematics module that Debian does not have. It tells what they are set to.
STAND_IN = """
import hal, json, os, sys, time
module, names = sys.argv[1], sys.argv[2:]
component = hal.component(module)
for name in names:
    component.newparam(name, hal.HAL_FLOAT, hal.HAL_RW)
component.ready()
while True:
    with open(module + ".new", "w") as file:
        json.dump({module + "." + name: component[name] for name in names}, file)
    os.replace(module + ".new", module + ".json")
    time.sleep(0.02)
"""


@pytest.mark.parametrize("to", ["matrix", "calibxyzkins"])
def test_hal_lines_set_what_they_say(tmp_path: Path, to: str) -> None:
    """To the last bit, with the comments of the file before them; a line that LinuxCNC refuses would end the start."""
    export(random_calibration(3), to, tmp_path / "lines.hal", origin=(5.0, -6.0, 7.0))
    expected = settings(tmp_path / "lines.hal")
    module = {"matrix": "matrixkins"}.get(to, to)
    names = [name.removeprefix(f"{module}.") for name in expected]
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)  # LinuxCNC's process may be another user's
        stand_in = Path(folder) / "stand_in.py"
        stand_in.write_text(STAND_IN)
        load = f"loadusr -Wn {module} {PYTHON} {stand_in} {module} {' '.join(names)}"
        with LinuxcncSession(hal=[load, *(tmp_path / "lines.hal").read_text().splitlines()]) as session:
            for _ in range(500):
                found = json.loads((session.folder / f"{module}.json").read_text())
                if found == expected:
                    break
                time.sleep(0.02)
    assert found == expected
