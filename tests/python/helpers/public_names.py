"""Every public name, of the package and of its modules for specialists: `simulate`, `optics.trace_beams`."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType

import one_thread  # noqa: F401 (for what its import does)

import stepdiag as sd


def public_names() -> Iterator[str]:
    for name in sd.__all__:
        value = getattr(sd, name)
        if isinstance(value, ModuleType):
            yield from (f"{name}.{inside}" for inside in value.__all__)
        elif name != "__version__":
            yield name
