"""Uncertainty before measuring: virtual calibrations, propagation (GUM), Monte Carlo (JCGM 101), studies on workers."""

from stepdiag._core import (
    BatchEvaluator,
    Distribution,
    FunctionModel,
    MonteCarloResult,
    Propagation,
    RangeModel,
    SampleModel,
    StatisticsOptions,
    UncertainInput,
    UncertainInputs,
    Validation,
    VirtualCalibrations,
    VirtualReadout,
    compare,
    derived_at_point,
    derived_on_diagonals,
    propagate,
    propagate_linear,
    with_covariance,
)
from stepdiag.progress import Progress
from stepdiag.uncertainty.dask_workers import workers_of
from stepdiag.uncertainty.model_source import ModelSource
from stepdiag.uncertainty.monte_carlo import run_monte_carlo
from stepdiag.uncertainty.result import UncertaintyResult
from stepdiag.uncertainty.run import UncertaintyRequest, evaluate_uncertainty
from stepdiag.uncertainty.study import FinishedCells, run_study
from stepdiag.uncertainty.study_keys import read_study
from stepdiag.uncertainty.study_table import study_table
from stepdiag.uncertainty.table import uncertainty_table

__all__ = [
    "BatchEvaluator",
    "Distribution",
    "FinishedCells",
    "FunctionModel",
    "ModelSource",
    "MonteCarloResult",
    "Progress",
    "Propagation",
    "RangeModel",
    "SampleModel",
    "StatisticsOptions",
    "UncertainInput",
    "UncertainInputs",
    "UncertaintyRequest",
    "UncertaintyResult",
    "Validation",
    "VirtualCalibrations",
    "VirtualReadout",
    "compare",
    "derived_at_point",
    "derived_on_diagonals",
    "evaluate_uncertainty",
    "propagate",
    "propagate_linear",
    "read_study",
    "run_monte_carlo",
    "run_study",
    "study_table",
    "uncertainty_table",
    "with_covariance",
    "workers_of",
]


def __dir__() -> list[str]:
    return __all__
