"""What holds for every table: the inverse's bound, the fingerprint of the values, the runs with known truth."""

from __future__ import annotations

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compensator_oracle import Oracle
from error_tables import COLUMNS, NAMES, RandomTable, leading_lines
from places import RUNS
from refusal import refused
from usual import ALL_CHAINS, VOLUME

import stepdiag as sd
from stepdiag.cli import main


def written(path: Path, text: str, **newline: Any) -> Path:
    path.write_text(text, **newline)
    return path


@pytest.mark.parametrize("seed", range(6))
def test_forward_of_a_command_is_the_target_within_the_stated_bound(tmp_path: Path, seed: int) -> None:
    chain = ALL_CHAINS[4 * seed]
    path = written(tmp_path / "table.csv", RandomTable(seed=500 + seed, chain=chain).text())
    for options in ({}, {"outside": "linear", "margin": 30.0}, {"origin": (-300.0, 20.0, 1e4)}):
        compensator = sd.Compensator(path, chain, **options)  # type: ignore[arg-type]
        targets = np.random.default_rng(seed).uniform(-0.03, 1.03, size=(20_000, 3)) * VOLUME
        targets += options.get("origin", (0.0, 0.0, 0.0))
        reached = compensator.forward(compensator.command(targets))
        assert np.linalg.norm(reached - targets, axis=1).max() <= compensator.inverse_bound
        assert compensator.inverse_bound <= 1e-9  # mm: what a kinematics module promises its controller


def steep(slope: float) -> str:
    """EXX rises and falls by `slope` every 10 mm."""
    rows = [f"EXX,{10.0 * k},{slope * 10e3 * (k % 2)},um," for k in range(81)]
    return "\n".join([*leading_lines("[w X' b Y Z t]", VOLUME, (0.0, 0.0, 0.0)), COLUMNS, *rows]) + "\n"


@pytest.mark.parametrize("slope", [0.01, 0.05, 0.099])
def test_inverse_of_steep_errors_keeps_its_bound(tmp_path: Path, slope: float) -> None:
    compensator = sd.Compensator(written(tmp_path / "table.csv", steep(slope)), "[w X' b Y Z t]", largest_correction=5)
    targets = np.random.default_rng(1).uniform(size=(5_000, 3)) * VOLUME
    reached = compensator.forward(compensator.command(targets))
    assert np.linalg.norm(reached - targets, axis=1).max() <= compensator.inverse_bound


@pytest.mark.parametrize("slope", [0.101, 0.5, 0.999, 1.0, 2.0])
def test_errors_whose_inverse_would_have_no_bound_are_refused(tmp_path: Path, slope: float) -> None:
    path = written(tmp_path / "table.csv", steep(slope))
    refused(sd.Compensator, path, "[w X' b Y Z t]", names="change by less than", largest_correction=5.0)


def fingerprint(path: Path, text: str, chain: str = "[w X' b Y Z t]", **options: Any) -> int:
    return sd.Compensator(written(path, text, newline=""), chain, **options).fingerprint


def test_fingerprint_is_that_of_the_values_whatever_the_spelling(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    text = RandomTable(seed=600).text()
    leading, rows = text.split(COLUMNS + "\n")
    same = {
        "windows line ends": text.replace("\n", "\r\n"),
        "byte order mark": "\ufeff" + text,
        "quotes": text.replace("EXX,", '"EXX",'),
        "leading lines in another order": "\n".join(reversed(leading.splitlines())) + "\n" + COLUMNS + "\n" + rows,
        "remarks": "# made by hand\n# operator=me\n" + text,
        "lengths": text.replace("800.0 600.0 500.0", "800 6e2 500.00"),
        "uncertainties": text.replace("urad,\n", "urad,0.5\n"),
        "parameters in another order": leading + COLUMNS + "\n" + by_parameter(rows),
        "columns in another order": leading + swapped(COLUMNS + "\n" + rows),
        "another file name": text,
    }
    expected = fingerprint(path, text)
    assert 0 <= expected < 2**64
    found = {name: fingerprint(tmp_path / "other.csv", other) for name, other in same.items()}
    assert found == dict.fromkeys(same, expected)


def by_parameter(rows: str) -> str:
    return "\n".join(sorted(rows.splitlines(), key=lambda row: row.split(",")[0], reverse=True)) + "\n"


def swapped(rows: str) -> str:
    return "".join(",".join(reversed(row.split(","))) + "\n" for row in rows.splitlines())


def test_fingerprint_changes_with_every_value(tmp_path: Path) -> None:
    text = RandomTable(seed=601).text()
    lines = text.splitlines(keepends=True)
    found = {fingerprint(tmp_path / "table.csv", text): "itself"}
    edits = {
        "chain": text.replace("[w X' b Y Z t]", "[w X' b Z Y t]"),
        "volume": text.replace("500.0", "500.00000000000006", 1),
        "tool": text.replace("80.0", "80.00000000000001", 1),
    }
    for name in [*NAMES, "C0Y", "B0Z", "A0Z"]:
        i = next(k for k, line in enumerate(lines) if line.startswith(name + ","))
        parameter, position, value, *rest = lines[i].split(",")
        # 1e-15: two values in urad that are one bit apart may be the same one in rad.
        other = repr(float(value) * (1.0 + 1e-15))
        edits[f"last bits of {name}"] = "".join(
            [*lines[:i], ",".join([parameter, position, other, *rest]), *lines[i + 1 :]]
        )
        edits[f"no {name}"] = "".join(line for line in lines if not line.startswith(name + ","))
        if position:
            moved = repr(float(np.nextafter(float(position), -np.inf)))
            edits[f"node of {name}"] = "".join(
                [*lines[:i], ",".join([parameter, moved, value, *rest]), *lines[i + 1 :]]
            )
    for name, other in edits.items():
        chain = "[w X' b Z Y t]" if name == "chain" else "[w X' b Y Z t]"
        one = fingerprint(tmp_path / "table.csv", other, chain)
        assert one not in found, f"{name} has the fingerprint of {found.get(one)}"
        found[one] = name


def with_leading_lines(case: str) -> tuple[str, sd.Chain, np.ndarray, sd.ErrorMap]:
    """The truth of a run as a calibration file, and the machine that it is of."""
    scenario = tomllib.loads((RUNS / case / "scenario.toml").read_text())
    volume = [scenario["volume"][f"{axis}_mm"] for axis in "xyz"]
    machine = scenario["machine"]
    text = (RUNS / case / "truth.csv").read_text()
    lines = leading_lines(machine["chain"], tuple(volume), tuple(machine["tool_mm"]))
    return "\n".join(lines) + "\n" + text, machine["chain"], np.array(volume), machine["tool_mm"]


@pytest.mark.parametrize("case", sorted(p.name for p in RUNS.iterdir() if p.is_dir()))
def test_truth_of_a_run_compensates_its_machine(tmp_path: Path, case: str) -> None:
    text, chain, volume, tool = with_leading_lines(case)
    path = written(tmp_path / "truth.csv", text)
    compensator = sd.Compensator(path, chain)
    machine = sd.Machine(chain, sd.read_error_map(RUNS / case / "truth.csv"), tool)
    oracle = Oracle(text)
    targets = np.random.default_rng(7).uniform(size=(1_000, 3)) * volume
    commands = compensator.command(targets)
    worst = np.linalg.norm(commands + machine.error(commands) - targets, axis=1).max()
    assert np.linalg.norm(machine.error(targets), axis=1).max() > 5e-3
    # Roundings of positions below 1000 mm, 1.1e-13 mm each, beside the bound of the inverse.
    assert worst <= compensator.inverse_bound + 1e-12
    for t, c in list(zip(targets, commands, strict=True))[:10]:
        assert max(abs(oracle.forward(c) - t)) <= compensator.inverse_bound + 1e-12


@pytest.mark.parametrize("case", ["three_beams", "reversed_order", "faces"])
def test_calibration_of_a_run_compensates_the_machine_that_was_measured(tmp_path: Path, case: str) -> None:
    """From the readings of another program to the tool's position: without noise, a picometre is left."""
    calibration = tmp_path / "calibration.csv"
    assert (
        main(
            [
                "evaluate",
                str(RUNS / case / "scenario.toml"),
                str(RUNS / case / "measurement.csv"),
                "-o",
                str(calibration),
            ]
        )
        == 0
    )
    _, chain, volume, tool = with_leading_lines(case)
    with pytest.warns(UserWarning, match="fit that is unchecked"):  # exact readings have no noise
        compensator = sd.Compensator(calibration, chain)
    assert compensator.uncompensated == []
    machine = sd.Machine(chain, sd.read_error_map(RUNS / case / "truth.csv"), tool)
    targets = np.random.default_rng(9).uniform(size=(1_000, 3)) * volume
    commands = compensator.command(targets)
    left = np.linalg.norm(commands + machine.error(commands) - targets, axis=1).max()
    # Values of a calibration are 2e-11 mm and 1e-13 rad from the truth here; levers are up to 1000 mm long.
    assert left <= compensator.inverse_bound + 1e-9


@pytest.mark.parametrize("case", ["clean", "misaligned"])
def test_truth_without_its_leading_lines_is_refused(case: str) -> None:
    refused(sd.Compensator, RUNS / case / "truth.csv", "[w X' b Y Z t]", names="chain")


def test_answers_are_the_same_on_many_threads(tmp_path: Path) -> None:
    path = written(tmp_path / "table.csv", RandomTable(seed=700).text())
    compensator = sd.Compensator(path, "[w X' b Y Z t]")
    targets = np.random.default_rng(8).uniform(size=(20_000, 3)) * VOLUME
    expected = compensator.command(targets)
    with ThreadPoolExecutor(8) as pool:
        for found in pool.map(lambda _: compensator.command(targets), range(16)):
            np.testing.assert_array_equal(found, expected)
    again = sd.Compensator(path, "[w X' b Y Z t]").command(targets)
    np.testing.assert_array_equal(again, expected)
