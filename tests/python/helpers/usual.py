"""The volume, chain and lines that most tests measure, a small volume where only files matter, and all there are."""

from itertools import permutations

import stepdiag as sd

VOLUME = (800.0, 600.0, 500.0)
SMALL_VOLUME = (80.0, 60.0, 50.0)
CHAIN = "[w X' b Y Z t]"
DIAGONALS = ["ppp", "npp", "pnp", "nnp"]
FACES = ["pp0", "np0", "p0p", "n0p", "0pp", "0np"]
SCALE_LINES = ["p00", "0p0", "00p"]

ALL_LINES = [a + b + c for a in "pn0" for b in "pn0" for c in "pn0" if a + b + c != "000"]
ORDERS = ["".join(order) for order in permutations("XYZ")]
# The six orders of the axes, with the bed at each of its four places.
ALL_CHAINS = [
    f"[w {' '.join([*(axis + chr(39) for axis in order[:bed]), 'b', *order[bed:]])} t]"
    for order in ORDERS
    for bed in range(4)
]


def small_plan(steps: int = 5) -> sd.Plan:
    return sd.Plan(SMALL_VOLUME, DIAGONALS, steps, scale_lines=SCALE_LINES)
