"""The object of `stepdiag selftest --json`."""

from collections.abc import Sequence
from typing import cast

from typing_extensions import TypedDict

from stepdiag.presentation.objects.writer import Object, first_keys
from stepdiag.presentation.quantity import Quantity, Unit, stated
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
    deviation: Quantity
    """The largest one; null: the case ended with an error"""
    allowed: Quantity
    passed: bool
    error: str | None


class SelftestObject(Object):
    """Result of `stepdiag selftest`."""

    passed: bool
    installation: TestedInstallation
    cases: list[TestedCase]


def selftest_object(found: SelfTest, warnings: Sequence[str]) -> SelftestObject:
    """What a self-test found."""
    tested = found.installation
    return {
        **first_keys("selftest", warnings),
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
                "deviation": stated(_unit(row.unit), row.deviation, reason=row.error or "not finite"),
                "allowed": stated(_unit(row.unit), row.allowed),
                "passed": row.passed,
                "error": row.error or None,
            }
            for row in found.rows
        ],
    }


def _unit(name: str) -> Unit:
    return "degC" if name == "°C" else cast(Unit, name)
