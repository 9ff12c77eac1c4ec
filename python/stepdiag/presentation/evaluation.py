"""What is said of an evaluation, in blocks."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from stepdiag._core import (
    Adjustment,
    Calibration,
    DriftEstimate,
    ExpansionEstimate,
    Measurement,
    straightness_reference,
)
from stepdiag.calibration.largest_by_kind import largest_uncertainties
from stepdiag.display import point_text
from stepdiag.findings.faults import fault_rows
from stepdiag.findings.meaning import NOISE_ALONE, fit_words
from stepdiag.findings.mistakes import FoundMistake
from stepdiag.findings.temperature import temperature_text
from stepdiag.findings.undetermined import combination_text
from stepdiag.findings.unseen import ONE_AT_A_TIME
from stepdiag.findings.verdict import verdict_words
from stepdiag.mistakes.copies import passes_of
from stepdiag.parameters import KINDS, REPORT_UNIT, Kind, in_report_units, kind_of
from stepdiag.presentation.blocks import Block, NoteBlock, RowBlock, TableBlock
from stepdiag.presentation.fault_control import control_blocks
from stepdiag.presentation.fit import fit_blocks
from stepdiag.presentation.prior_effects import cosine_rows, drift_rows, rounding_rows
from stepdiag.presentation.setup_table import NOTHING_LEARNT, setup_blocks
from stepdiag.scenario.description import JudgedEvaluation, reduced_run
from stepdiag.scenario.known import Known
from stepdiag.scenario.planned_readings import lost_readings
from stepdiag.units import HOUR, MICRO, MICROMETRE

SIGNIFICANT: Final = 2.58  # times its standard uncertainty: one of a hundred that are 0


def evaluation_blocks(
    result: JudgedEvaluation | Adjustment,
    measurement: Measurement,
    known: Known,
    mistakes: Sequence[FoundMistake] = (),
) -> Iterator[Block]:
    """The verdict of the fit, what to change if a mistake explains it, lost readings, largest standard uncertainties
    and what is not determined; of an adjustment also faults of the readings, and how head and mirror were set up."""
    if isinstance(result, JudgedEvaluation):
        return _published(result, measurement, known, mistakes)
    return _adjusted(result, measurement, known, mistakes)


def _published(
    judged: JudgedEvaluation, measurement: Measurement, known: Known, mistakes: Sequence[FoundMistake]
) -> Iterator[Block]:
    calibration = judged.calibration
    adjusted = "none" if judged.adjustment is None else judged.adjustment.verdict.fit
    words = fit_words(calibration)
    two = (
        f"the fit is the worse of the method's own test ({judged.own}) and of the adjustment of the same readings "
        f"({adjusted})"
    )
    yield from fit_blocks(words._replace(notes=(("two verdicts", two), *words.notes)), mistakes)
    yield from _what_was_done(calibration, measurement, known)
    yield uncertainty_table(calibration)
    yield from budget_rows(calibration)
    yield from undetermined_rows(calibration)
    yield RowBlock("reference", straightness_reference(calibration.chain, calibration.tool))
    yield unchecked_row(known)
    if known.keys.adjustment.model_fields_set:
        yield RowBlock("note", f"[adjustment] is not used by the method {calibration.method}")


def _adjusted(
    adjustment: Adjustment, measurement: Measurement, known: Known, mistakes: Sequence[FoundMistake]
) -> Iterator[Block]:
    calibration = adjustment.calibration
    yield from fit_blocks(verdict_words(adjustment), mistakes)
    yield from (RowBlock("note", row) for row in rounding_rows(adjustment.rounded))
    yield from _what_was_done(calibration, measurement, known)
    yield from (RowBlock(*row) for row in fault_rows(adjustment.faults))
    yield uncertainty_table(calibration)
    yield from budget_rows(calibration)
    yield from reversal_table(calibration)
    yield from setup_blocks(
        adjustment.setup,
        [*known.plan.lines, *known.plan.scale_lines],
        "set-up found, 12.3(45) being 12.3 with a standard uncertainty of 4.5",
    )
    yield from map(NoteBlock, expansion_rows(adjustment.expansion))
    yield from map(NoteBlock, machine_drift_rows(adjustment.machine_drift, known))
    yield from undetermined_rows(calibration, map(combination_text, adjustment.combinations))
    yield from smoothness_rows(adjustment.smoothness)
    # Caveats come last: the first screen is for the result.
    yield from unseen_rows(calibration)
    yield from map(NoteBlock, [*cosine_rows(measurement, known), *drift_rows(measurement, known)])
    yield RowBlock("reference", straightness_reference(calibration.chain, calibration.tool))
    yield unchecked_row(known)
    if adjustment.reliability:
        yield from control_blocks(adjustment.reliability)


def _what_was_done(calibration: Calibration, measurement: Measurement, known: Known) -> Iterator[Block]:
    yield RowBlock("method", f"{calibration.method}, chain {calibration.chain.name}")
    yield RowBlock("readings", f"{len(measurement)} points on {len(set(measurement.line))} lines")
    yield RowBlock("temperature", temperature_text(calibration))
    yield from map(NoteBlock, calibration.conditions)
    yield from air_rows(measurement, known)
    incomplete, missing = lost_readings(measurement, known.plan, known.signals)
    if incomplete or missing:
        yield RowBlock(
            "lost", f"{incomplete} rows without a complete reading, {missing} points of the plan without a row"
        )


def unseen_rows(calibration: Calibration) -> Iterator[Block]:
    """How large faults of readings may be in a calibration unseen."""
    yield from (RowBlock("unseen", sentence) for sentence in calibration.unseen_faults)
    if calibration.unseen_faults:
        yield NoteBlock(ONE_AT_A_TIME, indented=True)


def expansion_rows(estimates: Iterable[ExpansionEstimate], *, values: bool = True) -> Iterator[str]:
    """Expansion coefficients that were unknowns: what was stated, and what the readings made of it; without `values`
    its standard uncertainty alone."""
    for estimate in estimates:
        numbers = (estimate.stated, estimate.prior, estimate.value, estimate.standard_uncertainty)
        stated, prior, value, u = (number * MICRO for number in numbers)
        scales = "the scales" if len(estimate.axes) == 3 else f"the scale of {'XYZ'[estimate.axes[0]]}"
        found = "the readings add nothing"
        if u < NOTHING_LEARNT * prior:
            found = f"found {value:.4g} ± {u:.2g}" if values else f"found to ± {u:.2g}"
        yield f"expansion of {scales}: stated {stated:.4g} ± {prior:.2g} µm/(m·K), {found}"


def machine_drift_rows(estimates: Iterable[DriftEstimate], known: Known, *, values: bool = True) -> Iterator[str]:
    """The drift of the functional point, where it was an unknown, and whether it is more than chance makes; without
    `values` its standard uncertainty alone."""
    by_time = known.machine_drift is None or known.machine_drift.record == "time"
    factor, unit = (HOUR / MICROMETRE, "µm/h") if by_time else (1.0 / MICROMETRE, "µm/K")
    for estimate in estimates:
        value, u, prior = (factor * x for x in (estimate.value, estimate.standard_uncertainty, estimate.prior))
        found = "the readings add nothing"
        if u < NOTHING_LEARNT * prior:
            found = f"found to ± {u:.2g}"
            if values:
                size = "significant" if abs(value) > SIGNIFICANT * u else "not significant"
                found = f"found {value:.3g} ± {u:.2g}, {size}"
        yield f"drift of the functional point along {'XYZ'[estimate.axis]}: taken as 0 ± {prior:.2g} {unit}, {found}"


def air_rows(measurement: Measurement, known: Known) -> Iterator[Block]:
    """The largest correction for the air, where evaluations make it."""
    if known.assumed_air is None:
        return
    corrected, largest = reduced_run(known, measurement), 0.0
    for name in (name for name in corrected.channels if name.startswith("d")):
        change = corrected.channels[name] - measurement.channels[name]
        for rows in passes_of(measurement).values():
            read = change[rows][np.isfinite(change[rows])]
            if read.size:  # a constant of a line is none of its length
                largest = max(largest, float(np.ptp(read)))
    yield RowBlock(
        "air",
        "the instrument counted with a constant index; distances were corrected by up to "
        f"{largest * 1e3:.3g} µm along a line",
    )


def undetermined_rows(calibration: Calibration, combinations: Iterable[str] = ()) -> Iterator[Block]:
    """What is not determined, and what is known of it all the same."""
    yield from (RowBlock("undetermined", sentence) for sentence in calibration.undetermined)
    yield from (RowBlock("known", combination) for combination in combinations)
    if calibration.undetermined_slopes:
        yield RowBlock("note", "a function of undetermined slope is given by its shape, with both ends at 0")


def smoothness_rows(deviations: Mapping[str, float]) -> Iterator[Block]:
    """Which functions were smoothed, and how much."""
    if deviations:
        said = (
            f"{name} {in_report_units(kind_of(name), d):.3g} {REPORT_UNIT[kind_of(name)]}"
            for name, d in deviations.items()
        )
        yield RowBlock("smoothed, standard deviation of second differences", ", ".join(said))


def reversal_table(calibration: Calibration) -> Iterator[TableBlock]:
    """The largest reversal error of each kind."""
    largest: dict[Kind, tuple[float, float, str]] = {}
    for name, (position, value, uncertainty) in calibration.reversal.items():
        kind, worst = kind_of(name), int(np.argmax(np.abs(value)))
        if abs(value[worst]) >= abs(largest.get(kind, (0.0, 0.0, ""))[0]):
            largest[kind] = float(value[worst]), float(uncertainty[worst]), f"{name} at {position[worst]:g} mm"
    rows = []
    for kind in KINDS:
        if kind in largest:
            error, uncertainty_of_it, where = largest[kind]
            unit, u = REPORT_UNIT[kind], "not known"  # as of a calibration that was read from CSV
            if not math.isnan(uncertainty_of_it):
                u = f"{in_report_units(kind, uncertainty_of_it):.2g} {unit}"
            rows.append((kind, f"{in_report_units(kind, error):.3g}", unit, f"({where}; standard uncertainty {u})"))
    if rows:
        yield TableBlock(tuple(rows), title="largest reversal errors, + less - direction of approach", left=(0, 2, 3))


def budget_rows(calibration: Calibration) -> Iterator[Block]:
    """One row, where it is known."""
    if calibration.budget:
        yield RowBlock("budget", calibration.budget)


def uncertainty_table(calibration: Calibration) -> TableBlock:
    """The largest standard uncertainty of each kind, and where it is."""
    rows = (
        (kind, f"{in_report_units(kind, uncertainty):.3g}", REPORT_UNIT[kind], f"({where})")
        for kind, (uncertainty, where) in largest_uncertainties(calibration).items()
    )
    alone = ", of noise alone" if calibration.method in NOISE_ALONE else ""
    return TableBlock(tuple(rows), title=f"largest standard uncertainties{alone}", left=(0, 2, 3))


def unchecked_row(known: Known) -> RowBlock:
    """What no reading shows, with the values that were used, so that a person can check them."""
    heads = list(known.heads.values())
    standoffs = ", ".join(dict.fromkeys(f"{head.standoff:g}" for head in heads))
    wavelengths = ", ".join(dict.fromkeys(f"{head.wavelength:g}" for head in heads))
    scales = ""
    if known.expansion is not None:
        numbers = dict.fromkeys(f"{1e6 * c:g}" for c in known.expansion.expansion.coefficient)
        scales = f", expansion of the scales {', '.join(numbers)} µm/(m·K)"
    return RowBlock(
        "check by hand, as no reading shows it",
        f"place of b in the chain {known.chain.name}, tool offset {point_text(known.tool)}, standoff {standoffs} mm, "
        f"wavelength {wavelengths} nm{scales}, and the index of air and the temperature that all distances were "
        "reduced with",
    )
