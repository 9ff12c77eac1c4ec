"""The object of `stepdiag check --json`."""

from collections.abc import Sequence
from pathlib import Path

from typing_extensions import TypedDict

from stepdiag._core import InvalidArgument
from stepdiag.presentation.file_check import Finding
from stepdiag.presentation.objects.calibration import Fit, fit_of
from stepdiag.presentation.objects.evaluation import NamedMistake, mistake_of
from stepdiag.presentation.objects.writer import Object, first_keys
from stepdiag.presentation.scenario_and_run import FoundTogether


class CheckedFile(TypedDict):
    file: str
    valid: bool
    error: str | None
    """Why it is not valid."""
    kind: str | None
    """scenario, head, study, measurement, calibration, error map, raw readings, compensation.ini; null: not valid"""
    summary: str | None
    warnings: list[str]
    fit: Fit | None
    """Of a calibration; null: another kind of file"""


class CheckedRun(TypedDict):
    """A measurement with the one scenario among the files."""

    run: str
    scenario: str
    valid: bool
    error: str | None
    """Why the two do not belong together."""
    fit: Fit | None
    """null: nothing was read yet, or not valid"""
    mistakes: list[NamedMistake]
    """Of which one would explain a run that could be adjusted; of one that is refused the error says it."""
    text: list[str]
    """What the report says."""


class CheckObject(Object):
    """Result of `stepdiag check`."""

    valid: bool
    """Whether all files are valid and belong together."""
    files: list[CheckedFile]
    runs: list[CheckedRun]


def check_object(
    files: Sequence[tuple[Path, Finding | InvalidArgument]],
    scenario: Path | None,
    runs: Sequence[tuple[Path, FoundTogether | InvalidArgument]],
    warnings: Sequence[str],
) -> CheckObject:
    """What a check found: of each file, and of each run with the scenario, or why it is refused."""
    checked = [_file(file, found) for file, found in files]
    with_scenario = [_run(run, str(scenario), found) for run, found in runs]
    return {
        **first_keys("check", warnings),
        "valid": all(one["valid"] for one in checked) and all(one["valid"] for one in with_scenario),
        "files": checked,
        "runs": with_scenario,
    }


def _file(file: Path, found: Finding | InvalidArgument) -> CheckedFile:
    if isinstance(found, InvalidArgument):
        return {
            "file": str(file),
            "valid": False,
            "error": str(found),
            "kind": None,
            "summary": None,
            "warnings": [],
            "fit": None,
        }
    return {
        "file": str(file),
        "valid": True,
        "error": None,
        "kind": found.kind,
        "summary": found.summary,
        "warnings": list(found.warnings),
        "fit": None if found.calibration is None else fit_of(found.calibration),
    }


def _run(run: Path, scenario: str, found: FoundTogether | InvalidArgument) -> CheckedRun:
    refused = isinstance(found, InvalidArgument)
    calibration = None if isinstance(found, InvalidArgument) else found.calibration
    return {
        "run": str(run),
        "scenario": scenario,
        "valid": not refused,
        "error": str(found) if refused else None,
        "fit": None if calibration is None else fit_of(calibration),
        "mistakes": [] if isinstance(found, InvalidArgument) else list(map(mistake_of, found.mistakes)),
        "text": [] if isinstance(found, InvalidArgument) else list(found.text),
    }
