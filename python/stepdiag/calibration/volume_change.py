"""What the difference of two calibrations means in the volume: the error of the tool before and after."""

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from stepdiag._core import Calibration, ErrorMap, Machine
from stepdiag.calibration.comparison import Comparison, Difference
from stepdiag.calibration.table_sums import FloatArray
from stepdiag.calibration.volume import Interval, VolumeErrors, volume, without_between_nodes
from stepdiag.display import Displayed, Facts
from stepdiag.wrong_arguments import checked

ChangeVerdict = Literal["improved", "worse", "undecided"]
# Positions an axis, besides the nodes: the trapezoidal rule is then good to 1 % of the rms between rough nodes.
_GRID: Final = 21


@dataclass(frozen=True)
class FigureChange:
    """A figure of A and of B, mm, and B - A with its 95 % interval; NaN and None where it is not known."""

    a: float
    b: float
    a_interval: Interval | None
    b_interval: Interval | None
    interval: Interval | None
    verdict: ChangeVerdict | None

    @property
    def change(self) -> float:
        """B - A, mm."""
        return self.b - self.a


@dataclass(frozen=True)
class ParameterEffect:
    """The error of the tool in the volume (mm) that the difference of one parameter makes alone."""

    parameter: str
    largest: float
    rms: float
    significant: bool


@dataclass(frozen=True, eq=False, repr=False)
class VolumeChange(Displayed):
    """The error of the tool over the volume by A and by B, and which differences make it."""

    tool: FloatArray  # (3,) mm: that of A, for both
    a: VolumeErrors
    b: VolumeErrors
    largest: FigureChange
    rms: FigureChange
    effects: tuple[ParameterEffect, ...]  # the largest first; 0 left out
    no_verdict_because: str  # empty where there are verdicts

    def _facts(self) -> Facts:
        facts = []
        for name, figure in (("largest", self.largest), ("rms", self.rms)):
            verdict = f", {figure.verdict}" if figure.verdict else ""
            facts.append((name, f"{figure.a * 1e3:.4g} to {figure.b * 1e3:.4g} µm{verdict}"))
        facts += [("no verdict because", self.no_verdict_because)] if self.no_verdict_because else []
        return [
            *facts,
            *((f"effect of {effect.parameter}", f"{effect.largest * 1e3:.4g} µm") for effect in self.effects),
        ]


@checked
def volume_change(comparison: Comparison) -> VolumeChange:
    """Compute the largest error and the rms over the volume by A and by B, with verdicts and the parameters' effects.

    Both with the tool offset of A. What lies between the nodes is left out of the intervals of `largest`: it is much
    the same before and after. The interval of B - A follows from those of A and B, taken as independent (method of
    variance estimates recovery, Zou and Donner 2008): value -/+ sqrt(of the squared distances to the ends of the
    intervals that make it smaller/larger). The verdict is "improved" or "worse" where that interval excludes 0. There
    is none without covariances, for evaluations of the same run, and against an error map."""
    one, other = comparison.a, comparison.b
    a, b = (volume(each, tool=one.tool, ranking=False) for each in (one, other))
    reason = _no_verdict(comparison, a, b)
    known_a, known_b = (without_between_nodes(each).largest_interval for each in (a, b))
    return VolumeChange(
        one.tool,
        a,
        b,
        _change(a.largest, b.largest, known_a, known_b, reason),
        _change(a.rms, b.rms, a.rms_interval, b.rms_interval, reason),
        _effects(comparison),
        reason,
    )


def _no_verdict(comparison: Comparison, a: VolumeErrors, b: VolumeErrors) -> str:
    if comparison.agreement is not None:
        return "one of the two is an error map"
    run = comparison.a.provenance.get("run_sha256")
    if run is not None and run == comparison.b.provenance.get("run_sha256"):
        return "A and B are evaluations of the same run"
    for which, errors in (("A", a), ("B", b)):
        if errors.missing:
            names = sorted({name for missing in errors.missing.values() for name in missing})
            return f"{which} does not determine {', '.join(names)}"
    without = [which for which, one in (("A", comparison.a), ("B", comparison.b)) if one.covariance is None]
    return f"no covariance of {' and '.join(without)} (write it as .nc)" if without else ""


def difference_interval(a: float, b: float, of_a: Interval, of_b: Interval) -> Interval:
    """Interval of b - a from the intervals of independent a and b, of the same coverage."""
    low = b - a - math.hypot(b - of_b[0], of_a[1] - a)
    high = b - a + math.hypot(of_b[1] - b, a - of_a[0])
    return low, high


def _change(a: float, b: float, of_a: Interval | None, of_b: Interval | None, reason: str) -> FigureChange:
    if reason or of_a is None or of_b is None:
        return FigureChange(a, b, of_a, of_b, None, None)
    interval = difference_interval(a, b, of_a, of_b)
    verdict: ChangeVerdict = "undecided"
    if interval[1] < 0.0:
        verdict = "improved"
    elif interval[0] > 0.0:
        verdict = "worse"
    return FigureChange(a, b, of_a, of_b, interval, verdict)


def _effects(comparison: Comparison) -> tuple[ParameterEffect, ...]:
    a = comparison.a
    effects = []
    for difference in comparison.differences:
        if difference.parameter.endswith("_reversal"):
            continue  # the errors are those of positions approached in + direction
        found = volume(_machine_of(difference, a), box=[np.zeros(3), a.volume], grid=_GRID, ranking=False)
        if found.largest > 0.0:
            effects.append(
                ParameterEffect(difference.parameter, found.largest, found.rms, comparison.is_significant(difference))
            )
    return tuple(sorted(effects, key=lambda effect: -effect.largest))


def _machine_of(difference: Difference, a: Calibration) -> Machine:
    """A machine whose only error is the difference of one parameter."""
    name, value = difference.parameter, difference.value
    if np.isnan(difference.position[0]):
        return Machine(a.chain, ErrorMap({}, {name: float(value[0])}), a.tool)
    return Machine(a.chain, ErrorMap({name: (difference.position, value)}), a.tool)
