"""What tests expect where systems differ."""

import os
from pathlib import Path


def with_slashes(said: str) -> str:
    """What a command said, paths written as Linux has them."""
    return said.replace("\\", "/") if os.name == "nt" else said


def link_under(name: Path, target: Path) -> bool:
    """Make a symbolic link; whether there is one: Windows lets few people make them, and Wine says that it did."""
    try:
        name.symlink_to(target)
    except OSError:
        if os.name != "nt":
            raise
    return name.is_symlink()
