"""Calibration of three-axis machine tools by the laser step-diagonal method.

    import stepdiag as sd

    machine = sd.Machine("[w X' b Y Z t]", sd.random_error_map((800, 600, 500), seed=1))
    plan = sd.Plan((800, 600, 500), ["ppp", "npp", "pnp", "nnp"], 50, scale_lines=["p00", "0p0", "00p"])
    run = sd.simulate(machine, plan, sd.Head())
    calibration = sd.evaluate(run, plan, sd.Head(), machine.chain)

Lengths are in mm, angles in rad, wavelengths in nm. Invalid arguments and files raise
InvalidArgument, a ValueError.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from stepdiag._core import (
    Adjustment,
    AdjustmentOptions,
    BatchEvaluator,
    BeamSegment,
    BeamSpot,
    Calibration,
    CalibrationEntry,
    Camera,
    Chain,
    ChangePriors,
    CheckPoints,
    Compensator,
    DiagonalErrors,
    Distribution,
    DriftEstimate,
    Environment,
    ErrorAtPoint,
    ErrorMap,
    Expansion,
    ExpansionEstimate,
    Fault,
    FaultClass,
    FaultControl,
    FitReason,
    FunctionModel,
    GaussianMode,
    Head,
    HeadBeam,
    HeadBody,
    HeadCalibration,
    HeadDesign,
    Interferometer,
    InvalidArgument,
    KnownCombination,
    KnownExpansion,
    LateralEffect,
    LineDeviation,
    Machine,
    MachineDrift,
    Measurement,
    Misalignment,
    MonteCarloResult,
    Noise,
    Outlier,
    Plan,
    PlausibleLimits,
    Propagation,
    RangeModel,
    ReadingNoise,
    ReadingUncertainty,
    Recheck,
    ReplayMismatch,
    ReturnedBeam,
    RoundedChannel,
    SampleModel,
    ScaleTemperatures,
    Sensitivity,
    SetupEstimate,
    SetupPriors,
    SimulationOptions,
    Smoothness,
    SpotSensor,
    StatisticsOptions,
    UncertainInput,
    UncertainInputs,
    Undetermined,
    Validation,
    VarianceComponent,
    Verdict,
    Verification,
    VirtualCalibrations,
    VirtualReadout,
    VolumetricAccuracy,
    __version__,
    adjust,
    beam_radius,
    compare,
    couple,
    cramer_rao_bound,
    derived_at_point,
    derived_on_diagonals,
    diagonal_errors,
    error_at_point,
    evaluate,
    expose,
    head_sensitivities,
    locate,
    power_inside,
    propagate,
    propagate_linear,
    random_error_map,
    read_distance,
    read_error_map,
    read_head,
    recheck,
    simulate,
    trace_beams,
    verify,
    volumetric_accuracy,
    with_covariance,
    word_findings_with,
    word_reasons_with,
    word_unseen_faults_with,
)
from stepdiag.calibration.finding_text import reason_texts, undetermined_text
from stepdiag.calibration.unseen_text import unseen_texts
from stepdiag.figures import methods
from stepdiag.io import displays, to_xarray

if TYPE_CHECKING:
    from stepdiag.acquisition.acquire import acquire
    from stepdiag.acquisition.options import AcquireOptions
    from stepdiag.acquisition.settle_trigger import SettleTrigger
    from stepdiag.acquisition.settling import Settling
    from stepdiag.acquisition.tcp_trigger import TcpTrigger
    from stepdiag.acquisition.triggers import KeyTrigger
    from stepdiag.calibration.comparison import Comparison, Difference, compare_calibrations
    from stepdiag.calibration.functional_point import functional_point_straightness
    from stepdiag.calibration.largest_by_kind import Deviation, largest_deviations, largest_uncertainties
    from stepdiag.calibration.truth import TruthAgreement
    from stepdiag.calibration.volume import (
        PointErrors,
        VolumeContribution,
        VolumeErrors,
        VolumeFigure,
        errors_at_points,
        volume_errors,
        volume_grid,
    )
    from stepdiag.calibration.volume_change import FigureChange, ParameterEffect, VolumeChange, volume_change
    from stepdiag.evaluation.judge import Judgement, judge
    from stepdiag.export.common import ExportOptions
    from stepdiag.export.write import export_calibration
    from stepdiag.head.description import parse_head_design, read_head_design, shipped_head
    from stepdiag.io.data_files import read_calibration, read_measurement, write_calibration, write_measurement
    from stepdiag.linuxcnc.processes import LinuxcncError
    from stepdiag.linuxcnc.session import LinuxcncSession
    from stepdiag.mistakes.search import FoundMistake, find_mistakes
    from stepdiag.parameters import in_report_units, kind_of
    from stepdiag.planning.observation import extents, observe
    from stepdiag.positions.evaluation import MeasuredPositions, evaluate_positions
    from stepdiag.positions.figures import PositionFigure
    from stepdiag.positions.prediction import PredictedPositions, axis_line, diagonal_line, predict_positions
    from stepdiag.positions.readings import PositionReadings, read_positions
    from stepdiag.progress import Progress
    from stepdiag.rechecking.recheck import recheck_scenario
    from stepdiag.rechecking.verification import verify_scenario
    from stepdiag.scenario.description import (
        Scenario,
        adjust_scenario,
        evaluate_scenario,
        parse_scenario,
        read_scenario,
        simulate_scenario,
    )
    from stepdiag.scenario.known import Known
    from stepdiag.scenario.provenance import provenance_of
    from stepdiag.scenario.truth import Truth
    from stepdiag.twin.server import Twin
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
    "AcquireOptions",
    "Adjustment",
    "AdjustmentOptions",
    "BatchEvaluator",
    "BeamSegment",
    "BeamSpot",
    "Calibration",
    "CalibrationEntry",
    "Camera",
    "Chain",
    "ChangePriors",
    "CheckPoints",
    "Comparison",
    "Compensator",
    "Deviation",
    "DiagonalErrors",
    "Difference",
    "Distribution",
    "DriftEstimate",
    "Environment",
    "ErrorAtPoint",
    "ErrorMap",
    "Expansion",
    "ExpansionEstimate",
    "ExportOptions",
    "Fault",
    "FaultClass",
    "FaultControl",
    "FigureChange",
    "FinishedCells",
    "FitReason",
    "FoundMistake",
    "FunctionModel",
    "GaussianMode",
    "Head",
    "HeadBeam",
    "HeadBody",
    "HeadCalibration",
    "HeadDesign",
    "Interferometer",
    "InvalidArgument",
    "Judgement",
    "KeyTrigger",
    "Known",
    "KnownCombination",
    "KnownExpansion",
    "LateralEffect",
    "LineDeviation",
    "LinuxcncError",
    "LinuxcncSession",
    "Machine",
    "MachineDrift",
    "MeasuredPositions",
    "Measurement",
    "Misalignment",
    "ModelSource",
    "MonteCarloResult",
    "Noise",
    "Outlier",
    "ParameterEffect",
    "Plan",
    "PlausibleLimits",
    "PointErrors",
    "PositionFigure",
    "PositionReadings",
    "PredictedPositions",
    "Progress",
    "Propagation",
    "RangeModel",
    "ReadingNoise",
    "ReadingUncertainty",
    "Recheck",
    "ReplayMismatch",
    "ReturnedBeam",
    "RoundedChannel",
    "SampleModel",
    "ScaleTemperatures",
    "Scenario",
    "Sensitivity",
    "SettleTrigger",
    "Settling",
    "SetupEstimate",
    "SetupPriors",
    "SimulationOptions",
    "Smoothness",
    "SpotSensor",
    "StatisticsOptions",
    "TcpTrigger",
    "Truth",
    "TruthAgreement",
    "Twin",
    "UncertainInput",
    "UncertainInputs",
    "UncertaintyRequest",
    "UncertaintyResult",
    "Undetermined",
    "Validation",
    "VarianceComponent",
    "Verdict",
    "Verification",
    "VirtualCalibrations",
    "VirtualReadout",
    "VolumeChange",
    "VolumeContribution",
    "VolumeErrors",
    "VolumeFigure",
    "VolumetricAccuracy",
    "__version__",
    "acquire",
    "adjust",
    "adjust_scenario",
    "axis_line",
    "beam_radius",
    "compare",
    "compare_calibrations",
    "couple",
    "cramer_rao_bound",
    "derived_at_point",
    "derived_on_diagonals",
    "diagonal_errors",
    "diagonal_line",
    "error_at_point",
    "errors_at_points",
    "evaluate",
    "evaluate_positions",
    "evaluate_scenario",
    "evaluate_uncertainty",
    "export_calibration",
    "expose",
    "extents",
    "find_mistakes",
    "functional_point_straightness",
    "head_sensitivities",
    "in_report_units",
    "judge",
    "kind_of",
    "largest_deviations",
    "largest_uncertainties",
    "locate",
    "observe",
    "parse_head_design",
    "parse_scenario",
    "power_inside",
    "predict_positions",
    "propagate",
    "propagate_linear",
    "provenance_of",
    "random_error_map",
    "read_calibration",
    "read_distance",
    "read_error_map",
    "read_head",
    "read_head_design",
    "read_measurement",
    "read_positions",
    "read_scenario",
    "read_study",
    "recheck",
    "recheck_scenario",
    "run_monte_carlo",
    "run_study",
    "shipped_head",
    "simulate",
    "simulate_scenario",
    "study_table",
    "trace_beams",
    "uncertainty_table",
    "verify",
    "verify_scenario",
    "volume_change",
    "volume_errors",
    "volume_grid",
    "volumetric_accuracy",
    "with_covariance",
    "workers_of",
    "write_calibration",
    "write_measurement",
]

# Imported on first use, because pydantic, xarray and others are slow. By module, as above.
_LATER = {
    "acquisition.acquire": ("acquire",),
    "acquisition.options": ("AcquireOptions",),
    "acquisition.settle_trigger": ("SettleTrigger",),
    "acquisition.settling": ("Settling",),
    "acquisition.tcp_trigger": ("TcpTrigger",),
    "acquisition.triggers": ("KeyTrigger",),
    "twin.server": ("Twin",),
    "calibration.comparison": (
        "Comparison",
        "Difference",
        "compare_calibrations",
    ),
    "calibration.functional_point": ("functional_point_straightness",),
    "calibration.largest_by_kind": (
        "Deviation",
        "largest_deviations",
        "largest_uncertainties",
    ),
    "calibration.truth": ("TruthAgreement",),
    "calibration.volume": (
        "PointErrors",
        "VolumeContribution",
        "VolumeErrors",
        "VolumeFigure",
        "errors_at_points",
        "volume_errors",
        "volume_grid",
    ),
    "calibration.volume_change": (
        "FigureChange",
        "ParameterEffect",
        "VolumeChange",
        "volume_change",
    ),
    "export.common": ("ExportOptions",),
    "export.write": ("export_calibration",),
    "head.description": (
        "parse_head_design",
        "read_head_design",
        "shipped_head",
    ),
    "evaluation.judge": (
        "Judgement",
        "judge",
    ),
    "io.data_files": (
        "read_calibration",
        "read_measurement",
        "write_calibration",
        "write_measurement",
    ),
    "linuxcnc.processes": ("LinuxcncError",),
    "linuxcnc.session": ("LinuxcncSession",),
    "mistakes.search": (
        "FoundMistake",
        "find_mistakes",
    ),
    "parameters": (
        "in_report_units",
        "kind_of",
    ),
    "planning.observation": (
        "extents",
        "observe",
    ),
    "positions.evaluation": (
        "MeasuredPositions",
        "evaluate_positions",
    ),
    "positions.figures": ("PositionFigure",),
    "positions.prediction": (
        "PredictedPositions",
        "axis_line",
        "diagonal_line",
        "predict_positions",
    ),
    "positions.readings": (
        "PositionReadings",
        "read_positions",
    ),
    "progress": ("Progress",),
    "rechecking.recheck": ("recheck_scenario",),
    "rechecking.verification": ("verify_scenario",),
    "scenario.description": (
        "Scenario",
        "adjust_scenario",
        "evaluate_scenario",
        "parse_scenario",
        "read_scenario",
        "simulate_scenario",
    ),
    "scenario.known": ("Known",),
    "scenario.provenance": ("provenance_of",),
    "scenario.truth": ("Truth",),
    "uncertainty.dask_workers": ("workers_of",),
    "uncertainty.model_source": ("ModelSource",),
    "uncertainty.monte_carlo": ("run_monte_carlo",),
    "uncertainty.result": ("UncertaintyResult",),
    "uncertainty.run": (
        "UncertaintyRequest",
        "evaluate_uncertainty",
    ),
    "uncertainty.study": (
        "FinishedCells",
        "run_study",
    ),
    "uncertainty.study_keys": ("read_study",),
    "uncertainty.study_table": ("study_table",),
    "uncertainty.table": ("uncertainty_table",),
}
_MODULE_OF = {name: module for module, names in _LATER.items() for name in names}

to_xarray.attach()
displays.attach()
methods.attach()
word_findings_with(undetermined_text)  # the extension's findings are worded here
word_reasons_with(reason_texts)
word_unseen_faults_with(unseen_texts)


def __getattr__(name: str) -> Any:
    if name in _MODULE_OF:
        return getattr(import_module(f"stepdiag.{_MODULE_OF[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
