"""Export to LinuxCNC's COMP_FILE: the positioning error along the lines is gone, in both directions."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np
import pytest
from exported import CHAINS, TOOL, VOLUME, CompFile, calibration_of, export, machine_of, random_calibration
from hypothesis import given, settings
from hypothesis import strategies as st
from refusal import refused

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.io import whole_files

# Second order: trims are exact at the rows, and between them a kink of the inverse stands beside its row by the error,
# at most 24 µm, where the slope changes by at most 8 mm/m (40 µm over 7 mm, twice).
BETWEEN_ROWS = 24e-3 * 8e-3
# At the rows nine digits are written, of three numbers.
WRITTEN = 2e-9


def one_error(name: str, position: list[float], value: list[float]) -> sd.ErrorMap:
    """A machine of one error; all others are known to be 0."""
    functions: dict[str, tuple[list[float], list[float]]] = {
        f"E{component}{axis}": ([0.0], [0.0]) for axis in "XYZ" for component in "XYZABC"
    }
    return sd.ErrorMap(functions | {name: (position, value)}, dict.fromkeys(("C0Y", "B0Z", "A0Z"), 0.0))


def joints(folder: Path) -> list[CompFile]:
    return [CompFile(folder / f"joint{n}.comp") for n in range(3)]


def error_on_line(
    calibration: sd.Calibration, table: CompFile, axis: int, at: np.ndarray, positions: np.ndarray, sign: str
) -> np.ndarray:
    """Where the axis comes to with the table in force, less where it was sent; less what it is at home."""
    approach = "".join(sign if k == axis else "+" for k in range(3))
    machine = machine_of(calibration)
    line = np.tile(at, (len(positions) + 1, 1))
    line[:-1, axis] = table.motor(positions, sign)
    line[-1, axis] = 0.0
    home = machine.error(line[-1:])[0, axis]
    error: np.ndarray = line[:-1, axis] + machine.error(line, approach)[:-1, axis] - positions - home
    return error


def test_a_pitch_error_is_written_as_where_the_axis_comes_to(tmp_path: Path) -> None:
    errors = one_error("EXX", [0.0, 40.0, 80.0], [0.0, 0.010, -0.006])
    export(calibration_of(errors), "linuxcnc-comp", tmp_path / "comp")
    x, y, _ = joints(tmp_path / "comp")
    assert x.nominal.tolist() == [0.0, 40.0, 80.0]
    # To second order in the error: 0.010 mm with a slope of 0.4 mm/m makes 4 nm.
    assert x.forward == pytest.approx([0.0, 40.010, 79.994], abs=1e-5)
    assert np.array_equal(x.forward, x.reverse)
    assert np.array_equal(y.forward, y.nominal)


def test_a_pitching_axis_is_corrected_where_the_line_is(tmp_path: Path) -> None:
    # EBX of 50 µrad at the end, and Z above X in the chain: L_z = z + tool z; along X theta x L is EBX · L_z.
    calibration = calibration_of(one_error("EBX", [0.0, 80.0], [0.0, 50e-6]))
    export(calibration, "linuxcnc-comp", tmp_path / "comp", at=(0.0, 0.0, 20.0))
    x, _, z = joints(tmp_path / "comp")
    # Second order of 50 µrad over 80 mm is 0.1 nm, that of the inverse 8 µm · 8 µm / 80 mm: 0.8 nm.
    assert x.forward[-1] - x.nominal[-1] == pytest.approx(50e-6 * (20.0 + TOOL[2]), abs=1e-6)
    assert np.array_equal(z.forward, z.nominal)
    export(calibration, "linuxcnc-comp", tmp_path / "longer", at=(0.0, 0.0, 20.0), tool=(0.0, 0.0, 140.0))
    x = joints(tmp_path / "longer")[0]
    assert x.forward[-1] - x.nominal[-1] == pytest.approx(50e-6 * 160.0, abs=1e-6)


@pytest.mark.parametrize("chain", CHAINS)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_positioning_error_on_the_line_is_gone_in_both_directions(tmp_path: Path, chain: str, axis: int) -> None:
    calibration = random_calibration(11, chain, reversal=True)
    at = np.array([31.0, 12.0, 44.0])
    export(calibration, "linuxcnc-comp", tmp_path, at=tuple(at))
    table = joints(tmp_path)[axis]
    assert np.max(np.abs(table.forward - table.reverse)) > 1e-3  # there is reversal to correct
    between = np.linspace(0.0, VOLUME[axis], 997)
    for sign in "+-":
        left = error_on_line(calibration, table, axis, at, between, sign)
        assert np.max(np.abs(left)) < BETWEEN_ROWS
        at_rows = error_on_line(calibration, table, axis, at, table.nominal[1:-1], sign)
        assert np.max(np.abs(at_rows)) < WRITTEN


def test_the_default_line_goes_through_the_middle_of_the_volume(tmp_path: Path) -> None:
    calibration = random_calibration(2)
    export(calibration, "linuxcnc-comp", tmp_path / "a")
    export(calibration, "linuxcnc-comp", tmp_path / "b", at=(40.0, 30.0, 25.0))
    for n in range(3):
        assert (tmp_path / f"a/joint{n}.comp").read_bytes() == (tmp_path / f"b/joint{n}.comp").read_bytes()


def test_rows_are_in_the_controllers_coordinates(tmp_path: Path) -> None:
    calibration = random_calibration(2)
    export(calibration, "linuxcnc-comp", tmp_path / "a")
    export(calibration, "linuxcnc-comp", tmp_path / "b", origin=(-500.0, 10.0, 0.0))
    for a, b, shift in zip(joints(tmp_path / "a"), joints(tmp_path / "b"), (-500.0, 10.0, 0.0), strict=True):
        assert b.nominal == pytest.approx(a.nominal + shift, abs=WRITTEN)
        assert b.forward == pytest.approx(a.forward + shift, abs=2 * WRITTEN)


@settings(max_examples=10)
@given(count=st.integers(250, 500), seed=st.integers(0, 10))
def test_tables_with_many_uneven_nodes_fit_into_256_rows_with_the_loss_that_is_said(
    tmp_path_factory: pytest.TempPathFactory, count: int, seed: int
) -> None:
    random = np.random.default_rng(seed)
    position = np.concatenate([[0.0], np.cumsum(random.uniform(0.1, 1.0, count - 1))])
    position *= VOLUME[0] / position[-1]
    value = np.cumsum(random.normal(0.0, 1e-4, count))
    value -= value[0]
    calibration = calibration_of(one_error("EXX", position.tolist(), value.tolist()))
    folder = tmp_path_factory.mktemp("comp")
    report = export(calibration, "linuxcnc-comp", folder)
    table = joints(folder)[0]
    assert len(table.nominal) <= 256
    said = re.search(r"joint 0 .* by at most ([0-9.e-]+) µm", "\n".join(report))
    assert said
    at = np.array(VOLUME) / 2.0
    left = error_on_line(calibration, table, 0, at, np.linspace(0.0, VOLUME[0], 5001), "+")
    # Said with two digits, found on other positions than here.
    assert np.max(np.abs(left)) * 1e3 <= float(said[1]) * 1.06 + 1e-6


def test_nodes_that_are_one_but_for_rounding_make_one_row(tmp_path: Path) -> None:
    errors = one_error("EXX", [0.0, 20.0, 80.0], [0.0, 0.001, 0.0])
    functions = errors.functions | {"EBX": ([0.0, 20.0 + 4e-15, 79.99999999999999], [0.0, 1e-5, 0.0])}
    export(calibration_of(sd.ErrorMap(functions)), "linuxcnc-comp", tmp_path)
    assert joints(tmp_path)[0].nominal.tolist() == [0.0, 20.0, 80.0]


def test_what_is_left_in_the_volume_is_what_the_machine_then_does(tmp_path: Path) -> None:
    calibration = random_calibration(4)
    report = "\n".join(export(calibration, "linuxcnc-comp", tmp_path))
    said = re.search(r"without compensation ([0-9.]+) µm .* with it ([0-9.]+) µm", report)
    assert said
    machine = machine_of(calibration)
    tables = joints(tmp_path)
    axes = [np.linspace(0.0, edge, 8) for edge in VOLUME]  # the nodes of the tables
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    motor = np.stack([table.motor(grid[:, k], "+") for k, table in enumerate(tables)], axis=1)
    before = np.linalg.norm(machine.error(grid), axis=1)
    after = np.linalg.norm(motor + machine.error(motor) - grid, axis=1)
    # Said with four digits.
    assert float(said[1]) == pytest.approx(np.max(before) * 1e3, rel=1e-3)
    assert float(said[2]) == pytest.approx(np.max(after) * 1e3, rel=1e-3)


def test_the_companion_says_what_the_files_cannot(tmp_path: Path) -> None:
    export(random_calibration(4, reversal=True), "linuxcnc-comp", tmp_path, origin=(1.0, 2.0, 3.0))
    text = (tmp_path / "compensation.ini").read_text(encoding="ascii")
    assert text.count("COMP_FILE_TYPE = 0\n") == 3
    for words in ("[w X' b Y Z t]", "40 30 25 mm", "3 -5 40 mm", "home at 1 2 3 mm", "BACKLASH", "reversal up to"):
        assert words in text


def test_what_a_comp_file_cannot_hold_is_refused(tmp_path: Path) -> None:
    calibration = random_calibration(1)
    for rows in (1, 257):
        refused(export, calibration, "linuxcnc-comp", tmp_path, rows=rows, names="`rows`")
    refused(export, calibration, "linuxcnc-comp", tmp_path, at=(0.0, 0.0, 51.0), names="`at`")
    steep = calibration_of(one_error("EYY", [0.0, 10.0, 10.1], [0.0, 0.0, -0.2]))
    refused(export, steep, "linuxcnc-comp", tmp_path, names="EYY")
    assert not list(tmp_path.iterdir())


def test_only_what_the_lines_need_must_be_determined(tmp_path: Path) -> None:
    errors = random_calibration(1).to_error_map()
    needed = {n: v for n, v in errors.functions.items() if n[1] in "ABC" or n[1] == n[2]}
    export(calibration_of(sd.ErrorMap(needed)), "linuxcnc-comp", tmp_path / "a")
    del needed["EAY"]
    lacking = calibration_of(sd.ErrorMap(needed))
    refused(export, lacking, "linuxcnc-comp", tmp_path / "b", names="EAY")
    report = export(lacking, "linuxcnc-comp", tmp_path / "b", incomplete=True)
    assert any("NOT COMPENSATED" in line and "EAY" in line for line in report)
    assert "NOT COMPENSATED" in (tmp_path / "b/compensation.ini").read_text()


def largest_errors(lines: list[str]) -> tuple[float, float]:
    (row,) = [line for line in lines if line.startswith("largest error")]
    without, with_it = re.findall(r"compensation (\S+) µm|with it (\S+) µm", row)
    return float(without[0]), float(with_it[1])


def test_a_compensation_that_makes_the_machine_worse_is_warned_of_with_both_figures(tmp_path: Path) -> None:
    # X carries the workpiece: it is off by ECX (y + tool y), ±3 µm at its end. Right at one edge, it is off by 6 µm at
    # the other. Along Y it is off by ECX x, 8 µm, with and without.
    yaw = calibration_of(one_error("ECX", [0.0, 80.0], [0.0, 100e-6]))
    report = export(yaw, "linuxcnc-comp", tmp_path / "edge", at=(0.0, 60.0, 0.0), tool=(0.0, -30.0, 0.0))
    (warning,) = [line for line in report if line.startswith("warning:")]
    figures = [float(figure) for figure in re.findall(r"(\S+) µm", warning)]
    assert figures == pytest.approx([np.hypot(3.0, 8.0), 10.0], rel=1e-3)
    assert warning.replace("µ", "u") in (tmp_path / "edge/compensation.ini").read_text()
    report = export(yaw, "linuxcnc-comp", tmp_path / "middle", at=(0.0, 30.0, 0.0), tool=(0.0, -30.0, 0.0))
    assert not [line for line in report if line.startswith("warning:")]


@pytest.mark.parametrize("seed", range(6))
def test_the_warning_stands_where_the_stated_figures_say_so(tmp_path: Path, seed: int) -> None:
    report = export(random_calibration(seed), "linuxcnc-comp", tmp_path)
    before, after = largest_errors(report)
    assert any(line.startswith("warning:") for line in report) == (after > before)


def test_check_finds_a_set_of_two_exports(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    companion = tmp_path / "compensation.ini"
    export(random_calibration(1), "linuxcnc-comp", tmp_path)
    old = (tmp_path / "joint1.comp").read_bytes()
    assert f"sha256 of joint1.comp: {hashlib.sha256(old).hexdigest()}\n" in companion.read_text()
    assert main(["check", str(companion)]) == 0
    assert "3 tables of the same export" in capsys.readouterr().out
    export(random_calibration(2), "linuxcnc-comp", tmp_path)
    assert main(["check", str(companion)]) == 0
    (tmp_path / "joint1.comp").write_bytes(old)
    assert main(["check", str(companion)]) == 2
    assert "joint1.comp: is not the table that compensation.ini was written with" in capsys.readouterr().err
    (tmp_path / "joint1.comp").unlink()
    assert main(["check", str(companion)]) == 2


def test_all_files_are_on_the_disk_before_the_first_takes_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export(random_calibration(1), "linuxcnc-comp", tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    synced = []

    def full(handle: int) -> None:
        synced.append(handle)
        if len(synced) == 4:
            raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(whole_files.os, "fsync", full)
        with pytest.raises(sd.InvalidArgument, match="No space left on device"):
            export(random_calibration(2), "linuxcnc-comp", tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


GANTRY = """[EMC]
MACHINE = gantry
[KINS]
KINEMATICS = trivkins coordinates=XYYZ kinstype=BOTH
JOINTS = 4
[TRAJ]
COORDINATES = XYYZ
"""


def test_both_motors_of_a_gantry_have_the_table_of_their_axis(tmp_path: Path) -> None:
    calibration = random_calibration(seed=5)
    export(calibration, "linuxcnc-comp", tmp_path / "plain")
    export(calibration, "linuxcnc-comp", tmp_path / "gantry", coordinates="xyyz")
    plain, gantry = (
        [path.read_text() for path in sorted((tmp_path / name).glob("*.comp"))] for name in ("plain", "gantry")
    )
    assert gantry == [plain[0], plain[1], plain[1], plain[2]]
    ini = (tmp_path / "gantry" / "compensation.ini").read_text()
    assert "joints 0 1 2 3 = X Y Y Z" in ini
    assert re.findall(r"\[JOINT_(\d)\]\nCOMP_FILE = joint(\d)\.comp", ini) == [(str(n), str(n)) for n in range(4)]
    assert main(["check", str(tmp_path / "gantry" / "compensation.ini")]) == 0


def test_coordinates_are_those_of_the_ini_file(tmp_path: Path) -> None:
    ini = tmp_path / "gantry.ini"
    ini.write_text(GANTRY)
    calibration = random_calibration(seed=5)
    export(calibration, "linuxcnc-comp", tmp_path / "found", ini=ini)
    assert (tmp_path / "found" / "joint3.comp").exists()
    refused(
        export,
        calibration,
        "linuxcnc-comp",
        tmp_path / "other",
        ini=ini,
        coordinates="XYZ",
        names="`coordinates`: expected XYYZ, as",
    )
    ini.write_text(GANTRY.replace("JOINTS = 4", "JOINTS = 3"))
    refused(export, calibration, "linuxcnc-comp", tmp_path / "other", ini=ini, names="got XYYZ for 3 joints")
    ini.write_text("[TRAJ]\n")
    refused(export, calibration, "linuxcnc-comp", tmp_path / "other", ini=ini, names="KINEMATICS in [KINS]")
    for wrong in ("XY", "XXYY", "XYZ1"):
        refused(
            export, calibration, "linuxcnc-comp", tmp_path / "other", coordinates=wrong, names="expected a letter for"
        )
    assert not (tmp_path / "other").exists()
