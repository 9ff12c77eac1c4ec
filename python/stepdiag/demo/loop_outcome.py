"""One case of the closed loop: measure, calibrate, compensate, measure again."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag import _core
from stepdiag.demo.loop_cases import CHAIN, IN_USE, NOISE, LoopCase, runs_of, scenario_text, write_scenario, write_truth
from stepdiag.demo.loop_job import PATIENCE, Controller, FloatArray, Job, add_temperatures, compensator_of
from stepdiag.demo.loop_points import (
    Agreement,
    Sizes,
    Warmth,
    agreement,
    covariances,
    errors_at,
    grid_nodes,
    random_points,
)
from stepdiag.demo.loop_recheck import Translations, translations
from stepdiag.io.whole_files import write_whole
from stepdiag.program.measuring_program import measuring_program
from stepdiag.program.options import Options
from stepdiag.scenario.description import Scenario, adjust_scenario, parse_scenario, read_scenario, simulate_scenario

POINTS_OF_A_SEED: Final = 100  # of each kind
POINT_SEED: Final = 2026
Progress = Callable[[str], None]


@dataclass(frozen=True)
class PointSet:
    """Points that the controller went to, and the errors there, (n, 3), mm."""

    targets: FloatArray
    before: FloatArray
    after: FloatArray
    cold: FloatArray | None = None  # compensated without the temperatures of the scales


@dataclass(frozen=True)
class LoopOutcome:
    """The result of a case."""

    case: LoopCase
    scenario: Scenario
    machine: _core.Machine
    calibration: _core.Calibration
    table: Path
    points: dict[str, PointSet]  # "nodes" and "random"
    warmth: Warmth | None  # of the machine in use
    first: Translations  # of the runs before and after compensation
    second: Translations
    agreement: dict[str, Agreement]  # with noise: by kind of points


def run_case(
    case: LoopCase,
    folder: Path,
    controller: Controller,
    standing: FloatArray | None,
    steps: int,
    counts: tuple[int, int],
    progress: Progress,
) -> tuple[LoopOutcome, FloatArray]:
    """Measure, calibrate, compensate and measure again.

    Also returns the axis positions at the points without compensation."""
    here, *others = (folder / name for name, _ in runs_of(case))
    later = others[0]
    write_truth(case, folder, steps)
    scenario = read_scenario(write_scenario(case, here, steps))
    in_use = [read_scenario(write_scenario(case, other, steps, in_use=True)) for other in others]
    compensated = in_use[0]
    known = scenario.known.expansion
    warmth = None if known is None else Warmth(known.expansion, IN_USE)
    temperature = None if warmth is None else warmth.temperature
    program, table = here / "program.ngc", here / "calibration.csv"
    made = measuring_program(scenario.known, Options(timeout=PATIENCE))
    write_whole(program, made.text)
    sets = {
        "nodes": grid_nodes(scenario.known.plan, counts[0], POINT_SEED),
        "random": random_points(scenario.known.plan, counts[1], POINT_SEED),
    }
    points = np.concatenate(list(sets.values()))

    def say(text: str) -> None:
        progress(f"{case.name}: {text}")

    say(f"measure the machine, {made.readings} readings: {case.title}")
    went = controller.do(Job(scenario, program, here / "run.csv", points if standing is None else points[:0]), say)
    standing = went if standing is None else standing
    add_temperatures(here / "run.csv", scenario)
    run = _core.read_measurement(here / "run.csv")
    say("evaluate")
    calibration = adjust_scenario(scenario.known, run, full_covariance=True).calibration
    calibration.write_csv(table)
    say("measure the compensated machine")
    after = controller.do(Job(compensated, program, later / "run.csv", points, table, temperature), say)
    cold = None
    if warmth is not None:
        say("measure it compensated without the temperatures")
        cold = controller.do(Job(in_use[1], program, others[1] / "run.csv", points, table), say)
    for scenario_of_run, other in zip(in_use, others, strict=True):
        add_temperatures(other / "run.csv", scenario_of_run)
    machine = scenario.machine()
    found, row = {}, 0
    for name, targets in sets.items():
        rows = slice(row, row + len(targets))
        row += len(targets)
        axes = (standing, after) if cold is None else (standing, after, cold)
        found[name] = PointSet(targets, *(errors_at(machine, joints[rows], targets, warmth) for joints in axes))
    outcome = LoopOutcome(
        case,
        scenario,
        machine,
        calibration,
        table,
        found,
        warmth,
        translations(scenario.known, run, known),
        translations(compensated.known, _core.read_measurement(later / "run.csv")),
        {name: agreement(s.after, covariances(calibration, s.targets)) for name, s in found.items()}
        if case.noise
        else {},
    )
    return outcome, standing


def repetitions(outcome: LoopOutcome, seeds: int) -> dict[str, Agreement]:
    """Repeat the noisy case with other noise, calculated.

    Returns remaining errors and their stated uncertainty by kind of points."""
    errors: dict[str, list[FloatArray]] = {}
    variances: dict[str, list[FloatArray]] = {}
    steps = outcome.scenario.known.plan.steps
    for seed in range(1000, 1000 + seeds):
        scenario = parse_scenario(scenario_text(NOISE, steps, seed), outcome.scenario.path)
        calibration = adjust_scenario(scenario.known, simulate_scenario(scenario), full_covariance=True).calibration
        compensator = _core.Compensator(calibration, CHAIN)
        for name, points in outcome.points.items():
            targets = points.targets[:: max(1, len(points.targets) // POINTS_OF_A_SEED)]
            errors.setdefault(name, []).append(errors_at(outcome.machine, compensator.command(targets), targets))
            variances.setdefault(name, []).append(covariances(calibration, targets))
    return {name: agreement(np.concatenate(errors[name]), np.concatenate(variances[name])) for name in errors}


def whole_grid(outcome: LoopOutcome) -> tuple[float, float]:
    """Largest errors at all nodes of the grid before and after compensation, calculated, mm."""
    nodes = [outcome.scenario.known.plan.nodes(axis) for axis in "XYZ"]
    compensator, warmth = compensator_of(outcome.table, outcome.scenario), outcome.warmth
    temperature = None if warmth is None else warmth.temperature
    before = after = 0.0
    for x in nodes[0]:
        targets = np.stack(np.meshgrid([x], nodes[1], nodes[2], indexing="ij"), axis=-1).reshape(-1, 3)
        before = max(before, Sizes.of(errors_at(outcome.machine, targets, targets, warmth)).largest)
        left = errors_at(outcome.machine, compensator.command(targets, temperature=temperature), targets, warmth)
        after = max(after, Sizes.of(left).largest)
    return before, after
