"""What an uncertainty evaluation found: outputs with their propagation and their Monte Carlo result, side by side."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument
from stepdiag.config.key_errors import suggest
from stepdiag.parameters import KINDS, kind_of
from stepdiag.scenario.known import Known

FloatArray = npt.NDArray[np.float64]

FAMILIES: Final = (*KINDS, "derived")


@dataclass(frozen=True, eq=False)
class UncertaintyResult:
    """Of all outputs of a scenario's virtual calibrations, in their order: the entries of the calibration, then what
    is derived from it. Native units (mm, rad)."""

    known: Known
    method: str
    seed: int
    outputs: Sequence[Any]  # with name, position (NaN where it has none) and unit
    entries: int  # how many of them are the calibration's own
    coverage: float
    digits: int
    propagation: Any | None = None
    monte_carlo: Any | None = None
    comparison: Any | None = None
    volume: Any | None = None  # a VolumetricAccuracy

    @property
    def positions(self) -> FloatArray:
        return np.array([output.position for output in self.outputs])

    def families(self) -> Iterator[tuple[str, npt.NDArray[np.intp]]]:
        """Which outputs belong to each family; families without any are left out."""
        of = [kind_of(o.name) if k < self.entries else "derived" for k, o in enumerate(self.outputs)]
        for family in FAMILIES:
            members = np.flatnonzero([name == family for name in of])
            if len(members):
                yield family, members

    def uncertainties(self) -> FloatArray:
        """Those of the Monte Carlo method, or without one of the propagation."""
        source = self.propagation if self.monte_carlo is None else self.monte_carlo
        assert source is not None
        return np.asarray(source.standard_uncertainty)


def label(output: Any) -> str:
    """What reports call an output: "EXX at 800 mm", "C0Y"."""
    return str(output.name) if math.isnan(output.position) else f"{output.name} at {output.position:g} mm"


def find_output(outputs: Sequence[Any], text: str, option: str) -> int:
    """The output that a user means by "C0Y", "EXX@400" or the label of a derived quantity; of a function without a
    position that at its last node. Raises InvalidArgument."""
    name, at, place = text.partition("@")
    found = [k for k, output in enumerate(outputs) if output.name == name]
    if not found:
        known = list(dict.fromkeys(output.name for output in outputs))
        near = suggest(name, known)
        raise InvalidArgument(f"`{option}`: {text!r} is no output; {near if len(near) < 300 else near[:297] + '...'}")
    if not at:
        return found[-1]
    try:
        position = float(place)
    except ValueError:
        raise InvalidArgument(f"`{option}`: expected a position in mm after @, got {text!r}") from None
    nearest = min(found, key=lambda k: abs(outputs[k].position - position))
    if not abs(outputs[nearest].position - position) <= 1e-6 * max(1.0, abs(position)):
        nodes = outputs[nearest].position
        hint = "it has no position" if math.isnan(nodes) else f"the nearest node is at {nodes:g} mm"
        raise InvalidArgument(f"`{option}`: {text!r}: no node of {name}; {hint}")
    return nearest


def volume_units(name: str) -> str:
    """The native unit of one of the ranges over the volume."""
    return "rad" if name in ("V_A", "V_B", "V_C") else "mm"
