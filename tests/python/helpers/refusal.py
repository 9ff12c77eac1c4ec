"""How tests say that bad input is refused: an InvalidArgument, which is a ValueError, that names the culprit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import stepdiag as sd


def refused(call: Callable[..., Any], *arguments: Any, names: str, **options: Any) -> None:
    with pytest.raises(sd.InvalidArgument) as refusal:
        call(*arguments, **options)
    assert isinstance(refusal.value, ValueError)
    assert names in str(refusal.value), f"{refusal.value} does not name {names}"
