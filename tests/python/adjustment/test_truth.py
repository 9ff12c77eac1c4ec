"""Noise-free runs of random machines: the adjustment recovers the truth to the floor of double precision."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference
from adjusted import (
    LIMIT,
    adjust,
    assert_recovered,
    error_map,
    is_complete,
    knowledge_of,
)
from dense_adjustment import Knowledge
from places import RUNS
from reference_files import read_error_table, read_scenario
from usual import ALL_CHAINS, DIAGONALS, FACES, SCALE_LINES
from virtual_runs import head_of, measured, plan_of, random_scenario, random_table

import stepdiag as sd


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_random_machines_are_recovered(layout: str, seed: int) -> None:
    """Chain, tool, volume, order, steps, standoff, and 2 mrad and 3 mm of misalignment a line, all at random."""
    rng = np.random.default_rng(1000 + seed)
    scenario = random_scenario(rng, layout=layout)
    table = random_table(rng, scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    assert_recovered(adjust(run, scenario, knowledge_of(layout)), table, LIMIT[layout])


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_fifty_steps_an_axis_are_recovered(layout: str) -> None:
    rng = np.random.default_rng(50)
    scenario = random_scenario(rng, layout=layout, steps=50)
    table = random_table(rng, scenario.volume, 50)
    run = measured(reference.simulate(scenario, table))
    assert_recovered(adjust(run, scenario, knowledge_of(layout)), table, LIMIT[layout])


@pytest.mark.slow
@pytest.mark.parametrize("chain", ALL_CHAINS)
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_scale_lines_read_at_every_step_are_recovered(layout: str, chain: str) -> None:
    """In all chains, with the misaligned diagonals of a random machine."""
    rng = np.random.default_rng(7000 + ALL_CHAINS.index(chain))
    scenario = random_scenario(rng, layout=layout, chain=chain, steps=9, scale_points="steps")
    table = random_table(rng, scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    assert_recovered(adjust(run, scenario, knowledge_of(layout)), table, LIMIT[layout])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_steps_in_blocks_are_recovered(layout: str, seed: int) -> None:
    """Blocks that fit into the line, that leave a rest, and that are the whole line."""
    rng = np.random.default_rng(8000 + seed)
    scenario = random_scenario(
        rng, layout=layout, steps=9, block=[2, 3, 4, 5, 8, 9][seed], scale_points=["ends", "steps"][seed % 2]
    )
    table = random_table(rng, scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    assert_recovered(adjust(run, scenario, knowledge_of(layout)), table, LIMIT[layout])


@pytest.mark.parametrize("seed", range(4))
def test_reversed_lines_and_three_diagonals_are_recovered(seed: int) -> None:
    rng = np.random.default_rng(2000 + seed)
    lines = [["ppn", "npp", "nnn", "pnp"], DIAGONALS[:3], DIAGONALS[1:], ["nnn", "pnn", "npn"]][seed]
    scenario = random_scenario(rng, lines=lines, scale_lines=["n00", "0p0", "00n"])
    table = random_table(rng, scenario.volume, scenario.steps)
    assert_recovered(adjust(measured(reference.simulate(scenario, table)), scenario), table, LIMIT["ideal"])


@pytest.mark.parametrize("lines", [[*DIAGONALS, *FACES], ["ppp", "nnp", "pp0", "n0p", "0p0"], [*FACES, "p00", "ppp"]])
def test_lines_of_all_kinds_together_are_recovered(lines: list[str]) -> None:
    rng = np.random.default_rng(5)
    scales = [line for line in SCALE_LINES if line not in lines]
    scenario = random_scenario(rng, lines=lines, scale_lines=scales)
    # Of lines that do not move all axes, the reflector's tilts are not seen beside the laser's.
    flat = [line for line in lines if "0" in line]
    for line in flat:
        scenario.misalignment[line]["reflector"] = (0.0, 0.0)
    table = random_table(rng, scenario.volume, scenario.steps)
    known = Knowledge({(line, "reflector"): "fixed" for line in flat})
    assert_recovered(adjust(measured(reference.simulate(scenario, table)), scenario, known), table, LIMIT["ideal"])


@pytest.mark.parametrize("layout", ["ideal", "psd"])
def test_faces_with_the_reflector_fixed_are_recovered(layout: str) -> None:
    """Their scales come from the faces alone, with condition numbers ten times those of diagonals."""
    rng = np.random.default_rng(6)
    misalignment = {line: {"laser": tuple(rng.uniform(-2e-3, 2e-3, 2))} for line in FACES}
    scenario = random_scenario(rng, layout=layout, lines=FACES, scale_lines=[], steps=15, misalignment=misalignment)
    table = random_table(rng, scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    assert_recovered(adjust(run, scenario, Knowledge({"reflector": "fixed"})), table, LIMIT[layout])


@pytest.mark.parametrize("layout", ["ideal", "psd", "multi_beam"])
def test_priors_that_conflict_with_the_truth_can_be_switched_off(layout: str) -> None:
    """Roll 15 mrad, gain 1 %, a lateral offset and drift: free where they show, fixed where there is none."""
    rng = np.random.default_rng(7)
    scenario = random_scenario(rng, layout=layout, steps=9)
    for line in scenario.lines:
        scenario.misalignment[line] |= {
            "roll": float(rng.uniform(-15e-3, 15e-3)),
            "gain": float(rng.uniform(-0.01, 0.01)),
            "distance_constant": float(rng.uniform(-50.0, 50.0)),
        }
    table = random_table(rng, scenario.volume, scenario.steps)
    run = measured(reference.simulate(scenario, table))
    setup: dict[Any, Any] = {"lateral": "fixed"} | {
        (line, quantity): "free" for line in scenario.lines for quantity in ("roll", "gain")
    }
    known = Knowledge(setup | dict(knowledge_of(layout).setup))
    # Free means known to 1 rad and to 1 of gain: with uncertainties u of some 0.01 (0.06 from differences of beams)
    # that pulls them by u^2 of themselves to 0, and angles of 60 urad with them.
    assert_recovered(adjust(run, scenario, known), table, (5e-6, 1e-8))


@pytest.mark.parametrize("seed", range(2))
def test_runs_of_the_traced_ideal_head_are_recovered(seed: int) -> None:
    rng = np.random.default_rng(3000 + seed)
    scenario = random_scenario(rng)
    table = random_table(rng, scenario.volume, scenario.steps)
    run = sd.simulate(
        sd.Machine(sd.Chain(scenario.chain), error_map(table), scenario.tool),
        plan_of(scenario),
        head_of(scenario),
        misalignment={line: sd.Misalignment(**setup) for line, setup in scenario.misalignment.items()},
    )
    # A trace rounds at the mirror and at the reference plane: a few 1e-13 mm more than the closed form.
    assert_recovered(adjust(run, scenario), table, LIMIT["ideal"])


@pytest.mark.parametrize("case", sorted(p.name for p in RUNS.iterdir() if p.is_dir() and p.name != "noisy"))
def test_known_truth_is_recovered(case: str) -> None:
    """Made by another program. The scenarios of faces and three_beams say what is fixed."""
    scenario = read_scenario(RUNS / case / "scenario.toml")
    table = read_error_table(RUNS / case / "truth.csv")
    known = {"faces": {"reflector": "fixed"}, "three_beams": {"beam_constants": "fixed"}}.get(case, {})
    adjustment = adjust(sd.read_measurement(RUNS / case / "measurement.csv"), scenario, Knowledge(known))
    assert_recovered(adjustment, table, LIMIT[scenario.layout])


def test_noisy_run_is_recovered_within_its_uncertainties() -> None:
    case = RUNS / "noisy"
    scenario, table = read_scenario(case / "scenario.toml"), read_error_table(case / "truth.csv")
    adjustment = adjust(sd.read_measurement(case / "measurement.csv"), scenario, full_covariance=True)
    assert is_complete(adjustment.calibration)
    assert adjustment.chi_square_probability > 0.01
    assert adjustment.outliers == []
    calibration = adjustment.calibration
    truth = error_map(table)
    errors = []
    for name, position in calibration.covariance_labels:
        if position is None:
            errors.append(calibration.squareness[name][0] - truth.squareness[name])
        else:
            p, value, _ = calibration.functions[name]
            errors.append(value[list(p).index(position)] - truth.function(name, [position])[0])
    deviation = np.sqrt(np.diag(calibration.covariance))
    error = np.array(errors)
    known = deviation > 0
    assert np.max(np.abs(error[~known]), initial=0.0) == 0.0
    # 882 values: beyond 4.5 standard uncertainties once in 170 runs.
    assert np.max(np.abs(error[known] / deviation[known])) <= 4.5
    # All at once: e' C^+ e has chi-square's distribution with as many degrees of freedom as values.
    scaled = calibration.covariance[np.ix_(known, known)] / np.outer(deviation[known], deviation[known])
    whole = float((error[known] / deviation[known]) @ np.linalg.solve(scaled, error[known] / deviation[known]))
    count = int(np.sum(known))
    assert abs(whole - count) <= 4.5 * np.sqrt(2 * count)
