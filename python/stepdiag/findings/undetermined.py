"""What the readings leave open (`Undetermined`, `KnownCombination`), in words."""

from typing import Final

from stepdiag._core import KnownCombination, Undetermined
from stepdiag.parameters import kind_of
from stepdiag.units import MICRO

# By Undetermined.reasons(); empty where "undetermined" says it all.
REASONS: Final = {
    "not_seen": "",
    "not_moved": "no reading on a line that moves the axis to its end",
    "not_separated": "the readings do not distinguish them",
    "tool_rotations": "its line does not separate it from rotations that move the tool",
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
