"""Readings against a calibration that was made without them."""

import hashlib
from pathlib import Path
from typing import Final

from stepdiag import _core
from stepdiag._core import Calibration, InvalidArgument, Measurement, Verification
from stepdiag.io.whole_files import read_bytes
from stepdiag.scenario.description import Scenario, adjustment_options, reduced_run
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.known import Known
from stepdiag.wrong_arguments import checked

# A calibration that is right is refused by one test in a thousand.
ALPHA: Final = 0.001


@checked
def verify(calibration: Calibration, scenario: Scenario | Known, measurement: Measurement) -> Verification:
    """Predict the readings of a scenario's run from a calibration, and judge the deviations.

    How head and mirror stood is estimated from the readings, with the priors of `[adjustment]`; the
    machine is not.

    Args:
        calibration: with covariance and all 21 parameters (`evaluate -o FILE.nc`); of the same
            chain, volume and tool. It must not be made from these readings.
        scenario: plan, head, uncertainties and `[temperature]` of the readings.
        measurement: the readings.

    Raises:
        InvalidArgument: the calibration cannot predict these readings, or they do not fit the plan.
    """
    known = scenario.known
    return _core.verify(
        with_stated_between_nodes(calibration, known),
        reduced_run(known, measurement),
        known.plan,
        of_run(known.heads),
        known.chain,
        known.tool,
        adjustment_options(known),
    )


def with_stated_between_nodes(calibration: Calibration, known: Known) -> Calibration:
    """With the scenario's uncertainty of what lies between the nodes, where the calibration states none."""
    stated = known.between_nodes
    return calibration.with_between_nodes(stated) if calibration.between_nodes is None else calibration


def check_other_run(calibration: Calibration, run: Path) -> None:
    """Raise InvalidArgument if the calibration was made from this very run."""
    if run.is_file() and calibration.provenance.get("run_sha256") == hashlib.sha256(read_bytes(run)).hexdigest():
        raise InvalidArgument(
            f"{run}: the calibration was made from this run, so that it agrees with it in any case; "
            "verify it with other readings"
        )
