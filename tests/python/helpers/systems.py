"""What tests expect where systems differ."""

import os


def with_slashes(said: str) -> str:
    """What a command said, paths written as Linux has them."""
    return said.replace("\\", "/") if os.name == "nt" else said
