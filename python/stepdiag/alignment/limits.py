"""How well head and mirror have to be aligned: what the evaluation of the plan's run takes for granted."""

from dataclasses import dataclass
from typing import Final

from stepdiag.scenario.adjustment import scale_line_angle
from stepdiag.scenario.known import Known
from stepdiag.scenario.order_of_run import Visit
from stepdiag.setup_quantities import SETUP_QUANTITIES
from stepdiag.units import MICRORADIAN

FREE: Final = 1e-3  # rad, of angles that the evaluation finds: the beam stays on the mirror
FIXED: Final = 0.3e-3  # rad, of angles that it takes for 0
LEAST: Final = 0.1e-3  # rad; nobody turns a screw more finely


@dataclass(frozen=True)
class AlignmentLimits:
    """Largest angles of a line, rad."""

    laser: float
    reflector: float


def limits_of(known: Known, visit: Visit) -> AlignmentLimits:
    """The standard uncertainty with which the evaluation takes an angle for 0; else FREE or FIXED."""
    laser, reflector = (_limit(known, visit, name) for name in ("laser", "reflector"))
    return AlignmentLimits(laser, reflector)


def choice_of(known: Known, visit: Visit, quantity: str) -> str | float | None:
    """What `[adjustment]`, or the table of this line, says of a quantity; None: nothing."""
    keys, key = known.keys.adjustment, SETUP_QUANTITIES[quantity].key
    own = keys.by_line.get(visit.line)
    choice: str | float | None = None if own is None else getattr(own, key)
    return getattr(keys, key) if choice is None else choice


def _limit(known: Known, visit: Visit, quantity: str) -> float:
    keys = known.keys.adjustment
    if visit.is_scale_line:
        angle = scale_line_angle(keys, visit.line, quantity)
        return max(FIXED if angle == 0.0 else min(angle, FREE), LEAST)
    choice = choice_of(known, visit, quantity)
    if choice is None or choice == "free":
        return FREE
    return FIXED if choice == "fixed" else max(min(float(choice) * MICRORADIAN, FREE), LEAST)
