"""Jobs for a controller in the loop: run a measuring program, then go to points."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from stepdiag import _core
from stepdiag.demo.loop_cases import CHAIN, RANGE
from stepdiag.instruments.instrument import PICOMETRES
from stepdiag.scenario.description import Scenario
from stepdiag.scenario.order_of_run import visits_of
from stepdiag.twin.instrument import TwinInstrument

FloatArray = npt.NDArray[np.float64]
PATIENCE: Final = 20.0  # s for one reading
Say = Callable[[str], None]
Temperature = tuple[float, float, float]  # of X, Y, Z, °C


@dataclass(frozen=True)
class Job:
    """One start of the controller."""

    scenario: Scenario  # of the machine that it moves
    program: Path  # the measuring program (nc)
    run: Path  # the measurement file to write
    points: FloatArray  # (n, 3) machine positions, mm
    table: Path | None = None  # the calibration that it compensates with
    temperature: Temperature | None = None  # of the scales, that it is told


class Controller(Protocol):
    """Executes a job: writes the run, and returns the axis positions at the points, (n, 3), mm."""

    name: str

    def do(self, job: Job, say: Say) -> FloatArray: ...


class Calculated:
    """The same compensator and instrument without a controller, program, sockets or clock."""

    name = "no controller (calculated)"

    def do(self, job: Job, say: Say) -> FloatArray:
        instrument = TwinInstrument(job.scenario)
        rows = []
        visits = list(visits_of(job.scenario.known))
        for visit in visits:
            for index, joints in enumerate(self._joints(job, visit.positions)):
                instrument.move_to(joints)
                if index == 0:
                    instrument.visit(visit.number)
                warnings, picometres = instrument.positions()
                rows.append(np.where(warnings, np.nan, np.array(picometres) / PICOMETRES))
        readings = np.array(rows)
        _core.Measurement(
            [visit.line for visit in visits for _ in visit.points],
            [int(point) for visit in visits for point in visit.points],
            np.concatenate([visit.positions for visit in visits]),
            {name: readings[:, i] for i, name in enumerate(job.scenario.known.signals)},
            run=[visit.run for visit in visits for _ in visit.points],
            direction=[visit.direction for visit in visits for _ in visit.points],
        ).write(job.run)
        return self._joints(job, job.points)

    def _joints(self, job: Job, targets: FloatArray) -> FloatArray:
        if job.table is None:
            return targets
        return compensator_of(job.table, job.scenario).command(targets, temperature=job.temperature)


def compensator_of(table: Path, scenario: Scenario) -> _core.Compensator:
    """The compensator with the calibration of a scenario's run."""
    with warnings.catch_warnings():
        if scenario.truth.noise.distance == 0.0:
            # Readings without noise scatter less than their stated uncertainties, which makes the fit doubtful.
            warnings.filterwarnings("ignore", message=".*fit that is doubtful")
        return _core.Compensator(table, CHAIN, temperatures=None if scenario.known.expansion is None else RANGE)


def add_temperatures(run: Path, scenario: Scenario) -> None:
    """Add what the sensors of the scales read to a complete run, if they expand.

    A file for `acquire` would have one row a second, for some fifty readings of this loop."""
    scales, seconds = scenario.truth.scales, scenario.known.keys.plan.seconds_per_reading
    if scales is None or seconds is None:
        return
    measured = _core.read_measurement(run)
    time = seconds * np.arange(len(measured.point))
    names = ["temperature"] if scales.one_sensor else ["temperature_x", "temperature_y", "temperature_z"]
    sensors = {name: scales.start[axis] + scales.rate[axis] * time for axis, name in enumerate(names)}
    _core.Measurement(
        measured.line,
        [int(point) for point in measured.point],
        measured.position,
        {**measured.channels, **sensors},
        run=[int(number) for number in measured.run],
        direction=measured.direction,
    ).write(run)
