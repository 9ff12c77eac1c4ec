"""What all objects share: their first keys, and the text of an object."""

import json
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from typing_extensions import TypedDict

from stepdiag._core import __version__
from stepdiag.presentation.blocks import BlockObject


class Format(TypedDict):
    name: str
    """stepdiag and what it is of, such as "stepdiag evaluation"."""
    version: Literal[2]


class Object(TypedDict):
    """The keys that every object has."""

    stepdiag: str
    """Version of the program"""
    format: Format
    warnings: list[str]


class Reported(Object):
    """The keys of an object whose command has a report."""

    report: list[BlockObject]
    """What the command says without --json, in blocks."""


def first_keys(name: str, warnings: Sequence[str]) -> Object:
    """These keys of an object with this name."""
    return {
        "stepdiag": __version__,
        "format": {"name": f"stepdiag {name}", "version": 2},
        "warnings": list(warnings),
    }


def json_text(content: Mapping[str, Any]) -> str:
    """The object as one line of ASCII; numbers are read back to the same bits. Raises ValueError for NaN and inf."""
    return json.dumps(content, allow_nan=False)
