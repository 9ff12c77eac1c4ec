"""Has the machine changed since its calibration, by what, and what may have changed unseen."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stepdiag import _core
from stepdiag._core import Calibration, Measurement, Recheck
from stepdiag.calibration.volume import errors_at_points, volume_grid
from stepdiag.scenario.description import Scenario, adjustment_options, reduced_run
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.known import Known

GRID = 5  # positions an axis, of the low-order changes in the volume


def recheck_scenario(baseline: Calibration, scenario: Scenario | Known, measurement: Measurement) -> Recheck:
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
    known = scenario.known
    return _core.recheck(
        baseline,
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
    def updated(self) -> Calibration:
        """The calibration with the change; rejected where no such change explains the readings."""
        updated = self.recheck.updated
        if self.is_explained:
            return updated
        reason = "recheck: no change of low order explains the readings"
        return updated.judged("rejected", [*updated.fit_reasons, reason])

    @cached_property
    def hidden(self) -> float:
        """What a change that the readings do not tell may move the tool by, mm: twice the standard
        deviation of the functional point at the worst point of the volume, with the priors."""
        baseline = self.baseline
        labels = baseline.covariance_labels
        basis = np.zeros((len(labels), len(self.recheck.terms)))
        for k, term in enumerate(self.recheck.terms):
            travel = baseline.volume["XYZ".index(term.parameter[2])] if term.kind != "squareness" else 1.0
            for row, (parameter, position) in enumerate(labels):
                if parameter != term.parameter:
                    continue
                share = 0.0 if position is None else position / travel
                basis[row, k] = {
                    "scale": share * travel,
                    "bow": 4.0 * share * (1.0 - share),
                    "slope": share,
                    "squareness": 1.0,
                }[term.kind]
        changed = _core.with_covariance(baseline, basis @ self.recheck.covariance @ basis.T)
        points = errors_at_points(changed, volume_grid(np.stack([np.zeros(3), baseline.volume]), GRID))
        assert points.error_uncertainty is not None
        return 2.0 * float(np.sqrt((points.error_uncertainty**2).sum(axis=1)).max())
