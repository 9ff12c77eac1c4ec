"""Tables of controllers and of other programs as error maps: what export writes is read back, and what others write."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from controllers import INTERPRETERS
from exported import TOOL, VOLUME, export, machine_of, points_in, random_calibration
from refusal import refused
from simple_exports import MOTORS
from usual import ALL_CHAINS
from verified import TESTED

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.exporting.formats import FORMATS
from stepdiag.importing.controller_tables import ImportedMap, is_controller_table, read_controller_tables
from stepdiag.parameters import SQUARENESSES

ORIGIN = (-100.0, 25.0, 7.5)
RESOLUTION = 2e-6  # mm: six digits; rotations of nine degrees' digits on 80 mm
WHOLE = ("etalon", "isg", "heidenhain-kinematics")
VECTORS = ("csv-grid", "linuxcnc-kins")  # no functions of one position; a calibration file already


def files_of(to: str, output: Path) -> list[Path]:
    if to.startswith("heidenhain"):
        return [output / f"{axis}.com" for axis in "xyz"]
    return [output / "compensation.ini" if to == "linuxcnc-comp" else output]


def read_back(calibration: sd.Calibration, to: str, output: Path, **options: object) -> ImportedMap:
    needed = {"axis": "Y", "depends_on": "X"} if to == "position-error" else {}
    export(calibration, to, output, origin=ORIGIN, **needed, **options)
    given = {}
    if to.startswith("heidenhain"):  # its tables hold no comment
        given = {"chain": calibration.chain.name, "origin": ORIGIN, "tool": TOOL, "volume": VOLUME}
    if to == "linuxcnc-comp":
        given = {"chain": calibration.chain.name}
    return read_controller_tables(files_of(to, output), **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("to", ["etalon", "isg"])
def test_a_table_with_a_stated_uncertainty_is_verified(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], to: str
) -> None:
    """The truth in a file of others, and readings of the machine: chi-square is what its degrees of freedom say. Of
    another machine it is not."""
    monkeypatch.chdir(tmp_path)
    Path("tested.toml").write_text(TESTED)
    Path("other.toml").write_text(TESTED.replace("seed = 5", "seed = 6"))
    for name in ("tested", "other"):
        assert main(["simulate", f"{name}.toml", "-o", f"{name}.csv"]) == 0
    truth = sd.random_error_map((400.0, 300.0, 250.0), seed=5, intervals=6)
    zero = {name: (x, v, np.zeros_like(x)) for name, (x, v) in truth.functions.items()}
    squareness = {name: (angle, 0.0) for name, angle in truth.squareness.items()}
    calibration = sd.Calibration("truth", "[w X' b Y Z t]", (400.0, 300.0, 250.0), (0.0, 0.0, 0.0), zero, squareness)
    export(calibration, to, Path("table.txt"))
    assert main(["import", "table.txt", "--uncertainty", "0.01", "0.01", "-o", "table.nc"]) == 0
    found = sd.read_calibration("table.nc")
    assert found.covariance is not None
    assert (found["EXX"][2][1], found["C0Y"][2]) == (1e-5, 1e-8)
    capsys.readouterr()
    assert main(["verify", "table.nc", "tested.toml", "tested.csv", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["probability"] > 0.001
    assert main(["verify", "table.nc", "other.toml", "other.csv"]) == 3


@pytest.mark.parametrize("uncertainty", [("0", "1"), ("1", "-1"), ("nan", "1"), ("inf", "1")])
def test_an_uncertainty_that_is_none_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], uncertainty: tuple[str, str]
) -> None:
    file, output = tmp_path / "table.txt", tmp_path / "table.nc"
    export(random_calibration(1, ALL_CHAINS[0], intervals=3), "etalon", file)
    assert main(["import", str(file), "--uncertainty", *uncertainty, "-o", str(output)]) == 2
    assert "--uncertainty: expected a length and an angle above 0" in capsys.readouterr().err
    assert not output.exists()


@pytest.mark.parametrize("chain", ALL_CHAINS[::3])
@pytest.mark.parametrize("squareness", ["straightness", "parameters"])
@pytest.mark.parametrize("to", WHOLE)
def test_all_21_errors_come_back(tmp_path: Path, to: str, squareness: str, chain: str) -> None:
    if to == "heidenhain-kinematics" and squareness == "parameters":
        pytest.skip("always in the straightnesses")
    calibration = random_calibration(ALL_CHAINS.index(chain), chain, intervals=7)
    options = {"squareness": squareness} if "squareness" in FORMATS[to].options else {}
    found = read_back(calibration, to, tmp_path / "table", **options)
    assert found.chain == chain
    assert (found.volume, found.tool) == (VOLUME, TOOL)
    again = sd.Machine(found.chain, found.errors, found.tool)
    p = points_in(VOLUME, 2000)
    written, read = machine_of(calibration).first_order_error(p), again.first_order_error(p)
    assert np.abs(written - read).max() < RESOLUTION + 1.1e-5  # and parabolas between nodes
    if squareness == "parameters":
        for name, (angle, _) in calibration.squareness.items():
            assert found.errors.squareness[name] == pytest.approx(angle, abs=1e-12)
    turns = {name: table for name, table in found.errors.functions.items() if name[1] in "ABC"}
    for name, (position, value) in turns.items():
        assert np.interp(position, *calibration.functions[name][:2]) == pytest.approx(value, abs=2e-11)


@pytest.mark.parametrize("chain", ALL_CHAINS[::5])
@pytest.mark.parametrize("to", [to for to in FORMATS if to not in (*WHOLE, *VECTORS)])
def test_what_a_table_compensates_comes_back(tmp_path: Path, to: str, chain: str) -> None:
    """The map's error is what its controller subtracts."""
    calibration = random_calibration(ALL_CHAINS.index(chain), chain, reversal=to in ("siemens-cec", "linuxcnc-comp"))
    output = tmp_path / "table"
    found = read_back(calibration, to, output)
    again = sd.Machine(found.chain, found.errors, found.tool)
    p = points_in(VOLUME, 500)
    if to in ("linuxcnc-comp", "squareness"):  # the inverse, exact at the rows; and no motors from elsewhere than 0
        read = again.first_order_error(p)
        expected = (
            squareness_of(calibration, p)
            if to == "squareness"
            else np.stack([np.interp(p[:, n], *comp_rows(output, n, ORIGIN[n])) for n in range(3)], axis=1)
        )
        assert np.abs(read - expected).max() < RESOLUTION
        return
    motors = INTERPRETERS[to](output, p + ORIGIN, 1, 1.0) if to in INTERPRETERS else MOTORS[to](output, p + ORIGIN)
    home = np.array([ORIGIN])
    zero = (INTERPRETERS[to](output, home, 1, 1.0) if to in INTERPRETERS else MOTORS[to](output, home)) - home
    subtracted = -(motors - p - ORIGIN - zero)
    # A polynomial is one of the motors' positions, which go a little beyond the tables. Marlin and Klipper multiply two
    # angles.
    polynomial = to in ("matrix", "calibxyzkins")
    places, first = (motors - ORIGIN, zero) if polynomial else (p, np.zeros((1, 3)))
    read = again.first_order_error(places) - again.first_order_error(first)
    slack = 2e-5 if polynomial or to in ("marlin", "klipper") else RESOLUTION
    assert np.abs(read - subtracted).max() < slack


def squareness_of(calibration: sd.Calibration, p: np.ndarray) -> np.ndarray:
    angles = sd.ErrorMap({}, {name: angle for name, (angle, _) in calibration.squareness.items()})
    return sd.Machine(calibration.chain, angles, TOOL).first_order_error(p)


def comp_rows(folder: Path, joint: int, origin: float) -> tuple[np.ndarray, np.ndarray]:
    nominal, there, _ = np.loadtxt(folder / f"joint{joint}.comp").T
    return nominal - origin, there - nominal


TRAC_CAL = """// printed by Beckhoff and ISG
[C0B]
VALUE = 0.000022355737
[A0Z]
VALUE = 0.000047622950
[EXY]
Gridpoints = {
-280.0 -0.001358635132
-270.0 -0.000240680764
-260.0 0.000877273605
260.0 -0.001297146744
270.0 -0.000316265101
} // end of EXY
"""


def test_etalon_file_of_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("trac-cal.txt").write_text(TRAC_CAL)
    assert is_controller_table(Path("trac-cal.txt"))
    assert main(["import", "trac-cal.txt", "-o", "map.csv"]) == 2
    assert "give --chain" in capsys.readouterr().err
    given = ["--chain", "[w b X Y Z t]", "--volume", "400", "550", "300"]
    assert main(["import", "trac-cal.txt", "-o", "map.csv", *given]) == 0
    said = capsys.readouterr().out
    assert "left out, as no error of X, Y or Z: C0B" in said
    assert "home at 0 -280 0 mm of the file" in said
    found = sd.read_error_map("map.csv")
    position, value = found.functions["EXY"]
    assert position.tolist() == [0.0, 10.0, 20.0, 540.0, 550.0]
    assert value[0] == -0.001358635132
    assert found.squareness == {"A0Z": 0.000047622950}
    assert main(["plot", "map.csv", "-o", "map.png"]) in (0, 3)
    assert main(["export", "map.csv", "--to", "etalon", "-o", "again.txt"]) in (0, 3)
    assert main(["import", "again.txt", "-o", "again.csv"]) == 0
    again = sd.read_error_map("again.csv")  # with squarenesses, which its own file had in the straightnesses
    assert again.functions["EXY"][1] - again.squareness["C0Y"] * position == pytest.approx(value, abs=1e-8)
    assert again.squareness["A0Z"] == pytest.approx(0.000047622950, abs=1e-12)


@pytest.mark.parametrize(
    ("right", "wrong", "named"),
    [
        ("-270.0 -0.000240680764", "-290.0 0.0", "[EXY]: expected rows with ascending positions"),
        ("-270.0 -0.000240680764", "-270.0 nan", "[EXY], row 2: expected 2 numbers, got '-270.0 nan'"),
        ("VALUE = 0.000047622950", "VALUE = small", "line 4: [A0Z]: expected VALUE = number"),
        ("[C0B]\nVALUE", "[A0Z]\nVALUE", "line 4: [A0Z]: is there twice"),
        ("0.000047622950", "0.2", "A0Z is 200000 µrad"),
    ],
)
def test_damaged_tables_are_refused(tmp_path: Path, right: str, wrong: str, named: str) -> None:
    file = tmp_path / "map.txt"
    assert right in TRAC_CAL
    file.write_text(TRAC_CAL.replace(right, wrong))
    given = {"chain": "[w b X Y Z t]", "volume": (400.0, 550.0, 300.0)}
    refused(read_controller_tables, [file], names=named, **given)


def test_damaged_siemens_tables_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "cec.ini"
    export(random_calibration(3), "siemens-cec", file)
    text = file.read_text()
    for right, wrong, named in [
        ("$AN_CEC[0,3]=", "$AN_CEC[0,30]=", "table 0: '0,3' is missing"),
        ("$AN_CEC_IS_MODULO[1]=0", "$AN_CEC_IS_MODULO[1]=1", "IS_MODULO is set"),
        ("$AN_CEC_INPUT_AXIS[2]=(AX3)", "$AN_CEC_INPUT_AXIS[2]=(B1)", "got 'B1'"),
        ("$AN_CEC_STEP[0]=", "$AN_CEC_STEP(0)=", "expected $NAME[index]=value"),
    ]:
        assert right in text, right
        file.write_text(text.replace(right, wrong))
        refused(read_controller_tables, [file], names=named)


def test_squarenesses_alone_have_no_other(tmp_path: Path) -> None:
    found = read_back(random_calibration(3), "squareness", tmp_path / "s.csv")
    assert set(found.errors.squareness) == set(SQUARENESSES)
    assert any("not in the file: EXX" in line for line in found.text)


@pytest.mark.parametrize(
    "head", ["X\tY\tZ\tDistance", "x y z distance", "[EMC]\nVERSION = 1.1", "\n" * 5000 + "line,point"]
)
def test_what_is_no_table_is_left_to_others(tmp_path: Path, head: str) -> None:
    file = tmp_path / "readings.txt"
    file.write_text(f"{head}\n0\t0\t0\t1\n")
    assert not is_controller_table(file)
