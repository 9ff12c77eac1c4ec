"""The largest values of a calibration, kind by kind: how far it is from a known truth, and how uncertain."""

from dataclasses import dataclass

import numpy as np

from stepdiag._core import Calibration, ErrorMap
from stepdiag.parameters import KINDS, Kind, kind_of


@dataclass(frozen=True)
class Deviation:
    """The largest difference calibration - truth of one kind (mm or rad), and where."""

    value: float
    parameter: str
    position: float | None  # mm; none for a squareness


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


def largest_values(calibration: Calibration) -> dict[Kind, tuple[float, str]]:
    """The largest value of each kind, mm or rad, and the parameter and place that has it."""
    return _largest(calibration, 0)


def largest_uncertainties(calibration: Calibration) -> dict[Kind, tuple[float, str]]:
    """The largest standard uncertainty of each kind, mm or rad, and the parameter and place that has it."""
    return _largest(calibration, 1)


def _largest(calibration: Calibration, column: int) -> dict[Kind, tuple[float, str]]:
    largest: dict[Kind, tuple[float, str]] = {}

    def note(name: str, size: float, where: str) -> None:
        kind = kind_of(name)
        if np.isfinite(size) and (kind not in largest or abs(size) > abs(largest[kind][0])):
            largest[kind] = size, f"{name}{where}"

    for name, (position, *columns) in calibration.functions.items():
        worst = int(np.argmax(np.abs(columns[column])))
        note(name, float(columns[column][worst]), f" at {position[worst]:g} mm")
    for name, pair in calibration.squareness.items():
        note(name, pair[column], "")
    return {kind: largest[kind] for kind in KINDS if kind in largest}
