"""What is said of a plan: what a plan determines and how well, and what other numbers of steps would give."""

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
from stepdiag.presentation.blocks import Block, NoteBlock, RowBlock, TableBlock
from stepdiag.presentation.evaluation import expansion_rows, machine_drift_rows, uncertainty_table, undetermined_rows
from stepdiag.presentation.prior_effects import cosine_rows, drift_rows
from stepdiag.presentation.setup_table import setup_blocks
from stepdiag.scenario.known import Known
from stepdiag.scenario.planned_readings import lost_readings

PARAMETERS: Final = 21


def observation_blocks(found: Adjustment, run: _core.Measurement, known: Known) -> Iterator[Block]:
    """What the scenario's own plan determines, with what would help for the rest."""
    plan, calibration = known.plan, found.calibration
    yield RowBlock(
        "plan",
        f"{lines_text(plan)}; {len(run)} points, {', '.join(known.signals)}; {found.degrees_of_freedom} readings more "
        "than unknowns",
    )
    incomplete, _ = lost_readings(run, plan, known.signals)
    if incomplete:
        yield RowBlock("lost", f"{incomplete} rows without a complete reading, by the beam's way alone")
    yield NoteBlock("for a perfect machine, head and mirror set up without error:")
    whole, shapes, parts = extents(calibration, plan)
    all_of_them = "all 21 parameters" if len(whole) == PARAMETERS else ", ".join(whole)
    yield RowBlock("determined", all_of_them or "none as a whole")
    if shapes:
        yield RowBlock("determined but for a slope", ", ".join(shapes))
    if parts:
        yield RowBlock("determined at some of the positions", ", ".join(parts))
    # All values are 0 here, to rounding.
    combinations = (combination_text(combination, value=False) for combination in found.combinations)
    yield from undetermined_rows(calibration, combinations)
    if calibration.temperature_reference is not None:
        yield RowBlock("temperature", f"positioning errors are {reference_mark(calibration.temperature_reference)}")
    yield uncertainty_table(calibration)
    lines = [*plan.lines, *plan.scale_lines]
    yield from setup_blocks(found.setup, lines, "set-up, standard uncertainties", values=False)
    yield from map(NoteBlock, expansion_rows(found.expansion, values=False))
    yield from map(NoteBlock, machine_drift_rows(found.machine_drift, known, values=False))
    yield from map(NoteBlock, [*cosine_rows(run, known), *drift_rows(run, known)])


def prospect_blocks(found: Sequence[Prospect]) -> Iterator[Block]:
    """The table, its exponents below it."""
    rows = [("", "", *(REPORT_UNIT[kind] for kind in KINDS))]
    for p in found:
        cells = (f"{in_report_units(kind, p.largest[kind]):.3g}" if kind in p.largest else "-" for kind in KINDS)
        rows.append((str(p.steps), f"{p.mirror[0]:.1f} x {p.mirror[1]:.1f}", *cells))
    exponents = [growth(found, kind) for kind in KINDS]
    if any(e is not None for e in exponents):
        rows.append(("exponent", "", *("-" if e is None else f"{e:.2f}" for e in exponents)))
    title = "largest standard uncertainties by the number of steps, and the mirror that they take"
    yield TableBlock(tuple(rows), ("steps", "mirror mm", *KINDS), title, left=())
    yield from (NoteBlock(f"{p.steps} steps: {p.trouble}", indented=True) for p in found if p.trouble)


def prospect_csv(found: Sequence[Prospect]) -> str:
    """The table as a file; what is not determined is an empty field."""
    columns = "steps,mirror_width_mm,mirror_height_mm,u_positioning_um,u_straightness_um,u_angle_urad,u_squareness_urad"
    rows = []
    for p in found:
        cells = [in_report_units(kind, p.largest[kind]) if kind in p.largest else None for kind in KINDS]
        rows.append([p.steps, *p.mirror, *cells])
    return csv_text(columns.split(","), rows)
