"""For those who have values instead of a scenario: the evaluations themselves, their options and parts.

They search for faults of readings, but not for mistakes in the whole run; `stepdiag.judge` does.
"""

from stepdiag._core import (
    AdjustmentOptions,
    ChangePriors,
    KnownExpansion,
    PlausibleLimits,
    ReadingUncertainty,
    SetupPriors,
    Smoothness,
    diagonal_errors,
    recheck,
    verify,
)
from stepdiag.calibration.evaluations import adjust, evaluate
from stepdiag.calibration.functional_point import functional_point_straightness
from stepdiag.calibration.volume import volume_grid
from stepdiag.planning.observation import extents
from stepdiag.scenario.description import adjust_scenario, evaluate_scenario
from stepdiag.scenario.provenance import provenance_of

__all__ = [
    "AdjustmentOptions",
    "ChangePriors",
    "KnownExpansion",
    "PlausibleLimits",
    "ReadingUncertainty",
    "SetupPriors",
    "Smoothness",
    "adjust",
    "adjust_scenario",
    "diagonal_errors",
    "evaluate",
    "evaluate_scenario",
    "extents",
    "functional_point_straightness",
    "provenance_of",
    "recheck",
    "verify",
    "volume_grid",
]


def __dir__() -> list[str]:
    return __all__
