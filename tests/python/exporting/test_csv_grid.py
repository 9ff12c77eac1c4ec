"""Export to a grid of error vectors: exact at its points, and between them within the loss that is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from exported import CHAINS, VOLUME, GridFile, calibration_of, export, machine_of, points_in, random_calibration
from hypothesis import given, settings
from hypothesis import strategies as st
from refusal import refused
from scipy.spatial.transform import Rotation

import stepdiag as sd

# Nine digits of a µm and of a µrad are written.
MICRO = 0.51e-9


@pytest.mark.parametrize("chain", CHAINS)
def test_points_of_the_grid_have_the_errors_of_the_machine(tmp_path: Path, chain: str) -> None:
    calibration = random_calibration(6, chain)
    export(calibration, "csv-grid", tmp_path / "grid.csv", nodes=(3, 4, 5), orientation=True, origin=(5.0, 0.0, -7.0))
    grid = GridFile(tmp_path / "grid.csv")
    positions = grid.vectors("x_mm", "y_mm", "z_mm") - (5.0, 0.0, -7.0)
    assert len(positions) == 60
    machine = machine_of(calibration)
    assert np.max(np.abs(grid.vectors("ex_um", "ey_um", "ez_um") - machine.error(positions) * 1e3)) < MICRO
    exact = Rotation.from_matrix(machine.pose(positions)[0]).as_rotvec() * 1e6
    # The sine of 2e-4 rad differs from the angle by 1.3e-6 µrad.
    assert np.max(np.abs(grid.vectors("ea_urad", "eb_urad", "ec_urad") - exact)) < 1.4e-6


def test_one_error_is_found_where_it_is(tmp_path: Path) -> None:
    functions = {f"E{c}{a}": ([0.0], [0.0]) for a in "XYZ" for c in "XYZABC"} | {"EZX": ([0.0, 80.0], [0.0, 0.008])}
    calibration = calibration_of(sd.ErrorMap(functions, {"C0Y": 0.0, "B0Z": 0.0, "A0Z": 0.0}))
    export(calibration, "csv-grid", tmp_path / "grid.csv", nodes=(2, 2, 2))
    grid = GridFile(tmp_path / "grid.csv")
    assert grid.vectors("x_mm", "y_mm", "z_mm").tolist() == [
        [x, y, z] for x in (0.0, 80.0) for y in (0.0, 60.0) for z in (0.0, 50.0)
    ]
    assert not np.any(grid.vectors("ex_um", "ey_um"))
    assert grid.columns["ez_um"] == pytest.approx([0.0] * 4 + [8.0] * 4, abs=MICRO)


@settings(max_examples=15)
@given(seed=st.integers(0, 1000), nodes=st.tuples(*[st.integers(2, 15)] * 3), chain=st.sampled_from(CHAINS))
def test_interpolation_between_points_keeps_the_loss_that_is_said(
    tmp_path_factory: pytest.TempPathFactory, seed: int, nodes: tuple[int, int, int], chain: str
) -> None:
    calibration = random_calibration(seed, chain)
    path = tmp_path_factory.mktemp("grid") / "grid.csv"
    export(calibration, "csv-grid", path, nodes=nodes)
    grid = GridFile(path)
    positions = points_in(VOLUME, 3000, seed)
    deviation = np.linalg.norm(grid.interpolated(positions) - machine_of(calibration).error(positions), axis=1)
    said = float(grid.header["interpolation_loss_um"])
    # Looked for at nodes and middles: between them parabolas of θ p may stand out a little more.
    assert np.max(deviation) * 1e3 < 1.02 * said
    assert np.max(deviation) * 1e3 > 0.2 * said


def test_a_grid_at_the_nodes_of_a_machine_that_carries_only_the_tool_loses_nothing(tmp_path: Path) -> None:
    calibration = random_calibration(2, CHAINS[1])
    export(calibration, "csv-grid", tmp_path / "grid.csv", nodes=(8, 8, 8))
    # Second order: 1e-4 of 0.1 mm of exact rotations.
    assert float(GridFile(tmp_path / "grid.csv").header["interpolation_loss_um"]) < 0.01


def test_step_is_the_largest_spacing(tmp_path: Path) -> None:
    export(random_calibration(2), "csv-grid", tmp_path / "grid.csv", step=20.0)
    grid = GridFile(tmp_path / "grid.csv")
    assert [len(np.unique(grid.columns[f"{axis}_mm"])) for axis in "xyz"] == [5, 4, 4]
    assert grid.header["nodes"] == "5 4 4"


def test_the_leading_lines_say_chain_sign_tool_and_reference(tmp_path: Path) -> None:
    export(random_calibration(2), "csv-grid", tmp_path / "grid.csv", nodes=(2, 2, 2), tool=(0.0, 0.0, 100.0))
    header = GridFile(tmp_path / "grid.csv").header
    assert header["chain"] == CHAINS[0]
    assert header["tool_mm"] == "0.0 0.0 100.0"
    assert "actual - commanded" in header["sign"]
    assert "functional point" in header["reference"]
    assert header["approach"] == "mean"


def test_the_mean_lies_between_both_directions(tmp_path: Path) -> None:
    calibration = random_calibration(8, reversal=True)
    error = {}
    for approach in ("mean", "positive", "negative"):
        export(calibration, "csv-grid", tmp_path / "grid.csv", nodes=(4, 4, 4), approach=approach)
        error[approach] = GridFile(tmp_path / "grid.csv").vectors("ex_um", "ey_um", "ez_um")
    machine = machine_of(calibration)
    positions = GridFile(tmp_path / "grid.csv").vectors("x_mm", "y_mm", "z_mm")
    assert np.max(np.abs(error["positive"] - machine.error(positions) * 1e3)) < MICRO
    assert np.max(np.abs(error["negative"] - machine.error(positions, "---") * 1e3)) < MICRO
    # Rotations are not linear: of second order, 60 µrad · 24 µm.
    assert np.max(np.abs(error["mean"] - 0.5 * (error["positive"] + error["negative"]))) < 1e-2


def test_grids_that_cannot_be_are_refused(tmp_path: Path) -> None:
    calibration, path = random_calibration(1), tmp_path / "grid.csv"
    refused(export, calibration, "csv-grid", path, nodes=(1, 2, 2), names="`nodes`")
    refused(export, calibration, "csv-grid", path, nodes=(200, 200, 200), names="2,000,000")
    refused(export, calibration, "csv-grid", path, nodes=(2, 2, 2), step=3.0, names="`step`")
    for step in (0.0, -1.0, float("nan"), float("inf"), 1e-9):
        refused(export, calibration, "csv-grid", path, step=step, names="`step`")
    assert not list(tmp_path.iterdir())
