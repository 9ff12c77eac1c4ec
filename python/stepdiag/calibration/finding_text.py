"""The core's findings in words: what the readings leave open (`Undetermined`, `KnownCombination`) and the verdict of a
fit (`FitReason`; docs/conventions.md, "Verdict of a fit"), faults of readings (`FaultClass`), and where an error map
breaks the frame choice or is implausible. All sentences about them are here."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from stepdiag._core import (
    Adjustment,
    Calibration,
    ErrorMap,
    Fault,
    FaultClass,
    FitReason,
    InvalidArgument,
    KnownCombination,
    PlausibleLimits,
    Undetermined,
)
from stepdiag.parameters import AXES, kind_of, units_of
from stepdiag.setup_quantities import SETUP_QUANTITIES, component_name, report_unit
from stepdiag.units import MICRO, MICRORADIAN, report_value

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

LARGEST_ANGLE: Final = 0.1  # rad: twenty times what is plausible

# By Undetermined.reasons(); empty where "undetermined" says it all.
REASONS: Final = {
    "not_seen": "",
    "not_moved": "no reading on a line that moves the axis to its end",
    "not_separated": "the readings do not distinguish them",
    "tool_rotations": "its line does not tell it from rotations that move the tool",
    "few_tilts": "with tilts",
    "few_lengths": "with distance, tilts and known angles",
    "few_diagonals": "among the body diagonals",
    "laser_angles": "readings were lost, and the laser angles of the lines that bridge them are not determined",
    "distances_alone": "the conventional evaluation uses distances only",
}
# By Undetermined.all_remedies().
REMEDIES: Final = {
    "axis_line": "add the line {line}",
    "scale_line": "add the scale line {line}",
    "scale_line_ends": "measure both ends of its scale line",
    "body_diagonals": "add body diagonals",
    "face_diagonals": "add the two face diagonals of its plane",
    "lines_to_the_end": "add such lines",
    "lines_there": "measure more lines that visit them",
    "lost_points": "measure the lost points again",
    "tilts": "read tilts too",
    "tilts_of_other_directions": "read tilts on lines of other directions",
    "other_directions": "add lines of other directions",
    "other_order": "add lines with another order of steps",
    "two_directions": "two lines of different direction are needed at every step",
    "three_directions": "three lines of different direction are needed at every step",
    "three_diagonals": "three body diagonals of different direction are needed at every step",
    "both_ways": "measure more lines forward and backward",
    "single_axes_both_ways": "only its change along the axis is known; measure single-axis lines forward and backward",
    "prior": "give a prior",
    "line_priors": "give priors to the line's set-up",
    "fixed": "take it as fixed",
    "scales": "make the scales known",
}
# By Calibration.provenance_keys().
PROVENANCE: Final = {
    "program": "made by",
    "run_sha256": "run, SHA-256",
    "scenario_sha256": "scenario, SHA-256",
    "heads_sha256": "heads, SHA-256",
    "options": "options",
}
# Unknowns of a set-up, by component.
SETUP: Final = {
    "reflector": ("reflector tilt about local x", "reflector tilt about local y"),
    "laser": ("laser tilt about local x", "laser tilt about local y"),
    "psd_zero": (
        "zero offset of the position sensing device along local x",
        "zero offset of the position sensing device along local y",
    ),
    "lateral": ("lateral beam offset along local x", "lateral beam offset along local y"),
    "roll": ("head roll",),
    "gain": ("tilt gain",),
}

# Of a calibration whose reasons are not at hand.
MEANING: Final = {
    "accepted": "the readings agree with each other and with the scenario",
    "doubtful": "the readings scatter more, less or otherwise than their stated uncertainties allow",
    "rejected": "the readings contradict each other or the scenario; do not use this calibration",
    "unchecked": "nothing controls the readings",
}

# Whether a calibration is valid, where nothing else is said; what the machine is against its limit is another question.
HEADLINE: Final = {
    "accepted": "valid: the readings agree",
    "doubtful": "DOUBTFUL: do not rely on the stated uncertainties",
    "rejected": "REJECTED: do not use it",
    "unchecked": "UNCHECKED: nothing controls the readings",
    None: "NOT KNOWN to be valid",
}

# By its reason.
UNCHECKED: Final = {
    "no_redundancy": "there are no more readings than unknowns, so that nothing controls them",
    "no_noise": "no noise: all readings agree to the rounding of their numbers, as those of a simulation without noise "
    "do; the uncertainties are of the stated noise",
}

UNVERIFIED: Final = (
    "unverified: a checksum was absent when this calibration was read; its values may have been changed since they "
    "were written"
)

# The better first.
FITS: Final = ("accepted", "unchecked", "doubtful", "rejected")
# Of calibrations by linear methods, whose uncertainties know of nothing else.
NOISE_ALONE: Final = {
    "conventional": "note: uncertainties are of noise alone: what rotations, laser and mirror do to distances is "
    "neither in them nor corrected",
    "enhanced": "note: uncertainties are of noise alone: what laser and mirror angles do at second order is "
    "neither in them nor corrected",
}
# Of what is accepted.
NOT_SEEN: Final = "note: a good fit does not prove that wavelength, temperature, tool offset and place of b are right"


def undetermined_text(finding: Undetermined) -> str:
    """What is open, why, and what would help; without a full stop."""
    remedies = ", or ".join(REMEDIES[remedy].format(line=finding.line) for remedy in finding.remedies)
    return f"{_what(finding)}: {'; '.join(filter(None, (_why(finding), remedies)))}"


def _what(finding: Undetermined) -> str:
    names = ", ".join(finding.parameters)
    match finding.part:
        case "slope":
            return f"{_slope(names)} ({names})" if kind_of(names) == "positioning" else _slope(names)
        case "positions":
            shown = [f"{position:g}" for position in finding.positions[:4]]
            count = len(finding.positions)
            return f"{names} at {count} of its positions ({', '.join(shown)}{', ...' if count > 4 else ''} mm)"
        case "reversal":
            return f"reversal of {names}"
        case "reversal_at_home":
            return f"reversal of {names} at home"
        case "setup":
            lines = [line + (f" (run {run})" if run else "") for run, line in finding.setups]
            return f"{_setup(finding.parameters[0], finding.component)} on {', '.join(lines)}"
        case _:
            return "rotations" if finding.reason == "distances_alone" else names


def _why(finding: Undetermined) -> str:
    why = REASONS[finding.reason]
    if not finding.step:
        return why
    read, planned = finding.lines_read, finding.lines_planned
    first, last = finding.positions
    lines = f"{read} line{'' if read == 1 else 's'}" + (f" of {planned}" if read < planned else "")
    return f"step {finding.step} of {finding.parameters[0][2]} ({first:g} to {last:g} mm) was read on {lines} {why}"


def _slope(parameter: str) -> str:
    return f"scale of {parameter[2]}" if kind_of(parameter) == "positioning" else f"slope of {parameter}"


def _setup(quantity: str, component: int) -> str:
    if quantity == "beam_constants":
        return f"constant of beam d{component + 1}"
    names = SETUP.get(quantity, (quantity.replace("_", " "),))
    return names[component]


def combination_text(known: KnownCombination, *, value: bool = True) -> str:
    """What is known of unknowns that are not determined one by one; without `value` its standard uncertainty alone."""
    if known.line:
        what = " - ".join(_setup(quantity, known.component) for _, quantity in known.terms)
        what += f" on {known.line}" + (f" (run {known.run})" if known.run else "")
    else:
        terms = (f"{'-' if weight < 0 else '+'} {abs(weight):.3g} {_slope(name)}" for weight, name in known.terms)
        what = " ".join(terms).removeprefix("+ ")
    unit = "µrad" if known.line else "µm/m"
    shown = f" = {known.value * MICRO:.4g} ±" if value else ", ±"
    return f"{what}{shown} {known.standard_uncertainty * MICRO:.4g} {unit}"


def frame_deviation_texts(errors: ErrorMap, volume: "npt.ArrayLike") -> Iterator[str]:
    """Where an error map breaks the frame choice."""
    for name, position, value in errors.frame_deviations(volume):
        shown, unit = report_value(units_of(name), value)
        place = "at home" if position == 0.0 else "at the end of travel"
        yield f"{name} is {shown:g} {unit} {place}, where the frame choice has 0; used as given"


def implausible_texts(
    errors: ErrorMap, volume: "Sequence[float] | npt.NDArray[np.float64]", limits: PlausibleLimits
) -> Iterator[str]:
    """What no machine has, by the limits for results: a sentence for each parameter that is beyond them."""
    edges = dict(zip(AXES, volume, strict=True))
    for name, (value, place) in _largest_values(errors):
        limit = limits.rotation if units_of(name) == "rad" else limits.translation
        if name[0] == "E" and name[1] == name[2]:
            limit = min(limit, limits.positioning * edges[name[2]])
        if abs(value) > limit:
            shown, unit = report_value(units_of(name), value)
            most, _ = report_value(units_of(name), limit)
            yield f"{name} is {shown:g} {unit}{place}, beyond what a machine can be ({most:g} {unit}); used as given"


def check_angles(errors: ErrorMap, where: str) -> None:
    """Raise InvalidArgument for angles that are none of a machine's: a wrong unit or a damaged number."""
    for name, (value, place) in _largest_values(errors):
        if units_of(name) == "rad" and abs(value) >= LARGEST_ANGLE:
            raise InvalidArgument(
                f"{where}: {name} is {value / MICRORADIAN:g} µrad{place}, expected less than {LARGEST_ANGLE:g} rad"
            )


def _largest_values(errors: ErrorMap) -> Iterator[tuple[str, tuple[float, str]]]:
    """Of each parameter the value that is furthest from 0, and where."""
    for name, angle in errors.squareness.items():
        yield name, (angle, "")
    for tables in (errors.functions, errors.negative_functions):
        for name, (position, value) in tables.items():
            k = int(abs(value).argmax())
            yield name, (float(value[k]), f" at {position[k]:g} mm")


def is_valid(calibration: Calibration) -> bool:
    """Whether a calibration is to be relied on without a word of warning."""
    return calibration.fit == "accepted" and not calibration.unverified


def headline(calibration: Calibration, which: str = "Calibration") -> str:
    """Whether a calibration is valid, in a few words for titles and printed pages."""
    if not calibration.unverified:
        return f"{which} {HEADLINE[calibration.fit]}"
    if calibration.fit == "accepted":
        return f"{which} UNVERIFIED: its values may have been changed"
    return f"{which} {HEADLINE[calibration.fit]}. Unverified"


def fit_row(calibration: Calibration) -> str:
    """What the file of a calibration says of its fit."""
    if calibration.fit is None:
        return "fit: not known"
    factor = calibration.variance_factor
    figures = "" if factor is None else f" (variance factor {factor:.3g})"
    return f"fit: {_shown(calibration.fit)}: {MEANING[calibration.fit]}{figures}"


def trust_rows(calibration: Calibration) -> list[str]:
    """The same, and whether the calibration is unverified."""
    return [fit_row(calibration), *([UNVERIFIED] if calibration.unverified else [])]


def unverified_key(calibration: Calibration) -> dict[str, str]:
    """The key of a file that says that its calibration is unverified."""
    key, text = UNVERIFIED.split(": ")
    return {key: text} if calibration.unverified else {}


def fit_rows(calibration: Calibration) -> Iterator[str]:
    """The same with the reasons of the fit, and what no verdict tells."""
    yield from trust_rows(calibration)
    yield from (f"{calibration.fit} because {reason}" for reason in calibration.fit_reasons)
    if calibration.uncertainty_scaled is not None:
        yield f"note: all standard uncertainties were multiplied by {calibration.uncertainty_scaled:.3g}"
    if calibration.method in NOISE_ALONE:
        yield NOISE_ALONE[calibration.method]
    if calibration.fit == "accepted":
        yield NOT_SEEN


def provenance_rows(calibration: Calibration) -> list[str]:
    """What a calibration was made from, as far as its file says."""
    made = calibration.provenance
    return [f"{words}: {made[key]}" for key, words in PROVENANCE.items() if key in made]


def verdict_rows(adjustment: Adjustment) -> Iterator[str]:
    """The verdict of an adjustment with its reasons, and what no verdict tells."""
    verdict = adjustment.verdict
    if verdict.fit == "unchecked":
        yield f"fit: unchecked: {UNCHECKED[verdict.reasons[0].finding]}"
        return
    reasons = reason_texts(verdict.reasons)
    is_noise = bool(verdict.reasons) and _is_noise_of_channel(verdict.reasons[0])
    said = reasons.pop(0) if verdict.fit == "doubtful" or is_noise else MEANING[verdict.fit]
    corrected = f"; {_corrected(adjustment)}" if verdict.fit == "accepted" and adjustment.faults else ""
    yield (
        f"fit: {_shown(verdict.fit)}{corrected}: {said} (variance factor {adjustment.variance_factor:.3g} with "
        f"{adjustment.degrees_of_freedom} degrees of freedom, {_probability(adjustment.chi_square_probability)})"
    )
    yield from (f"{verdict.fit} because {reason}" for reason in reasons)
    if any(component.used for component in adjustment.variance_components):
        yield (
            "note: the uncertainties are of this noise; if it is what these channels have, state it in [uncertainty]"
        )
    elif [reason.finding for reason in verdict.reasons] == ["misfit"]:
        yield (
            "remedy: no line, channel, time or position scatters unlike the others; if the noise is what it is, "
            "[adjustment] scale_uncertainty = true multiplies all uncertainties by "
            f"{verdict.reasons[0].value:.3g}"
        )
    if any(found.treatment == "estimated" for found in adjustment.faults) and verdict.fit == "rejected":
        yield "note: the values come from a fit in which the faults named below are unknowns; they rest on that"
    if verdict.fit == "accepted":
        yield NOT_SEEN


def reason_text(reason: FitReason) -> str:
    """One reason, without a full stop."""
    noise = f"{reason.value:.3g} ± {reason.standard_uncertainty:.1g} times"
    match reason.finding:
        case "noise_factor" if reason.channel:
            return f"noise: {_scatter(reason)} (at most {reason.limit:g} times is credible)"
        case "noise_factor":
            return (
                f"the readings scatter {reason.value:.3g} times as much as their stated uncertainties "
                f"(at most {reason.limit:g} times is credible)"
            )
        case "uneven_misfit":
            return (
                f"the readings do not scatter evenly: {_group(reason)} {reason.value:.3g} times as much as stated, the "
                f"others {reason.limit:.3g} times"
            )
        case "trend":
            return _trend(reason)
        case "prior" if reason.channel == "expansion":
            scales = "the scales" if reason.component < 0 else f"the scale of {'XYZ'[reason.component]}"
            return (
                f"the expansion coefficient of {scales} is {reason.value:.3g} standard uncertainties from what "
                f"[temperature] states (at most {reason.limit:g} is credible)"
            )
        case "prior" if reason.channel == "machine_drift":
            return (
                f"the drift of the functional point along {'XYZ'[reason.component]} is {reason.value:.3g} standard "
                f"uncertainties from what [adjustment] takes it for (at most {reason.limit:g} is credible)"
            )
        case "prior":
            name = f"{reason.channel.replace('_', ' ')}{_component(reason)}"
            return (
                f"{name} of line {reason.line} is {reason.value:.3g} standard uncertainties from what [adjustment] "
                f"takes it for (at most {reason.limit:g} is credible)"
            )
        case "prior_scatter":
            return _prior_scatter(reason)
        case "misfit" if reason.channel:
            return f"noise: {_scatter(reason)}"
        case "misfit" | "no_misfit":
            return f"the noise is about {noise} what is stated"
        case "scaled":
            return (
                f"all uncertainties were multiplied by {noise.removesuffix(' times')}, which the readings' scatter says"
            )
        case "fault":
            return (
                f"fault {reason.fault} ({reason.channel} on line {reason.line}) was found and not corrected "
                f"(it takes {reason.value:.3g} off chi-square; {reason.limit:g} and more is none by chance)"
            )
        case "alternatives":
            value, unit = report_value(units_of(reason.parameter), reason.value)
            limit, _ = report_value(units_of(reason.parameter), reason.limit)
            return (
                f"what fault {reason.fault} may be, and no reading tells, makes a difference of {value:.3g} {unit} in "
                f"{reason.parameter} ({limit:g} {unit} is plausible)"
            )
        case "fault_cost":
            return (
                f"what was left out or freed for faults makes {kind_of(reason.parameter)} ({reason.parameter}) "
                f"{reason.value:.3g} times as uncertain (at most {reason.limit:g} times is accepted)"
            )
        case "undetermined":
            return f"what was left out or freed for faults leaves {reason.parameter} undetermined, wholly or in part"
        case "mistake":
            return mistake_reason(reason.parameter)
        case "implausible_input":
            return reason.parameter
        case "no_noise":
            return UNCHECKED["no_noise"]
        case _:
            return "nothing controls the readings"


def mistake_reason(mistake: str) -> str:
    """Why a fit is rejected where a mistake was found; both without a full stop."""
    return f"a mistake explains the readings: {mistake}"


def fault_rows(faults: Sequence[FaultClass]) -> Iterator[str]:
    """Each class of faults, and what was done about it."""
    for number, found in enumerate(faults, 1):
        yield f"fault {number}: {fault_text(found)}"


def fault_text(found: FaultClass) -> str:
    """What may have happened, whether the readings tell which, and what was done about it; without a full stop."""
    shown = 4
    best, *others = found.members
    texts = [_fault(best), *map(_alternative, others[: shown - 1])]
    if len(others) >= shown:
        texts.append(f"one of {len(others) - shown + 1} more")
    return "; ".join(filter(None, (", or ".join(texts), _doubt(found), _treatment(found))))


def _fault(fault: Fault) -> str:
    is_angle = fault.channel in ("alpha", "beta")
    factor, unit = (MICRO, "µrad") if is_angle else (1e3, "µm")
    size = (
        f"{abs(fault.size) * factor:.4g} ± {fault.standard_uncertainty * factor:.2g} {unit} "
        f"too {'much' if fault.size > 0 else 'little'}"
    )
    run = f" (run {fault.run})" if fault.run else ""
    if fault.kind == "factor":
        return f"a factor on distances: {fault.channel} on {fault.line}{run} reads {size} where the line is farthest"
    if fault.kind == "slip":
        name = "an offset" if is_angle or fault.channel.startswith("spot") else "a slip of the fringe counter"
        return f"{name}: {fault.channel} on {fault.line}{run} reads {size} from point {fault.point} on"
    return f"a wrong reading: {fault.channel} of {fault.line} point {fault.point}{run} is {size}"


def _alternative(fault: Fault) -> str:
    is_angle = fault.channel in ("alpha", "beta")
    size = f"{fault.size * (MICRO if is_angle else 1e3):+.4g} {'µrad' if is_angle else 'µm'}"
    run = f" (run {fault.run})" if fault.run else ""
    where = {"slip": f" from point {fault.point} on", "factor": " growing along the line"}
    return f"{fault.channel} of {fault.line}{where.get(fault.kind, f' point {fault.point}')}{run} ({size})"


def _doubt(found: FaultClass) -> str:
    if found.told_apart:
        return ""
    return "the readings do not tell which (stepdiag observe says which plan would)"


def _treatment(found: FaultClass) -> str:
    match found.treatment:
        case "left_out":
            if found.told_apart:
                return "left out"
            if any(fault.kind == "slip" for fault in found.members):
                return "the single readings among these are left out, which removes the slips, too"
            return "all of these readings are left out"
        case "estimated" if found.told_apart:
            return "its size is an unknown of the adjustment"
        case "estimated":
            return "the size is shared, and the spread of the alternatives is in the uncertainty"
        case _:
            return "nothing was done about it"


def reason_texts(reasons: Sequence[FitReason]) -> list[str]:
    """The reasons of a verdict, a sentence each; trends that the readings do not distinguish share one."""
    texts: list[str] = []
    alternatives: dict[int, list[str]] = {}  # by the text that they belong to
    for reason in reasons:
        if reason.alternative and texts:
            size, unit = _size(reason, reason.value)
            alternatives.setdefault(len(texts) - 1, []).append(f"{_signal(reason)} ({size:+.3g} {unit})")
        else:
            texts.append(reason_text(reason))
    for place, others in alternatives.items():
        shown, more = others[:4], len(others) - 4
        texts[place] += f"; it may be {', '.join(shown)}{f' or one of {more} more' if more > 0 else ''} instead"
    return texts


def _group(reason: FitReason) -> str:
    """The readings that scatter unlike the others, with their verb."""
    match reason.aspect, reason.run >= 0:
        case "second_half", _:
            return "the second half of the run does"
        case "far_half", _:
            return "the far halves of the lines do"
        case _, True:
            return f"run {reason.run} does"
    channel = f"channel {reason.channel}" if reason.channel else ""
    return f"{' of '.join(filter(None, (channel, reason.line and f'line {reason.line}')))} does"


def _corrected(adjustment: Adjustment) -> str:
    """How many readings were left out and faults freed."""
    left_out, freed = len(adjustment.outliers), sum(found.treatment == "estimated" for found in adjustment.faults)
    texts = [f"{left_out} reading{'s' * (left_out != 1)} left out"] if left_out else []
    if freed:
        texts.append(f"{freed} fault{'s' * (freed != 1)} freed")
    return ", ".join(texts) or "a fault of readings"


def _is_noise_of_channel(reason: FitReason) -> bool:
    return reason.finding in ("noise_factor", "misfit") and bool(reason.channel)


def _scatter(reason: FitReason) -> str:
    where = f" on line {reason.line}" if reason.line else ""
    return (
        f"{reason.channel}{where} scatters {reason.value:.3g} ± {reason.standard_uncertainty:.2g} times as much as "
        "stated"
    )


def _signal(reason: FitReason) -> str:
    return f"{reason.channel} on {f'line {reason.line}' if reason.line else 'all lines'}"


def _size(reason: FitReason, size: float) -> tuple[float, str]:
    return report_value("rad" if reason.channel in ("alpha", "beta") else "mm", size)


def _trend(reason: FitReason) -> str:
    size, unit = _size(reason, reason.value)
    uncertainty, _ = _size(reason, reason.standard_uncertainty)
    return (
        f"{_signal(reason)} runs with {reason.aspect.replace('_', ' ')} by {size:+.3g} ± {uncertainty:.2g} {unit} from "
        "its first reading to its last, beyond what set-up and machine explain"
    )


def _prior_scatter(reason: FitReason) -> str:
    unit = report_unit(reason.channel)
    name = reason.channel.replace("_", " ")
    return (
        f"the {name} found is larger than its prior: about {reason.value / unit.native:.2g} {unit.name} by line, where "
        f"{SETUP_QUANTITIES[reason.channel].key} in [adjustment] is "
        f"{reason.limit / unit.native:.2g} {unit.name}"
    )


def _probability(probability: float) -> str:
    least = 1e-12
    return f"probability {probability:.2g}" if probability >= least else f"probability below {least:g}"


def _component(reason: FitReason) -> str:
    of = " of" if SETUP_QUANTITIES[reason.channel].of_beams else ""
    return f"{of} {component_name(reason.channel, reason.component)}".rstrip()


def _shown(fit: str) -> str:
    return fit.upper() if fit == "rejected" else fit
