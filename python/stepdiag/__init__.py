"""Calibration of three-axis machine tools by the laser step-diagonal method.

    import stepdiag as sd

    machine = sd.Machine("[w X' b Y Z t]", sd.random_error_map((800, 600, 500), seed=1))
    plan = sd.Plan((800, 600, 500), ["ppp", "npp", "pnp", "nnp"], 50, scale_lines=["p00", "0p0", "00p"])
    run = sd.simulate(machine, plan, sd.Head())
    calibration = sd.evaluate(run, plan, sd.Head(), machine.chain)

Units are native throughout: length mm, angle rad, wavelength nm.
Bad input raises InvalidArgument, a ValueError.
"""

from typing import TYPE_CHECKING, Any

from stepdiag._core import (
    Adjustment,
    BatchEvaluator,
    BeamSegment,
    BeamSpot,
    Calibration,
    CalibrationEntry,
    Camera,
    Chain,
    Compensator,
    DiagonalErrors,
    Environment,
    ErrorAtPoint,
    ErrorMap,
    FitReason,
    GaussianMode,
    Head,
    HeadBeam,
    HeadBody,
    HeadCalibration,
    HeadDesign,
    Interferometer,
    InvalidArgument,
    LateralEffect,
    Machine,
    Measurement,
    Misalignment,
    Noise,
    Outlier,
    Plan,
    PlausibleLimits,
    Propagation,
    RangeModel,
    ReadingUncertainty,
    ReplayMismatch,
    ReturnedBeam,
    Sensitivity,
    SetupEstimate,
    SetupPriors,
    Smoothness,
    SpotSensor,
    Validation,
    Verdict,
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
    simulate,
    trace_beams,
    volumetric_accuracy,
    with_covariance,
)
from stepdiag.calibration.comparison import Comparison, Difference, compare_calibrations
from stepdiag.calibration.functional_point import functional_point_straightness
from stepdiag.calibration.largest_by_kind import Deviation, largest_deviations
from stepdiag.io.data_files import read_calibration, read_measurement, write_calibration, write_measurement

if TYPE_CHECKING:
    from stepdiag.head.description import parse_head_design, read_head_design, shipped_head
    from stepdiag.scenario.description import (
        Scenario,
        adjust_scenario,
        evaluate_scenario,
        parse_scenario,
        read_scenario,
        simulate_scenario,
    )

__all__ = [
    "Adjustment",
    "BatchEvaluator",
    "BeamSegment",
    "BeamSpot",
    "Calibration",
    "CalibrationEntry",
    "Camera",
    "Chain",
    "Comparison",
    "Compensator",
    "Deviation",
    "DiagonalErrors",
    "Difference",
    "Environment",
    "ErrorAtPoint",
    "ErrorMap",
    "FitReason",
    "GaussianMode",
    "Head",
    "HeadBeam",
    "HeadBody",
    "HeadCalibration",
    "HeadDesign",
    "Interferometer",
    "InvalidArgument",
    "LateralEffect",
    "Machine",
    "Measurement",
    "Misalignment",
    "Noise",
    "Outlier",
    "Plan",
    "PlausibleLimits",
    "Propagation",
    "RangeModel",
    "ReadingUncertainty",
    "ReplayMismatch",
    "ReturnedBeam",
    "Scenario",
    "Sensitivity",
    "SetupEstimate",
    "SetupPriors",
    "Smoothness",
    "SpotSensor",
    "Validation",
    "Verdict",
    "VolumetricAccuracy",
    "__version__",
    "adjust",
    "adjust_scenario",
    "beam_radius",
    "compare",
    "compare_calibrations",
    "couple",
    "cramer_rao_bound",
    "derived_at_point",
    "derived_on_diagonals",
    "diagonal_errors",
    "error_at_point",
    "evaluate",
    "evaluate_scenario",
    "expose",
    "functional_point_straightness",
    "head_sensitivities",
    "largest_deviations",
    "locate",
    "parse_head_design",
    "parse_scenario",
    "power_inside",
    "propagate",
    "propagate_linear",
    "random_error_map",
    "read_calibration",
    "read_distance",
    "read_error_map",
    "read_head",
    "read_head_design",
    "read_measurement",
    "read_scenario",
    "shipped_head",
    "simulate",
    "simulate_scenario",
    "trace_beams",
    "volumetric_accuracy",
    "with_covariance",
    "write_calibration",
    "write_measurement",
]

# Where to find what has to do with our TOML files.
_LATER = {
    "Scenario": "scenario",
    "adjust_scenario": "scenario",
    "evaluate_scenario": "scenario",
    "parse_scenario": "scenario",
    "read_scenario": "scenario",
    "simulate_scenario": "scenario",
    "parse_head_design": "head_description",
    "read_head_design": "head_description",
    "shipped_head": "head_description",
}


def __getattr__(name: str) -> Any:
    """Imports what has to do with TOML files on first use: it brings pydantic along."""
    if name in _LATER:
        from importlib import import_module

        return getattr(import_module(f"stepdiag.{_LATER[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
