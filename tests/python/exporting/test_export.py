"""`stepdiag export`: options, refusals, and the table of LinuxCNC's kinematics module."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calibrations import calibrate, parts_of, same_calibration, simulate
from exported import CHAINS, calibration_of, export, random_calibration
from refusal import refused
from usual import CHAIN, DIAGONALS, SMALL_VOLUME, small_plan

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.exporting.formats import FORMATS, MAKERS, of_maker
from stepdiag.exporting.write import WRITERS

OUTPUT = {
    "linuxcnc-comp": "comp",
    "linuxcnc-kins": "kins.csv",
    "isg": "isg.csv",
    "csv-grid": "grid.csv",
    "squareness": "squareness.csv",
    "matrix": "matrix.hal",
    "calibxyzkins": "calibxyzkins.hal",
    "position-error": "error.csv",
    "siemens-cec": "cec.ini",
    "siemens-enc-comp": "enc_comp.ini",
    "heidenhain-com": "com",
    "heidenhain-kinematics": "kinematics",
    "etalon": "etalon.txt",
    "rrf": "config.g",
    "marlin": "marlin.gcode",
    "klipper": "klipper.gcode",
}
# What these tests take for the axes that position-error needs.
POSITIONING = {axis: {"axis": axis, "depends_on": axis} for axis in "XZ"}


@pytest.fixture
def calibration_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    random_calibration(5).write("calibration.csv")
    return tmp_path / "calibration.csv"


def axes_of(to: str) -> list[str]:
    return ["--axis", "X", "--depends-on", "X"] if to == "position-error" else []


def test_the_command_knows_the_formats_of_the_library() -> None:
    assert list(FORMATS) == list(WRITERS)


@pytest.mark.parametrize("maker", MAKERS)
def test_a_makers_name_lists_its_formats(maker: str, capsys: pytest.CaptureFixture[str]) -> None:
    if maker in FORMATS:  # a format itself
        return
    assert main(["export", "--to", maker]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in listed] == [name for name, _ in of_maker(maker)]
    assert all(one.tested in line for line, (_, one) in zip(listed, of_maker(maker), strict=True))


@pytest.mark.parametrize("to", FORMATS)
def test_every_format_tells_chain_sign_and_loss(
    calibration_file: Path, to: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "calibration.csv", "--to", to, "-o", OUTPUT[to], *axes_of(to)]) == 0
    said = capsys.readouterr().out
    for words in ("chain [w X' b Y Z t]", "sign: ", f"wrote {OUTPUT[to]}"):
        assert words in said
    assert any(words in said for words in ("loses at most", "loss: ", "deviates", "differs", "left out: "))


@pytest.mark.parametrize(
    ("temperature", "said", "in_table"),
    [
        ({"temperature_reference": 20.0}, "referred to 20 °C", "temperature_reference_c=20.0"),
        (
            {"temperature_as_found": (23.1, 23.0, 22.8)},
            "as found, with the scales of X, Y, Z at 23.1, 23.0, 22.8 °C",
            "temperature_as_found_c=23.1 23.0 22.8",
        ),
        ({}, "no temperature was recorded", ""),
    ],
)
@pytest.mark.parametrize("to", FORMATS)
def test_every_export_says_for_which_temperature_it_is(
    tmp_path: Path, to: str, temperature: dict[str, Any], said: str, in_table: str
) -> None:
    """In a comment of the file, in ASCII; a COMP_FILE takes none, and the INI lines beside it have it."""
    calibration = sd.Calibration(**parts_of(random_calibration(5)), **temperature)
    report = export(calibration, to, tmp_path / OUTPUT[to], **POSITIONING["X"] if to == "position-error" else {})
    assert any(line.startswith("temperature: ") and said in line for line in report)
    written = tmp_path / OUTPUT[to] / FORMATS[to].mark
    lines = written.read_text("utf-8").splitlines()
    if to == "linuxcnc-kins":  # a calibration file, with the keys of one
        assert not in_table or f"# {in_table}" in lines
        return
    (line,) = [line for line in lines if re.match(r"(?:# |// |; )?temperature(?:: |=)", line)]
    assert said.replace("°C", "degC") in line
    assert line.isascii()


@pytest.mark.parametrize("to", FORMATS)
def test_netcdf_and_csv_are_exported_alike(calibration_file: Path, to: str) -> None:
    calibration = sd.read_calibration("calibration.csv")
    calibration.write("calibration.nc")
    texts = []
    for name in ("calibration.csv", "calibration.nc"):
        assert main(["export", name, "--to", to, "-o", OUTPUT[to], *axes_of(to)]) == 0
        files = [Path(OUTPUT[to]) / name for name in FORMATS[to].folder] or [Path(OUTPUT[to])]
        texts.append([file.read_text() for file in files if file.exists()])
    assert texts[0] == texts[1] != []


@pytest.mark.parametrize("to", FORMATS)
@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("at", (1.0, 1.0, 1.0)),
        ("rows", 20),
        ("approach", "positive"),
        ("nodes", (2, 2, 2)),
        ("step", 5.0),
        ("orientation", True),
        ("squareness", "parameters"),
        ("axis", "X"),
        ("depends_on", "Y"),
        ("tables", 4),
        ("axis_names", ("X1", "Y1", "Z1")),
        ("fixed", (0.0, 0.0, 100.0)),
    ],
)
def test_an_option_of_another_format_is_refused(tmp_path: Path, to: str, option: str, value: Any) -> None:
    calibration, path = random_calibration(5), tmp_path / "out"
    needed = POSITIONING["X"] if to == "position-error" else {}
    if option in FORMATS[to].options:
        assert export(calibration, to, path, **needed | {option: value})
    else:
        refused(export, calibration, to, path, names=f"`{option}`", **{option: value})
        assert not path.exists()


@pytest.mark.parametrize("to", [to for to in FORMATS if to != "squareness"])
def test_a_scale_that_is_not_determined_is_no_scale_of_0(tmp_path: Path, to: str) -> None:
    plan = sd.Plan(SMALL_VOLUME, DIAGONALS, 5)  # no scale lines
    calibration = calibrate(1, plan=plan)
    assert "EXX" in calibration.undetermined_slopes
    needed = POSITIONING["X"] if to == "position-error" else {}
    refused(export, calibration, to, tmp_path / "out", names="EXX (slope)", **needed)
    report = export(calibration, to, tmp_path / "out", incomplete=True, **needed)
    assert any("NOT COMPENSATED" in line and "EXX (slope)" in line for line in report)


@pytest.mark.parametrize("to", [to for to in FORMATS if to != "squareness"])
def test_a_table_that_ends_before_the_volume_does_is_said_to_hold_its_end(tmp_path: Path, to: str) -> None:
    errors = random_calibration(5).to_error_map()
    position, value = errors.functions["EZZ"]
    short = {"EZZ": (position[1:-1], value[1:-1])}
    calibration = calibration_of(sd.ErrorMap(errors.functions | short, errors.squareness))
    needed = POSITIONING["Z"] if to == "position-error" else {}
    report = "\n".join(export(calibration, to, tmp_path / "out", **needed))
    assert f"EZZ below {position[1]:g} mm, EZZ above {position[-2]:g} mm" in report


def test_a_reversal_that_is_known_but_for_a_constant_is_not_passed_on_in_silence(tmp_path: Path) -> None:
    parts = parts_of(random_calibration(8, reversal=True))
    calibration = sd.Calibration(**parts | {"undetermined_reversal_constants": ["EYY"]})
    refused(export, calibration, "linuxcnc-comp", tmp_path / "out", names="EYY (constant of its reversal error)")


def test_what_an_error_map_lacks_is_0(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    errors = sd.ErrorMap({"EXX": ([0.0, 80.0], [0.0, 0.01])})
    errors.write("map.csv", chain=CHAINS[0], volume=SMALL_VOLUME, tool=(0.0, 0.0, 0.0))
    assert main(["export", "map.csv", "--to", "linuxcnc-comp", "-o", "comp"]) == 0
    assert Path("comp/joint0.comp").read_text().endswith("80.000000000 80.009998750 80.009998750\n")
    assert "NOT COMPENSATED" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["calibration.csv", "--to", "fanuc", "-o", "x"], "--to"),
        (["calibration.csv", "-o", "x"], "--to"),
        (["calibration.csv", "--to", "isg"], "-o"),
        (["calibration.csv", "--to", "isg", "-o", "calibration.csv"], "is also an input"),
        (["calibration.csv", "--to", "isg", "-o", "nowhere/x"], "nowhere"),
        (["missing.csv", "--to", "isg", "-o", "x.csv"], "missing.csv"),
        (["calibration.csv", "--to", "isg", "-o", "x.csv", "--tool", "1", "2"], "--tool"),
        (["calibration.csv", "--to", "isg", "-o", "x.csv", "--tool", "1", "2", "nan"], "--tool"),
        (["calibration.csv", "--to", "csv-grid", "-o", "x.csv", "--origin", "inf", "2", "3"], "--origin"),
        (["calibration.csv", "--to", "linuxcnc-comp", "-o", "calibration.csv"], "calibration.csv"),
        (["calibration.csv", "--to", "linuxcnc-comp", "-o", "x", "--at", "900", "0", "0"], "--at"),
        (["calibration.csv", "--to", "position-error", "-o", "x.csv", "--axis", "X"], "--depends-on"),
        (["calibration.csv", "--to", "position-error", "-o", "x.csv", "--axis", "A", "--depends-on", "X"], "--axis"),
        (["calibration.csv", "--to", "matrix", "-o", "x.csv"], "x.csv: expected a name that ends in .hal"),
        (["calibration.csv", "--to", "csv-grid", "-o", "x.csv", "--nodes", "2", "2", "2", "--step", "1"], "--step"),
    ],
)
def test_bad_arguments_are_refused_by_name(
    calibration_file: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], names: str
) -> None:
    assert main(["export", *arguments]) == 2
    assert names in capsys.readouterr().err
    assert sorted(path.name for path in calibration_file.parent.iterdir()) == ["calibration.csv"]


def test_tables_of_the_conventional_method_hold_for_their_tool_only(tmp_path: Path) -> None:
    parts = parts_of(random_calibration(5)) | {"method": "conventional"}
    calibration = sd.Calibration(**parts)
    refused(export, calibration, "csv-grid", tmp_path / "x", tool=(0.0, 0.0, 0.0), names="`tool`")
    assert export(calibration, "csv-grid", tmp_path / "x", tool=tuple(calibration.tool))


def test_the_kinematics_table_is_the_calibration_to_the_last_bit(tmp_path: Path) -> None:
    plan = small_plan()
    calibration = sd.methods.adjust(
        simulate(2, plan=plan, backward=True), plan, sd.Head(), CHAINS[0], (1.0, -2.0, 30.0)
    ).calibration
    assert calibration.reversal
    report = export(calibration, "linuxcnc-kins", tmp_path / "table.csv", incomplete=True)
    calibration.write_csv(tmp_path / "calibration.csv")
    assert (tmp_path / "table.csv").read_bytes() == (tmp_path / "calibration.csv").read_bytes()
    assert any("stepdiagkins" in line and "chain=wXbYZt" in line for line in report)


def test_the_kinematics_table_may_be_for_another_tool(tmp_path: Path) -> None:
    calibration = random_calibration(5, reversal=True)
    export(calibration, "linuxcnc-kins", tmp_path / "table.csv", tool=(0.0, 0.0, 125.0))
    table = sd.read_calibration(tmp_path / "table.csv")
    assert table.tool.tolist() == [0.0, 0.0, 125.0]
    again = sd.Calibration(**parts_of(table) | {"tool": calibration.tool})
    assert same_calibration(again, calibration)


def test_the_kinematics_table_keeps_the_expansion_of_the_scales(tmp_path: Path) -> None:
    parts = parts_of(random_calibration(5)) | {"covariance": None}
    expansion = {"temperature_reference": 20.0, "expansion": (1.15e-5, 8e-6, 0.0), "fixed_point": (0.0, 300.0, -1.5)}
    report = export(
        sd.Calibration(**parts, **expansion), "linuxcnc-kins", tmp_path / "table.csv", tool=(0.0, 0.0, 125.0)
    )
    assert any("temperatures=LOWEST,HIGHEST" in line for line in report)
    table = sd.read_calibration(tmp_path / "table.csv")
    assert (tuple(table.expansion), tuple(table.fixed_point)) == (expansion["expansion"], expansion["fixed_point"])
    assert sd.Compensator(tmp_path / "table.csv", table.chain, temperatures=(10, 35)).temperature_reference == 20.0
    told = export(random_calibration(5), "linuxcnc-kins", tmp_path / "as_found.csv")
    assert not any("temperatures=" in line for line in told)


def test_an_export_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    old = tmp_path / "grid.csv"
    old.write_text("kept\n")
    refused(export, random_calibration(1), "csv-grid", old, nodes=(1, 1, 1), names="`nodes`")
    assert old.read_text() == "kept\n"
    comp = tmp_path / "comp"
    (comp / "joint2.comp").mkdir(parents=True)
    refused(export, random_calibration(1), "linuxcnc-comp", comp, names="joint2.comp")
    assert not (comp / "joint0.comp").exists()


def test_a_machine_without_errors_needs_no_correction(tmp_path: Path) -> None:
    edges = zip("XYZ", SMALL_VOLUME, strict=True)
    functions = {f"E{c}{a}": ([0.0, edge], [0.0, 0.0]) for a, edge in edges for c in "XYZABC"}
    calibration = calibration_of(sd.ErrorMap(functions, dict.fromkeys(("C0Y", "B0Z", "A0Z"), 0.0)))
    for to in FORMATS:
        assert export(calibration, to, tmp_path / OUTPUT[to], **POSITIONING["X"] if to == "position-error" else {})
    assert np.all(np.genfromtxt(tmp_path / "comp/joint0.comp")[:, 1] == [0.0, 80.0])


def test_table_that_the_module_would_refuse_is_refused(tmp_path: Path) -> None:
    """And what is written is loaded: the report tells its id."""
    functions = {
        f"E{c}{a}": ([0.0, edge], [0.0, 0.0]) for a, edge in zip("XYZ", SMALL_VOLUME, strict=True) for c in "XYZABC"
    }
    squareness = dict.fromkeys(("C0Y", "B0Z", "A0Z"), 0.0)
    steep = calibration_of(sd.ErrorMap(functions | {"EXX": ([0.0, 80.0], [0.0, 40.0])}, squareness))
    with pytest.raises(sd.InvalidArgument, match="change by less than"):
        export(steep, "linuxcnc-kins", tmp_path / "steep.csv")
    assert not (tmp_path / "steep.csv").exists()
    report = export(calibration_of(sd.ErrorMap(functions, squareness)), "linuxcnc-kins", tmp_path / "good.csv")
    fingerprint = sd.Compensator(tmp_path / "good.csv", CHAIN).fingerprint
    assert any(f"table id {fingerprint:016x}" in line for line in report)
