"""To which point straightness refers, and what it is at the functional point.

A table's straightness is the displacement of the origin of its axis' own frame (docs/conventions.md). While axis a
moves alone, with the others at home, the functional point's error is to first order

    e = delta_a + theta_a x L_a,   L_a = tool offset, plus p along a where a carries the workpiece.

Its straightness is that of the table plus the two components of theta_a x L_a: EYX + p ECX and EZX - p EBX for an X
that carries the workpiece, if the tool offset is 0. Squareness terms are not in it, nor in the table's.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from stepdiag._core import Calibration, straightness_reference
from stepdiag.calibration.table_sums import FloatArray, TableValues, Term
from stepdiag.wrong_arguments import checked

__all__ = ["functional_point_straightness", "straightness_reference"]

# (theta x L) along X is B L_Z - C L_Y, and so on: rotation, lever, sign.
_CROSS_PRODUCT: Final[Mapping[str, tuple[tuple[str, str, float], ...]]] = {
    "X": (("B", "Z", 1.0), ("C", "Y", -1.0)),
    "Y": (("C", "X", 1.0), ("A", "Z", -1.0)),
    "Z": (("A", "Y", 1.0), ("B", "X", -1.0)),
}


@checked
def functional_point_straightness(
    calibration: Calibration,
) -> dict[str, tuple[FloatArray, FloatArray, FloatArray]]:
    """Straightness of the functional point where it is not the table's.

    name -> (position, value, standard uncertainty), mm, at the nodes of the table. Of axes that carry the workpiece,
    and of all where the tool has an offset. Absent where a rotation that it needs is not determined. The covariance of
    straightness and rotations counts where the calibration has a full covariance; else they are taken as independent.
    """
    tables = TableValues(calibration)
    found = {}
    for axis in "XYZ":
        for component in "XYZ".replace(axis, ""):
            name = f"E{component}{axis}"
            if name not in tables.functions:
                continue
            position = tables.functions[name][0]
            levers = list(_lever_terms(calibration, component, axis, position))
            needed = {term.function for term in levers}
            if levers and needed <= tables.functions.keys() - set(calibration.undetermined_slopes):
                found[name] = (position, *tables.sum([Term(name, position, np.ones_like(position)), *levers]))
    return found


def _lever_terms(calibration: Calibration, component: str, axis: str, position: FloatArray) -> list[Term]:
    """What theta_a x L_a adds to a straightness; lever arms of 0 left out."""
    terms = []
    for rotation, lever, sign in _CROSS_PRODUCT[component]:
        arm = np.full_like(position, calibration.tool["XYZ".index(lever)])
        if lever == axis and calibration.chain.carries_workpiece(axis):
            arm = arm + position
        if np.any(arm):
            terms.append(Term(f"E{rotation}{axis}", position, sign * arm))
    return terms
