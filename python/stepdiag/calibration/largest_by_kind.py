"""How far a calibration is from a known truth, kind by kind."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from stepdiag._core import Calibration, ErrorMap

Kind = Literal["positioning", "straightness", "angle", "squareness"]
KINDS: Final[tuple[Kind, ...]] = ("positioning", "straightness", "angle", "squareness")


@dataclass(frozen=True)
class Deviation:
    """The largest difference calibration - truth of one kind (mm or rad), and where."""

    value: float
    parameter: str
    position: float | None  # mm; none for a squareness


def kind_of(parameter: str) -> Kind:
    """The kind of a parameter by its name, EXX ... ECZ or C0Y, B0Z, A0Z."""
    if parameter[0] != "E":
        return "squareness"
    if parameter[1] in "ABC":
        return "angle"
    return "positioning" if parameter[1] == parameter[2] else "straightness"


def units_of(parameter: str) -> str:
    """The native unit of a parameter."""
    return "rad" if kind_of(parameter) in ("angle", "squareness") else "mm"


def largest_deviations(calibration: Calibration, truth: ErrorMap) -> dict[Kind, Deviation]:
    """Largest deviations of a calibration from the truth, at the calibration's nodes.

    A kind of which nothing is determined is absent; so are functions whose slope is not determined."""
    largest: dict[Kind, Deviation] = {}

    def note(parameter: str, value: float, position: float | None) -> None:
        kind = kind_of(parameter)
        if kind not in largest or abs(value) > abs(largest[kind].value):
            largest[kind] = Deviation(value, parameter, position)

    for name, (position, value, _) in calibration.functions.items():
        if name in calibration.undetermined_slopes:
            continue
        difference = value - truth.function(name, position)
        worst = int(np.argmax(np.abs(difference)))
        note(name, float(difference[worst]), float(position[worst]))
    for name, (angle, _) in calibration.squareness.items():
        note(name, angle - truth.squareness.get(name, 0.0), None)
    return {kind: largest[kind] for kind in KINDS if kind in largest}
