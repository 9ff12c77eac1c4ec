"""Whether a scenario and a measurement belong together."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepdiag._core import Adjustment, Calibration, InvalidArgument, Measurement, check_points
from stepdiag.evaluation.judge import judge
from stepdiag.findings.mistakes import FoundMistake, change_rows, mistake_text
from stepdiag.findings.verdict import verdict_words
from stepdiag.io.data_files import read_measurement
from stepdiag.presentation.blocks import text_of
from stepdiag.presentation.fit import fit_blocks
from stepdiag.scenario.description import read_scenario
from stepdiag.scenario.known import Known
from stepdiag.scenario.planned_readings import lost_readings


@dataclass(frozen=True)
class FoundTogether:
    """What a scenario and a measurement say together; no calibration of a sheet without readings."""

    text: tuple[str, ...]
    calibration: Calibration | None = None
    mistakes: tuple[FoundMistake, ...] = ()

    unverified = False  # it comes from readings

    @property
    def fit(self) -> str | None:
        """Verdict of the adjustment."""
        return None if self.calibration is None else self.calibration.fit


def adjust_run(scenario_file: Path, run_file: Path) -> FoundTogether:
    """Adjusts a run with a scenario.

    Raises InvalidArgument naming both files where they do not belong together."""
    known, run = read_scenario(scenario_file).known, read_measurement(run_file)
    try:
        if any(np.isfinite(run.channels[name]).any() for name in known.signals if name in run.channels):
            return _adjusted(known, run)
        check_points(run, known.plan)
    except InvalidArgument as error:
        raise InvalidArgument(f"{run_file}: does not belong to {scenario_file}: {error}") from None
    return FoundTogether(("the points are those of the plan; there are no readings of this head yet",))


def _adjusted(known: Known, run: Measurement) -> FoundTogether:
    found = judge(known, run)
    assert found.adjustment is not None  # as the method is the adjustment
    text = tuple(_said(known, run, found.adjustment, found.mistakes))
    return FoundTogether(text, found.calibration, found.mistakes)


def _said(known: Known, run: Measurement, adjustment: Adjustment, mistakes: Sequence[FoundMistake]) -> Iterator[str]:
    incomplete, missing = lost_readings(run, known.plan, known.signals)
    yield f"{len(run)} rows, {incomplete} without a complete reading; {missing} points of the plan without a row"
    yield from text_of(fit_blocks(verdict_words(adjustment)))
    if mistakes and adjustment.verdict.fit == "accepted":  # by its faults, which were corrected
        yield f"note: {mistake_text(mistakes)}"
    yield from map(": ".join, change_rows(mistakes))
