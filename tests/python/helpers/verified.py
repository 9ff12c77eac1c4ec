"""A calibration, and a run of two of its lines in larger steps that verifies it."""

from __future__ import annotations

MACHINE = """
[volume]
x_mm = 400.0
y_mm = 300.0
z_mm = 250.0

[machine]
chain = "[w X' b Y Z t]"

[machine.random]
seed = 5
intervals = 6

[head]
layout = "ideal"

[noise]
distance_um = 0.2
tilt_urad = 1.0
seed = {seed}

[uncertainty]
distance_um = 0.2
tilt_urad = 1.0

[adjustment]
lateral_mm = "fixed"
roll_urad = "fixed"
gain = "fixed"
"""
CALIBRATED = (
    MACHINE.format(seed=1)
    + """
[plan]
lines = ["ppp", "npp", "pnp", "nnp"]
steps = 6
scale_lines = ["p00", "0p0", "00p"]
"""
)
TESTED = MACHINE.format(seed=2) + '[plan]\nlines = ["ppp", "nnp"]\nsteps = 3\n'
