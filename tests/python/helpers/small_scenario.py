"""A small scenario that reads no other file."""

from __future__ import annotations

import one_thread  # noqa: F401 (for what its import does)

SCENARIO = """
[volume]
x_mm = 80.0
y_mm = 60.0
z_mm = 50.0
[machine]
chain = "[w X' b Y Z t]"
[machine.random]
seed = 7
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
steps = 5
scale_lines = ["p00", "0p0", "00p"]
[head]
layout = "ideal"
[misalignment]
reflector_urad = [100.0, 300.0]
[noise]
distance_um = 0.1
seed = 3
"""


def of_map(path: str) -> str:
    """The scenario with an error map in place of the random one."""
    return SCENARIO.replace("[machine.random]\nseed = 7", f'errors = "{path}"')
