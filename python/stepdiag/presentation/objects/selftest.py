"""The object of `stepdiag selftest --json`."""

from collections.abc import Sequence
from typing import Literal

from typing_extensions import TypedDict

from stepdiag.presentation.objects.writer import number
from stepdiag.selftest.table import SelfTest


class TestedInstallation(TypedDict):
    sha256: str
    """Of the names and contents of all files of the package but byte code"""
    instruction_set: str
    python: str
    numpy: str
    system: str
    date: str
    """ISO 8601, UTC"""


class TestedCase(TypedDict):
    case: str
    compared: str
    truth: str
    """Where it comes from"""
    deviation: float | None
    """The largest one, in `unit`; null: the case ended with an error"""
    allowed: float
    unit: str
    """mm, rad, nm, °C; 1: a number"""
    passed: bool
    error: str | None


class SelftestObject(TypedDict):
    """Result of `stepdiag selftest`."""

    stepdiag: str
    format: Literal["stepdiag selftest 1"]
    warnings: list[str]
    passed: bool
    installation: TestedInstallation
    cases: list[TestedCase]


def selftest_object(found: SelfTest, warnings: Sequence[str]) -> SelftestObject:
    """What a self-test found."""
    tested = found.installation
    return {
        "stepdiag": tested.stepdiag,
        "format": "stepdiag selftest 1",
        "warnings": list(warnings),
        "passed": found.passed,
        "installation": {
            "sha256": tested.sha256,
            "instruction_set": tested.instruction_set,
            "python": tested.python,
            "numpy": tested.numpy,
            "system": tested.system,
            "date": tested.date,
        },
        "cases": [
            {
                "case": row.case,
                "compared": row.compared,
                "truth": row.source,
                "deviation": None if row.deviation is None else number(row.deviation),
                "allowed": row.allowed,
                "unit": row.unit,
                "passed": row.passed,
                "error": row.error or None,
            }
            for row in found.rows
        ],
    }
