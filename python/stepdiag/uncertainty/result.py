"""Result of an uncertainty evaluation: outputs with their propagation and Monte Carlo results."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from stepdiag._core import InvalidArgument
from stepdiag.config.key_errors import suggest
from stepdiag.display import Displayed, Facts
from stepdiag.parameters import KINDS, kind_of
from stepdiag.scenario.known import Known
from stepdiag.style import drawn
from stepdiag.units import report_value

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FloatArray = npt.NDArray[np.float64]

UNCERTAINTY_FORMAT: Final = "stepdiag uncertainty 1"  # of files
FAMILIES: Final = (*KINDS, "derived")

# If a larger share of the samples has no result, the figures describe the others only.
LARGEST_LOST_SHARE: Final = 1e-3


def only_survivors(samples: int, lost: int) -> str | None:
    """What to say of figures from which too many samples without a result were left out; else None.

    `samples`: with a result. `lost`: without one."""
    if lost <= LARGEST_LOST_SHARE * (samples + lost):
        return None
    return (
        f"{lost:,} of {samples + lost:,} virtual calibrations gave no result: the Monte Carlo figures are those of "
        "the others, which may be the better ones"
    )


@dataclass(frozen=True, eq=False, repr=False)
class UncertaintyResult(Displayed):
    """Result for all outputs of a scenario's virtual calibrations, in native units (mm, rad).

    The outputs are the entries of the calibration, followed by derived quantities. All arrays have
    this order. Parts of the result that were not requested are None."""

    known: Known
    method: str
    seed: int
    outputs: Sequence[Any]  # with name, position (mm, or NaN) and unit
    entries: int  # number of outputs that are the calibration's entries
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
        """Names of the families and indices of their outputs; empty families are omitted."""
        of = [kind_of(o.name) if k < self.entries else "derived" for k, o in enumerate(self.outputs)]
        for family in FAMILIES:
            members = np.flatnonzero([name == family for name in of])
            if len(members):
                yield family, members

    @property
    def warning(self) -> str | None:
        """Why the result does not deserve trust; None if it does."""
        found = self.monte_carlo
        return None if found is None else only_survivors(found.samples, found.lost)

    def _facts(self) -> Facts:
        ways = {"propagation": self.propagation, "Monte Carlo": self.monte_carlo, "validation": self.comparison}
        u = self.uncertainties()
        facts = [("warning", self.warning)] if self.warning is not None else []
        facts += [
            ("method", self.method),
            ("by", ", ".join(name for name, found in ways.items() if found is not None)),
            ("outputs", str(len(self.outputs))),
        ]
        if self.monte_carlo is not None:
            facts.append(("virtual calibrations", f"{self.monte_carlo.samples:,} with a result, seed {self.seed}"))
        for family, members in self.families():
            if family != "derived":
                worst = int(members[np.argmax(u[members])])
                size, unit = report_value(self.outputs[worst].unit, float(u[worst]))
                place = "" if math.isnan(self.positions[worst]) else f" at {self.positions[worst]:g} mm"
                facts.append((f"largest u of {family}", f"{size:.3g} {unit} ({self.outputs[worst].name}{place})"))
        return [*facts, ("scenario", str(self.known.path))]

    def uncertainties(self) -> FloatArray:
        """Standard uncertainties by the Monte Carlo method if it was used, else by propagation."""
        source = self.propagation if self.monte_carlo is None else self.monte_carlo
        assert source is not None
        return np.asarray(source.standard_uncertainty)

    def plot(self) -> "Figure":
        """Draw the standard uncertainties of all parameters, and the budget as stacked bars (a matplotlib Figure)."""
        return drawn(self)


def label(output: Any) -> str:
    """Text for an output in reports: "EXX at 800 mm", "C0Y"."""
    return str(output.name) if math.isnan(output.position) else f"{output.name} at {output.position:g} mm"


def find_output(outputs: Sequence[Any], text: str, option: str) -> int:
    """Index of the output named "C0Y", "EXX@400" or by the label of a derived quantity.

    For a function without a position it is the output at the last node. Raises InvalidArgument
    naming `option`."""
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
