"""What a plan and a head can determine and how well, before anyone measures.

An error-free run of the scenario's plan (perfect machine, nothing out of true, no noise) is adjusted with the
scenario's weights and unknowns: uncertainties and rank depend on where is read what, hardly on what is read."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from stepdiag import _core
from stepdiag._core import Adjustment, Calibration, InvalidArgument
from stepdiag.calibration.largest_by_kind import largest_uncertainties
from stepdiag.config.toml_text import located
from stepdiag.config.uncertainty_keys import UncertaintySection
from stepdiag.parameters import Kind
from stepdiag.scenario.description import Scenario, adjust_scenario, simulate_scenario
from stepdiag.scenario.known import Known, known_of
from stepdiag.scenario.truth import Truth
from stepdiag.scenario.uncertain_inputs import OF_SCALE_LINES
from stepdiag.wrong_arguments import checked

USUAL_STEPS: Final = (5, 10, 20, 50, 100, 200)


@dataclass(frozen=True)
class Prospect:
    """What a number of steps would give: the smallest mirror (mm), and the largest standard uncertainty of each kind,
    mm or rad; absent where nothing of the kind is determined. `trouble`: why there is none."""

    steps: int
    mirror: tuple[float, float]
    largest: dict[Kind, float]
    trouble: str = ""


@checked
def observe(scenario: Scenario | Known) -> tuple[_core.Measurement, Adjustment]:
    """The error-free run of a scenario, and what is found in it, with the faults that its readings control. Raises
    InvalidArgument where nothing is."""
    known = not_measured(scenario.known)
    # Temperatures that change tell something of expansion coefficients.
    truth = Truth(scales=scenario.truth.scales) if isinstance(scenario, Scenario) else Truth()
    run = simulate_scenario(Scenario(known, truth))
    with located(str(known.path)):
        return run, adjust_scenario(known, run, reliability=True)


def prospects(
    known: Known, steps: Sequence[int], progress: Callable[[int, int], None] = lambda done, total: None
) -> list[Prospect]:
    """By the number of steps, ascending. `progress` receives how many of how many are done."""
    found: list[Prospect] = []
    for count in sorted(set(steps)):
        found.append(_prospect(known, count))
        progress(len(found), len(set(steps)))
    return found


def _prospect(known: Known, steps: int) -> Prospect:
    plan = known.plan
    width, height = _core.Plan(
        plan.volume, plan.lines, steps, order=plan.orders, scale_lines=plan.scale_lines, block=min(plan.block, steps)
    ).smallest_mirror()
    mirror = (float(width), float(height))
    try:
        planned = not_measured(known, {"steps": steps})
        found = adjust_scenario(planned, simulate_scenario(Scenario(planned, Truth())))
    except InvalidArgument as error:
        return Prospect(steps, mirror, {}, str(error))
    return Prospect(
        steps, mirror, {kind: value for kind, (value, _) in largest_uncertainties(found.calibration).items()}
    )


@checked
def extents(calibration: Calibration, plan: _core.Plan) -> tuple[list[str], list[str], list[str]]:
    """The parameters of a calibration that are determined as a whole, but for a slope, and at some nodes only."""
    functions = calibration.functions
    parts = [name for name in functions if len(functions[name][0]) < plan.steps + 1]
    shapes = [name for name in calibration.undetermined_slopes if name not in parts]
    whole = [name for name in functions if name not in (*parts, *shapes)]
    return [*whole, *calibration.squareness], shapes, parts


def not_measured(known: Known, plan: Mapping[str, Any] | None = None) -> Known:
    """The same for a run that nobody has measured: with these keys of [plan] in place of its own, and no reading left
    out."""
    keys, uncertainty = known.keys, known.keys.uncertainty
    planned = keys.plan.model_copy(update=plan)
    at = {
        "check_points": min(planned.check_points, planned.steps),
        "check_point": min(planned.check_point, planned.steps),
        "block": min(planned.block, planned.steps),
        "scale_points": planned.scale_points if planned.scale_lines else "ends",
    }
    planned = planned.model_copy(update=at)
    if not planned.scale_lines:  # then there is nothing that these could be about
        stated = {name: getattr(uncertainty, name) for name in uncertainty.model_fields_set - {*OF_SCALE_LINES}}
        uncertainty = UncertaintySection.model_construct(**stated)
    adjustment = keys.adjustment.model_copy(update={"outlier_probability": 0.0})
    of_lines = {line: own for line, own in keys.line.items() if line in (*planned.lines, *planned.scale_lines)}
    changes = {"plan": planned, "line": of_lines, "adjustment": adjustment, "uncertainty": uncertainty}
    return known_of(keys.model_copy(update=changes), known.described, known.path, known.assumed_air)


def growth(found: Sequence[Prospect], kind: Kind) -> float | None:
    """The exponent e of u ~ steps^e, by least squares of the logarithms; None where fewer than three are known."""
    points = [(math.log(p.steps), math.log(p.largest[kind])) for p in found if p.largest.get(kind, 0.0) > 0.0]
    if len(points) < 3:
        return None
    x, y = np.transpose(points)
    return float(np.polyfit(x, y, 1)[0])
