"""The message of a refusal (`InvalidArgument`), in words."""

from typing import Any

from stepdiag._core import InvalidArgument
from stepdiag.findings.undetermined import undetermined_text


def refusal_text(error: InvalidArgument) -> str:
    """The message of an error. That of readings that determine nothing has a finding, which says why."""
    message = str(error.args[0]) if error.args else ""
    finding = getattr(error, "finding", None)
    return message if finding is None else f"{message}. {undetermined_text(finding)}"


def _reduced_error(error: InvalidArgument) -> tuple[type[InvalidArgument], tuple[str]]:
    return InvalidArgument, (refusal_text(error),)  # a finding cannot be pickled


def attach() -> None:
    """The message of InvalidArgument in words; called when stepdiag is imported."""
    words: Any = {"__str__": refusal_text, "__reduce__": _reduced_error}
    for name, method in words.items():
        setattr(InvalidArgument, name, method)
