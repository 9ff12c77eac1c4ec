"""What a plan and a head can determine and how well, before anyone measures.

An error-free run of the scenario's plan (perfect machine, nothing out of true, no noise) is adjusted with the
scenario's weights and unknowns: uncertainties and rank depend on where is read what, hardly on what is read."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np

from stepdiag import _core
from stepdiag._core import Adjustment, Calibration, InvalidArgument
from stepdiag.calibration.largest_by_kind import largest_uncertainties
from stepdiag.config.key_types import Section
from stepdiag.config.scenario_head_keys import EnvironmentSection, HeadKeys
from stepdiag.config.scenario_keys import MisalignmentSection, NoiseSection, RandomSection, ScenarioKeys
from stepdiag.config.toml_text import located
from stepdiag.config.uncertainty_keys import UncertaintySection
from stepdiag.parameters import Kind
from stepdiag.scenario.description import Scenario, adjust_scenario, build_scenario, simulate_scenario
from stepdiag.scenario.uncertain_inputs import OF_SCALE_LINES

AnyHead = TypeVar("AnyHead", bound=HeadKeys)
AnySection = TypeVar("AnySection", bound=Section)
USUAL_STEPS: Final = (5, 10, 20, 50, 100, 200)


@dataclass(frozen=True)
class Prospect:
    """What a number of steps would give: the smallest mirror (mm), and the largest standard uncertainty of each kind,
    mm or rad; absent where nothing of the kind is determined. `trouble`: why there is none."""

    steps: int
    mirror: tuple[float, float]
    largest: dict[Kind, float]
    trouble: str = ""


def observe(scenario: Scenario) -> tuple[_core.Measurement, Adjustment]:
    """The error-free run of a scenario, and what is found in it. Raises InvalidArgument where nothing is."""
    perfect = without_errors(scenario, scenario.plan.steps)
    run = simulate_scenario(perfect)
    with located(str(scenario.path)):
        return run, adjust_scenario(perfect, run)


def prospects(scenario: Scenario, steps: Sequence[int]) -> list[Prospect]:
    """By the number of steps, ascending."""
    return [_prospect(scenario, count) for count in sorted(set(steps))]


def _prospect(scenario: Scenario, steps: int) -> Prospect:
    plan = scenario.plan
    width, height = _core.Plan(
        plan.volume, plan.lines, steps, order=plan.orders, scale_lines=plan.scale_lines
    ).smallest_mirror()
    mirror = (float(width), float(height))
    try:
        perfect = without_errors(scenario, steps)
        found = adjust_scenario(perfect, simulate_scenario(perfect))
    except InvalidArgument as error:
        return Prospect(steps, mirror, {}, str(error))
    return Prospect(
        steps, mirror, {kind: value for kind, (value, _) in largest_uncertainties(found.calibration).items()}
    )


def extents(calibration: Calibration, plan: _core.Plan) -> tuple[list[str], list[str], list[str]]:
    """The parameters of a calibration that are determined as a whole, but for a slope, and at some nodes only."""
    functions = calibration.functions
    parts = [name for name in functions if len(functions[name][0]) < plan.steps + 1]
    shapes = [name for name in calibration.undetermined_slopes if name not in parts]
    whole = [name for name in functions if name not in (*parts, *shapes)]
    return [*whole, *calibration.squareness], shapes, parts


def without_errors(scenario: Scenario, steps: int) -> Scenario:
    """The scenario of a perfect machine and a perfect set-up, with the same weights and unknowns."""
    perfect = build_scenario(_perfect_keys(scenario.keys, {"steps": steps}), scenario.path)
    return dataclasses.replace(perfect, uncertainty=scenario.uncertainty)


def with_usual_errors(scenario: Scenario, plan: Mapping[str, Any], *, noise: bool = False) -> Scenario:
    """The scenario with other keys of [plan], without its noise or with it, of a machine with errors: those of its
    [machine.random], else of that section's defaults. What it says of lines that are not measured is passed over."""
    keys, usual = scenario.keys, _perfect_keys(scenario.keys, plan)
    measured = {*usual.plan.lines, *usual.plan.scale_lines}
    errors = keys.machine.random or RandomSection(seed=0)

    uncertainty = keys.uncertainty
    if not usual.plan.scale_lines:  # then there is nothing that these could be about
        stated = {name: getattr(uncertainty, name) for name in uncertainty.model_fields_set - {*OF_SCALE_LINES}}
        uncertainty = UncertaintySection.model_construct(**stated)

    def kept(section: AnySection, by_line: Mapping[str, Any]) -> AnySection:
        return section.model_copy(update={"by_line": {line: by_line[line] for line in by_line if line in measured}})

    sections = {
        "machine": usual.machine.model_copy(update={"random": errors}),
        "misalignment": kept(keys.misalignment, keys.misalignment.by_line),
        "noise": keys.noise if noise else usual.noise,
        "uncertainty": kept(uncertainty, uncertainty.by_line),
    }
    built = build_scenario(usual.model_copy(update=sections), scenario.path)
    return dataclasses.replace(built, uncertainty=scenario.uncertainty)


def _perfect_keys(keys: ScenarioKeys, changes: Mapping[str, Any]) -> ScenarioKeys:
    heads = {name: _nominal(head) for name, head in keys.head.by_head.items()}
    plan = keys.plan.model_copy(update=changes)
    measured = {*plan.lines, *plan.scale_lines}
    return keys.model_copy(
        update={
            "machine": keys.machine.model_copy(update={"errors": None, "random": None}),
            "plan": plan,
            "line": {line: own for line, own in keys.line.items() if line in measured},
            "head": _nominal(keys.head).model_copy(update={"by_head": heads}),
            "misalignment": MisalignmentSection(),
            "environment": EnvironmentSection(),
            "noise": NoiseSection(),
            "adjustment": keys.adjustment.model_copy(
                update={
                    "outlier_probability": 0.0,
                    "by_line": {line: own for line, own in keys.adjustment.by_line.items() if line in measured},
                }
            ),
        }
    )


def _nominal(head: AnyHead) -> AnyHead:
    """With its components in their places."""
    return head.model_copy(update={"pose_errors": {}} if "pose_errors" in head.model_fields_set else {})


def growth(found: Sequence[Prospect], kind: Kind) -> float | None:
    """The exponent e of u ~ steps^e, by least squares of the logarithms; None where fewer than three are known."""
    points = [(math.log(p.steps), math.log(p.largest[kind])) for p in found if p.largest.get(kind, 0.0) > 0.0]
    if len(points) < 3:
        return None
    x, y = np.transpose(points)
    return float(np.polyfit(x, y, 1)[0])
