"""The largest values of a calibration, kind by kind: how far it is from a known truth, and how uncertain."""

from dataclasses import dataclass

import numpy as np

from stepdiag._core import Calibration, ErrorMap
from stepdiag.parameters import KINDS, Kind, kind_of
from stepdiag.wrong_arguments import checked


@dataclass(frozen=True)
class Deviation:
    """The largest difference calibration - truth of one kind (mm or rad), and where."""

    value: float
    parameter: str
    position: float | None  # mm; none for a squareness


@checked
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


@dataclass(frozen=True)
class LargestEntry:
    """The entry of a calibration with the largest value, or standard uncertainty, of its kind; mm or rad."""

    parameter: str
    position: float | None  # mm; none for a squareness
    value: float
    standard_uncertainty: float  # NaN where it is not known

    @property
    def place(self) -> str:
        return self.parameter if self.position is None else f"{self.parameter} at {self.position:g} mm"


def largest_entries(calibration: Calibration, *, uncertainty: bool = False) -> dict[Kind, LargestEntry]:
    """The entry of each kind with the largest value, or with the largest standard uncertainty.

    A kind of which no such number is known is absent."""
    largest: dict[Kind, LargestEntry] = {}
    sizes: dict[Kind, float] = {}

    def note(entry: LargestEntry) -> None:
        kind = kind_of(entry.parameter)
        size = abs(entry.standard_uncertainty if uncertainty else entry.value)
        if np.isfinite(size) and (kind not in sizes or size > sizes[kind]):
            largest[kind], sizes[kind] = entry, size

    for name, (position, value, u) in calibration.functions.items():
        known = np.abs(u if uncertainty else value)
        k = int(np.argmax(np.where(np.isnan(known), -1.0, known)))
        note(LargestEntry(name, float(position[k]), float(value[k]), float(u[k])))
    for name, (angle, u_angle) in calibration.squareness.items():
        note(LargestEntry(name, None, angle, u_angle))
    return {kind: largest[kind] for kind in KINDS if kind in largest}


@checked
def largest_uncertainties(calibration: Calibration) -> dict[Kind, tuple[float, str]]:
    """The largest standard uncertainty of each kind, mm or rad, and the parameter and place that has it."""
    entries = largest_entries(calibration, uncertainty=True)
    return {kind: (entry.standard_uncertainty, entry.place) for kind, entry in entries.items()}
