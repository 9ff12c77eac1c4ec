"""`verify --compensated`: a run that was measured with a table in force tells whether the table acts, and how.

What a table does is put into the virtual machine as errors of its own: tables of one axis by one axis are sums of
functions, as straightnesses and positioning errors are.
"""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from verified import TESTED

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.importing.controller_tables import read_controller_tables
from stepdiag.io.data_files import read_measurement
from stepdiag.rechecking import verification
from stepdiag.scenario.description import read_scenario

SIGNS = {"right": 1.0, "off": 0.0, "wrong": -1.0}


def compensated_machine(table: sd.ErrorMap, sign: float) -> sd.ErrorMap:
    """The truth less what the table has; both have their nodes, and their ends, in common."""
    truth = sd.random_error_map((400.0, 300.0, 250.0), seed=5, intervals=6)
    functions = {}
    for name, (position, value) in truth.functions.items():
        x, v = table.functions.get(name, ([0.0, position[-1]], [0.0, 0.0]))
        places = np.union1d(np.round(position, 6), np.round(x, 6))
        functions[name] = places, np.interp(places, position, value) - sign * np.interp(places, x, v)
    angles = {name: angle - sign * table.squareness.get(name, 0.0) for name, angle in truth.squareness.items()}
    return sd.ErrorMap(functions, angles)


@pytest.mark.parametrize("to", ["siemens-cec", "siemens-enc-comp", "linuxcnc-comp"])
@pytest.mark.parametrize("way", SIGNS)
def test_a_run_tells_whether_the_table_acts(
    files: Path,
    to: str,
    way: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    output = "comp" if to == "linuxcnc-comp" else "table.ini"
    file = Path("comp/compensation.ini" if to == "linuxcnc-comp" else "table.ini")
    assert main(["export", "calibration.nc", "--to", to, "-o", output]) == 0
    table = read_controller_tables([file], chain="[w X' b Y Z t]").errors
    machine = compensated_machine(table, SIGNS[way])
    machine.write("compensated.csv", chain="[w X' b Y Z t]", volume=(400.0, 300.0, 250.0), tool=(0.0, 0.0, 0.0))
    changed = TESTED.replace("[machine.random]\nseed = 5\nintervals = 6\n", "").replace(
        "[machine]\n", '[machine]\nerrors = "compensated.csv"\n'
    )
    Path("changed.toml").write_text(changed)
    assert main(["simulate", "changed.toml", "-o", "changed.csv", "--overwrite"]) == 0
    capsys.readouterr()
    command = ["verify", "calibration.nc", "tested.toml", "changed.csv", "--compensated", str(file)]
    status = main(command)
    said = capsys.readouterr()
    assert main([*command, "--json"]) == status
    acts = json.loads(capsys.readouterr().out)["compensated"]
    sizes = [acts[name] for name in ("chi_square", "chi_square_without", "chi_square_turned")]
    assert acts["tables"] == [str(file)]
    assert acts["acts"] == {"right": "as it is", "off": "not", "wrong": "turned"}[way]
    assert list(SIGNS)[int(np.argmin(sizes))] == way
    if way == "right":
        assert status == 0, said
        assert "the table is in force, with the right sign" in said.out
        return
    assert status == 3
    verdict = {"off": "those of the machine without the table", "wrong": "acts with the wrong sign: take it away"}
    assert verdict[way] in said.err


def test_a_table_of_a_calibration_file_is_taken_too(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All 21 are compensated, and the tilts stay: such a machine has no error map. Its readings are those of the
    uncompensated one, so that it is said that no table acts."""
    assert main(["export", "calibration.nc", "--to", "linuxcnc-kins", "-o", "kins.csv"]) == 0
    capsys.readouterr()
    assert main(["verify", "calibration.nc", "tested.toml", "new.csv", "--compensated", "kins.csv"]) == 3
    assert "those of the machine without the table" in capsys.readouterr().err


def test_a_table_of_two_directions_acts_by_the_direction_of_each_axis(
    files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario, run = read_scenario("tested.toml"), read_measurement("new.csv")
    errors = sd.ErrorMap({"EXX": ([0.0], [1.0])}, negative_functions={"EXX": ([0.0], [2.0])})
    sent = []
    monkeypatch.setattr(verification, "verify", lambda *_, sent: shifts_of(sent))

    def shifts_of(shift: np.ndarray) -> object:
        sent.append(shift)
        return SimpleNamespace(chi_square=0.0, degrees_of_freedom=1)

    verification.verify_compensated(None, scenario, run, sd.Machine("[w b X Y Z t]", errors))  # type: ignore[arg-type]
    expected = [{"p": -1.0, "n": -2.0}[line[0]] for line in run.line]
    assert {"ppp", "nnp"} == set(run.line)
    assert sent[0][:, 0].tolist() == expected
    assert verification._approach("p0n", "backward") == "-++"
