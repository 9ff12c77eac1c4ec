"""Machines of coverage_cases that are calibrated, and read again by a short run: as they were, or after a change."""

from __future__ import annotations

import coverage_cases
import numpy as np
from usual import DIAGONALS

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS, SQUARENESSES, Kind, kind_of

CASE = coverage_cases.CASES["adjustment"]
LINES = (DIAGONALS[:1], DIAGONALS[:2], DIAGONALS)
CHANGES: dict[Kind, str] = {
    "positioning": "scale",
    "straightness": "bow",
    "angle": "slope",
    "squareness": "squareness",
}


def calibrated(seed: int, steps: int) -> tuple[coverage_cases.Drawn, sd.Calibration, np.random.Generator]:
    drawn, rng = coverage_cases.draw(CASE, seed, steps)
    return drawn, coverage_cases.evaluated(CASE, drawn, coverage_cases.measured(drawn, rng)), rng


def short_plan(drawn: coverage_cases.Drawn, seed: int, steps: int) -> sd.Plan:
    return sd.Plan(drawn.plan.volume, LINES[seed % len(LINES)], steps // (1 + seed // 3 % 2))


def read_again(
    drawn: coverage_cases.Drawn, machine: sd.Machine, plan: sd.Plan, rng: np.random.Generator
) -> sd.Measurement:
    misalignment = {line: coverage_cases.setup_of(CASE, rng, line) for line in plan.lines}
    again = coverage_cases.Drawn(machine, plan, drawn.head, misalignment, drawn.uncertainty, drawn.chain)
    return coverage_cases.measured(again, rng)


def options(drawn: coverage_cases.Drawn) -> sd.AdjustmentOptions:
    return sd.AdjustmentOptions(uncertainty=drawn.uncertainty, setup=sd.SetupPriors(laser="free"))


def random_change(rng: np.random.Generator, size: float = 1.0) -> dict[str, float]:
    """By parameter; from the usual priors, or from `size` times as wide ones."""
    priors = sd.ChangePriors()
    return {name: size * getattr(priors, CHANGES[kind_of(name)]) * rng.normal() for name in (*FUNCTIONS, *SQUARENESSES)}


def changed_machine(drawn: coverage_cases.Drawn, change: dict[str, float]) -> sd.Machine:
    """By the closed forms of docs/verify.md."""
    functions = {}
    for name, (position, value) in drawn.machine.errors.functions.items():
        kind = CHANGES[kind_of(name)]
        share = position / drawn.plan.volume["XYZ".index(name[2])]
        added = {"scale": position, "bow": 4.0 * share * (1.0 - share), "slope": share}[kind]
        functions[name] = (position, value + change[name] * added)
    squareness = {name: value + change[name] for name, value in drawn.machine.errors.squareness.items()}
    return sd.Machine(drawn.chain, sd.ErrorMap(functions, squareness), drawn.machine.tool)
