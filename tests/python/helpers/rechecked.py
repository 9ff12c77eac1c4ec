"""Machines of coverage_cases that are calibrated, and read again by a short run: as they were, or after a change."""

from __future__ import annotations

import dataclasses

import coverage_cases
import numpy as np
from usual import DIAGONALS, SCALE_LINES

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


def options(drawn: coverage_cases.Drawn) -> sd.methods.AdjustmentOptions:
    return sd.methods.AdjustmentOptions(uncertainty=drawn.uncertainty, setup=sd.methods.SetupPriors(laser="free"))


def random_change(rng: np.random.Generator, size: float = 1.0) -> dict[str, float]:
    """By parameter; from the usual priors, or from `size` times as wide ones."""
    priors = sd.methods.ChangePriors()
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


# What happens to a machine that was calibrated, or to the readings of the run that rechecks it.
SCREW, SHAPE, WRONG = 5e-3, 5e-3, 1.0  # mm
LAYOUTS = ("ideal", "psd", "multi_beam")
EVENTS = ("nothing", "screw", "cubic bow", "wrong reading", "slip")


@dataclasses.dataclass(frozen=True)
class Eventful:
    """A calibration and a run after an event, with what both are to be judged with."""

    baseline: sd.Calibration
    run: sd.Measurement
    plan: sd.Plan
    drawn: coverage_cases.Drawn
    options: sd.methods.AdjustmentOptions
    hit: tuple[str, int] | None  # line and point of the reading that is wrong, or of the first one that slipped

    @property
    def given(self) -> tuple[sd.Calibration, sd.Measurement, sd.Plan, sd.Head, sd.Chain, tuple[float, ...]]:
        tool = tuple(self.drawn.machine.tool)
        return self.baseline, self.run, self.plan, self.drawn.head, sd.Chain(self.drawn.chain), tool


def after(event: str, layout: str, seed: int, steps: int = 8) -> Eventful:
    """Of a random machine; noise of 0.01 to 0.1 um; runs of one, two or four diagonals, and of four with scale lines.

    A screw error of 5 um of any pitch and phase on one axis, a cubic bow of 5 um of one straightness; a distance wrong
    by 1 mm; a distance that slips by 1 to 100 um."""
    case = coverage_cases.CASES[{"ideal": "adjustment"}.get(layout, f"adjustment, layout {'ab'[layout == 'psd']}")]
    drawn, rng = coverage_cases.draw(case, seed, steps)
    distance = coverage_cases.log_uniform(rng, 1e-5, 1e-4)
    uncertainty = sd.methods.ReadingUncertainty(distance=distance, tilt=1e-2 * distance, spot=10.0 * distance)
    drawn = dataclasses.replace(drawn, uncertainty=uncertainty)
    baseline = coverage_cases.evaluated(case, drawn, coverage_cases.measured(drawn, rng))
    diagonals, scale_lines = (*((lines, ()) for lines in LINES), (DIAGONALS, SCALE_LINES))[seed % 4]
    plan = sd.Plan(drawn.plan.volume, diagonals, steps // (1 + seed // 4 % 2), scale_lines=scale_lines)
    machine = drawn.machine
    if event in ("screw", "cubic bow"):
        machine = _with_shape(machine, event, rng)
    lines = [*plan.lines, *plan.scale_lines]
    misalignment = {str(line): coverage_cases.setup_of(case, rng, str(line)) for line in lines}
    run = coverage_cases.measured(
        dataclasses.replace(drawn, machine=machine, plan=plan, misalignment=misalignment), rng
    )
    hit = None
    if event in ("wrong reading", "slip"):
        run, hit = _spoilt(run, event, rng)
    told = {"setup": case.told["setup"], "setup_by_line": {}}
    if scale_lines:
        told = case.told
    return Eventful(baseline, run, plan, drawn, sd.methods.AdjustmentOptions(uncertainty=uncertainty, **told), hit)


def _with_shape(machine: sd.Machine, event: str, rng: np.random.Generator) -> sd.Machine:
    names = [name for name in FUNCTIONS if kind_of(name) == ("positioning" if event == "screw" else "straightness")]
    changed = str(rng.choice(names))
    functions = dict(machine.errors.functions)
    position, value = functions[changed]
    share = position / position[-1]
    if event == "screw":
        pitch, phase = coverage_cases.log_uniform(rng, 4.0, 400.0), rng.uniform(0.0, 2.0 * np.pi)
        added = SCREW * (np.sin(2.0 * np.pi * position / pitch + phase) - np.sin(phase))
    else:
        added = SHAPE * 12.0 * np.sqrt(3.0) * share * (share - 0.5) * (share - 1.0)  # largest value 1
    functions[changed] = (position, value + added)
    return sd.Machine(machine.chain, sd.ErrorMap(functions, dict(machine.errors.squareness)), machine.tool)


def _spoilt(run: sd.Measurement, event: str, rng: np.random.Generator) -> tuple[sd.Measurement, tuple[str, int]]:
    channels = {name: np.array(value) for name, value in run.channels.items()}
    channel = str(rng.choice([name for name in channels if name.startswith("d")]))
    row = int(rng.integers(1, len(run)))
    if event == "slip":
        line = np.array(run.line) == run.line[row]
        channels[channel][line & (np.arange(len(run)) >= row)] += coverage_cases.log_uniform(rng, 1e-3, 0.1)
    else:
        channels[channel][row] += WRONG * rng.choice([-1.0, 1.0])
    spoilt = sd.Measurement(run.line, run.point, run.position, channels)
    return spoilt, (run.line[row], int(run.point[row]))
