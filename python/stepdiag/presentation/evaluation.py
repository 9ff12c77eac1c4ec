"""What the commands tell about their results, as lines of text."""

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
from stepdiag.findings.meaning import NOISE_ALONE, fit_rows
from stepdiag.findings.mistakes import FoundMistake, change_rows
from stepdiag.findings.temperature import temperature_rows
from stepdiag.findings.undetermined import combination_text
from stepdiag.findings.unseen import unseen_rows
from stepdiag.findings.verdict import verdict_rows
from stepdiag.mistakes.copies import passes_of
from stepdiag.parameters import KINDS, REPORT_UNIT, Kind, in_report_units, kind_of
from stepdiag.presentation.fault_control import control_rows
from stepdiag.presentation.prior_effects import cosine_rows, drift_rows, rounding_rows
from stepdiag.presentation.setup_table import NOTHING_LEARNT, setup_rows
from stepdiag.scenario.description import JudgedEvaluation, reduced_run
from stepdiag.scenario.known import Known
from stepdiag.scenario.planned_readings import lost_readings
from stepdiag.units import HOUR, MICRO, MICROMETRE

SIGNIFICANT: Final = 2.58  # times its standard uncertainty: one of a hundred that are 0


def evaluation_report(
    result: JudgedEvaluation | Adjustment,
    measurement: Measurement,
    known: Known,
    mistakes: Sequence[FoundMistake] = (),
) -> Iterator[str]:
    """The verdict of the fit, what to change if a mistake explains it, lost readings, largest standard uncertainties
    and what is not determined; of an adjustment also faults of the readings, and how head and mirror were set up."""
    if isinstance(result, JudgedEvaluation):
        return _published(result, measurement, known, mistakes)
    return _adjusted(result, measurement, known, mistakes)


def _published(
    judged: JudgedEvaluation, measurement: Measurement, known: Known, mistakes: Sequence[FoundMistake]
) -> Iterator[str]:
    calibration = judged.calibration
    first, *rest = fit_rows(calibration)
    yield first
    adjusted = "none" if judged.adjustment is None else judged.adjustment.verdict.fit
    yield (
        f"that is the worse of the method's own test ({judged.own}) and of the adjustment of the same readings "
        f"({adjusted})"
    )
    yield from rest
    yield from change_rows(mistakes)
    yield from _what_was_done(calibration, measurement, known)
    yield from uncertainty_rows(calibration)
    yield from budget_rows(calibration)
    yield from undetermined_rows(calibration)
    yield f"reference: {straightness_reference(calibration.chain, calibration.tool)}"
    yield unchecked_row(known)
    if known.keys.adjustment.model_fields_set:
        yield f"note: [adjustment] is not used by the method {calibration.method}"


def _adjusted(
    adjustment: Adjustment, measurement: Measurement, known: Known, mistakes: Sequence[FoundMistake]
) -> Iterator[str]:
    calibration = adjustment.calibration
    yield from verdict_rows(adjustment)
    yield from change_rows(mistakes)
    yield from (f"note: {row}" for row in rounding_rows(adjustment.rounded))
    yield from _what_was_done(calibration, measurement, known)
    yield from fault_rows(adjustment.faults)
    yield from uncertainty_rows(calibration)
    yield from budget_rows(calibration)
    yield from reversal_rows(calibration)
    rows = list(setup_rows(adjustment.setup, [*known.plan.lines, *known.plan.scale_lines]))
    if rows:
        yield "set-up found, 12.3(45) being 12.3 with a standard uncertainty of 4.5:"
        yield from rows
    yield from expansion_rows(adjustment.expansion)
    yield from machine_drift_rows(adjustment.machine_drift, known)
    yield from undetermined_rows(calibration, map(combination_text, adjustment.combinations))
    yield from smoothness_rows(adjustment.smoothness)
    # Caveats come last: the first screen is for the result.
    yield from unseen_rows(calibration)
    yield from cosine_rows(measurement, known)
    yield from drift_rows(measurement, known)
    yield f"reference: {straightness_reference(calibration.chain, calibration.tool)}"
    yield unchecked_row(known)
    if adjustment.reliability:
        yield from control_rows(adjustment.reliability)


def _what_was_done(calibration: Calibration, measurement: Measurement, known: Known) -> Iterator[str]:
    yield f"method: {calibration.method}, chain {calibration.chain.name}"
    yield f"readings: {len(measurement)} points on {len(set(measurement.line))} lines"
    yield from temperature_rows(calibration)
    yield from calibration.conditions
    yield from air_rows(measurement, known)
    incomplete, missing = lost_readings(measurement, known.plan, known.signals)
    if incomplete or missing:
        yield f"lost: {incomplete} rows without a complete reading, {missing} points of the plan without a row"


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


def air_rows(measurement: Measurement, known: Known) -> Iterator[str]:
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
    yield (
        "air: the instrument counted with a constant index; distances were corrected by up to "
        f"{largest * 1e3:.3g} µm along a line"
    )


def undetermined_rows(calibration: Calibration, combinations: Iterable[str] = ()) -> Iterator[str]:
    """What is not determined, and what is known of it all the same."""
    for sentence in calibration.undetermined:
        yield f"undetermined: {sentence}"
    for combination in combinations:
        yield f"known: {combination}"
    if calibration.undetermined_slopes:
        yield "note: a function of undetermined slope is given by its shape, with both ends at 0"


def smoothness_rows(deviations: Mapping[str, float]) -> Iterator[str]:
    """Which functions were smoothed, and how much."""
    if deviations:
        said = (
            f"{name} {in_report_units(kind_of(name), d):.3g} {REPORT_UNIT[kind_of(name)]}"
            for name, d in deviations.items()
        )
        yield f"smoothed, standard deviation of second differences: {', '.join(said)}"


def reversal_rows(calibration: Calibration) -> Iterator[str]:
    """The largest reversal error of each kind."""
    largest: dict[Kind, tuple[float, float, str]] = {}
    for name, (position, value, uncertainty) in calibration.reversal.items():
        kind, worst = kind_of(name), int(np.argmax(np.abs(value)))
        if abs(value[worst]) >= abs(largest.get(kind, (0.0, 0.0, ""))[0]):
            largest[kind] = float(value[worst]), float(uncertainty[worst]), f"{name} at {position[worst]:g} mm"
    if largest:
        yield "largest reversal errors, + less - direction of approach:"
    for kind in KINDS:
        if kind in largest:
            error, uncertainty_of_it, where = largest[kind]
            unit, u = REPORT_UNIT[kind], "not known"  # as of a calibration that was read from CSV
            if not math.isnan(uncertainty_of_it):
                u = f"{in_report_units(kind, uncertainty_of_it):.2g} {unit}"
            yield f"  {kind:<13}{in_report_units(kind, error):9.3g} {unit:<5} ({where}; standard uncertainty {u})"


def budget_rows(calibration: Calibration) -> Iterator[str]:
    """One line, where it is known."""
    if calibration.budget:
        yield f"budget: {calibration.budget}"


def uncertainty_rows(calibration: Calibration) -> Iterator[str]:
    """The largest standard uncertainty of each kind, and where it is."""
    yield f"largest standard uncertainties{', of noise alone' if calibration.method in NOISE_ALONE else ''}:"
    for kind, (uncertainty, where) in largest_uncertainties(calibration).items():
        yield f"  {kind:<13}{in_report_units(kind, uncertainty):9.3g} {REPORT_UNIT[kind]:<5} ({where})"


def unchecked_row(known: Known) -> str:
    """What no reading shows, with the values that were used, so that a person can check them."""
    heads = list(known.heads.values())
    standoffs = ", ".join(dict.fromkeys(f"{head.standoff:g}" for head in heads))
    wavelengths = ", ".join(dict.fromkeys(f"{head.wavelength:g}" for head in heads))
    scales = ""
    if known.expansion is not None:
        numbers = dict.fromkeys(f"{1e6 * c:g}" for c in known.expansion.expansion.coefficient)
        scales = f", expansion of the scales {', '.join(numbers)} µm/(m·K)"
    return (
        f"check by hand, as no reading shows it: place of b in the chain {known.chain.name}, tool offset "
        f"{point_text(known.tool)}, standoff {standoffs} mm, wavelength {wavelengths} nm{scales}, and the index of air "
        "and the temperature that all distances were reduced with"
    )
