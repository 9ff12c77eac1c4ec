"""A machine with 21 errors of some tens of µm and µrad, its table, and points to send it to."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from stepdiag import ErrorMap, Expansion

CHAIN = "[w X' b Y Z t]"
VOLUME = (400.0, 300.0, 200.0)
TOOL = (12.0, -7.0, -150.0)
MODULE = Path("/usr/lib/linuxcnc/modules/stepdiagkins.so")
KINS = "stepdiagkins."
# Of its scales, and the leading lines of a table that is referred with it.
EXPANSION = Expansion((1.15e-5, 2.38e-5, -3e-6), fixed_point=(150.0, -40.5, 200.0), reference=20.0)
EXPANSION_LINES = (
    "# temperature_reference_c=20\n# expansion_per_k=1.15e-05 2.38e-05 -3e-06\n# fixed_point_mm=150 -40.5 200\n"
)

Points = npt.NDArray[np.float64]


def make_errors(seed: int = 5, scale: float = 1.0) -> ErrorMap:
    random = np.random.default_rng(seed)
    functions = {}
    for axis, edge in zip("XYZ", VOLUME, strict=True):
        positions = np.linspace(0.0, edge, 9)
        for kind in ("EX", "EY", "EZ", "EA", "EB", "EC"):
            values = random.normal(0.0, scale * (10e-3 if kind[1] in "XYZ" else 30e-6), 9)
            values[0] = 0.0
            if kind[1] in "XYZ" and kind[1] != axis:
                values[-1] = 0.0
            functions[kind + axis] = (positions, values)
    return ErrorMap(functions, {name: scale * random.normal(0.0, 40e-6) for name in ("C0Y", "B0Z", "A0Z")})


def random_points(count: int, seed: int = 1, edge: float = 0.5) -> Points:
    """Inside the volume, `edge` mm away from its faces: so that joints, too, are inside."""
    low, high = np.full(3, edge), np.array(VOLUME) - edge
    return np.random.default_rng(seed).uniform(low, high, (count, 3))


def distances(points: npt.ArrayLike) -> Points:
    return np.asarray(np.linalg.norm(np.atleast_2d(points), axis=1))
