"""Export to the CSV of ISG-CNC and TwinCAT CNC: read as its manual says, the model has the machine's errors."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from exported import CHAINS, TOOL, VOLUME, IsgFile, calibration_of, export, machine_of, points_in, random_calibration
from hypothesis import example, given, settings
from hypothesis import strategies as st
from refusal import refused

import stepdiag as sd

# The file's model is of first order: products of 60 µrad with 24 µm and with 60 µrad · 200 mm are 2 nm; what parabolas
# hide between nodes is 10 nm for each of three axes.
MODEL = 4e-5


def letters(chain: str) -> str:
    return "".join(letter for letter in chain if letter in "XYZ")


@pytest.mark.parametrize("squareness", ["straightness", "parameters"])
@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (-300.0, 20.0, 150.0)])
@pytest.mark.parametrize("chain", CHAINS)
def test_the_file_has_the_errors_of_the_machine(
    tmp_path: Path, chain: str, origin: tuple[float, float, float], squareness: str
) -> None:
    calibration = random_calibration(3, chain)
    path = tmp_path / "isg.csv"
    report = "\n".join(export(calibration, "isg", path, origin=origin, squareness=squareness))
    positions = points_in(VOLUME, 2000)
    error = IsgFile.read(path).error(positions + origin, letters(chain))
    exact = machine_of(calibration).error(positions)
    deviation = np.max(np.linalg.norm(error - exact, axis=1))
    assert deviation < MODEL
    said = re.search(r"by at most ([0-9.e-]+) µm in the volume", report)
    assert said
    assert deviation * 1e3 < float(said[1]) * 1.06 + 1e-6  # said with two digits, found on other points


def test_a_squareness_is_the_slope_of_a_straightness_or_a_parameter(tmp_path: Path) -> None:
    functions = {f"E{c}{a}": ([0.0], [0.0]) for a in "XYZ" for c in "XYZABC"}
    calibration = calibration_of(sd.ErrorMap(functions, {"C0Y": 50e-6, "B0Z": 0.0, "A0Z": 0.0}))
    export(calibration, "isg", tmp_path / "a.csv")
    folded = IsgFile.read(tmp_path / "a.csv")
    # C0Y > 0 turns Y by the right-hand rule about Z: towards -X.
    assert folded.tables["EXY"][1].tolist() == [0.0, -0.003]
    assert "C0Y" not in folded.constants
    assert "C0Y = 50 urad" in folded.comments
    export(calibration, "isg", tmp_path / "b.csv", squareness="parameters")
    apart = IsgFile.read(tmp_path / "b.csv")
    assert apart.tables["EXY"][1].tolist() == [0.0, 0.0]
    assert apart.constants["C0Y"] == 50e-6


def test_straightness_of_an_axis_that_carries_the_workpiece_is_that_of_the_functional_point(tmp_path: Path) -> None:
    errors = {f"E{c}{a}": ([0.0], [0.0]) for a in "XYZ" for c in "XYZABC"} | {"ECX": ([0.0, 80.0], [0.0, 40e-6])}
    squareness = dict.fromkeys(("C0Y", "B0Z", "A0Z"), 0.0)
    for chain, at_the_end in (("[w X' b Y Z t]", 80.0 * 40e-6), ("[w b X Y Z t]", 0.0)):
        export(calibration_of(sd.ErrorMap(errors, squareness), chain), "isg", tmp_path / "isg.csv")
        file = IsgFile.read(tmp_path / "isg.csv")
        assert file.tables["EYX"][1][-1] == pytest.approx(at_the_end, abs=1e-9)  # nine digits are written
        assert [file.constants[f"P0{axis}"] for axis in "XYZ"] == list(TOOL)


@settings(max_examples=8)
@given(seed=st.integers(0, 1000), rows=st.integers(20, 60))
@example(seed=0, rows=54)  # the worst point is not on a line through the worst one of a coarse grid
def test_resampling_keeps_the_rows_and_the_loss_that_is_said(
    tmp_path_factory: pytest.TempPathFactory, seed: int, rows: int
) -> None:
    calibration = random_calibration(seed, intervals=90)
    path = tmp_path_factory.mktemp("isg") / "isg.csv"
    report = "\n".join(export(calibration, "isg", path, rows=rows))
    file = IsgFile.read(path)
    assert max(len(argument) for argument, _ in file.tables.values()) <= rows
    positions = points_in(VOLUME, 3000)
    exact = machine_of(calibration).error(positions)
    deviation = np.linalg.norm(file.error(positions, "XYZ") - exact, axis=1)
    said = re.search(r"by at most ([0-9.e-]+) µm in the volume", report)
    assert said
    # Looked for on a part of all combinations of nodes, and from the worst of each slice along the axes.
    assert np.max(deviation) * 1e3 < float(said[1]) * 1.1


def test_one_direction_of_approach_or_the_mean_is_written(tmp_path: Path) -> None:
    calibration = random_calibration(8, CHAINS[1], reversal=True)
    values = {}
    for approach in ("mean", "positive", "negative"):
        export(calibration, "isg", tmp_path / "isg.csv", approach=approach)
        values[approach] = IsgFile.read(tmp_path / "isg.csv").tables["EZY"][1]
    assert values["mean"] == pytest.approx(0.5 * (values["positive"] + values["negative"]), abs=2e-9)
    assert np.max(np.abs(values["positive"] - values["negative"])) > 1e-3


def test_the_file_says_that_it_was_tried_on_no_controller(tmp_path: Path) -> None:
    report = export(random_calibration(1), "isg", tmp_path / "isg.csv")
    comments = IsgFile.read(tmp_path / "isg.csv").comments
    for words in ("not tried on a controller", "[w X' b Y Z t]", "actual - commanded", "chain XYZ, workpiece_axes 0"):
        assert words in comments
        assert words in "\n".join(report)


def test_what_is_not_determined_is_refused_or_said(tmp_path: Path) -> None:
    errors = random_calibration(1).to_error_map()
    lacking = calibration_of(sd.ErrorMap({n: v for n, v in errors.functions.items() if n != "ECZ"}, {"C0Y": 1e-5}))
    refused(export, lacking, "isg", tmp_path / "isg.csv", names="ECZ, B0Z, A0Z")
    report = export(lacking, "isg", tmp_path / "isg.csv", incomplete=True)
    assert any("NOT COMPENSATED" in line and "ECZ, B0Z, A0Z" in line for line in report)
    file = IsgFile.read(tmp_path / "isg.csv")
    assert not np.any(file.tables["ECZ"][1])
    assert "ECZ, B0Z, A0Z" in file.comments
    refused(export, lacking, "isg", tmp_path / "isg.csv", incomplete=True, rows=1, names="`rows`")
