"""squareness, matrix, calibxyzkins, position-error: what they say is left is left, by another pose and the controllers'
published formulas, on all chains."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported import TOOL, VOLUME, calibration_of, export, machine_of, random_calibration
from json_objects import printed
from reference import ErrorTable, pose
from refusal import refused
from simple_exports import MOTORS, rows_of, settings
from usual import ALL_CHAINS, CHAIN

import stepdiag as sd
from stepdiag.calibration.parts import parts_of
from stepdiag.exporting.options import ExportOptions
from stepdiag.exporting.result import Export
from stepdiag.exporting.write import write_export
from stepdiag.parameters import FUNCTIONS, SQUARENESSES

Vectors = np.ndarray
AXES: dict[str, dict[str, Any]] = {"position-error": {"axis": "Y", "depends_on": "X"}}
SIMPLE = ("squareness", "matrix", "calibxyzkins", "position-error")
ROUNDING = 1e-9  # mm: positions of 80 mm have 1e-14 mm, the CSV of rows 5e-13 mm; a thousand times of both


def written(calibration: sd.Calibration, to: str, path: Path, **options: Any) -> Export:
    return write_export(calibration, to, path, ExportOptions(**AXES.get(to, {}) | options))


def errors_of(calibration: sd.Calibration, motors: Vectors, approach: int = 1) -> Vectors:
    """Actual minus commanded functional point, mm, by the tests' own pose."""
    tables = calibration.to_error_map()
    table = ErrorTable(
        {name: (p.tolist(), v.tolist()) for name, (p, v) in tables.functions.items()},
        dict(tables.squareness),
        {name: (p.tolist(), v.tolist()) for name, (p, v) in tables.negative_functions.items()},
    )
    tool = calibration.tool
    there = [pose(calibration.chain.name, table, tool, m, approach=(approach,) * 3)[1] for m in motors]
    return np.array(there) - motors - tool


def nodes(count: int) -> tuple[Vectors, Vectors]:
    """Equidistant points of the volume, and their weights in a mean by the trapezoidal rule."""
    axes = [np.linspace(0.0, edge, count) for edge in VOLUME]
    ends = np.array([0.5, *np.ones(count - 2), 0.5]) / (count - 1)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid, np.prod(np.stack(np.meshgrid(ends, ends, ends, indexing="ij")), axis=0).ravel()


def sizes(errors: Vectors, weights: Vectors) -> list[float]:
    squares = np.sum(errors**2, axis=1)
    return [float(np.sqrt(np.max(squares))), float(np.sqrt(weights @ squares)), *np.max(np.abs(errors), axis=0)]


@pytest.mark.parametrize("chain", ALL_CHAINS)
def test_what_is_said_to_be_left_is_left(tmp_path: Path, chain: str) -> None:
    calibration = random_calibration(ALL_CHAINS.index(chain), chain, intervals=3)
    grid, weights = nodes(4)
    before = sizes(errors_of(calibration, grid), weights)
    for to in SIMPLE:
        done = written(calibration, to, tmp_path / to)
        assert done.left is not None
        motors = MOTORS[to](tmp_path / to, grid)
        after = sizes(motors + errors_of(calibration, motors) - grid, weights)
        for own, size in ((before, done.left.without), (after, done.left.with_it)):
            assert [size.largest, size.rms, *size.components] == pytest.approx(own, abs=ROUNDING)
        said = "\n".join(done.report)
        assert f"with it {after[0] * 1e3:.4g} µm" in said
        assert (
            f"rms error in the volume without compensation {before[1] * 1e3:.4g} µm, with it {after[1] * 1e3:.4g} µm"
            in said
        )


@pytest.mark.parametrize("chain", ALL_CHAINS[::5])
def test_no_other_three_angles_leave_a_smaller_rms_error(tmp_path: Path, chain: str) -> None:
    calibration = random_calibration(5, chain, intervals=2)
    grid, weights = nodes(11)  # at least so many are fitted
    done = written(calibration, "squareness", tmp_path / "s.csv")
    c0y, b0z, a0z = (done.values["fitted"][name] for name in SQUARENESSES)
    _, y, z = grid.T
    left = errors_of(calibration, grid) - np.stack([b0z * z - c0y * y, -a0z * z, 0.0 * z], axis=1)
    for product in (left[:, 0] * y, left[:, 0] * z, left[:, 1] * z):
        assert abs(weights @ product) < ROUNDING
    assert [float(row["fitted_urad"]) * 1e-6 for row in rows_of(tmp_path / "s.csv")[1]] == pytest.approx(
        [c0y, b0z, a0z]
    )
    # Fitted at eleven positions of an axis, stated at the three nodes: rms errors of both are not the same.
    assert done.left is not None
    assert done.values["with_fitted"].with_it.rms < 1.02 * min(done.left.with_it.rms, done.left.without.rms)


@pytest.mark.slow
@pytest.mark.parametrize("chain", ALL_CHAINS)
def test_no_other_matrix_leaves_a_smaller_rms_error(tmp_path: Path, chain: str) -> None:
    """The weighted sum of what the model leaves times each of its terms is 0: the normal equations."""
    calibration = random_calibration(5, chain, intervals=2)
    grid, weights = nodes(11)  # at least so many are fitted
    errors = errors_of(calibration, grid)
    for to, powers in (("matrix", 1), ("calibxyzkins", 2)):
        values = written(calibration, to, tmp_path / to).values
        terms = np.concatenate([grid**k for k in range(1, powers + 1)], axis=1)
        model = np.concatenate([values["linear"] - np.eye(3), *([values["quadratic"]] if powers == 2 else [])], axis=1)
        left = errors - terms @ model.T
        correlation = (weights[:, None] * left).T @ (terms / np.max(np.abs(terms), axis=0))
        assert np.max(np.abs(correlation)) < ROUNDING


def only(functions: dict[str, tuple[Sequence[float], Sequence[float]]], **squareness: float) -> sd.Calibration:
    """A machine of these errors; all others are known to be 0."""
    nothing = {name: ([0.0], [0.0]) for name in FUNCTIONS}
    return calibration_of(sd.ErrorMap(nothing | functions, dict.fromkeys(SQUARENESSES, 0.0) | squareness))


def test_squareness_is_all_that_a_squareness_needs(tmp_path: Path) -> None:
    calibration = only({}, C0Y=100e-6, B0Z=-70e-6, A0Z=30e-6)
    for to in ("squareness", "matrix", "calibxyzkins"):
        left = written(calibration, to, tmp_path / to).left
        assert left is not None
        assert left.without.largest > 4e-3
        assert left.with_it.largest < ROUNDING
    values = settings(tmp_path / "matrix")
    # C = I - A to first order; the second is 1e-8.
    assert values["matrixkins.C_xy"] == pytest.approx(100e-6, abs=2e-8)
    assert values["matrixkins.C_xz"] == pytest.approx(70e-6, abs=2e-8)
    assert values["matrixkins.C_yz"] == pytest.approx(30e-6, abs=2e-8)
    text = (tmp_path / "matrix").read_text()
    row = re.search(r"# I \+ A, row X: (\S+) (\S+) (\S+)\n", text)
    assert row
    assert [float(number) for number in row.groups()] == pytest.approx([1.0, -100e-6, -70e-6], abs=1e-13)


def test_signs_of_squareness_are_those_of_the_angles_between_the_axes(tmp_path: Path) -> None:
    angles = {"C0Y": 100e-6, "B0Z": 70e-6, "A0Z": -30e-6}
    export(only({}, **angles), "squareness", tmp_path / "s.csv")
    # Directions of the axes: where a millimetre along each leads, by the tests' own pose.
    x, y, z = errors_of(only({}, **angles), np.eye(3)) + np.eye(3)
    between = {"XY": (x, y), "XZ": (x, z), "YZ": (y, z)}
    _, rows = rows_of(tmp_path / "s.csv")
    assert [row["parameter"] for row in rows] == ["C0Y", "B0Z", "A0Z"]
    for row in rows:
        a, b = between[row["axes"]]
        above = np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)) - np.pi / 2.0
        # Products of two angles of 1e-4 are not in the parameters.
        assert float(row["larger_than_90_urad"]) * 1e-6 == pytest.approx(above, abs=1e-8)
        value = float(row["value_urad"])
        assert value * 1e-6 == pytest.approx(angles[row["parameter"]], rel=1e-14)
        assert float(row["value_arcsec"]) == pytest.approx(np.degrees(value * 1e-6) * 3600.0, rel=1e-14)
        assert float(row["value_mm_per_m"]) == pytest.approx(value * 1e-3, rel=1e-14)


def test_scales_are_on_the_diagonal(tmp_path: Path) -> None:
    calibration = only({"EYY": ([0.0, 60.0], [0.0, 0.012])})
    left = written(calibration, "matrix", tmp_path / "m.hal").left
    assert settings(tmp_path / "m.hal")["matrixkins.C_yy"] == pytest.approx(1.0 / (1.0 + 0.2e-3), rel=1e-14)
    assert left is not None
    assert left.with_it.largest < ROUNDING


def test_parabola_is_all_that_calibxyzkins_has_beyond_a_matrix(tmp_path: Path) -> None:
    y = np.linspace(0.0, 60.0, 31)
    calibration = only({"EXY": (y, 1e-5 * y * (60.0 - y))})
    matrix, quadratic = (written(calibration, to, tmp_path / to).left for to in ("matrix", "calibxyzkins"))
    assert matrix is not None
    assert quadratic is not None
    # Chords of 2 mm of this parabola bulge by 1e-5 · 2² / 4 mm; the figures are those at nodes.
    assert quadratic.with_it.largest < ROUNDING
    # A line through home in y alone leaves the square root of 1 - 30/48 of it; slopes along x and z take some more.
    assert 0.2 < matrix.with_it.rms / matrix.without.rms < 0.612


def test_workpiece_carrying_axis_is_fitted_by_what_its_rotations_do_to_the_functional_point(tmp_path: Path) -> None:
    # X carries the workpiece and pitches in proportion to x: EBX x L_z moves the functional point along X, and
    # -EBX p along Z, a parabola. The tables have no slope at all.
    calibration = only({"EBX": ([0.0, 80.0], [0.0, 80e-6])})
    done = written(calibration, "matrix", tmp_path / "m.hal")
    mean_lever = TOOL[2] + VOLUME[2] / 2.0
    # Not that of the mean lever alone: the line through home takes part of x z as a slope along z.
    assert done.values["linear"][0, 0] - 1.0 == pytest.approx(1e-6 * mean_lever, rel=0.15)
    assert done.left is not None
    assert done.left.with_it.rms < 0.5 * done.left.without.rms


@pytest.mark.parametrize("to", ["matrix", "calibxyzkins", "squareness"])
def test_controllers_zero_may_be_elsewhere(tmp_path: Path, to: str) -> None:
    """The same is left relative to home. calibxyzkins leaves home where it is; a matrix leaves the controller's 0."""
    calibration, origin = random_calibration(4, intervals=3), np.array([-300.0, 20.0, 1000.0])
    here = written(calibration, to, tmp_path / "a").left
    done = written(calibration, to, tmp_path / "b", origin=tuple(origin))
    assert here is not None
    assert done.left is not None
    # Second order: home moves by 0.2 mm, and with it the errors' tables, of slopes up to 1e-3, by that.
    assert done.left.with_it.rms == pytest.approx(here.with_it.rms, rel=0.02)
    grid, weights = nodes(4)
    motors = MOTORS[to](tmp_path / "b", grid + origin) - origin
    left = motors + errors_of(calibration, motors) - grid
    shift = MOTORS[to](tmp_path / "b", origin[None, :])[0] - origin
    if to == "calibxyzkins":
        # Squares of 1000 mm take four digits of the 16.
        assert np.max(np.abs(shift)) < 1e-8
    if to == "matrix":
        assert f"home is displaced by {' '.join(f'{s * 1e3:.4g}' for s in shift)} µm" in "\n".join(done.report)
    home = left[0]
    assert sizes(left - home, weights)[1] == pytest.approx(done.left.with_it.rms, abs=1e-7)


@pytest.mark.parametrize("chain", ALL_CHAINS[::5])
@pytest.mark.parametrize("axis", "XYZ")
@pytest.mark.parametrize("by", "XYZ")
def test_rows_are_the_errors_on_their_line(tmp_path: Path, chain: str, axis: str, by: str) -> None:
    calibration, at, origin = random_calibration(7, chain), np.array([31.0, 12.0, 44.0]), np.array([5.0, -6.0, 7.0])
    report = export(
        calibration, "position-error", tmp_path / "e.csv", axis=axis, depends_on=by, at=tuple(at), origin=tuple(origin)
    )
    leading, rows = rows_of(tmp_path / "e.csv")
    assert (leading["axis"], leading["depends_on"]) == (axis, by)
    k, n = "XYZ".index(axis), "XYZ".index(by)
    position = np.array([float(row["position_mm"]) for row in rows]) - origin[n]
    assert position == pytest.approx(np.linspace(0.0, VOLUME[n], 8), abs=1e-12)
    line = np.tile(at, (8, 1))
    line[:, n] = position
    error = errors_of(calibration, line)[:, k]
    # Rows have nine digits of a micrometre.
    assert [float(row["error_um"]) * 1e-3 for row in rows] == pytest.approx(error - error[0], abs=2e-12)
    assert any(line.startswith("left out: ") for line in report)


def test_rows_are_chosen_so_that_least_is_left_between_them(tmp_path: Path) -> None:
    x = np.linspace(0.0, 80.0, 401)
    calibration = only({"EYX": (x, 0.003 * np.sin(np.pi * x / 80.0) + 0.001 * np.sin(2.0 * np.pi * x / 40.0))})
    export(calibration, "position-error", tmp_path / "e.csv", rows=12, **AXES["position-error"])
    leading, rows = rows_of(tmp_path / "e.csv")
    assert len(rows) == 12
    position = [float(row["position_mm"]) for row in rows]
    error = [float(row["error_um"]) for row in rows]
    value = calibration.functions["EYX"][1] * 1e3
    deviation = np.max(np.abs(np.interp(x, position, error) - value))
    assert float(leading["deviation_um"]) == pytest.approx(deviation, rel=1e-3)  # four digits
    even = np.linspace(0.0, 80.0, 12)
    assert deviation < 0.7 * np.max(np.abs(np.interp(x, even, np.interp(even, x, value)) - value))


@pytest.mark.parametrize("to", ["matrix", "calibxyzkins", "position-error"])
def test_approach_chooses_the_tables_of_its_direction(tmp_path: Path, to: str) -> None:
    calibration = random_calibration(9, reversal=True)
    left = {}
    for approach in ("mean", "positive", "negative"):
        done = written(calibration, to, tmp_path / to, approach=approach)
        assert done.left is not None
        left[approach] = done.left.with_it.rms
        motors = MOTORS[to](tmp_path / to, np.array([[40.0, 30.0, 25.0]]))
        alike = {"positive": 1, "negative": -1}.get(approach)
        if to == "position-error" and alike:
            line = np.array([[40.0, 30.0, 25.0], [0.0, 30.0, 25.0]])
            there, home = errors_of(calibration, line, alike)[:, 1]
            # The tables have a node at 34.3 and at 45.7 mm: linear between, but for ECX x (x carries the workpiece).
            assert motors[0, 1] - 30.0 == pytest.approx(-(there - home), abs=2e-4)
    assert len(set(left.values())) == 3
    # Both directions count in what is left, so that no table of one direction leaves less than that of the mean.
    assert left["mean"] == min(left.values()) or to == "position-error"


def test_only_what_acts_on_the_line_must_be_determined(tmp_path: Path) -> None:
    """X carries the workpiece, Y and Z follow: of Y by X act EYX, and EAX, ECX by z, x and the tool."""
    errors = random_calibration(1).to_error_map()
    acting = {name: errors.functions[name] for name in ("EYX", "EAX", "ECX")}
    done = written(calibration_of(sd.ErrorMap(acting)), "position-error", tmp_path / "a")
    assert (list(done.coverage.whole), list(done.coverage.in_part)) == (["EYX"], ["EAX", "ECX"])
    assert len(done.coverage.left_out) == 18
    assert done.left is None
    assert any("not known, because not determined: EXX" in line for line in done.report)
    del acting["EAX"]
    refused(written, calibration_of(sd.ErrorMap(acting)), "position-error", tmp_path / "b", names="EAX")
    squareness = dict(errors.squareness)
    done = written(
        calibration_of(sd.ErrorMap(errors.functions, squareness)),
        "position-error",
        tmp_path / "c",
        axis="X",
        depends_on="Y",
    )
    assert list(done.coverage.whole) == ["EXY", "C0Y"]
    del squareness["C0Y"]
    lacking = calibration_of(sd.ErrorMap(errors.functions, squareness))
    for to, needs in (("squareness", {}), ("matrix", {}), ("position-error", {"axis": "X", "depends_on": "Y"})):
        refused(written, lacking, to, tmp_path / "d", names="C0Y", **needs)
    done = written(lacking, "squareness", tmp_path / "e", incomplete=True)
    assert [row["parameter"] for row in rows_of(tmp_path / "e")[1]] == ["B0Z", "A0Z"]
    assert "C0Y" in done.coverage.left_out
    assert rows_of(tmp_path / "e")[0]["not_compensated"] == "NOT COMPENSATED, because not determined: C0Y"


def test_what_position_error_needs_is_asked_for(tmp_path: Path) -> None:
    calibration = random_calibration(1)
    for bad in ("", "x", "A", "XY", None):
        refused(written, calibration, "position-error", tmp_path / "a", axis=bad, names="`axis`")
        refused(written, calibration, "position-error", tmp_path / "a", depends_on=bad, names="`depends_on`")
    refused(written, calibration, "position-error", tmp_path / "a", rows=1, names="rows")
    refused(written, calibration, "position-error", tmp_path / "a", at=(0.0, 0.0, 51.0), names="`at`")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("to", [*SIMPLE, "linuxcnc-kins", "linuxcnc-comp"])
def test_the_object_has_what_is_left_out_and_what_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], to: str
) -> None:
    monkeypatch.chdir(tmp_path)
    calibration = random_calibration(5)
    calibration.write("calibration.csv")
    ending = {"matrix": ".hal", "calibxyzkins": ".hal", "linuxcnc-comp": ""}.get(to, ".csv")
    axes = ["--axis", "Y", "--depends-on", "X"] if to == "position-error" else []
    said = printed("export", capsys, "export", "calibration.csv", "--to", to, "-o", f"out{ending}", *axes)
    done = written(calibration, to, tmp_path / "again")
    named = [said[key] for key in ("compensated", "compensated_in_part", "left_out")]
    assert sorted(name for names in named for name in names) == sorted([*FUNCTIONS, *SQUARENESSES])
    assert said["left_out"] == done.coverage.left_out
    assert len(said["left_out"]) == {"squareness": 18, "position-error": 18, "linuxcnc-comp": 9}.get(to, 0)
    if to == "linuxcnc-kins":
        assert said["without"] is said["with_it"] is None
    else:
        assert done.left is not None
        for key, size in (("without", done.left.without), ("with_it", done.left.with_it)):
            assert said[key]["largest"]["value"] == pytest.approx(size.largest * 1e3, rel=1e-15)
            assert said[key]["rms"]["value"] == pytest.approx(size.rms * 1e3, rel=1e-15)
        assert said["without"]["largest"]["value"] == pytest.approx(
            np.max(np.linalg.norm(machine_of(calibration).error(nodes(8)[0]), axis=1)) * 1e3, rel=1e-12
        )
    if to in ("matrix", "calibxyzkins"):
        np.testing.assert_array_equal([row["value"] for row in said["linear"]], done.values["linear"])
    for key in ("squareness", "fitted_squareness", "with_fitted"):
        assert (said[key] is not None) == (to == "squareness")
    assert all((tmp_path / file).is_file() for file in said["files"])


def test_calibxyzkins_is_told_to_solve_to_better_than_its_micrometre(tmp_path: Path) -> None:
    """Its default tolerance leaves errors below 1 µm as they are: nothing would be compensated near home."""
    export(random_calibration(2, CHAIN), "calibxyzkins", tmp_path / "c.hal")
    assert settings(tmp_path / "c.hal")["calibxyzkins.tol"] == 1e-9


@pytest.mark.parametrize("to", ["squareness", "linuxcnc-comp"])
def test_machine_of_two_axes_needs_no_permission(tmp_path: Path, to: str) -> None:
    """X and Y were measured, Z was not: it is taken to be without errors, and that is said."""
    functions = {
        f"E{component}{axis}": (np.array([0.0, 80.0]), np.array([0.0, 0.004]), np.full(2, np.nan))
        for axis in "XY"
        for component in "XYABC"
    }
    whole = random_calibration(seed=5)
    parts = parts_of(whole) | {"functions": functions, "squareness": {"C0Y": (1e-4, np.nan)}}
    calibration = sd.Calibration(**parts)
    out = tmp_path / ("comp" if to == "linuxcnc-comp" else "table.csv")
    notes = sd.export(calibration, out, to=to)
    assert "note: Z was not measured: it is taken to be without errors and is not compensated" in notes
    without = sd.Calibration(**(parts | {"functions": functions | {"EXZ": functions["EXX"]}}))
    if to == "linuxcnc-comp":  # a part of Z is known: that is a gap
        with pytest.raises(sd.InvalidArgument, match="not determined by this calibration"):
            sd.export(without, tmp_path / "other", to=to)
