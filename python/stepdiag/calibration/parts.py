"""The parts of a calibration: all, to make another one of it, and those that it lacks."""

from collections.abc import Mapping
from typing import Any, Final

from stepdiag._core import Calibration
from stepdiag.parameters import AXES


def parts_of(calibration: Calibration) -> dict[str, Any]:
    """What the constructor takes to make this calibration again."""
    return {
        "method": calibration.method,
        "chain": calibration.chain,
        "volume": calibration.volume,
        "tool": calibration.tool,
        "functions": calibration.functions,
        "squareness": calibration.squareness,
        "undetermined_slopes": calibration.undetermined_slopes,
        "undetermined": calibration.undetermined,
        "covariance": calibration.covariance,
        "reversal": calibration.reversal,
        "reversal_negative_uncertainty": {
            name: calibration.negative_functions[name][2] for name in calibration.reversal
        },
        "undetermined_reversal_constants": calibration.undetermined_reversal_constants,
        "date": calibration.date,
        "fit": calibration.fit,
        "variance_factor": calibration.variance_factor,
        "fit_codes": calibration.fit_codes,
        "fit_reasons": calibration.fit_reasons,
        "unseen_faults": calibration.unseen_faults,
        "conditions": calibration.conditions,
        "budget": calibration.budget,
        "uncertainty_scaled": calibration.uncertainty_scaled,
        "between_nodes": calibration.between_nodes,
        "temperature_reference": calibration.temperature_reference,
        "temperature_as_found": calibration.temperature_as_found,
        "expansion": calibration.expansion,
        "fixed_point": calibration.fixed_point,
        "unverified": calibration.unverified,
        "provenance": calibration.provenance,
    }


# Of a squareness, the axis beside that of its name.
OTHER_AXIS: Final[Mapping[str, str]] = {"C0Y": "X", "B0Z": "X", "A0Z": "Y"}


def unmeasured_axes(calibration: Calibration) -> list[str]:
    """Axes of which a calibration has no function and no squareness."""
    return [
        axis
        for axis in AXES
        if not any(f"E{component}{axis}" in calibration.functions for component in "XYZABC")
        and not any(axis in (name[2], OTHER_AXIS[name]) for name in calibration.squareness)
    ]
