"""What a plan and a head can determine and how well, before anyone measures.

An error-free run of the scenario's plan (perfect machine, nothing out of true, no noise) is adjusted with the
scenario's weights and unknowns: uncertainties and rank depend on where is read what, hardly on what is read."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np
from stepdiag.parameters import KINDS, REPORT_UNIT, Kind, in_report_units

from stepdiag import _core
from stepdiag._core import Adjustment, Calibration, InvalidArgument
from stepdiag.calibration.largest_by_kind import largest_uncertainties
from stepdiag.config.key_types import Section
from stepdiag.config.scenario_head_keys import EnvironmentSection, HeadKeys
from stepdiag.config.scenario_keys import MisalignmentSection, NoiseSection, RandomSection, ScenarioKeys
from stepdiag.config.toml_text import located
from stepdiag.config.uncertainty_keys import UncertaintySection
from stepdiag.report.evaluation import cosine_rows, uncertainty_rows, undetermined_rows
from stepdiag.report.setup_table import setup_rows
from stepdiag.scenario.description import Scenario, adjust_scenario, build_scenario, simulate_scenario
from stepdiag.scenario.planned_readings import lost_readings
from stepdiag.scenario.uncertain_inputs import OF_SCALE_LINES

PARAMETERS: Final = 21
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


def observation_report(found: Adjustment, run: _core.Measurement, scenario: Scenario) -> Iterator[str]:
    """What the scenario's own plan determines, with what would help for the rest."""
    plan, calibration = scenario.plan, found.calibration
    yield (
        f"plan: {len(plan.lines)} lines of {plan.steps} steps, {len(plan.scale_lines)} scale lines; {len(run)} points, "
        f"{', '.join(scenario.signals)}; {found.degrees_of_freedom} readings more than unknowns"
    )
    incomplete, _ = lost_readings(run, plan, scenario.signals)
    if incomplete:
        yield f"lost: {incomplete} rows without a complete reading, by the beam's way alone"
    yield "for a perfect machine, head and mirror set up without error:"
    whole, shapes, parts = extents(calibration, plan)
    yield f"determined: {'all 21 parameters' if len(whole) == PARAMETERS else ', '.join(whole) or 'none as a whole'}"
    if shapes:
        yield f"determined but for a slope: {', '.join(shapes)}"
    if parts:
        yield f"determined at some of the positions: {', '.join(parts)}"
    # All values are 0 here, to rounding.
    known = [f"{what.partition(' = ')[0]}, ±{what.partition(' +- ')[2]}" for what in found.combinations]
    yield from undetermined_rows(calibration, known)
    yield from uncertainty_rows(calibration)
    rows = list(setup_rows(found.setup, [*plan.lines, *plan.scale_lines], values=False))
    if rows:
        yield "set-up, standard uncertainties:"
        yield from rows
    yield from cosine_rows(scenario)


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


def prospect_rows(found: Sequence[Prospect]) -> Iterator[str]:
    """The table, its exponents below it."""
    yield f"  {'steps':>5}  {'mirror mm':>13}" + "".join(f"{kind:>14}" for kind in KINDS)
    yield f"  {'':>5}  {'':>13}" + "".join(f"{REPORT_UNIT[kind]:>14}" for kind in KINDS)
    for p in found:
        mirror = f"{p.mirror[0]:.1f} x {p.mirror[1]:.1f}"
        cells = [f"{in_report_units(kind, p.largest[kind]):.3g}" if kind in p.largest else "-" for kind in KINDS]
        yield f"  {p.steps:5}  {mirror:>13}" + "".join(f"{cell:>14}" for cell in cells)
    exponents = [growth(found, kind) for kind in KINDS]
    if any(e is not None for e in exponents):
        cells = ["-" if e is None else f"{e:.2f}" for e in exponents]
        yield f"  {'exponent':<20}" + "".join(f"{cell:>14}" for cell in cells)
    for p in found:
        if p.trouble:
            yield f"  {p.steps} steps: {p.trouble}"


def prospect_csv(found: Sequence[Prospect]) -> str:
    """The table as a file; what is not determined is an empty field."""
    rows = ["steps,mirror_width_mm,mirror_height_mm,u_positioning_um,u_straightness_um,u_angle_urad,u_squareness_urad"]
    for p in found:
        cells = [repr(in_report_units(kind, p.largest[kind])) if kind in p.largest else "" for kind in KINDS]
        rows.append(",".join([str(p.steps), *map(repr, p.mirror), *cells]))
    return "\n".join(rows) + "\n"
