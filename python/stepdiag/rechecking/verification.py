"""Readings against a calibration that was made without them."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag._core import Calibration, InvalidArgument, Machine, Measurement, Verification
from stepdiag.io.whole_files import read_bytes
from stepdiag.scenario.description import Scenario, adjustment_options, reduced_run
from stepdiag.scenario.heads import of_run
from stepdiag.scenario.known import Known
from stepdiag.wrong_arguments import checked

# A calibration that is right is refused by one test in a thousand.
ALPHA: Final = 0.001


@checked
def verify(
    calibration: Calibration,
    scenario: Scenario | Known,
    measurement: Measurement,
    *,
    sent: npt.ArrayLike | None = None,
) -> Verification:
    """Predict the readings of a scenario's run from a calibration, and judge the deviations.

    How head and mirror stood is estimated from the readings, with the priors of `[adjustment]`; the
    machine is not.

    Args:
        calibration: with covariance and all 21 parameters (`evaluate -o FILE.nc`); of the same
            chain, volume and tool. It must not be made from these readings.
        scenario: plan, head, uncertainties and `[temperature]` of the readings.
        measurement: the readings.
        sent: (n, 3), mm: of a run with a compensation in force, by row of the measurement, where its table sent
            the motors less the commanded position. The errors are taken at the commanded positions, from which
            they differ by a shift times a slope.

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
        sent=sent,
    )


_VERDICTS: Final = {
    "as it is": "the table is in force, with the right sign",
    "not": "the readings are those of the machine without the table",
    "turned": "the table acts with the wrong sign: take it away",
}


@dataclass(frozen=True)
class Compensated:
    """Chi-square of a run by a calibration, with a table in force as it is, without it, and with its sign turned."""

    with_it: float
    without: float
    turned: float
    degrees_of_freedom: int

    def sentence(self) -> str:
        figures = (
            f"chi-square with the table {self.with_it:.5g}, without it {self.without:.5g}, with its sign turned "
            f"{self.turned:.5g}, {self.degrees_of_freedom} degrees of freedom"
        )
        return f"{figures}: {_VERDICTS[self.acts]}"

    @property
    def acts(self) -> Literal["as it is", "not", "turned"]:
        """What the smallest of the three says."""
        if self.with_it <= min(self.without, self.turned):
            return "as it is"
        return "not" if self.without <= self.turned else "turned"


def verify_compensated(
    calibration: Calibration, scenario: Scenario | Known, measurement: Measurement, table: Machine
) -> tuple[Verification, Compensated]:
    """Verify with a run that was measured with a table in force.

    `table`: a machine that has the errors of the table, which a controller subtracts at the commanded position."""
    shift = np.zeros_like(measurement.position)
    approach = [_approach(*row) for row in zip(measurement.line, measurement.direction, strict=True)]
    for signs in set(approach):  # a table may have two directions of travel
        rows = [k for k, one in enumerate(approach) if one == signs]
        shift[rows] = -table.first_order_error(measurement.position[rows], signs)
    found = [verify(calibration, scenario, measurement, sent=factor * shift) for factor in (1.0, 0.0, -1.0)]
    sizes = [one.chi_square for one in found]
    return found[0], Compensated(sizes[0], sizes[1], sizes[2], found[0].degrees_of_freedom)


def _approach(line: str, direction: str) -> str:
    """The direction in which X, Y, Z come to the points of a line; an axis that stands counts as +."""
    forward = {"p": "+", "n": "-", "0": "+"}
    backward = {"p": "-", "n": "+", "0": "+"}
    return "".join((backward if direction == "backward" else forward)[letter] for letter in line)


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
