"""A sound scenario, changed in one place, and what is said of it."""

from __future__ import annotations

import stepdiag as sd
from stepdiag.scenario.description import parse_scenario

GOOD = """
[volume]
x_mm = 800.0
y_mm = 600.0
z_mm = 500.0
[machine]
chain = "[w X' b Y Z t]"
tool_mm = [1.0, 2.0, 3.0]
[machine.random]
seed = 7
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
steps = 50
scale_lines = ["p00", "0p0"]
[head]
layout = "ideal"
[misalignment]
reflector_urad = [100.0, 300.0]
psd_zero_mm = [1.5, 2.0]
[misalignment.npp]
laser_urad = [700, 1000]
[misalignment.p00]
laser_urad = [10.0, 20.0]
[noise]
distance_um = 0.2
seed = 1
"""


def changed(old: str, new: str) -> str:
    assert GOOD.count(old) == 1
    return GOOD.replace(old, new)


def refusal(text: str) -> str:
    """What is said about a scenario that is refused; nothing about a sound one. Other exceptions pass through."""
    try:
        parse_scenario(text, "s.toml")
    except sd.InvalidArgument as error:
        return str(error)
    return ""
