"""What `stepdiag observe` tells: what a plan determines and how well, and what other numbers of steps would give."""

from collections.abc import Iterator, Sequence
from typing import Final

from stepdiag import _core
from stepdiag._core import Adjustment
from stepdiag.display import lines_text
from stepdiag.findings.temperature import reference_mark
from stepdiag.findings.undetermined import combination_text
from stepdiag.io.csv_text import csv_text
from stepdiag.parameters import KINDS, REPORT_UNIT, in_report_units
from stepdiag.planning.observation import Prospect, extents, growth
from stepdiag.presentation.evaluation import expansion_rows, machine_drift_rows, uncertainty_rows, undetermined_rows
from stepdiag.presentation.prior_effects import cosine_rows, drift_rows
from stepdiag.presentation.setup_table import setup_rows
from stepdiag.scenario.known import Known
from stepdiag.scenario.planned_readings import lost_readings

PARAMETERS: Final = 21


def observation_report(found: Adjustment, run: _core.Measurement, known: Known) -> Iterator[str]:
    """What the scenario's own plan determines, with what would help for the rest."""
    plan, calibration = known.plan, found.calibration
    yield (
        f"plan: {lines_text(plan)}; {len(run)} points, "
        f"{', '.join(known.signals)}; {found.degrees_of_freedom} readings more than unknowns"
    )
    incomplete, _ = lost_readings(run, plan, known.signals)
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
    combinations = (combination_text(combination, value=False) for combination in found.combinations)
    yield from undetermined_rows(calibration, combinations)
    if calibration.temperature_reference is not None:
        yield f"temperature: positioning errors are {reference_mark(calibration.temperature_reference)}"
    yield from uncertainty_rows(calibration)
    rows = list(setup_rows(found.setup, [*plan.lines, *plan.scale_lines], values=False))
    if rows:
        yield "set-up, standard uncertainties:"
        yield from rows
    yield from expansion_rows(found.expansion, values=False)
    yield from machine_drift_rows(found.machine_drift, known, values=False)
    yield from cosine_rows(run, known)
    yield from drift_rows(run, known)


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
    columns = "steps,mirror_width_mm,mirror_height_mm,u_positioning_um,u_straightness_um,u_angle_urad,u_squareness_urad"
    rows = []
    for p in found:
        cells = [in_report_units(kind, p.largest[kind]) if kind in p.largest else None for kind in KINDS]
        rows.append([p.steps, *p.mirror, *cells])
    return csv_text(columns.split(","), rows)
