"""The reasons of a verdict (`FitReason`), in words."""

from collections.abc import Sequence
from typing import Final

from stepdiag._core import FitReason
from stepdiag.parameters import kind_of, units_of
from stepdiag.setup_quantities import SETUP_QUANTITIES, component_name, report_unit
from stepdiag.units import report_value

# By its reason.
UNCHECKED: Final = {
    "no_redundancy": "there are no more readings than unknowns, so that nothing controls them",
    "no_noise": "no noise: all readings agree to the rounding of their numbers, as those of a simulation without noise "
    "do; the uncertainties are of the stated noise",
}


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
                f"uncertainties from its prior in [adjustment] (at most {reason.limit:g} is credible)"
            )
        case "prior":
            name = f"{reason.channel.replace('_', ' ')}{_component(reason)}"
            return (
                f"{name} of line {reason.line} is {reason.value:.3g} standard uncertainties from its prior in "
                f"[adjustment] (at most {reason.limit:g} is credible)"
            )
        case "prior_scatter":
            return _prior_scatter(reason)
        case "misfit" if reason.channel:
            return f"noise: {_scatter(reason)}"
        case "misfit" | "no_misfit":
            return f"the noise is about {noise} the stated one"
        case "scaled":
            return (
                f"all uncertainties were multiplied by {noise.removesuffix(' times')}, to match the readings' scatter"
            )
        case "fault":
            return (
                f"fault {reason.fault} ({reason.channel} on line {reason.line}) was found and not corrected "
                f"(without it chi-square falls by {reason.value:.3g}; chance alone explains less than {reason.limit:g})"
            )
        case "alternatives":
            value, unit = report_value(units_of(reason.parameter), reason.value)
            limit, _ = report_value(units_of(reason.parameter), reason.limit)
            return (
                f"the readings do not distinguish the alternatives of fault {reason.fault}, which change "
                f"{reason.parameter} by {value:.3g} {unit} ({limit:g} {unit} is plausible)"
            )
        case "fault_cost":
            return (
                f"leaving out or freeing readings for faults makes {kind_of(reason.parameter)} ({reason.parameter}) "
                f"{reason.value:.3g} times as uncertain (at most {reason.limit:g} times is accepted)"
            )
        case "undetermined":
            return (
                f"leaving out or freeing readings for faults leaves {reason.parameter} undetermined, wholly or in part"
            )
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


def _component(reason: FitReason) -> str:
    of = " of" if SETUP_QUANTITIES[reason.channel].of_beams else ""
    return f"{of} {component_name(reason.channel, reason.component)}".rstrip()
