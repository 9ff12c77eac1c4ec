"""Objects that commands print with --json, checked against their schema."""

from __future__ import annotations

import json
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from stepdiag.cli import main
from stepdiag.presentation.objects.schemas import schema_text


def checked(name: str, text: str) -> Any:
    """The object of one line of text. Fails if it does not fit the schema `name`."""
    assert text.endswith("\n")
    assert text.count("\n") == 1

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    found = json.loads(text, parse_constant=refuse)
    error = best_match(Draft202012Validator(json.loads(schema_text(name))).iter_errors(found))
    assert error is None, f"{error.json_path}: {error.message[:500]}"
    return found


def printed(name: str, capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> Any:
    """The object that the command prints, with this exit status; its warnings are those on standard error."""
    capsys.readouterr()
    ended = main([*arguments, "--json"])
    out, err = capsys.readouterr()
    assert ended == status, err
    found = checked(name, out)
    told = [line.removeprefix("warning: ") for line in err.splitlines() if line.startswith("warning: ")]
    assert told == found["warnings"]
    return found
