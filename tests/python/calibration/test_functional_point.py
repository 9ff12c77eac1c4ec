"""Straightness of the functional point: that of the exact machine, moved along one axis alone."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calibrations import calibrate
from usual import CHAIN, VOLUME

import stepdiag as sd
from stepdiag.cli import main
from stepdiag.parameters import FUNCTIONS

CHAINS = ["[w X' b Y Z t]", "[w Z' Y' b X t]", "[w Y' X' Z' b t]", "[w b X Y Z t]"]
TOOLS = [(0.0, 0.0, 0.0), (20.0, -40.0, 150.0)]


def random_calibration(chain: str, tool: tuple[float, float, float], seed: int = 5) -> sd.Calibration:
    errors = sd.random_error_map(VOLUME, seed=seed, intervals=20)
    functions = {name: (p, v, np.full_like(p, 1e-5)) for name, (p, v) in errors.functions.items()}
    return sd.Calibration("truth", chain, VOLUME, tool, functions)


def along(axis: str, position: Any) -> Any:
    commanded = np.zeros((len(position), 3))
    commanded[:, "XYZ".index(axis)] = position
    return commanded


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("chain", CHAINS)
def test_is_what_the_exact_machine_does_moved_along_one_axis(chain: str, tool: tuple[float, float, float]) -> None:
    calibration = random_calibration(chain, tool)
    machine = sd.Machine(chain, calibration.to_error_map(), tool)
    straightness = sd.methods.functional_point_straightness(calibration)
    for axis in "XYZ":
        for i, component in enumerate("XYZ"):
            if component == axis:
                continue
            name = f"E{component}{axis}"
            position, value, _ = straightness.get(name, calibration.functions[name])
            exact = machine.error(along(axis, position))[:, i]
            # What is left is of second order: rotations up to 1e-4 rad, squared, times an arm of up to 1 m.
            np.testing.assert_allclose(value, exact, rtol=0.0, atol=1e-5)


def test_57_micrometres_at_71_microradians_and_800_millimetres() -> None:
    zero = np.zeros(2)
    ends = np.array([0.0, 800.0])
    functions = {"EYX": (ends, zero, zero), "EZX": (ends, zero, zero), "EBX": (ends, zero, zero)}
    functions["ECX"] = (ends, np.array([0.0, 71e-6]), zero)
    found = sd.methods.functional_point_straightness(sd.Calibration("", CHAIN, VOLUME, (0, 0, 0), functions))
    assert found["EYX"][1].tolist() == [0.0, pytest.approx(0.0568)]
    assert found["EZX"][1].tolist() == [0.0, 0.0]


def test_only_what_differs_and_is_determined_is_there() -> None:
    assert sd.methods.functional_point_straightness(random_calibration("[w b X Y Z t]", (0, 0, 0))) == {}
    assert sd.methods.functional_point_straightness(random_calibration(CHAIN, (0, 0, 0))).keys() == {"EYX", "EZX"}
    with_tool = sd.methods.functional_point_straightness(random_calibration(CHAIN, (0, 0, 100.0)))
    # EZY + EAY t_y - EBY t_x: an offset along Z is no arm.
    assert with_tool.keys() == {"EYX", "EZX", "EXY", "EXZ", "EYZ"}
    functions = random_calibration(CHAIN, (0, 0, 0)).functions
    del functions["ECX"]
    assert sd.methods.functional_point_straightness(sd.Calibration("", CHAIN, VOLUME, (0, 0, 0), functions)).keys() == {
        "EZX"
    }
    open_slope = sd.Calibration("", CHAIN, VOLUME, (0, 0, 0), functions, undetermined_slopes=["EBX"])
    assert sd.methods.functional_point_straightness(open_slope) == {}


def test_uncertainty_counts_the_covariance_of_straightness_and_rotation() -> None:
    calibration = calibrate(1, full_covariance=True)
    covariance, labels = calibration.covariance, calibration.covariance_labels
    assert covariance is not None
    position, _, uncertainty = sd.methods.functional_point_straightness(calibration)["EYX"]
    for k, p in enumerate(position):
        rows = np.array([labels.index((name, p)) for name in ("EYX", "ECX", "EAX")])
        factor = np.array([1.0, p + calibration.tool[0], -calibration.tool[2]])  # of theta x L along Y
        variance = factor @ covariance[np.ix_(rows, rows)] @ factor
        # Sums of the same terms in another order.
        assert uncertainty[k] == pytest.approx(np.sqrt(variance), rel=1e-9, abs=1e-15)


def test_without_a_covariance_straightness_and_rotation_are_taken_as_independent() -> None:
    calibration = random_calibration(CHAIN, (0, 0, 0))
    position, _, uncertainty = sd.methods.functional_point_straightness(calibration)["EYX"]
    np.testing.assert_allclose(uncertainty, 1e-5 * np.hypot(1.0, position), rtol=1e-14)


def test_nodes_of_rotations_are_interpolated() -> None:
    functions = {
        "EYX": ([0.0, 300.0, 800.0], [0.0, 0.01, 0.0], [0.0, 1e-4, 0.0]),
        "ECX": ([0.0, 400.0], [0.0, 40e-6], [0.0, np.nan]),
    }
    found = sd.methods.functional_point_straightness(sd.Calibration("", CHAIN, VOLUME, (0, 0, 0), functions))["EYX"]
    assert found[1].tolist() == [0.0, pytest.approx(0.01 + 300 * 30e-6), pytest.approx(800 * 40e-6)]
    assert np.isnan(found[2]).tolist() == [False, True, True]


@pytest.mark.parametrize(
    ("chain", "tool", "there"),
    [
        ("[w X' b Y Z t]", (0, 0, 0), "EYX + p ECX, EZX - p EBX"),
        ("[w Y' b X Z t]", (0, 0, 0), "EXY - p ECY, EZY + p EAY"),
        ("[w Z' b X Y t]", (0, 0, 0), "EXZ + p EBZ, EYZ - p EAZ"),
        ("[w X' b Y Z t]", (0, 0, 9), "EYX + p ECX, EZX - p EBX, plus rotation x tool offset"),
        ("[w b X Y Z t]", (0, 0, 9), "those plus rotation x tool offset"),
        ("[w b X Y Z t]", (0, 0, 0), "the same"),
    ],
)
def test_reference_is_told_in_one_line(
    tmp_path: Path, chain: str, tool: tuple[float, float, float], there: str
) -> None:
    own = "straightnesses refer to the origin of each axis' own frame; at the functional point they are "
    calibration = sd.Calibration("", chain, VOLUME, tool, {})
    assert calibration.straightness_reference == own + there
    calibration.write(tmp_path / "calibration.csv")
    assert f"# straightness_reference={own}{there}\n" in (tmp_path / "calibration.csv").read_text()


def test_report_tells_the_reference_and_exports_the_functional_point(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    calibration = calibrate(1, full_covariance=True)
    calibration.write("calibration.nc")
    calibration.write("calibration.csv")
    assert main(["report", "calibration.nc", "--functional-point", "point.csv"]) == 0
    said = capsys.readouterr().out
    assert f"reference: {calibration.straightness_reference}" in said
    assert "functional point: EYX " in said
    assert "method: adjustment, date: 2026-11-21T" in said
    assert "squareness" in said
    rows = [line.split(",") for line in Path("point.csv").read_text().splitlines() if not line.startswith("#")]
    assert rows[0] == ["parameter", "position_mm", "table", "functional_point", "unit", "standard_uncertainty"]
    for name, (position, value, uncertainty) in sd.methods.functional_point_straightness(calibration).items():
        table = np.array([[float(field) for field in (*row[1:4], row[5])] for row in rows if row[0] == name])
        expected = np.column_stack([position, calibration.functions[name][1] * 1e3, value * 1e3, uncertainty * 1e3])
        np.testing.assert_allclose(table, expected, rtol=1e-15)
    assert "# covariance=counted" in Path("point.csv").read_text()
    assert main(["report", "calibration.csv", "--functional-point", "other.csv"]) == 0
    assert "# covariance=not known" in Path("other.csv").read_text()


def test_functional_point_is_no_error_map(tmp_path: Path) -> None:
    """Its values are not the tables': nobody may load them as those."""
    calibrate(1).write(tmp_path / "calibration.csv")
    assert main(["report", str(tmp_path / "calibration.csv"), "--functional-point", str(tmp_path / "point.csv")]) == 0
    for reader in (sd.read_error_map, sd.read_calibration):
        with pytest.raises(sd.InvalidArgument, match=r"point\.csv"):
            reader(tmp_path / "point.csv")


def test_report_of_a_calibration_that_knows_little(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    little = sd.Calibration("", CHAIN, VOLUME, (0, 0, 0), {"EXX": ([0.0, 800.0], [0.0, 0.01], [np.nan, np.nan])})
    little.write(tmp_path / "little.nc")
    assert main(["report", str(tmp_path / "little.nc")]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "fit: not known"
    assert said[1].startswith("method: not known")
    assert said[2] == "made from: not known"
    assert said[4].startswith("temperature: no temperature was recorded")
    assert [line.split()[0] for line in said[6:]] == ["positioning", "signs:", "reference:"]
    assert said[6].endswith("not known")


def test_report_tells_shapes_from_errors_and_what_reversal_there_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nodes, u = [0.0, 400.0, 800.0], [1e-4] * 3
    calibration = sd.Calibration(
        "",
        CHAIN,
        VOLUME,
        (0, 0, 0),
        {"EXX": (nodes, [0.0, 0.012, 0.0], u), "EYX": (nodes, [0.0, 0.003, 0.0], u)},
        undetermined_slopes=["EXX"],
        reversal={"EYX": (nodes, [0.0, -0.004, 0.001], u)},
    )
    calibration.write(tmp_path / "calibration.csv")
    assert main(["report", str(tmp_path / "calibration.csv")]) == 0
    said = capsys.readouterr().out
    assert "(EXX's shape at 400 mm)" in said
    assert "note: a function of undetermined slope is given by its shape, with both ends at 0" in said
    assert "-4 µm (EYX at 400 mm; standard uncertainty not known)" in " ".join(said.split())
    assert "signs: actual less commanded" in said


def test_report_refuses_to_write_over_its_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    calibrate(1).write(tmp_path / "calibration.csv")
    path = str(tmp_path / "calibration.csv")
    assert main(["report", path, "--functional-point", path]) == 2
    assert "is also an input" in capsys.readouterr().err


def test_table_has_the_functional_point_beside_the_table() -> None:
    table = calibrate(1).to_xarray()
    assert {f"{name}_functional_point" for name in FUNCTIONS if name[1] in "XYZ" and name[1] != name[2]} <= set(table)
    assert table["EYX_functional_point"].dims == table["EYX"].dims
