"""For designers of heads: the light of a described head, its detectors, and its sensitivities."""

from stepdiag._core import (
    BeamSegment,
    BeamSpot,
    Camera,
    GaussianMode,
    HeadBeam,
    HeadBody,
    HeadCalibration,
    HeadDesign,
    Interferometer,
    LateralEffect,
    ReplayMismatch,
    ReturnedBeam,
    Sensitivity,
    SpotSensor,
    beam_radius,
    couple,
    cramer_rao_bound,
    expose,
    head_sensitivities,
    locate,
    power_inside,
    read_distance,
    read_signals,
    trace_beams,
)
from stepdiag.head.description import parse_head_design, read_head_design, shipped_head

__all__ = [
    "BeamSegment",
    "BeamSpot",
    "Camera",
    "GaussianMode",
    "HeadBeam",
    "HeadBody",
    "HeadCalibration",
    "HeadDesign",
    "Interferometer",
    "LateralEffect",
    "ReplayMismatch",
    "ReturnedBeam",
    "Sensitivity",
    "SpotSensor",
    "beam_radius",
    "couple",
    "cramer_rao_bound",
    "expose",
    "head_sensitivities",
    "locate",
    "parse_head_design",
    "power_inside",
    "read_distance",
    "read_head_design",
    "read_signals",
    "shipped_head",
    "trace_beams",
]


def __dir__() -> list[str]:
    return __all__
