"""One engine for the published variants: what each can and cannot determine, and recovered where it can.

Soons 1998: diagonals in changed step sequences, distances only. Ibaraki and Hata 2010: set-up unknowns, no tilts, a
machine without angles. Wang 2000: four diagonals. Bui et al.: face diagonals.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import reference
from adjusted import adjust, assert_rank, distance_from
from dense_adjustment import DenseAdjustment, Knowledge
from usual import DIAGONALS, FACES, SCALE_LINES
from virtual_runs import lost, measured, random_scenario, random_table, within

import stepdiag as sd


def distances_of(scenario: reference.Scenario, table: reference.ErrorTable) -> sd.Measurement:
    return lost(measured(reference.simulate(scenario, table)), channels=("alpha", "beta"))


def machine_without_angles(seed: int, **given: Any) -> tuple[reference.Scenario, reference.ErrorTable]:
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng, **({"steps": 5, "misalignment": {}} | given))
    return scenario, random_table(rng, scenario.volume, scenario.steps, rotation=0.0)


def test_wang_is_right_where_nothing_turns_and_nothing_is_out_of_true() -> None:
    scenario, table = machine_without_angles(61)
    knowledge = Knowledge({"reflector": "fixed", "laser": "fixed"}, rotations=False)
    adjustment = adjust(distances_of(scenario, table), scenario, knowledge)
    assert len(adjustment.calibration.functions) == 9
    assert len(adjustment.calibration.squareness) == 3
    assert distance_from(adjustment, table).position <= 2e-11


@pytest.mark.parametrize("lines", [DIAGONALS, DIAGONALS[:3], [*DIAGONALS, *FACES]])
@pytest.mark.parametrize("scale_lines", [SCALE_LINES, SCALE_LINES[:1], []])
def test_ibaraki_and_hata(lines: list[str], scale_lines: list[str]) -> None:
    """Reflector and laser unknown, distances only, no angles: the reflector's are seen, the laser's in second order."""
    rng = np.random.default_rng(62)
    misalignment = {line: {"reflector": within(rng, 2e-3)} for line in lines}
    scenario, table = machine_without_angles(62, lines=lines, scale_lines=scale_lines, misalignment=misalignment)
    run = distances_of(scenario, table)
    knowledge = Knowledge({"laser": "fixed"}, rotations=False)
    dense = DenseAdjustment(run, scenario, knowledge)
    adjustment = adjust(run, scenario, knowledge)
    assert_rank(adjustment, dense)
    if dense.null.shape[0] == 0:
        assert distance_from(adjustment, table).position <= 5e-11  # seen at a tenth of what tilts would tell


def test_tilts_of_a_machine_without_angles_are_all_the_reflectors() -> None:
    rng = np.random.default_rng(63)
    misalignment = {line: {"reflector": within(rng, 2e-3), "laser": within(rng, 2e-3)} for line in DIAGONALS}
    scenario, table = machine_without_angles(63, misalignment=misalignment)
    run = measured(reference.simulate(scenario, table))
    adjustment = adjust(run, scenario, Knowledge(rotations=False))
    assert set(adjustment.calibration.functions) == {f"E{c}{a}" for c in "XYZ" for a in "XYZ"}
    assert len(adjustment.calibration.squareness) == 3
    assert distance_from(adjustment, table).position <= 2e-11
    assert adjustment.iterations <= 6


def test_angles_that_are_denied_show_in_the_residuals() -> None:
    rng = np.random.default_rng(64)
    scenario = random_scenario(rng, steps=5)
    run = measured(reference.simulate(scenario, random_table(rng, scenario.volume, 5)))
    assert adjust(run, scenario, Knowledge(rotations=False), outlier_probability=0.0).chi_square_probability < 1e-6


ORDERS = ["XYZ", "YZX", "ZXY"]


@pytest.mark.parametrize("rotations", [True, False])
@pytest.mark.parametrize("orders", [ORDERS[:1], ORDERS[:2], ORDERS])
def test_soons(orders: list[str], rotations: bool) -> None:
    """Each diagonal in several step sequences, one run number each."""
    rng = np.random.default_rng(65)
    misalignment = {line: {"reflector": within(rng, 1e-3)} for line in DIAGONALS}
    scenario = random_scenario(rng, steps=3, misalignment=misalignment, order="XYZ")
    table = random_table(rng, scenario.volume, 3, rotation=60e-6 if rotations else 0.0)
    rows = [
        {**row, "run": i}
        for i, order in enumerate(orders)
        for row in reference.simulate(replace(scenario, order=order), table)
    ]
    run = lost(measured(rows), channels=("alpha", "beta"))
    knowledge = Knowledge({"laser": "fixed"}, rotations=rotations, one_setup_per_line=True)
    dense = DenseAdjustment(run, scenario, knowledge)
    plan = sd.Plan(scenario.volume, scenario.lines, 3, order=orders, scale_lines=scenario.scale_lines)
    adjustment = adjust(run, scenario, knowledge, outlier_probability=0.0, plan=plan)
    assert_rank(adjustment, dense)
    error = distance_from(adjustment, table)
    if dense.null.shape[0] == 0:
        assert error.position <= 1e-10
