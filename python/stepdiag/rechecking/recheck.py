"""Has the machine changed since its calibration, by what, and what may have changed unseen."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag._core import Calibration, ChangesSeen, Measurement, Recheck
from stepdiag.calibration.volume import GRID, volume_grid
from stepdiag.rechecking.verification import with_stated_between_nodes
from stepdiag.scenario.description import Scenario, adjustment_options, reduced_run
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.known import Known
from stepdiag.units import MICROMETRE, MICRORADIAN
from stepdiag.wrong_arguments import checked

FloatArray = npt.NDArray[np.float64]

Verdict = Literal["unchanged", "changed", "unexplained"]

# Native values of a change in the unit of reports.
CHANGE_UNITS: Final = {
    "scale": ("µm/m", 1e-6),
    "bow": ("µm", MICROMETRE),
    "slope": ("µrad", MICRORADIAN),
    "squareness": ("µrad", MICRORADIAN),
}


@checked
def recheck(baseline: Calibration, scenario: Scenario | Known, measurement: Measurement) -> Recheck:
    """Test whether a machine has changed since its calibration, and estimate the change.

    The machine is the baseline plus a change with low-order terms (`[change]` of the scenario). Both
    and how head and mirror stand are estimated together.

    Args:
        baseline: the calibration, with covariance and all 21 parameters (`evaluate -o FILE.nc`).
        scenario: plan, head, uncertainties, `[temperature]` and `[change]` of the readings.
        measurement: readings of a short run. The baseline must not be made from them.

    Raises:
        InvalidArgument: the baseline cannot predict these readings, or they do not fit the plan.
    """
    return _core.recheck(*_arguments(baseline, scenario.known, measurement))


def changes_seen(baseline: Calibration, known: Known, measurement: Measurement) -> ChangesSeen:
    """Which changes `recheck` would see in runs of some of these lines: `measurement` has readings without noise of a
    machine as the baseline has it, each line once."""
    return _core.ChangesSeen(*_arguments(baseline, known, measurement))


def _arguments(baseline: Calibration, known: Known, measurement: Measurement) -> tuple[Any, ...]:
    return (
        with_stated_between_nodes(baseline, known),
        reduced_run(known, measurement),
        known.plan,
        of_run(known.heads),
        known.chain,
        known.tool,
        adjustment_options(known),
        known.change,
    )


@dataclass(frozen=True)
class Judged:
    """A recheck, and what follows from it at a probability `alpha` of a false alarm."""

    recheck: Recheck
    baseline: Calibration
    alpha: float

    @property
    def has_changed(self) -> bool:
        return self.recheck.probability < self.alpha

    @property
    def is_explained(self) -> bool:
        """Whether a change of low order explains the readings."""
        return self.recheck.fit_probability >= self.alpha

    @property
    def verdict(self) -> Verdict:
        """Unexplained: neither the baseline nor a change of low order explains the readings."""
        if not self.is_explained:
            return "unexplained"
        return "changed" if self.has_changed else "unchanged"

    @property
    def is_sound(self) -> bool:
        """Whether the baseline is as good as before, by readings that are all right."""
        return self.verdict == "unchanged" and not self.recheck.left_out

    @property
    def updated(self) -> Calibration:
        """The calibration with the change; rejected where no such change explains the readings."""
        updated = self.recheck.updated
        if self.is_explained:
            return updated
        reason = "recheck: no change of low order explains the readings"
        has_codes = len(updated.fit_codes) == len(updated.fit_reasons)  # a file of an older version has none
        codes = [*updated.fit_codes, "recheck_unexplained"] if has_codes else []
        return updated.judged("rejected", [*updated.fit_reasons, reason], codes)

    @cached_property
    def hidden(self) -> float:
        """What a change that the readings do not determine may move the tool by, mm: twice the standard
        deviation of the functional point at the worst point of the volume, with the priors."""
        return hidden_by(moves_by(self.baseline, self.recheck.shape), self.recheck.covariance)


def moves_by(baseline: Calibration, shape: FloatArray) -> FloatArray:
    """How the functional point moves at a grid in the volume by changes of the calibration's entries (entries, k):
    (points, 3, k), mm."""
    points = volume_grid([np.zeros(3), baseline.volume], GRID)
    moves = _core.error_changes_at(baseline, points, shape)
    return moves.reshape(len(points), 6, -1)[:, :3]


def hidden_by(moves: FloatArray, covariance: FloatArray) -> float:
    """Twice the standard deviation of the functional point where it is largest, mm, by a covariance (k, k) of the
    changes."""
    variances = ((moves @ covariance) * moves).sum(axis=(1, 2))
    return 2.0 * float(np.sqrt(variances.max()))
