"""What a report is made from: read, and checked to belong together."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from stepdiag._core import Calibration, InvalidArgument, Measurement
from stepdiag.calibration.comparison import Comparison, compare
from stepdiag.calibration.volume_change import VolumeChange, volume_change
from stepdiag.evaluation.judge import Judgement, judge
from stepdiag.findings.mistakes import FoundMistake
from stepdiag.io.adjustment_read import FitDetails, details_of, read_fit_details
from stepdiag.io.data_files import date_of_today, read_calibration, read_measurement
from stepdiag.io.whole_files import check_input, read_bytes
from stepdiag.parameters import in_report_units, kind_of, units_of
from stepdiag.platform import command_line
from stepdiag.presentation.page.budget import Budget, read_budget
from stepdiag.presentation.page.header import ReportHeader, header_of
from stepdiag.scenario.description import read_scenario
from stepdiag.scenario.known import Known
from stepdiag.scenario.provenance import provenance_of
from stepdiag.units import REPORT_UNITS

# By how much two evaluations of one run may differ: other processors sum in another order. mm or rad.
SAME_VALUE: Final = 1e-9


@dataclass(frozen=True)
class ReportRequest:
    """The files of a report, and what its header says. `before`: an earlier calibration of the machine."""

    calibration: Path
    before: Path | None = None
    scenario: Path | None = None
    run: Path | None = None
    uncertainty: Path | None = None
    limit: float | None = None  # of the largest error, mm
    words: Mapping[str, str | None] = field(default_factory=dict)
    logo: Path | None = None
    language: str = "en"

    def command(self, output: Path) -> str:
        """The command that makes this report, with names of files alone."""
        options = {"scenario": self.scenario, "run": self.run, "uncertainty": self.uncertainty, "logo": self.logo}
        words = ["stepdiag", "report", *(path.name for path in (self.before, self.calibration) if path is not None)]
        for name, path in options.items():
            words += [] if path is None else [f"--{name}", path.name]
        words += [] if self.limit is None else ["--limit", f"{self.limit * 1e3:.15g}"]
        for name, text in self.words.items():
            words += [] if text is None else [f"--{name.replace('_', '-')}", text]
        words += [] if self.language == "en" else ["--language", self.language]
        return command_line([*words, "-o", output.name])

    @property
    def inputs(self) -> list[Path]:
        """The files that are read."""
        paths = (self.calibration, self.before, self.scenario, self.run, self.uncertainty, self.logo)
        return [path for path in paths if path is not None]


@dataclass(frozen=True, eq=False)
class Contents:
    """A calibration and all that stands beside it; what was not given is None. `notes`: what does not quite fit."""

    request: ReportRequest
    header: ReportHeader
    date: str
    calibration: Calibration
    details: FitDetails | None
    before: Calibration | None
    comparison: Comparison | None
    change: VolumeChange | None
    known: Known | None
    measurement: Measurement | None
    budget: Budget | None
    notes: tuple[str, ...]
    mistakes: tuple[FoundMistake, ...] = ()  # of which one would explain a fit that is not accepted

    @property
    def lines(self) -> list[str]:
        """The measured lines in their order, as far as they are known."""
        if self.known is not None:
            return [*self.known.plan.lines, *self.known.plan.scale_lines]
        if self.measurement is not None:
            return list(dict.fromkeys(self.measurement.line))
        return [] if self.details is None else list(dict.fromkeys(self.details.line))


def read_contents(request: ReportRequest) -> Contents:
    """Read the files of a report.

    Raises InvalidArgument for files that are not sound, or do not belong together."""
    for path in request.inputs:
        check_input(path)
    calibration = read_calibration(request.calibration)
    details, adjustment = read_fit_details(request.calibration), None
    known = None if request.scenario is None else read_scenario(request.scenario).known
    measurement = None if request.run is None else read_measurement(request.run)
    notes: list[str] = []
    if known is not None:
        _check_machine(request, calibration, known)
    _check_fingerprints(request, calibration, known, notes)
    mistakes: tuple[FoundMistake, ...] = ()
    if known is not None and measurement is not None:
        is_again = details is None and calibration.method == "adjustment"
        if is_again or calibration.fit in ("doubtful", "rejected"):
            judged = _judged(request, calibration, known, measurement)
            mistakes = judged.mistakes if calibration.fit in ("doubtful", "rejected") else ()
            if is_again and judged.adjustment is not None:
                adjustment = judged.adjustment
                _check_values(request, calibration, adjustment.calibration)
                details = details_of(adjustment, measurement)
    if adjustment is not None:
        notes.append("Residuals and set-up were computed again from scenario and run; the values are the file's.")
    before = comparison = None
    if request.before is not None:
        before = read_calibration(request.before)
        try:
            comparison = compare(before, calibration)
        except InvalidArgument as error:
            raise InvalidArgument(f"{request.before}, {request.calibration}: {error}") from None
    folder = Path() if request.scenario is None else request.scenario.parent
    return Contents(
        request=request,
        header=header_of(None if known is None else known.keys.report, folder, request.words, request.logo),
        date=date_of_today(),
        calibration=calibration,
        details=details,
        before=before,
        comparison=comparison,
        change=None if comparison is None else volume_change(comparison),
        known=known,
        measurement=measurement,
        budget=None if request.uncertainty is None else read_budget(request.uncertainty, calibration),
        notes=tuple(notes),
        mistakes=mistakes,
    )


def _judged(request: ReportRequest, calibration: Calibration, known: Known, measurement: Measurement) -> Judgement:
    """The evaluation once more, with what would explain that it is not accepted."""
    try:
        match calibration.method:
            case "enhanced" | "conventional" as method:
                return judge(known, measurement, method=method)
            case _:
                return judge(known, measurement)
    except InvalidArgument as error:
        raise InvalidArgument(f"{request.run}: does not belong to {request.scenario}: {error}") from None


def _check_machine(request: ReportRequest, calibration: Calibration, known: Known) -> None:
    """A scenario of another machine is a mistake."""
    if known.chain != calibration.chain:
        raise InvalidArgument(
            f"{request.scenario}: does not belong to {request.calibration}: its chain is {known.chain}, the "
            f"calibration's {calibration.chain}"
        )
    for name, own, other in (
        ("volume", known.plan.volume, calibration.volume),
        ("tool offset", known.tool, calibration.tool),
    ):
        if not np.allclose(own, other, rtol=0.0, atol=1e-6):
            mine, theirs = (" ".join(f"{length:g}" for length in lengths) for lengths in (own, other))
            raise InvalidArgument(
                f"{request.scenario}: does not belong to {request.calibration}: its {name} is {mine} mm, the "
                f"calibration's {theirs} mm"
            )


def _check_fingerprints(
    request: ReportRequest, calibration: Calibration, known: Known | None, notes: list[str]
) -> None:
    """The run must be the one that was evaluated; a scenario may have got a header since, which is noted."""
    made = calibration.provenance
    if request.run is not None:
        own = hashlib.sha256(read_bytes(request.run)).hexdigest()
        if "run_sha256" not in made:
            notes.append(f"{request.calibration.name} does not say which run it was made from.")
        elif own != made["run_sha256"]:
            raise InvalidArgument(
                f"{request.run}: is not the run of {request.calibration}: its SHA-256 is {own}, the calibration was "
                f"made from {made['run_sha256']}"
            )
    if known is not None:
        own_prints = provenance_of(known, request.run or known.path)
        if "scenario_sha256" not in made:
            notes.append(f"{request.calibration.name} does not say which scenario it was made with.")
        elif own_prints["scenario_sha256"] != made["scenario_sha256"]:
            notes.append(
                f"{known.path.name} has changed since the evaluation (another SHA-256). The header and the measured "
                "lines of this report are from the file as it is now; the values are those of the evaluation."
            )
        if own_prints.get("heads_sha256", "") != made.get("heads_sha256", "") and "scenario_sha256" in made:
            notes.append("The description of a head has changed since the evaluation (another SHA-256).")


def _check_values(request: ReportRequest, calibration: Calibration, again: Calibration) -> None:
    """The same evaluation once more must give the file's values."""
    if (
        again.functions.keys() != calibration.functions.keys()
        or again.squareness.keys() != calibration.squareness.keys()
    ):
        raise InvalidArgument(
            f"{request.scenario}: evaluating {request.run} with it does not determine what {request.calibration} has"
        )
    for name, (position, value, _) in calibration.functions.items():
        there, found, _ = again.functions[name]
        alike = len(there) == len(position) and bool(np.allclose(there, position, rtol=0.0, atol=1e-6))
        if not alike or np.max(np.abs(found - value), initial=0.0) > SAME_VALUE:
            _refuse(request, name, float("inf") if not alike else float(np.max(np.abs(found - value))))
    for name, (angle, _) in calibration.squareness.items():
        if abs(again.squareness[name][0] - angle) > SAME_VALUE:
            _refuse(request, name, abs(again.squareness[name][0] - angle))


def _refuse(request: ReportRequest, name: str, difference: float) -> None:
    how = "has other positions"
    if np.isfinite(difference):
        how = f"differs by up to {in_report_units(kind_of(name), difference):.3g} {REPORT_UNITS[units_of(name)][0]}"
    raise InvalidArgument(
        f"{request.scenario}: evaluating {request.run} with it does not give {request.calibration}: {name} {how}"
    )
