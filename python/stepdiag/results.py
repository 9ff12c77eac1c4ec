"""Classes of what functions return, for annotations: nobody constructs them."""

from stepdiag._core import (
    CalibrationEntry,
    DiagonalErrors,
    DriftEstimate,
    ExpansionEstimate,
    Fault,
    FaultClass,
    FaultControl,
    FitReason,
    KnownCombination,
    LineDeviation,
    Outlier,
    ReadingNoise,
    Recheck,
    RoundedChannel,
    SetupEstimate,
    Undetermined,
    VarianceComponent,
    Verdict,
    Verification,
)
from stepdiag.calibration.comparison import Comparison, Difference
from stepdiag.calibration.largest_by_kind import Deviation
from stepdiag.calibration.truth import TruthAgreement
from stepdiag.calibration.volume import PointErrors, VolumeContribution, VolumeErrors, VolumeFigure
from stepdiag.calibration.volume_change import FigureChange, ParameterEffect, VolumeChange
from stepdiag.evaluation.judge import Judgement
from stepdiag.findings.mistakes import FoundMistake
from stepdiag.scenario.known import Known
from stepdiag.scenario.truth import Truth

__all__ = [
    "CalibrationEntry",
    "Comparison",
    "Deviation",
    "DiagonalErrors",
    "Difference",
    "DriftEstimate",
    "ExpansionEstimate",
    "Fault",
    "FaultClass",
    "FaultControl",
    "FigureChange",
    "FitReason",
    "FoundMistake",
    "Judgement",
    "Known",
    "KnownCombination",
    "LineDeviation",
    "Outlier",
    "ParameterEffect",
    "PointErrors",
    "ReadingNoise",
    "Recheck",
    "RoundedChannel",
    "SetupEstimate",
    "Truth",
    "TruthAgreement",
    "Undetermined",
    "VarianceComponent",
    "Verdict",
    "Verification",
    "VolumeChange",
    "VolumeContribution",
    "VolumeErrors",
    "VolumeFigure",
]


def __dir__() -> list[str]:
    return __all__
