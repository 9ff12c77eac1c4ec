"""Fields of option classes that say what they mean, from which the command line makes its options."""

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any


def option(
    default: Any,
    meaning: str,
    *,
    name: str | None = None,
    least: float | None = None,
    above: float | None = None,
    words: Mapping[str, Any] | None = None,
    factor: float = 1.0,
    metavar: str | None = None,
    parse: Callable[[str], Any] | None = None,
) -> Any:
    """A field of a dataclass with a default that is an option of a command, too.

    `name`: of the option, if it is another than the field's. `least`, `above`: the range of a number. `words`: what the
    option's words mean. `factor`: of the field's unit in the option's. `parse`: from the option's text."""
    more = {"name": name, "least": least, "above": above, "words": words, "factor": factor}
    return field(default=default, metadata={"meaning": meaning, "metavar": metavar, "parse": parse, **more})
